#include "torsio/safety/angle_unwrapper.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

/// Beyond so many turns an expected angle has too few digits, and is not an angle.
constexpr double kMaxTurns = 1e6;

constexpr std::string_view kPlace = "angle unwrapper";

}  // namespace

AngleUnwrapper::AngleUnwrapper(const Settings& settings) : settings_(settings) {
  require(settings.turn_rad > 0.0 && std::isfinite(settings.turn_rad), {kPlace, "turn_rad"},
          "a positive number", settings.turn_rad);
  require(
      settings.largest_change_rad > 0.0 && settings.largest_change_rad < 0.5 * settings.turn_rad,
      {kPlace, "largest_change_rad"}, "above 0, below half a turn", settings.largest_change_rad);
}

void AngleUnwrapper::set_turn(double raw_rad, double near_rad) noexcept {
  // From the raw value each time: sums of changes would collect rounding errors.
  angle_rad_ = raw_rad + std::round((near_rad - raw_rad) / settings_.turn_rad) * settings_.turn_rad;
  periods_ = 0;
}

bool AngleUnwrapper::start(double raw_rad, double expected_rad, double tolerance_rad) noexcept {
  // Written so that NaN is refused.
  is_started_ = false;
  if (!(std::abs(raw_rad) <= settings_.turn_rad)) return false;
  if (!(std::abs(expected_rad) <= kMaxTurns * settings_.turn_rad)) return false;
  if (!(tolerance_rad > 0.0 && tolerance_rad < 0.5 * settings_.turn_rad)) return false;
  if (!(std::abs(std::remainder(raw_rad - expected_rad, settings_.turn_rad)) <= tolerance_rad))
    return false;
  set_turn(raw_rad, expected_rad);
  is_started_ = true;
  return true;
}

AngleUnwrapper::Output AngleUnwrapper::step(double raw_rad) noexcept {
  if (!is_started_) return {.angle_rad = angle_rad_, .fault = Fault::zero_not_set};
  // Counted until any turn is possible, and no further: a count that overflows would begin again.
  if (periods_ * settings_.largest_change_rad < settings_.turn_rad) ++periods_;
  const double possible_rad = periods_ * settings_.largest_change_rad;
  const Output held{.angle_rad = angle_rad_, .fault = Fault::input_not_finite};
  if (!(std::abs(raw_rad) <= settings_.turn_rad)) return held;
  const double distance_rad = std::abs(std::remainder(raw_rad - angle_rad_, settings_.turn_rad));
  if (!(distance_rad <= possible_rad)) return held;
  if (!(distance_rad < settings_.turn_rad - possible_rad)) {
    is_started_ = false;
    return {.angle_rad = angle_rad_, .fault = Fault::zero_not_set};
  }
  set_turn(raw_rad, angle_rad_);
  return {.angle_rad = angle_rad_, .fault = Fault::none};
}

}  // namespace torsio
