#include "model/common/schedule.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/all_finite.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

bool same_sign(double a, double b) { return (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0); }

/// Three-point slope at an end, limited so that the cubic keeps the shape of its first interval.
double end_slope(double h0, double h1, double secant0, double secant1) {
  const double slope = ((2.0 * h0 + h1) * secant0 - h0 * secant1) / (h0 + h1);
  if (!same_sign(slope, secant0)) return 0.0;
  if (!same_sign(secant0, secant1) && std::abs(slope) > 3.0 * std::abs(secant0))
    return 3.0 * secant0;
  return slope;
}

void check(const CoefficientSchedule& schedule, std::size_t input_count, const std::string& place) {
  if (!all_finite(schedule.values.values))
    throw Error({.place = place + ": coefficients", .expected = "finite numbers"});
  const std::size_t rows = schedule.scheduled ? schedule.knots.size() : 1;
  if (schedule.values.rows != rows || rows == 0 ||
      schedule.values.values.size() != rows * schedule.values.columns)
    throw Error({.place = place + ": coefficients",
                 .expected = schedule.scheduled ? "one row for each of at least one knot"
                                                : "one row, since they are not scheduled",
                 .found = std::to_string(schedule.values.rows) + " rows and " +
                          std::to_string(schedule.knots.size()) + " knots"});
  if (!schedule.scheduled) {
    if (!schedule.knots.empty())
      throw Error({.place = place + ": knots",
                   .expected = "none, since the coefficients are not scheduled",
                   .found = std::to_string(schedule.knots.size())});
    return;
  }
  if (schedule.feature >= input_count)
    throw Error({.place = place + ": scheduling feature",
                 .expected = "one of the " + std::to_string(input_count) + " inputs",
                 .found = "number " + std::to_string(schedule.feature)});
  if (!all_ascending(schedule.knots))
    throw Error({.place = place + ": knots", .expected = "finite, strictly ascending numbers"});
}

}  // namespace

std::vector<double> monotone_slopes(std::span<const double> knots, std::span<const double> values) {
  const std::size_t count = knots.size();
  std::vector<double> slopes(count, 0.0);
  if (count < 2) return slopes;
  const auto width = [&](std::size_t k) { return knots[k + 1] - knots[k]; };
  const auto secant = [&](std::size_t k) { return (values[k + 1] - values[k]) / width(k); };
  if (count == 2) {
    slopes[0] = slopes[1] = secant(0);
    return slopes;
  }
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const double before = secant(k - 1);
    const double after = secant(k);
    if (!same_sign(before, after)) continue;
    const double weight_before = 2.0 * width(k) + width(k - 1);
    const double weight_after = width(k) + 2.0 * width(k - 1);
    slopes[k] = (weight_before + weight_after) / (weight_before / before + weight_after / after);
  }
  const std::size_t last = count - 2;
  slopes.front() = end_slope(width(0), width(1), secant(0), secant(1));
  slopes.back() = end_slope(width(last), width(last - 1), secant(last), secant(last - 1));
  return slopes;
}

ScheduledCoefficients::ScheduledCoefficients(CoefficientSchedule schedule, std::size_t input_count,
                                             std::string_view place)
    : schedule_(std::move(schedule)) {
  check(schedule_, input_count, std::string(place));
  const Matrix& values = schedule_.values;
  slopes_ = Matrix(values.rows, values.columns);
  if (!schedule_.scheduled) return;
  std::vector<double> column(values.rows);
  for (std::size_t j = 0; j < values.columns; ++j) {
    for (std::size_t k = 0; k < values.rows; ++k) column[k] = values(k, j);
    const std::vector<double> slopes = monotone_slopes(schedule_.knots, column);
    for (std::size_t k = 0; k < values.rows; ++k) slopes_(k, j) = slopes[k];
  }
}

ScheduledCoefficients::Position ScheduledCoefficients::locate(Features features) const noexcept {
  if (!schedule_.scheduled) return {};
  const std::vector<double>& knots = schedule_.knots;
  const double s = features[schedule_.feature];
  const std::size_t last = knots.size() - 1;
  if (!(s > knots.front())) return {};  // NaN too, which has no place between knots
  if (s >= knots.back()) return {.left = last, .right = last};
  const auto above = std::ranges::upper_bound(knots, s);
  const auto right = static_cast<std::size_t>(above - knots.begin());
  const double h = knots[right] - knots[right - 1];
  const double t = (s - knots[right - 1]) / h;
  const double u = 1.0 - t;
  return {
      .left = right - 1,
      .right = right,
      .weights = {(1.0 + 2.0 * t) * u * u, h * t * u * u, t * t * (3.0 - 2.0 * t), -h * t * t * u}};
}

void ScheduledCoefficients::evaluate(Features features, std::span<double> out) const noexcept {
  const Position at = locate(features);
  for (std::size_t j = 0; j < size(); ++j) out[j] = coefficient(at, j);
}

double ScheduledCoefficients::weighted_sum(const Position& at, std::size_t first, Features features,
                                           std::size_t from) const noexcept {
  double sum = 0.0;
  for (std::size_t j = from; j < features.size(); ++j)
    sum += coefficient(at, first + j) * features[j];
  return sum;
}

double ScheduledCoefficients::largest(std::size_t column) const noexcept {
  double largest = 0.0;
  for (std::size_t k = 0; k < schedule_.values.rows; ++k)
    largest = std::max(largest, std::abs(schedule_.values(k, column)));
  return largest;
}

std::size_t ScheduledCoefficients::fitted_count() const noexcept {
  std::size_t terms = 0;
  for (std::size_t j = 0; j < size(); ++j) {
    bool is_term = false;
    for (std::size_t k = 0; k < schedule_.values.rows; ++k)
      is_term = is_term || schedule_.values(k, j) != 0.0;
    if (is_term) ++terms;
  }
  return terms * schedule_.values.rows;
}

}  // namespace torsio
