#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"

namespace torsio {

/// One line of `compare`, `evaluate` and `demo`: one model, scored on one recording or on all of a
/// split together.
struct ResultRow {
  std::string family;
  std::string variant = {};    ///< the settings, "schedule=support_m"; may be empty
  std::string input_set = {};  ///< name of the manifest's input set; may be empty
  Role split = Role::test;
  std::string fold = {};                      ///< fold of a cross-validation; else empty
  std::optional<std::string> recording = {};  ///< empty: the whole split together
  Score score = {};
  double fit_seconds = kNotMeasured;  ///< not measured for a model from a file
  std::size_t parameter_count = 0;
  std::string status = "ok";  ///< ok, failed, diverged
  std::string reason = {};    ///< why it failed, or a remark on the row
  bool leak = false;          ///< an input was computed from the target, or the target from it
};

/// The samples on which the models of one split are ranked: those that no ranked model guarded. Errors
/// there are those of the linear fallback, or of a model beyond its training range.
struct Ranking {
  Role split = Role::test;
  std::size_t scored_samples = 0;          ///< scored by at least one of the models
  std::size_t common_samples = 0;          ///< scored, and guarded in no ranked model
  double best_fit_percent = kNotMeasured;  ///< fit of the first model; 0: that of the mean

  /// Share of the scored samples that a guard excludes; NaN if none were scored.
  [[nodiscard]] double guarded_share() const noexcept {
    return 1.0 - static_cast<double>(common_samples) / static_cast<double>(scored_samples);
  }
  /// A ranking on less than half of the samples would rank what the guards do.
  [[nodiscard]] bool is_possible() const noexcept {
    return common_samples > 0 && 2 * common_samples >= scored_samples;
  }
};

struct Results {
  std::string target;
  std::string unit;
  std::string label = {};                ///< description of the split
  std::vector<std::string> inputs = {};  ///< inputs of the first input set
  std::vector<std::pair<std::string, std::vector<std::string>>> input_sets = {};
  bool non_causal_zero = false;
  std::vector<ResultRow> rows = {};
  /// Warnings of the fits, each with the models that it is about; for one model, inputs that leave their range of its
  /// training.
  std::vector<std::string> warnings = {};
  std::vector<Ranking> rankings = {};  ///< one for each held-out split; empty: nothing was compared
};

}  // namespace torsio
