#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "studies/study.hpp"

/// Options of `torsio reproduce board` that other items do not have.
struct BoardFlags {
  std::string set;
  std::string test_samples;
  std::string training_samples;
  std::string predictions;
  std::string name;
  std::string rows;
  bool is_recorded = false;

  void add(CLI::App& verb);
  /// Whether one of them was given.
  [[nodiscard]] bool is_used() const;
};

/// What `torsio reproduce board` does with these options, or with a page.
/// @param items names of the experiments that were asked for: the board alone
/// @param page file of docs/board.md; empty: none
/// @throws torsio::UsageError if the options do not belong together.
void reproduce_board(const BoardFlags& flags, const std::vector<std::string>& items,
                     const torsio::StudyOptions& options, const std::string& page,
                     const JsonOutput& json);
