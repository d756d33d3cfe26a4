#include "specimen_spread.hpp"

#include <cstdint>

#include "core/fnv_hash.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// The random deviations of one specimen. Their order must not change: it determines every
/// specimen.
struct SpecimenDraws {
  explicit SpecimenDraws(std::uint64_t seed) : random(seed) {}
  /// Uniform within +-bound.
  double draw(double bound) noexcept { return bound * (2.0 * random.uniform() - 1.0); }

  Random random;
  double stiffness = 1.0 + draw(0.03);
  double inner_friction = 1.0 + draw(0.25);
  double backlash = 1.0 + draw(0.50);
  double asymmetry = draw(0.03);
  double coulomb = 1.0 + draw(0.20);
  double motor_zero_rad = draw(kZero_rad);
  double middle_zero_rad = draw(kZero_rad);
  double joint_zero_rad = draw(kZero_rad);
  double twist_zero_rad = draw(kZero_rad);

  static constexpr double kZero_rad = rad_from_deg(0.02);
};

void scale(SheetValue& value, double factor) noexcept { value = assumed(value.value * factor); }
void shift(SheetValue& value, double by) noexcept { value = assumed(value.value + by); }

template <class Values>
void scale_each(Values& values, double factor) noexcept {
  for (SheetValue& value : values) scale(value, factor);
}

void spread(SpringSheet& spring, const SpecimenDraws& specimen) noexcept {
  scale(spring.stiffness_Nm_rad, specimen.stiffness);
  scale(spring.stage_stiffness_Nm_rad, specimen.stiffness);
  scale(spring.friction_Nm, specimen.inner_friction);
  for (CurvePoint& point : spring.curve) {
    scale(point.torque_Nm, specimen.stiffness);
    scale(point.deflection_rad, 1.0);  // the table has one origin
  }
  if (!spring.curve.empty()) return;  // play and asymmetry are a part of the curve
  scale(spring.half_gap_rad, specimen.backlash);
  shift(spring.asymmetry, specimen.asymmetry);
}

void spread(ElastomerSheet& coupling, const SpecimenDraws& specimen) noexcept {
  scale(coupling.stiffness_Nm_rad, specimen.stiffness);
  scale_each(coupling.branch_stiffness_Nm_rad, specimen.stiffness);
  scale_each(coupling.slip_Nm, specimen.inner_friction);
}

void spread(RubberSheet& rubber, const SpecimenDraws& specimen) noexcept {
  shift(rubber.asymmetry_Nm_rad, specimen.asymmetry * rubber.stiffness_Nm_rad.value);
  scale(rubber.asymmetry_Nm_rad, specimen.stiffness);
  scale(rubber.stiffness_Nm_rad, specimen.stiffness);
  scale(rubber.slip_Nm, specimen.inner_friction);
}

void spread(TubeSheet& tube, const SpecimenDraws& specimen) noexcept {
  scale(tube.stiffness_Nm_rad, specimen.stiffness);
}

void spread(const GearSheet& /*gear*/, const SpecimenDraws& /*specimen*/) noexcept {}
void spread(const ClutchSheet& /*clutch*/, const SpecimenDraws& /*specimen*/) noexcept {}

}  // namespace

void spread_specimen(DataSheet& sheet) {
  if (!sheet.serial) return;
  const SpecimenDraws specimen(text_hash(sheet.name) + *sheet.serial);
  const auto spread_part = [&](auto& part) { spread(part, specimen); };
  std::visit(spread_part, sheet.first);
  std::visit(spread_part, sheet.second);
  scale(sheet.friction.coulomb_Nm, specimen.coulomb);
  scale(sheet.joint.bearing_friction_Nm, specimen.coulomb);
  shift(sheet.sensors.motor_zero_rad, specimen.motor_zero_rad);
  shift(sheet.sensors.middle_zero_rad, specimen.middle_zero_rad);
  shift(sheet.sensors.joint_zero_rad, specimen.joint_zero_rad);
  if (sheet.sensors.twist_sensor_bits.value > 0.0)
    shift(sheet.sensors.twist_zero_rad, specimen.twist_zero_rad);
}

}  // namespace torsio
