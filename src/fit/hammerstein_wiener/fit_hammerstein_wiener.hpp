#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/fitted.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What becomes of G after the fit in discrete time.
enum class ContinuousForm : std::uint8_t {
  none,
  tustin,   ///< G by Tustin in continuous time, run by an exact first-order hold
  refined,  ///< second stage: refined in continuous time, the curves as found
};

struct HammersteinWienerOptions {
  /// Empty: searched for, or 1 zero, 2 poles (in 1/z), degrees 2 and 3, as (2) to (6) of paper 003.
  std::optional<std::size_t> zeros = {};
  std::optional<std::size_t> poles = {};
  std::optional<std::size_t> input_degree = {};
  std::optional<std::size_t> output_degree = {};
  bool is_piecewise_linear = false;
  std::size_t knots = 5;  ///< of each curve, if piecewise linear
  bool is_searched = true;
  ContinuousForm continuous = ContinuousForm::none;
  std::size_t iterations = 200;  ///< of one search, at most
};

/// A Hammerstein-Wiener model of the first input by least simulation error (output error: what is
/// predicted is what is simulated), in two stages.
///
/// 1. Structure: where it is not given, orders and then degrees by the simulation error on held-out
///    blocks (5 folds of 10 interleaved blocks); the smallest within 1 % of the best.
/// 2. Parameters: G by Steiglitz-McBride and from a grid of time constants, curves by least squares, then
///    all of them together by Ceres with sensitivities run as filters. Gauges are held, poles stay inside
///    the unit circle, each record starts from a state of its own (at rest where that would be more than
///    64 numbers).
///
/// Source: specification 3.5. The table tells the coefficients with standard errors; notes tell
/// poles, zeros, the form in continuous time and what the data cannot tell apart.
/// @throws Error if the first input is constant, there are fewer than ten samples a number or no record
/// outlasts the lags, nothing stable starts the search, or it does not converge; UsageError for an order
/// or a degree out of range, or more zeros than poles in continuous time.
[[nodiscard]] Fitted<HammersteinWiener> fit_hammerstein_wiener(
    const TrainingData& data, const HammersteinWienerOptions& options,
    const FitContext& context = {});

/// G in continuous time by Tustin where it has at most three poles, and what stands against reading it
/// so (`continuous_warning`); a line each.
[[nodiscard]] std::vector<std::string> continuous_notes(
    const HammersteinWiener::Parameters& parameters);

}  // namespace torsio
