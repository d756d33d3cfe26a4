#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>

#include "common/output.hpp"
#include "torsio/store/registry.hpp"

/// The flags of all parts of `torsio store`.
struct StoreFlags {
  std::string store = "torsio-studies.sqlite";
  JsonOutput json;

  /// @param json_help empty: without `--json`
  void add(CLI::App& part, const char* json_help);
  /// @throws torsio::UsageError if there is no such file: only what adds something creates a store.
  [[nodiscard]] torsio::StoreAddress existing() const;
  [[nodiscard]] std::unique_ptr<torsio::Registry> open() const;
};

/// The user and the machine, for the history of a device: "robot@bench".
[[nodiscard]] std::string person_here();

/// The parts that change something: add, promote, roll-back.
void add_store_changes(CLI::App& store);
