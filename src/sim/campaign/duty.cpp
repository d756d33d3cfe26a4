#include "duty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>

#include "sim/experiments/experiment_table.hpp"

namespace torsio {
namespace {

// Shares of a sheet's values.
constexpr double kClutchShare = 0.6;     // share of its static torque: it must not slip
constexpr double kInertialShare = 0.05;  // share of the torque, for the acceleration of the load
constexpr double kInertiaRatio =
    3.0;  // largest inertia of joint and load over the reflected rotor's
constexpr double kStiffInertiaRatio = 1.5;  // where rotor and load are nearly rigid
constexpr double kRange_rad = 2.4;
constexpr double kRubberRange_rad = 1.0;
constexpr double kLeverAt1Nm_m = 0.13;  // length: grows with the cube root of the torque

constexpr double kSlowestShare = 0.02;      // share of the rated speed
constexpr double kShortestWayShare = 0.02;  // share of the range
constexpr double kReachTop_s = 0.3;         // a bare joint reaches its top speed in this time
constexpr double kShortestRest_s = 0.1;
constexpr double kShortRest_s = 2.0;
constexpr double kLongRest_s = 12.0;
constexpr double kLongRestsShare = 0.1;
constexpr double kShortestWeight_s = 30.0;
constexpr double kLongestWeight_s = 90.0;
constexpr double kWeightChange_s = 1.0;
constexpr double kShortestImpact_s = 5e-3;
constexpr double kLongestImpact_s = 50e-3;
constexpr double kImpactGap_s = 3.0;
constexpr double kImpactReserve = 0.2;    // share of the torque, for what still swings
constexpr double kLeastImpact = 0.03;     // share of the torque under which there is none
constexpr double kLargestResponse = 1.8;  // response of an undamped spring to a half-sine
constexpr double kConditionTime_s = 1200.0;
constexpr std::size_t kHourTicks = 3600 * static_cast<std::size_t>(kBenchRate_Hz);

/// Between rotor and joint, at the joint: from the lower natural frequency without load.
double stiffness(const PlantParameters& of) {
  const double ratio = total_ratio(of);
  const double rotor_kg_m2 = of.rotor_inertia_kg_m2 * ratio * ratio;
  const double speed_rad_s = 2.0 * std::numbers::pi * natural_frequencies(of)[0];
  return speed_rad_s * speed_rad_s * rotor_kg_m2 * of.joint_inertia_kg_m2 /
         (rotor_kg_m2 + of.joint_inertia_kg_m2);
}

constexpr double smooth(double share) { return share * share * (3.0 - 2.0 * share); }

}  // namespace

DutyLimits duty_limits(const DataSheet& sheet) {
  const PlantParameters plant = plant_parameters(sheet);
  const bool is_stiff = sheet.family == ActuatorFamily::harmonic_drive;
  DutyLimits limits{
      .torque_Nm = sheet.rating.torque_Nm.value,
      .range_rad = sheet.family == ActuatorFamily::rubber_clutch ? kRubberRange_rad : kRange_rad,
      .bandwidth_rad_s = is_stiff ? 100.0 : 200.0};
  if (const auto* const clutch = std::get_if<ClutchSheet>(&sheet.first))
    limits.torque_Nm = std::min(limits.torque_Nm, kClutchShare * clutch->static_torque_Nm.value);
  const double ratio = total_ratio(plant);
  limits.load_inertia_kg_m2 =
      (is_stiff ? kStiffInertiaRatio : kInertiaRatio) * plant.rotor_inertia_kg_m2 * ratio * ratio -
      plant.joint_inertia_kg_m2;
  return limits;
}

Duty::Duty(const DataSheet& sheet, const DutySettings& settings, std::uint64_t seed)
    : limits_(duty_limits(sheet)),
      settings_(settings),
      random_(seed),
      joint_inertia_kg_m2_(plant_parameters(sheet).joint_inertia_kg_m2),
      stiffness_Nm_rad_(stiffness(plant_parameters(sheet))),
      top_speed_rad_s_(settings.speed_share * sheet.rating.speed_rad_s.value),
      move_({.waypoints_rad = {0.0}}, kBenchRate_Hz) {
  to_ = drawn_weight();
  from_ = to_;
  load_ = {.inertia_kg_m2 = to_.inertia_kg_m2, .gravity_Nm = to_.gravity_Nm};
  wanted_rad_ = random_.uniform(-0.5, 0.5) * limits_.range_rad;
  rest_left_ = ticks_between(kShortestRest_s, kShortRest_s);
  next_weight_ = ticks_between(kShortestWeight_s, kLongestWeight_s);
  next_impact_ = ticks_between(0.0, 2.0 * kImpactGap_s);
  temperature_K_ = random_.uniform(settings_.coldest_K, settings_.hottest_K);
  wear_ = random_.uniform(settings_.min_friction, settings_.max_friction);
}

std::size_t Duty::ticks_between(double shortest_s, double longest_s) noexcept {
  return 1 + static_cast<std::size_t>(random_.uniform(shortest_s, longest_s) * kBenchRate_Hz);
}

// The lever is short enough for the loop, whatever its weight.
Duty::Weight Duty::drawn_weight() noexcept {
  const double gravity_Nm = settings_.gravity_share * limits_.torque_Nm * random_.uniform();
  const double length_m = kLeverAt1Nm_m * std::cbrt(limits_.torque_Nm) * random_.uniform(0.5, 1.0);
  return {.gravity_Nm = gravity_Nm,
          .inertia_kg_m2 = std::clamp(gravity_Nm * length_m / 9.81, 0.0,
                                      std::max(limits_.load_inertia_kg_m2, 0.0))};
}

void Duty::begin_move() {
  const double inertia_kg_m2 = joint_inertia_kg_m2_ + load_.inertia_kg_m2;
  const double speed_rad_s = top_speed_rad_s_ * std::pow(kSlowestShare, random_.uniform());
  const double acceleration_rad_s2 =
      std::min(kInertialShare * limits_.torque_Nm / inertia_kg_m2, top_speed_rad_s_ / kReachTop_s);
  double to_rad = random_.uniform(-1.0, 1.0) * limits_.range_rad;
  const double least_rad = kShortestWayShare * limits_.range_rad;
  if (std::abs(to_rad - wanted_rad_) < least_rad)
    to_rad = wanted_rad_ > 0.0 ? wanted_rad_ - least_rad : wanted_rad_ + least_rad;
  move_ = JointMove({.waypoints_rad = {wanted_rad_, to_rad},
                     .speed_rad_s = speed_rad_s,
                     .acceleration_rad_s2 = acceleration_rad_s2},
                    kBenchRate_Hz);
  is_moving_ = true;
}

void Duty::begin_rest() noexcept {
  is_moving_ = false;
  const bool is_long = random_.uniform() < kLongRestsShare;
  rest_left_ = ticks_between(kShortestRest_s, is_long ? kLongRest_s : kShortRest_s);
  if (tick_ < next_weight_) return;
  next_weight_ = tick_ + ticks_between(kShortestWeight_s, kLongestWeight_s);
  from_ = to_;
  to_ = drawn_weight();
  weight_tick_ = tick_;
  rest_left_ += static_cast<std::size_t>(kWeightChange_s * kBenchRate_Hz);
}

void Duty::change_weight() noexcept {
  if (weight_tick_ == 0) return;
  const double share =
      std::min(static_cast<double>(tick_ - weight_tick_) / (kWeightChange_s * kBenchRate_Hz), 1.0);
  load_.gravity_Nm = from_.gravity_Nm + (to_.gravity_Nm - from_.gravity_Nm) * smooth(share);
  load_.inertia_kg_m2 =
      from_.inertia_kg_m2 + (to_.inertia_kg_m2 - from_.inertia_kg_m2) * smooth(share);
  if (share == 1.0) weight_tick_ = 0;
}

void Duty::begin_impact() noexcept {
  const double mean_s = std::max(60.0 / settings_.impacts_per_min - kImpactGap_s, 0.0);
  const double gap_s = kImpactGap_s - mean_s * std::log1p(-random_.uniform());
  next_impact_ = tick_ + 1 + static_cast<std::size_t>(gap_s * kBenchRate_Hz);
  // Always the same count of draws.
  const std::size_t ticks = ticks_between(kShortestImpact_s, kLongestImpact_s);
  const double share = random_.uniform(0.2, 1.0);
  const double sign = random_.uniform() < 0.5 ? -1.0 : 1.0;
  const double left_Nm = limits_.torque_Nm * (0.95 - kImpactReserve) -
                         std::abs(load_.gravity_Nm * std::sin(wanted_rad_));
  if (!(left_Nm > kLeastImpact * limits_.torque_Nm)) return;
  const double speed_rad_s =
      std::sqrt(stiffness_Nm_rad_ / (joint_inertia_kg_m2_ + load_.inertia_kg_m2));
  const double response =
      std::min(kLargestResponse,
               2.0 * speed_rad_s * static_cast<double>(ticks) / kBenchRate_Hz / std::numbers::pi);
  impact_tick_ = tick_;
  impact_ticks_ = ticks;
  impact_Nm_ = sign * share * left_Nm / response;
}

void Duty::step_impact() noexcept {
  if (settings_.impacts_per_min > 0.0 && tick_ >= next_impact_) begin_impact();
  const std::size_t since = tick_ - impact_tick_;
  load_.external_torque_Nm =
      since < impact_ticks_ ? impact_Nm_ * std::sin(std::numbers::pi * static_cast<double>(since) /
                                                    static_cast<double>(impact_ticks_))
                            : 0.0;
}

double Duty::since_impact_s() const noexcept {
  if (impact_ticks_ == 0) return std::numeric_limits<double>::infinity();
  return static_cast<double>(tick_ - impact_tick_) / kBenchRate_Hz;
}

// Each hour has its own temperature and wear, which are approached exponentially.
void Duty::step_condition() noexcept {
  if (tick_ % kHourTicks == 0) {
    wanted_K_ = random_.uniform(temperature_K_, settings_.hottest_K);
    wanted_wear_ = random_.uniform(settings_.min_friction, settings_.max_friction);
    if (tick_ != 0 && random_.uniform() < 0.5)
      wanted_K_ = random_.uniform(settings_.coldest_K, settings_.hottest_K);
  }
  const double share = static_cast<double>(kConditionTicks) / kBenchRate_Hz / kConditionTime_s;
  temperature_K_ += share * (wanted_K_ - temperature_K_);
  wear_ += share * (wanted_wear_ - wear_);
  friction_factor_ = torsio::friction_factor(temperature_K_) * wear_;
}

void Duty::step() {
  if (tick_ % kConditionTicks == 0) step_condition();
  if (is_moving_) {
    const JointMove::Output at = move_.step();
    wanted_rad_ = at.position_rad;
    if (at.is_done) begin_rest();
  } else if (rest_left_-- == 0) {
    begin_move();
  }
  change_weight();
  step_impact();
  ++tick_;
}

}  // namespace torsio
