#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// One number that a simulation fit searches for.
struct SearchedParameter {
  std::string name;
  std::string unit;
  double typical = 1.0;  ///< a change that matters, > 0: the search counts in it
  double lowest = -HUGE_VAL;
  double highest = HUGE_VAL;
};

/// A model with a state, seen as a function from its parameters and the state at the first sample
/// to its outputs.
struct SimulatedModel {
  std::vector<SearchedParameter> parameters;
  /// Steps through the first `values.size()` samples of a sequence as `run` does.
  /// @returns false if the parameters are refused or the run leaves its range
  std::function<bool(std::span<const double> parameters, std::span<const double> state,
                     const Sequence& sequence, std::span<double> values)>
      run;
  /// `ResidualProblem::difference`, one search after the other: what stops and starts make rough looks
  /// smooth from afar, and a fine difference alone stays in the first dent.
  std::vector<double> differences = {1e-6};
  std::size_t free_states = 2;  ///< free states of the start: position, velocity, ..
};

/// A model of family M, made from what the search has; nothing if it refuses that.
template <class M>
std::optional<M> model_if_valid(const typename M::Parameters& parameters) {
  try {
    return M(parameters);
  } catch (const Error&) {
    return std::nullopt;
  }
}

template <class M>
bool run_from(std::optional<M> model, std::span<const double> state, const Sequence& sequence,
              std::span<double> values) {
  if (!model) return false;
  model->set_state(state);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!sequence.has_features(n)) continue;
    const Estimate estimate = model->step(sequence.features.row(n));
    if (estimate.fault != Fault::none) return false;
    values[n] = estimate.value;
  }
  return true;
}

struct SimulationFitOptions {
  std::size_t first_horizon = 500;  ///< samples of each sequence that the first search uses
  std::size_t growth = 4;           ///< growth of the horizon from one search to the next
  std::size_t kept = 3;             ///< starts that continue to the second horizon
  std::size_t max_iterations = 200;
  double tolerance = 1e-9;  ///< relative fall of the squares below which a search has converged
  /// First samples of each record that put its start, as in a score; 0: the start is searched for
  /// beside the parameters. A start that all of the record draws on hides what a free run drifts by.
  std::size_t start_samples = 0;
  Progress progress = {};
};

struct SimulationFit {
  std::vector<double> parameters;
  std::vector<FittedParameter> table = {};
  std::vector<std::string> notes = {};  ///< what the data do not determine
  double rmse = 0.0;                    ///< RMSE of free runs in training
  std::size_t samples = 0;              ///< that were scored
};

/// argmin over the parameters of the sum of (y_k - target_k)^2, y a free run through the record
/// from a start that is a searched parameter, too, or determined by the record's first samples. The
/// search runs from all starts over a short horizon, then from the best over longer ones: a long
/// run has many minima in frequency and phase, a short one few. Where the records are more than
/// `kMaxSearchedStarts`, the starts are not searched but estimated from the first samples.
/// @throws Error if a record is shorter than the unknowns need, every start diverges, or the last
/// search did not converge; Cancelled.
inline constexpr std::size_t kMaxSearchedStarts = 30;
[[nodiscard]] SimulationFit fit_by_simulation(const SimulatedModel& model, const TrainingData& data,
                                              const std::vector<std::vector<double>>& starts,
                                              const SimulationFitOptions& options);

[[nodiscard]] std::size_t longest_sequence(const TrainingData& data);

/// Position and velocity of a line through the first measured samples.
[[nodiscard]] std::vector<double> measured_start(const Sequence& sequence, double sample_rate_Hz);

/// The state from which a free run has the least error over the first samples of a sequence
/// (Gauss-Newton, from `measured_start`). Nothing if no run can be computed.
[[nodiscard]] std::optional<std::vector<double>> start_by_first(const SimulatedModel& model,
                                                                std::span<const double> parameters,
                                                                const Sequence& sequence,
                                                                double sample_rate_Hz,
                                                                double spread, std::size_t samples);

/// Root mean square error of free runs, the start of each sequence determined by its first
/// `initialise` measured samples, which are not scored. Infinite if a run cannot be computed.
[[nodiscard]] double held_out_rmse(const SimulatedModel& model, std::span<const double> parameters,
                                   const TrainingData& data, std::size_t initialise);

/// The requirements of these families on their data: a first input that changes, a target that
/// changes.
/// @throws Error that states which is missing.
void require_excitation(const TrainingData& data);

/// Gains of the inputs after the first, to be searched for, from 0 on.
[[nodiscard]] std::vector<SearchedParameter> further_gains(const TrainingData& data);

/// The sequences cut into about `blocks` contiguous parts of as many usable samples, each a sequence of its own.
[[nodiscard]] TrainingData in_blocks(const TrainingData& data, std::size_t blocks);

/// The range of the target, widened by five times its width to each side and to 0.
struct EndStops {
  double lowest = 0.0;
  double highest = 0.0;
};
[[nodiscard]] EndStops end_stops(const TrainingData& data);

}  // namespace torsio
