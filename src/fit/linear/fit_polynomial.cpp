#include "fit/linear/fit_polynomial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "fit/common/fitted.hpp"
#include "fit/common/folds.hpp"
#include "fit/common/regression.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/linear/named_coefficients.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// The usable samples that have a direction, if one is needed.
struct Samples {
  Matrix features;
  std::vector<double> target;
  std::vector<Direction> direction;
};

void require_movement(const TrainingData& data) {
  const Table table = usable_table(data);
  for (std::size_t n = 1; n < table.features.rows; ++n)
    if (table.features(n, 0) != table.features(0, 0)) return;
  throw Error({.problem = "a polynomial needs a first input that varies",
               .found = data.inputs[0].expression + " is constant in the training data"});
}

Error one_way(const TrainingData& data, const std::string& where) {
  return Error({.problem = fmt::format(
                    "the first input, {}, moves in one direction only in the training data{}",
                    data.inputs[0].expression, where),
                .advice = "Record a full loop, or fit one curve for both directions: --set "
                          "branch=false."});
}

Samples directed_samples(const TrainingData& data, bool branch, double dead_band) {
  const Table table = usable_table(data);
  std::vector<Direction> direction;
  for (const Sequence& sequence : data.sequences) {
    DirectionTracker tracker(dead_band);
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.has_features(n)) tracker.step(sequence.features(n, 0));
      if (sequence.use[n] != 0) direction.push_back(tracker.direction());
    }
  }
  std::vector<std::size_t> kept;
  for (std::size_t n = 0; n < direction.size(); ++n)
    if (!branch || direction[n] != Direction::unknown) kept.push_back(n);
  Samples samples{rows_of(table.features, kept), rows_of(table.target, kept), {}};
  for (const std::size_t n : kept) samples.direction.push_back(direction[n]);
  if (branch)
    for (const Direction each : {Direction::rising, Direction::falling})
      if (std::ranges::find(samples.direction, each) == samples.direction.end())
        throw one_way(data, "");
  return samples;
}

std::pair<double, double> centre_and_half_range(const Samples& samples) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::size_t n = 0; n < samples.features.rows; ++n) {
    lowest = std::min(lowest, samples.features(n, 0));
    highest = std::max(highest, samples.features(n, 0));
  }
  return {0.5 * (lowest + highest), 0.5 * (highest - lowest)};
}

/// Lowest and highest x_0 of each curve in each group.
Matrix ranges_of(const Samples& samples, const Groups& groups, const TrainingData& data,
                 bool branch) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Matrix ranges(groups.samples.size(), branch ? 4 : 2);
  for (std::size_t k = 0; k < ranges.rows; ++k) {
    for (std::size_t j = 0; j < ranges.columns; j += 2) {
      double& lowest = ranges(k, j) = kInfinity;
      double& highest = ranges(k, j + 1) = -kInfinity;
      for (const std::size_t n : groups.samples[k]) {
        if (branch && (samples.direction[n] == Direction::falling) != (j == 2)) continue;
        lowest = std::min(lowest, samples.features(n, 0));
        highest = std::max(highest, samples.features(n, 0));
      }
      if (lowest > highest)
        throw one_way(data,
                      fmt::format(" where {} is {:.6g}", groups.feature, groups.frame.knots[k]));
    }
  }
  return ranges;
}

Design polynomial_design(const TrainingData& data, const Samples& samples, const Groups& groups,
                         const Polynomial::Parameters& shape, bool rates) {
  const std::size_t curve = shape.degree + 1;
  const std::size_t first_slope = shape.curve_columns();
  const std::size_t columns = first_slope + data.input_count();
  Design design{Matrix(samples.features.rows, columns), samples.target,
                std::vector<std::string>(columns)};
  for (std::size_t i = 0; i < first_slope; ++i)
    design.terms[i] = "power " + std::to_string(i % curve) + " of " + data.inputs[0].expression;
  add_slopes(design, first_slope, data, samples.features, groups, rates);
  design.terms[first_slope].clear();
  for (std::size_t n = 0; n < samples.features.rows; ++n) {
    const bool falls = shape.by_direction && samples.direction[n] == Direction::falling;
    const double z = (samples.features(n, 0) - shape.centre) / shape.half_range;
    double power = 1.0;
    for (std::size_t i = 0; i < curve; ++i, power *= z)
      design.columns(n, (falls ? curve : 0) + i) = power;
    design.columns(n, first_slope) = 0.0;
  }
  return design;
}

