#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// To be printed with every attribution.
inline constexpr std::string_view kAttributionCaveat =
    "These numbers tell what the model uses, not what causes the target. Inputs that move together "
    "(a deflection and its rate, a current and a torque) share the credit in a way that the data "
    "do not settle, and replacing one of them alone shows the model combinations that the joint "
    "never makes.";

/// Exact values take 2^inputs coalitions.
inline constexpr std::size_t kMaxAttributedInputs = 12;

struct AttributionOptions {
  std::size_t windows = 200;       ///< explained, drawn from the data
  std::size_t background = 50;     ///< what an absent input is replaced by, drawn from the data
  std::size_t window_samples = 0;  ///< 0: as long as the model remembers (`memory_samples`)
  std::size_t repeats = 5;         ///< shuffles of each input
  std::uint64_t seed = 1;
  std::size_t threads = 0;  ///< 0: as many as the machine has; changes no bit of the result
};

/// The value that the model gives at the end of a window, from a reset at its begin, and the share
/// of each input in its distance from `Attribution::expected_value`.
struct ExplainedWindow {
  std::string recording;
  std::size_t sample = 0;  ///< the window's last
  double value = 0.0;
  std::vector<double> shapley;
};

/// What one input is worth to the model, in the target's unit.
struct InputAttribution {
  std::string input;
  double mean_abs_shapley = kNotMeasured;   ///< mean |phi| over the explained windows
  double share = kNotMeasured;              ///< of the sum of these
  double rmse_increase = kNotMeasured;      ///< when this input's blocks are shuffled
  double rmse_increase_std = kNotMeasured;  ///< over the shuffles, divided by n - 1
};

struct Attribution {
  std::vector<InputAttribution> inputs;  ///< in the model's order
  std::vector<ExplainedWindow> explained;
  std::size_t background = 0;
  std::size_t window_samples = 0;
  /// False: the model still remembered more than a window; its values are those from a reset.
  bool window_is_long_enough = true;
  double expected_value = 0.0;    ///< mean value over the background, E f
  double additivity_error = 0.0;  ///< largest |sum phi - (f - E f)|
  double rmse = kNotMeasured;     ///< of the model alone, free run, on what is shuffled
  std::size_t samples = 0;        ///< that `rmse` is of
  std::size_t block_samples = 0;  ///< what is shuffled as a whole
};

/// Exact Shapley values of a game:
///
///     phi_i = sum over S without i of |S|! (n-|S|-1)! / n! [v(S + i) - v(S)]
///
/// @param values v(S) for each of 2^n coalitions; bit i of the index: player i takes part.
/// @throws Error if their number is not a power of two.
[[nodiscard]] std::vector<double> shapley_values(std::span<const double> values);

/// The samples after which a model has forgotten its start: the least power of two, up to 1024,
/// after which it says in 95 % of the cases what it says in the course of the record, to 0.1 % of
/// that value's spread. 1 for a model without memory.
struct Memory {
  std::size_t samples = 1;
  bool is_longer = false;  ///< than 1024 samples, or than the records
};
[[nodiscard]] Memory memory_samples(const AnyModel& model, const TrainingData& data,
                                    std::uint64_t seed);

/// What a model makes of its inputs on some recordings: exact interventional Shapley values, in
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
