#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Is printed with every attribution.
inline constexpr std::string_view kAttributionCaveat =
    "These numbers show what the model uses, not what causes the target. Inputs that move together "
    "(a deflection and its rate, a current and a torque) share the credit in a way that the data "
    "do not determine, and replacing one of them alone gives the model combinations that the joint "
    "never produces.";

/// Exact values take 2^inputs coalitions.
inline constexpr std::size_t kMaxAttributedInputs = 12;

struct AttributionOptions {
  std::size_t windows = 200;       ///< number of explained windows, drawn from the data
  std::size_t background = 50;     ///< samples that replace absent inputs, drawn from the data
  std::size_t window_samples = 0;  ///< 0: the model's memory (`memory_samples`)
  std::size_t repeats = 5;         ///< shuffles of each input
  std::uint64_t seed = 1;
  std::size_t threads = 0;  ///< 0: all cores; the result does not depend on it
};

/// The model's output at the end of a window, from a reset at its beginning, and each input's share
/// in its distance from `Attribution::expected_value`.
struct ExplainedWindow {
  std::string recording;
  std::size_t sample = 0;  ///< last sample of the window
  double value = 0.0;
  std::vector<double> shapley;
};

/// The importance of one input to the model, in the target's unit.
struct InputAttribution {
  std::string input;
  double mean_abs_shapley = kNotMeasured;   ///< mean |phi| over the explained windows
  double share = kNotMeasured;              ///< share of the sum of `mean_abs_shapley`
  double rmse_increase = kNotMeasured;      ///< when this input's blocks are shuffled
  double rmse_increase_std = kNotMeasured;  ///< over the shuffles, divided by n - 1
};

struct Attribution {
  std::vector<InputAttribution> inputs;  ///< in the model's order
  std::vector<ExplainedWindow> explained;
  std::size_t background = 0;
  std::size_t window_samples = 0;
  /// False: the model's memory is longer than a window; its values are those from a reset.
  bool window_is_long_enough = true;
  double expected_value = 0.0;    ///< mean value over the background, E f
  double additivity_error = 0.0;  ///< largest |sum phi - (f - E f)|
  double rmse = kNotMeasured;     ///< RMSE of the model alone, free run, without shuffling
  std::size_t samples = 0;        ///< number of samples in `rmse`
  std::size_t block_samples = 0;  ///< length of the blocks that are shuffled
};

/// The importance of a model's inputs on some recordings: exact interventional Shapley values, in
/// which an absent input's whole window is replaced by that of the same input in a background
/// window, v(S) being the mean over these; and permutation importance, the increase of the RMSE
/// when one input is shuffled over all recordings in blocks no shorter than a window. The model
/// alone is asked, without the estimator's guards. Source: specification 3.10; Lundberg and Lee
/// 2017.
///
/// Cost: windows x background x (2^inputs - 2) x window_samples steps of the model, and repeats x
/// inputs passes over the data. `progress` is called from several threads, one at a time.
/// @throws Error for more than `kMaxAttributedInputs` inputs, data with another number of inputs
/// or shorter than a window; UsageError for options that are 0; Cancelled.
[[nodiscard]] Attribution attribute(const AnyModel& model, const TrainingData& data,
                                    const AttributionOptions& options = {},
                                    const Progress& progress = {});

}  // namespace torsio
