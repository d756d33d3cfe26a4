#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <string>
#include <string_view>

#include "torsio/search/workers.hpp"
#include "torsio/store/study_store.hpp"

/// The flags of verbs that run trials of studies.
struct WorkerFlags {
  std::string store;
  std::string study;
  std::size_t threads = 0;
  std::string lease = "60s";

  void add(CLI::App& verb, const char* store_help, const char* study_help);
  [[nodiscard]] torsio::WorkerOptions options() const;
};

/// "1 trial", "2 trials".
[[nodiscard]] std::string counted(std::size_t count, std::string_view noun);

/// Remarks once that the server is lost and once that it is back; false after Ctrl-C.
[[nodiscard]] bool wait_for_server(const std::string& reason);

/// Gives the trials back that a program on this machine was running when it was killed.
void take_back_of_dead(torsio::StudyStore& store, const torsio::StoredStudy& study);
