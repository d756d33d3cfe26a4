#pragma once

#include <string>
#include <vector>

#include "studies/board_rows.hpp"
#include "studies/study.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// What one run of every family measured.
struct BoardRun {
  std::vector<BoardRow> rows;
  std::vector<std::string> left_out;  ///< sets that could not be run, with the reason
};

/// Deterministic for the options. @throws Error if a file has another content than expected; Cancelled.
[[nodiscard]] BoardRun run_board(const StudyOptions& options, const Progress& progress = {});

/// Its tables, with the published figures beside the measured ones.
[[nodiscard]] Study board_study(const StudyOptions& options, const BoardRun& run);

/// The settings of the models whose names do not state them, as `--models` takes them: "emps, lstm; 32 cells: lstm:..."
[[nodiscard]] std::vector<std::string> board_settings();

/// Names of models on the board have a semicolon in the place of a comma, which separates fields of a file.
[[nodiscard]] std::string board_model_name(std::string_view name);

}  // namespace torsio