/// Sum of squared errors on each fifth of each group, fitted to the rest of the group.
double held_out_error(const Design& design, const Groups& groups) {
  double sum = 0.0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    Groups training{groups.frame, groups.feature, {}};
    std::vector<std::vector<std::size_t>> held_out;
    for (const std::vector<std::size_t>& samples : groups.samples) {
      auto& kept = training.samples.emplace_back();
      auto& left_out = held_out.emplace_back();
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const bool is_held_out = interleaved_fold(i, samples.size()) == fold;
        (is_held_out ? left_out : kept).push_back(samples[i]);
      }
    }
    const Matrix coefficients = fit_design(design, training).coefficients.values;
    for (std::size_t k = 0; k < held_out.size(); ++k) {
      for (const std::size_t n : held_out[k]) {
        const auto row = design.columns.row(n);
        const double value =
            std::inner_product(row.begin(), row.end(), coefficients.row(k).begin(), 0.0);
        sum += (value - design.target[n]) * (value - design.target[n]);
      }
    }
  }
  return sum;
}

std::size_t chosen_degree(const TrainingData& data, const Samples& samples, const Groups& groups,
                          Polynomial::Parameters shape, bool rates) {
  std::vector<double> errors;
  while (errors.size() < kHighestChosenDegree) {
    shape.degree = errors.size() + 1;
    try {
      errors.push_back(
          held_out_error(polynomial_design(data, samples, groups, shape, rates), groups));
    } catch (const Error&) {  // too few samples for so many terms, hence for more, too
      if (errors.empty()) throw;
      break;
    }
  }
  const double good = 1.01 * 1.01 * *std::ranges::min_element(errors);
  const auto first = std::ranges::find_if(errors, [good](double error) { return error <= good; });
  return static_cast<std::size_t>(first - errors.begin()) + 1;
}

}  // namespace

double default_dead_band(const TrainingData& data) {
  double resolution = std::numeric_limits<double>::infinity();
  double lowest = resolution;
  double highest = -resolution;
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      const double x = sequence.features(n, 0);
      if (!std::isfinite(x)) continue;
      lowest = std::min(lowest, x);
      highest = std::max(highest, x);
      const double change = n == 0 ? 0.0 : std::abs(x - sequence.features(n - 1, 0));
      if (change > 0.0) resolution = std::min(resolution, change);
    }
  }
  if (!std::isfinite(resolution)) return 0.0;
  return std::max(2.0 * resolution, 0.005 * (highest - lowest));
}

Fitted<Polynomial> fit_polynomial(const TrainingData& data, const PolynomialOptions& options) {
  Fitted<Polynomial> fitted;
  Polynomial::Parameters& parameters = fitted.parameters;
  parameters.degree = options.degree;
  parameters.by_direction = options.branch;
  if (options.branch) {
    const bool derived = std::isnan(options.dead_band);
    parameters.dead_band = derived ? default_dead_band(data) : options.dead_band;
    if (derived)
      fitted.notes.push_back(fmt::format("{} turns once it moved back by more than {:.3g}",
                                         data.inputs[0].expression, parameters.dead_band));
  }
  require_movement(data);
  const Samples samples = directed_samples(data, options.branch, parameters.dead_band);
  std::tie(parameters.centre, parameters.half_range) = centre_and_half_range(samples);
  const Groups groups = groups_by(options.schedule, data, samples.features);
  parameters.ranges = ranges_of(samples, groups, data, options.branch);
  if (parameters.degree == 0) {
    parameters.degree = chosen_degree(data, samples, groups, parameters, options.rates);
    fitted.notes.push_back("degree " + std::to_string(parameters.degree) +
                           " chosen by cross-validation");
  }
  const Design design = polynomial_design(data, samples, groups, parameters, options.rates);
  DesignFit fit = fit_design(design, groups);
  parameters.coefficients = std::move(fit.coefficients);
  fitted.table = fitted_coefficients(parameters, parameters.coefficients.values, design, data);
  std::ranges::move(fit.notes, std::back_inserter(fitted.notes));
  if (!options.rates)
    note_on_rates(fitted.notes, design, groups, data, samples.features, Polynomial::kFamily);
  return fitted;
}

}  // namespace torsio
