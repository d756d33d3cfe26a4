#include "model/linear/polynomial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/checks.hpp"
#include "model/common/affine_inverse.hpp"

namespace torsio {
namespace {

std::size_t inputs_of(const Polynomial::Parameters& parameters) {
  require(parameters.degree <= Polynomial::kHighestDegree, "polynomial: degree",
          "at most " + std::to_string(Polynomial::kHighestDegree),
          std::to_string(parameters.degree));
  const std::size_t columns = parameters.coefficients.values.columns;
  require(
      columns > parameters.curve_columns(), "polynomial: coefficients",
      std::to_string(parameters.curve_columns()) + " columns for the curve and one for each input",
      std::to_string(columns) + " columns");
  return columns - parameters.curve_columns();
}

/// The ranges as a schedule over the coefficients' knots.
CoefficientSchedule ranges_of(const Polynomial::Parameters& parameters) {
  CoefficientSchedule schedule = parameters.coefficients;
  const std::size_t columns = 2 * parameters.curves();
  if (!parameters.ranges.values.empty()) {
    const Matrix& given = parameters.ranges;
    require(given.rows == schedule.values.rows && given.columns == columns, "polynomial: ranges",
            std::to_string(schedule.values.rows) + " x " + std::to_string(columns) +
                ", lowest and highest of each curve",
            std::to_string(given.rows) + " x " + std::to_string(given.columns));
    schedule.values = given;
    return schedule;
  }
  Matrix whole(schedule.values.rows, columns);
  for (std::size_t k = 0; k < whole.rows; ++k)
    for (std::size_t j = 0; j < columns; ++j)
      whole(k, j) = parameters.centre + (j % 2 == 0 ? -1.0 : 1.0) * parameters.half_range;
  schedule.values = std::move(whole);
  return schedule;
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
      ranges_(ranges_of(parameters), input_count(), "polynomial: ranges"),
      direction_(parameters.dead_band) {
  require(std::isfinite(centre_), {kFamily, "centre"}, "a finite number", centre_);
  require(std::isfinite(half_range_) && half_range_ > 0.0, {kFamily, "half_range"},
          "a positive number", half_range_);
  require(std::isfinite(dead_band_) && dead_band_ >= 0.0, {kFamily, "dead_band"},
          "a number not below 0", dead_band_);
  const Matrix& values = parameters.coefficients.values;
  for (std::size_t k = 0; k < values.rows; ++k)
    require(values(k, first_slope_) == 0.0, {kFamily, "slope of the first input"},
            "0, since the curve holds that term", values(k, first_slope_));
  const Matrix& ranges = ranges_.schedule().values;
  for (std::size_t k = 0; k < ranges.rows; ++k)
    for (std::size_t j = 0; j < ranges.columns; j += 2)
      require(ranges(k, j) <= ranges(k, j + 1), {kFamily, "ranges"},
              "a highest that is not below the lowest", ranges(k, j + 1));
}

Polynomial::Parameters Polynomial::parameters() const {
  return {.coefficients = coefficients_.schedule(),
          .degree = degree_,
          .by_direction = by_direction_,
          .dead_band = dead_band_,
          .centre = centre_,
          .half_range = half_range_,
          .ranges = ranges_.schedule().values};
}

ModelMemory Polynomial::memory(const InputRanges& ranges) const {
  if (!by_direction_) return {};
  // The largest |P+ - P-| within the range, |z| <= 1.
  const Matrix& values = coefficients_.schedule().values;
  double apart = 0.0;
  for (std::size_t i = 0; i <= degree_; ++i) {
    double largest = 0.0;
    for (std::size_t k = 0; k < values.rows; ++k)
      largest = std::max(largest, std::abs(values(k, i) - values(k, degree_ + 1 + i)));
    apart += largest;
  }
  // The direction is determined after a travel of the dead band, until which the bound is as large.
  constexpr double kSmallestShare = 1e-3;
  const double band = std::max(dead_band_, kSmallestShare * ranges.width(0));
  return {.slips = {{apart / band, 2.0 * band}}};
}

Polynomial::Reach Polynomial::reach(const Position& at, std::size_t branch) const noexcept {
  return {(ranges_.coefficient(at, 2 * branch) - centre_) / half_range_,
          (ranges_.coefficient(at, 2 * branch + 1) - centre_) / half_range_};
}

Polynomial::Curve Polynomial::branch(const Position& at, std::size_t branch,
                                     double z) const noexcept {
  const Reach own = reach(at, branch);
  const double border = kBorder * (own.highest - own.lowest);
  const double held = std::min(std::max(z, own.lowest - border), own.highest + border);
  const std::size_t first = branch * (degree_ + 1);
  Curve result{.is_held = held < z || held > z};
  for (std::size_t i = degree_ + 1; i-- > 0;) {
    result.slope = result.slope * held + result.value;
    result.value = result.value * held + coefficients_.coefficient(at, first + i);
  }
  if (result.is_held) result.slope = 0.0;
  return result;
}

Polynomial::Curve Polynomial::curve(const Position& at, double z) const noexcept {
  const Direction direction = direction_.direction();
  if (!by_direction_ || direction == Direction::rising) return branch(at, 0, z);
  const Curve falling = branch(at, 1, z);
  if (direction == Direction::falling) return falling;
  const Curve rising = branch(at, 0, z);
  return {0.5 * (rising.value + falling.value), 0.5 * (rising.slope + falling.slope),
          rising.is_held || falling.is_held};
}

Estimate Polynomial::step(Features features) noexcept {
  direction_.step(features[0]);
  const auto at = coefficients_.locate(features);
  const double z = (features[0] - centre_) / half_range_;
  const Curve here = curve(at, z);
  return {.value = here.value + coefficients_.weighted_sum(at, first_slope_, features),
          .fault = here.is_held ? Fault::outside_training_range : Fault::none};
}

Estimate Polynomial::invert(double target, Features features) const noexcept {
  const CoefficientSchedule& schedule = coefficients_.schedule();
  if (schedule.scheduled && schedule.feature == 0) return detail::no_inverse(features);
  const auto at = coefficients_.locate(features);
  const double wanted = target - coefficients_.weighted_sum(at, first_slope_, features, 1);
  const auto x = [this](double z) { return centre_ + half_range_ * z; };

  const Direction direction = direction_.direction();
  auto [low, high] = !by_direction_ ? reach(at, 0)
                     : direction == Direction::unknown
                         ? Reach{}
                         : reach(at, direction == Direction::rising ? 0 : 1);
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
