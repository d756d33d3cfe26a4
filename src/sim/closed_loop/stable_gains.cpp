#include "sim/closed_loop/stable_gains.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <variant>
#include <vector>

#include "torsio/control/joint_impedance.hpp"

namespace torsio {
namespace {

constexpr double kGainStep = 1.1;

bool is_stable_with(ImpedancePlan plan, const JointImpedance::Gains& gains) {
  std::get<ImpedancePlan::Spring>(plan.controller).gains = gains;
  return LinearImpedance(plan).is_stable();
}

/// @param good @param other values, of which only the first is good
/// @returns the good value next to the boundary between them
template <class IsGood>
double good_up_to(double good, double other, const IsGood& is_good) {
  constexpr int kHalvings = 20;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = std::sqrt(good * other);
    (is_good(middle) ? good : other) = middle;
  }
  return good;
}

/// The values of a gain from below, geometrically up to the first that is (not) good, then by
/// bisection: the result depends on `lowest` only if it is good in several ranges.
/// @returns the least good one, or the largest below those that are not; none if there is none
template <class IsGood>
std::optional<double> find_gain(double lowest, double highest, bool looks_for_good,
                                const IsGood& is_good) {
  std::optional<double> last;
  for (double value = lowest; value > 0.0 && value <= highest; value *= kGainStep) {
    const bool is_this_good = is_good(value);
    if (looks_for_good && is_this_good) return last ? good_up_to(value, *last, is_good) : value;
    if (!looks_for_good && !is_this_good)
      return last ? std::optional(good_up_to(*last, value, is_good)) : std::nullopt;
    last = value;
  }
  return looks_for_good ? std::nullopt : last;
}

/// With three digits, none of them rounded up, or none down.
double three_digits(double value, bool rounds_up) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  return unit * (rounds_up ? std::ceil(value / unit) : std::floor(value / unit));
}

const ImpedancePlan::Spring& spring_of(const ImpedancePlan& plan) {
  return std::get<ImpedancePlan::Spring>(plan.controller);
}

double spring_stiffness_Nm_rad(const ImpedancePlan& plan) {
  return spring_of(plan).torque.deflection.joint.stiffness_Nm_rad;
}

/// The least damping that makes a stiffness stable; none if there is none.
std::optional<double> least_damping(const ImpedancePlan& plan, double stiffness_Nm_rad) {
  constexpr double kShortestRatio_s = 1e-5;
  constexpr double kLongestRatio_s = 1.0;
  const auto found = find_gain(kShortestRatio_s * spring_stiffness_Nm_rad(plan),
                               kLongestRatio_s * stiffness_Nm_rad, true, [&](double value) {
                                 return is_stable_with(plan, {stiffness_Nm_rad, value});
                               });
  return found ? std::optional(three_digits(*found, true)) : std::nullopt;
}

/// The largest damping below that of the plan that is stable with its stiffness.
std::optional<double> largest_damping(const ImpedancePlan& plan) {
  constexpr int kSteps = 100;
  const JointImpedance::Gains& gains = spring_of(plan).gains;
  const auto is_stable_at = [&](double value) {
    return is_stable_with(plan, {gains.stiffness_Nm_rad, value});
  };
  double less_Nms_rad = gains.damping_Nms_rad / kGainStep;
  for (int n = 0; n < kSteps && less_Nms_rad > 0.0; ++n, less_Nms_rad /= kGainStep)
    if (is_stable_at(less_Nms_rad))
      return three_digits(good_up_to(less_Nms_rad, kGainStep * less_Nms_rad, is_stable_at), false);
  return std::nullopt;
}

std::optional<double> largest_stiffness(const ImpedancePlan& plan) {
  constexpr double kSmallest = 1e-4;
  const JointImpedance::Gains& gains = spring_of(plan).gains;
  const auto found = find_gain(kSmallest * spring_stiffness_Nm_rad(plan),
                               kGainStep * gains.stiffness_Nm_rad, false, [&](double value) {
                                 return is_stable_with(plan, {value, gains.damping_Nms_rad});
                               });
  return found ? std::optional(three_digits(*found, false)) : std::nullopt;
}

}  // namespace

std::string stable_gains(const ImpedancePlan& plan) {
  const JointImpedance::Gains& gains = spring_of(plan).gains;
  std::vector<std::string> ways;
  if (const auto largest_Nms_rad = largest_damping(plan))
    ways.push_back(fmt::format("a damping of at most {:.3g} Nms/rad", *largest_Nms_rad));
  const auto least_Nms_rad = least_damping(plan, gains.stiffness_Nm_rad);
  if (least_Nms_rad && gains.damping_Nms_rad < *least_Nms_rad)
    ways.push_back(fmt::format("a damping from {:.3g} Nms/rad on", *least_Nms_rad));
  if (const auto largest_Nm_rad = largest_stiffness(plan))
    ways.push_back(fmt::format("at most {:.3g} Nm/rad with this damping", *largest_Nm_rad));
  double softer_Nm_rad = 0.5 * gains.stiffness_Nm_rad;
  for (int n = 0; ways.empty() && n < 10; ++n, softer_Nm_rad *= 0.5)
    if (const auto found = least_damping(plan, softer_Nm_rad))
      ways.push_back(
          fmt::format("for example {:.3g} Nm/rad with {:.3g} Nms/rad", softer_Nm_rad, *found));
  return ways.empty() ? "another bandwidth" : fmt::format("{}", fmt::join(ways, ", or "));
}

std::optional<double> largest_correction_rad_s(
    const ImpedancePlan& plan, const std::function<bool(const ImpedancePlan&)>& is_good) {
  constexpr double kSlowest_rad_s = 0.01;
  ImpedancePlan slower = plan;
  const auto is_good_with = [&](double bandwidth_rad_s) {
    slower.correction.bandwidth_rad_s = bandwidth_rad_s;
    return is_good(slower);
  };
  const double highest_rad_s = plan.correction.bandwidth_rad_s;
  if (highest_rad_s <= kSlowest_rad_s || !is_good_with(kSlowest_rad_s)) return std::nullopt;
  return three_digits(good_up_to(kSlowest_rad_s, highest_rad_s, is_good_with), false);
}

}  // namespace torsio
