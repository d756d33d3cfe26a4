#include "fit/hysteresis/operator_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fit/common/regression.hpp"
#include "fit/common/usable_table.hpp"
#include "model/linear/direction.hpp"
#include "numerics/nnls.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

void set_range(OperatorData& result, const std::string& input) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Stretch& stretch : result.stretches)
    for (const double x : stretch.x) {
      lowest = std::min(lowest, x);
      highest = std::max(highest, x);
    }
  if (!(highest > lowest))
    throw Error({.problem = "hysteresis needs a first input that varies",
                 .found = input + " is constant in the training data"});
  result.centre = 0.5 * (lowest + highest);
  result.half_range = 0.5 * (highest - lowest);
}

/// Inputs with a slope, as far as they vary.
std::vector<bool> sloped_inputs(const TrainingData& data, bool rates, OperatorData& result) {
  std::vector<bool> sloped(data.input_count(), false);
  const Table table = usable_table(data);
  for (std::size_t j = 1; j < data.input_count(); ++j) {
    if (!has_slope(data, j, {}, rates)) continue;
    for (std::size_t n = 1; n < table.features.rows && !sloped[j]; ++n)
      sloped[j] = table.features(n, j) != table.features(0, j);
    if (!sloped[j])
      result.notes.push_back("input " + data.inputs[j].expression +
                             " is constant in the training data: no term");
  }
  return sloped;
}

/// Leaves out unused samples on the way between two turns: an operator that hears no rate is where
/// it is by its turns alone.
Stretch turns_of(const Stretch& stretch) {
  Stretch kept;
  for (std::size_t n = 0; n < stretch.x.size(); ++n) {
    const double x = stretch.x[n];
    const bool is_between =
        n > 0 && n + 1 < stretch.x.size() && (x - kept.x.back()) * (stretch.x[n + 1] - x) >= 0.0;
    if (stretch.row[n] == Stretch::kUnused && is_between) continue;
    kept.x.push_back(x);
    kept.row.push_back(stretch.row[n]);
  }
  return kept;
}

void set_units(OperatorData& result, const TrainingData& data) {
  result.torque_unit = unit_label(data.target);
  result.x_unit = unit_label(data.inputs[0].expression);
  result.stiffness_unit = result.torque_unit;
  if (!result.x_unit.empty())
    result.stiffness_unit =
        (result.torque_unit.empty() ? "1" : result.torque_unit) + "/" + result.x_unit;
}

}  // namespace

OperatorData operator_data(const TrainingData& data, bool rates, std::size_t rate_feature,
                           std::size_t max_rows, std::size_t parameters) {
  OperatorData result;
  const std::size_t usable = data.usable_samples();
  if (usable < kSamplesPerTerm * parameters)
    throw Error({.problem = "too few training samples",
                 .expected = fmt::format("at least {}, {} for each of {} parameters",
                                         kSamplesPerTerm * parameters, kSamplesPerTerm, parameters),
                 .found = std::to_string(usable)});
  const std::vector<bool> sloped = sloped_inputs(data, rates, result);
  const std::size_t stride = (usable + max_rows - 1) / max_rows;
  std::size_t seen = 0;
  result.others.columns = data.input_count();
  for (const Sequence& sequence : data.sequences) {
    Stretch& stretch = result.stretches.emplace_back();
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const auto features = sequence.features.row(n);
      stretch.x.push_back(features[0]);
      if (rate_feature > 0) stretch.rate.push_back(features[rate_feature]);
      stretch.row.push_back(Stretch::kUnused);
      if (sequence.use[n] == 0 || seen++ % stride != 0) continue;
      stretch.row.back() = result.target.size();
      result.target.push_back(sequence.target[n]);
      for (std::size_t j = 0; j < features.size(); ++j)
        result.others.values.push_back(sloped[j] ? features[j] : 0.0);
    }
    if (rate_feature == 0) stretch = turns_of(stretch);
  }
  result.others.rows = result.target.size();
  for (std::size_t j = 0; j < data.input_count(); ++j)
    result.terms.push_back(sloped[j] ? "input " + data.inputs[j].expression : std::string{});
  set_range(result, data.inputs[0].expression);
  set_units(result, data);
  return result;
}

