#include "torsio/actuator/wear.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <variant>

#include "actuator/stage_wear.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr double kFrictionScale_K = 60.0;
constexpr double kStiffnessLost = 0.1;
constexpr double kFrictionGained = 1.0;
constexpr double kPlayGained = 2.0;

/// What wear does to a stage, value by value.
class Ageing {
 public:
  explicit Ageing(const StageWear& wear) : wear_(wear) {}

  void operator()(SpringSheet& spring) const {
    soften(spring.stiffness_Nm_rad);
    soften(spring.stage_stiffness_Nm_rad);
    for (CurvePoint& point : spring.curve) {
      soften(point.torque_Nm);
      scale(point.deflection_rad, 1.0);  // the table has one origin
    }
    rub(spring.friction_Nm);
    rub(spring.load_friction);
    rub(spring.break_away_rad);
    rub(spring.knee_rad);
    scale(spring.half_gap_rad, wear_.play);
  }
  void operator()(ElastomerSheet& coupling) const {
    soften(coupling.stiffness_Nm_rad);
    for (SheetValue& branch : coupling.branch_stiffness_Nm_rad) soften(branch);
    rub(coupling.slip_Nm);
    rub(coupling.break_away_rad);
  }
  void operator()(RubberSheet& rubber) const {
    soften(rubber.stiffness_Nm_rad);
    soften(rubber.asymmetry_Nm_rad);
    rub(rubber.slip_Nm);
    rub(rubber.break_away_rad);
  }
  /// The hysteresis is specified as an angle.
  void operator()(GearSheet& gear) const {
    soften(gear.stiffness_Nm_rad);
    rub(gear.hysteresis_rad);
    rub(gear.break_away_rad);
  }
  void operator()(ClutchSheet& clutch) const { soften(clutch.stiffness_Nm_rad); }
  void operator()(TubeSheet& tube) const { soften(tube.stiffness_Nm_rad); }

 private:
  static void scale(SheetValue& value, double factor) { value = assumed(value.value * factor); }
  void soften(SheetValue& value) const { scale(value, wear_.stiffness); }
  void rub(SheetValue& value) const { scale(value, wear_.friction); }
  template <class Values>
  void rub(Values& values) const {
    for (SheetValue& value : values) rub(value);
  }

  StageWear wear_;
};

}  // namespace

void check(const OperatingConditions& conditions) {
  using Limits = OperatingConditions;
  const auto is_possible = [](double temperature_K) {
    return temperature_K >= Limits::kColdest_K && temperature_K <= Limits::kHottest_K;
  };
  const std::string range =
      fmt::format("{:g} to {:g} K (-40 to 85 degC)", Limits::kColdest_K, Limits::kHottest_K);
  const double last_K = conditions.temperature_K + conditions.warm_up_K;
  require<UsageError>(is_possible(conditions.temperature_K), "temperature", range,
                      conditions.temperature_K);
  require<UsageError>(is_possible(last_K), "temperature after the warm-up", range, last_K);
  require<UsageError>(conditions.warm_up_time_s >= Limits::kShortestWarmUp_s &&
                          std::isfinite(conditions.warm_up_time_s),
                      "warm-up time", fmt::format("at least {:g} s", Limits::kShortestWarmUp_s),
                      conditions.warm_up_time_s);
  require<UsageError>(conditions.age >= 0.0 && conditions.age <= 1.0, "age", "0 to 1",
                      conditions.age);
}

double temperature(const OperatingConditions& conditions, double time_s) noexcept {
  return conditions.temperature_K -
         conditions.warm_up_K * std::expm1(-time_s / conditions.warm_up_time_s);
}

double friction_factor(double temperature_K) noexcept {
  return std::exp((OperatingConditions::kReference_K - temperature_K) / kFrictionScale_K);
}

DataSheet aged(const DataSheet& sheet, double age) {
  DataSheet old = sheet;
  if (age == 0.0) return old;  // the tags stay
  const Ageing ageing({.stiffness = 1.0 - kStiffnessLost * age,
                       .friction = 1.0 + kFrictionGained * age,
                       .play = 1.0 + kPlayGained * age});
  std::visit(ageing, old.first);
  std::visit(ageing, old.second);
  return old;
}

DataSheet worn(const DataSheet& sheet, const StageWear& wear) {
  DataSheet changed = sheet;
  std::visit(Ageing(wear), changed.second);
  return changed;
}

}  // namespace torsio
