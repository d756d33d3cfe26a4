#include "torsio/model/polynomial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "model/affine_inverse.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::size_t inputs_of(const Polynomial::Parameters& parameters) {
  if (parameters.degree > Polynomial::kHighestDegree)
    throw Error({.place = "polynomial: degree",
                 .expected = "at most " + std::to_string(Polynomial::kHighestDegree),
                 .found = std::to_string(parameters.degree)});
  const std::size_t columns = parameters.coefficients.values.columns;
  if (columns <= parameters.curve_columns())
    throw Error({.place = "polynomial: coefficients",
                 .expected = std::to_string(parameters.curve_columns()) +
                             " columns for the curve and one for each input",
                 .found = std::to_string(columns) + " columns"});
  return columns - parameters.curve_columns();
}

void require(bool good, const std::string& field, const std::string& expected, double found) {
  if (!good)
    throw Error(
        {.place = "polynomial: " + field, .expected = expected, .found = std::to_string(found)});
}

}  // namespace

Polynomial::Polynomial(const Parameters& parameters)
    : degree_(parameters.degree),
      by_direction_(parameters.by_direction),
      dead_band_(parameters.dead_band),
      centre_(parameters.centre),
      half_range_(parameters.half_range),
      first_slope_(parameters.curve_columns()),
      coefficients_(parameters.coefficients, inputs_of(parameters), kFamily),
      direction_(parameters.dead_band) {
  require(std::isfinite(centre_), "centre", "a finite number", centre_);
  require(std::isfinite(half_range_) && half_range_ > 0.0, "half_range", "a positive number",
          half_range_);
  require(std::isfinite(dead_band_) && dead_band_ >= 0.0, "dead_band", "a number not below 0",
          dead_band_);
  const Matrix& values = parameters.coefficients.values;
  for (std::size_t k = 0; k < values.rows; ++k)
    require(values(k, first_slope_) == 0.0, "slope of the first input",
            "0, since the curve holds that term", values(k, first_slope_));
}

Polynomial::Parameters Polynomial::parameters() const {
  return {.coefficients = coefficients_.schedule(),
          .degree = degree_,
          .by_direction = by_direction_,
          .dead_band = dead_band_,
          .centre = centre_,
          .half_range = half_range_};
}

Polynomial::Curve Polynomial::branch(const ScheduledCoefficients::Position& at, std::size_t first,
                                     double z) const noexcept {
  Curve result;
  for (std::size_t i = degree_ + 1; i-- > 0;) {
    result.slope = result.slope * z + result.value;
    result.value = result.value * z + coefficients_.coefficient(at, first + i);
  }
  return result;
}

Polynomial::Curve Polynomial::curve(const ScheduledCoefficients::Position& at,
                                    double z) const noexcept {
  const Direction direction = direction_.direction();
  if (!by_direction_ || direction == Direction::rising) return branch(at, 0, z);
  const Curve falling = branch(at, degree_ + 1, z);
  if (direction == Direction::falling) return falling;
  const Curve rising = branch(at, 0, z);
  return {0.5 * (rising.value + falling.value), 0.5 * (rising.slope + falling.slope)};
}

Estimate Polynomial::step(Features features) noexcept {
  direction_.step(features[0]);
  const auto at = coefficients_.locate(features);
  const double z = (features[0] - centre_) / half_range_;
  return {.value = curve(at, z).value + coefficients_.weighted_sum(at, first_slope_, features)};
}

Estimate Polynomial::invert(double target, Features features) const noexcept {
  const CoefficientSchedule& schedule = coefficients_.schedule();
  if (schedule.scheduled && schedule.feature == 0) return no_inverse(features);
  const auto at = coefficients_.locate(features);
  const double wanted = target - coefficients_.weighted_sum(at, first_slope_, features, 1);
  const auto x = [this](double z) { return centre_ + half_range_ * z; };

  double low = -1.0;
  double high = 1.0;
  const double error_low = curve(at, low).value - wanted;
  const double error_high = curve(at, high).value - wanted;
  if (!(error_low * error_high <= 0.0)) {
    const double nearer = std::abs(error_low) < std::abs(error_high) ? low : high;
    return {.value = x(nearer), .fault = Fault::outside_training_range};
  }
  const bool rises = error_high >= error_low;
  const double given = (features[0] - centre_) / half_range_;
  double z = std::isnan(given) ? 0.0 : std::clamp(given, low, high);
  double moved = high - low;
  for (int i = 0; i < kInversionSteps; ++i) {
    const Curve here = curve(at, z);
    const double error = here.value - wanted;
    if (error == 0.0) break;
    ((error < 0.0) == rises ? low : high) = z;
    // Newton's step where it stays in the bracket and at least halves the last step (it crawls
    // towards a multiple root), else half the bracket.
    const double newton = z - error / here.slope;
    const bool good = newton > low && newton < high && std::abs(newton - z) <= 0.5 * moved;
    const double next = good ? newton : 0.5 * (low + high);
    moved = std::abs(next - z);
    z = next;
    if (moved <= std::numeric_limits<double>::epsilon()) break;
  }
  return {.value = x(z)};
}

}  // namespace torsio
