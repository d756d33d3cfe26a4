#include "fit/common/regression.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/did_you_mean.hpp"
#include "fit/common/usable_table.hpp"
#include "numerics/least_squares.hpp"
#include "numerics/nnls.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxKnots = 64;

std::size_t input_named(const std::string& expression, const TrainingData& data) {
  const auto input = std::ranges::find(data.inputs, expression, &InputInfo::expression);
  if (input != data.inputs.end()) return static_cast<std::size_t>(input - data.inputs.begin());
  std::vector<std::string> names;
  for (const InputInfo& each : data.inputs) names.push_back(each.expression);
  const std::string nearest = did_you_mean(expression, names);
  throw UsageError(
      {.place = "option schedule",
       .expected = fmt::format("one of the model's inputs ({})", fmt::join(names, ", ")),
       .found = '"' + expression + '"',
       .advice =
           nearest.empty() ? "Add it to --inputs: the model requires it at run time." : nearest});
}

/// A knot at each distinct value of the scheduling input.
template <class EachSample>
CoefficientSchedule frame_of(const std::string& schedule, const TrainingData& data,
                             const EachSample& each_sample) {
  CoefficientSchedule frame{.scheduled = true, .feature = input_named(schedule, data)};
  std::set<double> values;
  each_sample([&](std::span<const double> features) {
    if (values.size() <= kMaxKnots) values.insert(features[frame.feature]);
  });
  if (values.size() < 2 || values.size() > kMaxKnots)
    throw Error({.place = "option schedule: " + schedule,
                 .expected = "2 to " + std::to_string(kMaxKnots) +
                             " distinct values in the training data, each of them a knot",
                 .found = values.size() > kMaxKnots ? "more" : "one value",
                 .advice = "Schedule over a condition of the records, which is constant in each."});
  frame.knots.assign(values.begin(), values.end());
  return frame;
}

struct Dropped {
  std::size_t groups = 0;
  bool constant = true;
};

bool is_constant(const Matrix& matrix, std::size_t column) {
  for (std::size_t n = 1; n < matrix.rows; ++n)
    if (matrix(n, column) != matrix(0, column)) return false;
  return true;
}

std::string note(const std::string& term, const Dropped& dropped, const Groups& groups) {
  std::string text =
      term + (dropped.constant ? " is constant in the training data"
                               : " depends linearly on the terms before it in the training data");
  if (dropped.groups < groups.samples.size())
    text += " at " + std::to_string(dropped.groups) + " of " +
            std::to_string(groups.samples.size()) + " knots of " + groups.feature;
  return text + ": no term";
}

void check_size(std::size_t samples, std::size_t terms, const Groups& groups, std::size_t group) {
  const std::size_t needed = kSamplesPerTerm * terms;
  if (samples >= needed) return;
  const std::string where =
      groups.feature.empty()
          ? std::string{}
          : fmt::format(" where {} is {:.6g}", groups.feature, groups.frame.knots[group]);
  throw Error({.problem = "too few training samples" + where,
               .expected = "at least " + std::to_string(needed) + ", " +
                           std::to_string(kSamplesPerTerm) + " for each of " +
                           std::to_string(terms) + " terms",
               .found = std::to_string(samples)});
}

LeastSquares solve(const Matrix& columns, const std::vector<double>& target,
                   std::span<const std::uint8_t> is_free) {
  if (is_free.empty()) return least_squares(columns, target);
  NonNegativeFit fit = non_negative_least_squares(normal_equations(columns, target), is_free);
  if (!fit.has_converged)
    throw Error(
        {.problem = "least squares with bounds did not converge: its active sets went in circles",
         .advice = "Take fewer terms, or --set passive=false where there is that."});
  return {std::move(fit.coefficients), std::move(fit.dropped)};
}

/// What least squares leave of the sum of squares.
double squares_left(const Matrix& columns, const std::vector<double>& target,
                    std::span<const std::uint8_t> is_free) {
  const std::vector<double> coefficients = solve(columns, target, is_free).coefficients;
  double squares = 0.0;
  for (std::size_t n = 0; n < target.size(); ++n) {
    const double estimate =
        std::inner_product(coefficients.begin(), coefficients.end(), columns.row(n).begin(), 0.0);
    squares += (target[n] - estimate) * (target[n] - estimate);
  }
  return squares;
}

}  // namespace

Matrix rows_of(const Matrix& matrix, std::span<const std::size_t> samples) {
  Matrix rows(samples.size(), matrix.columns);
  for (std::size_t n = 0; n < samples.size(); ++n)
    std::ranges::copy(matrix.row(samples[n]), rows.row(n).begin());
  return rows;
}

std::vector<double> rows_of(const std::vector<double>& values,
                            std::span<const std::size_t> samples) {
  std::vector<double> rows(samples.size());
  std::ranges::transform(samples, rows.begin(), [&](std::size_t n) { return values[n]; });
  return rows;
}

Groups groups_by(const std::string& schedule, const TrainingData& data, const Matrix& features) {
  Groups groups;
  groups.samples.resize(1);
  if (schedule.empty()) {
    for (std::size_t n = 0; n < features.rows; ++n) groups.samples[0].push_back(n);
    return groups;
  }
  groups.feature = schedule;
  groups.frame = frame_of(schedule, data, [&features](const auto& take) {
    for (std::size_t n = 0; n < features.rows; ++n) take(features.row(n));
  });
  groups.samples.resize(groups.frame.knots.size());
  for (std::size_t n = 0; n < features.rows; ++n)
    groups.samples[knot_at(groups.frame, features.row(n))].push_back(n);
  return groups;
}