OperatorData without_small_turns(OperatorData data, double dead_band) {
  for (Stretch& stretch : data.stretches) {
    DirectionTracker tracker(dead_band);
    std::size_t extreme = 0;  // since the last turn
    std::vector<bool> is_turn(stretch.x.size(), false);
    for (std::size_t n = 0; n < stretch.x.size(); ++n) {
      const Direction before = tracker.direction();
      const Direction now = tracker.step(stretch.x[n]);
      const double beyond = stretch.x[n] - stretch.x[extreme];
      if (now != before) {
        is_turn[extreme] = true;
        extreme = n;
      } else if (now == Direction::falling ? beyond <= 0.0 : beyond >= 0.0) {
        extreme = n;
      }
    }
    Stretch kept;
    for (std::size_t n = 0; n < stretch.x.size(); ++n) {
      if (stretch.row[n] == Stretch::kUnused && !is_turn[n] && n > 0) continue;
      kept.x.push_back(stretch.x[n]);
      kept.row.push_back(stretch.row[n]);
    }
    stretch = std::move(kept);
  }
  return data;
}

LinearSolution solve_linear(const Matrix& columns, const std::vector<double>& target,
                            const std::vector<std::uint8_t>& is_free, std::span<double> residuals) {
  NonNegativeFit fit = non_negative_least_squares(normal_equations(columns, target), is_free);
  for (std::size_t n = 0; n < columns.rows; ++n) {
    const auto row = columns.row(n);
    residuals[n] = -target[n];
    for (std::size_t j = 0; j < row.size(); ++j) residuals[n] += row[j] * fit.coefficients[j];
  }
  return {std::move(fit.coefficients), std::move(fit.dropped)};
}

SearchResult converged_search(const ResidualProblem& problem,
                              const std::vector<std::vector<double>>& starts, SearchOptions options,
                              std::string_view family) {
  constexpr std::size_t kFirstIterations = 6;
  const std::size_t most = options.max_iterations;
  options.max_iterations = std::min(most, kFirstIterations);
  std::vector<double> best =
      starts.size() == 1 ? starts.front() : minimise_squares_from(problem, starts, options).theta;
  options.max_iterations = most;
  SearchResult found = minimise_squares(problem, std::move(best), options);
  if (!found.has_converged)
    throw Error({.problem = fmt::format("the search for the parameters of {} did not converge in "
                                        "{} iterations",
                                        family, most),
                 .advice = "Give it more (--set iterations=1000), or records that move the first "
                           "input over full loops."});
  return found;
}

void note_null_directions(const ParameterUncertainty& uncertainty,
                          const std::vector<FittedParameter>& table,
                          std::vector<std::string>& notes) {
  std::vector<std::string> names;
  names.reserve(table.size());
  for (const FittedParameter& each : table) names.push_back(each.name);
  for (const std::vector<double>& direction : uncertainty.null_directions)
    notes.push_back("the data do not determine " + description_of(direction, names));
}

void powers(double z, std::span<double> values) {
  double power = 1.0;
  for (double& value : values) {
    value = power;
    power *= z;
  }
}

void bernstein(double z, std::span<double> values) {
  const double up = 0.5 * (1.0 + z);
  const double down = 0.5 * (1.0 - z);
  std::ranges::fill(values, 0.0);
  values[0] = 1.0;
  for (std::size_t degree = 1; degree < values.size(); ++degree) {
    for (std::size_t j = degree; j > 0; --j) values[j] = down * values[j] + up * values[j - 1];
    values[0] *= down;
  }
}

std::vector<double> powers_of_bernstein(std::span<const double> weights) {
  // De Casteljau's scheme on polynomials: each round joins neighbours by (1 -+ z) / 2.
  std::vector<std::vector<double>> parts;
  for (const double weight : weights) parts.push_back({weight});
  for (; parts.size() > 1; parts.pop_back())
    for (std::size_t j = 0; j + 1 < parts.size(); ++j) {
      std::vector<double> joined(parts[j].size() + 1, 0.0);
      for (std::size_t i = 0; i < parts[j].size(); ++i) {
        joined[i] += 0.5 * (parts[j][i] + parts[j + 1][i]);
        joined[i + 1] += 0.5 * (parts[j + 1][i] - parts[j][i]);
      }
      parts[j] = std::move(joined);
    }
  return parts.front();
}

}  // namespace torsio