CoefficientSchedule schedule_frame(const std::string& schedule, const TrainingData& data) {
  if (schedule.empty()) return {};
  return frame_of(schedule, data, [&data](const auto& take) {
    for_each_usable(data, [&](std::span<const double> features, double) { take(features); });
  });
}

std::size_t knot_at(const CoefficientSchedule& frame, std::span<const double> features) {
  if (!frame.scheduled) return 0;
  return static_cast<std::size_t>(std::ranges::find(frame.knots, features[frame.feature]) -
                                  frame.knots.begin());
}

DesignFit fit_design(const Design& design, const Groups& groups,
                     std::span<const std::uint8_t> is_free) {
  DesignFit fit{groups.frame, {}};
  fit.coefficients.values = Matrix(groups.samples.size(), design.columns.columns);
  const auto terms = design.terms.size() -
                     static_cast<std::size_t>(std::ranges::count(design.terms, std::string{}));
  std::map<std::size_t, Dropped> dropped;
  for (std::size_t k = 0; k < groups.samples.size(); ++k) {
    check_size(groups.samples[k].size(), terms, groups, k);
    const Matrix columns = rows_of(design.columns, groups.samples[k]);
    const LeastSquares solved = solve(columns, rows_of(design.target, groups.samples[k]), is_free);
    std::ranges::copy(solved.coefficients, fit.coefficients.values.row(k).begin());
    for (const std::size_t j : solved.dropped) {
      ++dropped[j].groups;
      dropped[j].constant = dropped[j].constant && is_constant(columns, j);
    }
  }
  for (const auto& [j, what] : dropped)
    if (!design.terms[j].empty()) fit.notes.push_back(note(design.terms[j], what, groups));
  return fit;
}

bool has_slope(const TrainingData& data, std::size_t input, const Groups& groups, bool rates) {
  const bool schedules = groups.frame.scheduled && groups.frame.feature == input;
  return !schedules && (rates || !data.inputs[input].is_rate);
}

void note_on_rates(std::vector<std::string>& notes, const Design& design, const Groups& groups,
                   const TrainingData& data, const Matrix& features, std::string_view family,
                   std::span<const std::uint8_t> is_free) {
  constexpr double kWorthANote = 0.9;
  constexpr double kNegligible = 1e-6;  // share of the target's variance
  std::vector<std::size_t> rates;
  for (std::size_t j = 0; j < data.input_count(); ++j)
    if (data.inputs[j].is_rate && has_slope(data, j, groups, true)) rates.push_back(j);
  if (rates.empty()) return;
  std::vector<std::uint8_t> free_with_rates(is_free.begin(), is_free.end());
  if (!is_free.empty()) free_with_rates.resize(is_free.size() + rates.size(), 1);
  double without = 0.0;
  double with = 0.0;
  double count = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  for (const std::vector<std::size_t>& all : groups.samples) {
    std::vector<std::size_t> samples;
    for (std::size_t n = 0; n < all.size(); n += 1 + all.size() / kSamplesOfANote)
      samples.push_back(all[n]);
    const Matrix columns = rows_of(design.columns, samples);
    const std::vector<double> target = rows_of(design.target, samples);
    Matrix more(samples.size(), columns.columns + rates.size());
    for (std::size_t n = 0; n < samples.size(); ++n) {
      auto rest = std::ranges::copy(columns.row(n), more.row(n).begin()).out;
      for (const std::size_t j : rates) *rest++ = features(samples[n], j);
    }
    without += squares_left(columns, target, is_free);
    with += squares_left(more, target, free_with_rates);
    for (const double value : target) count += 1.0, sum += value, squares += value * value;
  }
  if (!(without > kNegligible * (squares - sum * sum / count))) return;
  if (!(std::sqrt(with) <= kWorthANote * std::sqrt(without))) return;
  std::vector<std::string> names;
  names.reserve(rates.size());
  for (const std::size_t j : rates) names.push_back(data.inputs[j].expression);
  notes.push_back(fmt::format(
      "warning: {0} has no slope over rates ({1}); with them, the RMSE of the training would be "
      "about {2:.4g} instead of {3:.4g} {4}: --set rates=true, in --models {0}:rates=true",
      family, fmt::join(names, ", "), std::sqrt(with / count), std::sqrt(without / count),
      unit_label(data.target)));
}

std::size_t first_rate(const TrainingData& data, std::string_view family) {
  const auto input = std::ranges::find(data.inputs, true, &InputInfo::is_rate);
  if (input == data.inputs.end())
    throw Error({.problem = std::string(family) + " has no input that is a rate",
                 .expected = "one such as lowpass(rate(spring_deflection_rad), 10Hz)",
                 .advice = "Add it to --inputs; the friction follows it."});
  return static_cast<std::size_t>(input - data.inputs.begin());
}

void add_slopes(Design& design, std::size_t first, const TrainingData& data, const Matrix& features,
                const Groups& groups, bool rates) {
  for (std::size_t j = 0; j < data.input_count(); ++j) {
    if (!has_slope(data, j, groups, rates)) continue;
    design.terms[first + j] = "input " + data.inputs[j].expression;
    for (std::size_t n = 0; n < features.rows; ++n) design.columns(n, first + j) = features(n, j);
  }
}

}  // namespace torsio
