#include "specimen_spread.hpp"

#include <cstdint>

#include "text_hash.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// What one piece has of each spread. The order of the draws is part of what a serial number means.
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

void spread(SpringSheet& spring, const SpecimenDraws& piece) noexcept {
  scale(spring.stiffness_Nm_rad, piece.stiffness);
  scale(spring.stage_stiffness_Nm_rad, piece.stiffness);
  scale(spring.friction_Nm, piece.inner_friction);
  scale(spring.half_gap_rad, piece.backlash);
  shift(spring.asymmetry, piece.asymmetry);
}

void spread(ElastomerSheet& coupling, const SpecimenDraws& piece) noexcept {
  scale(coupling.stiffness_Nm_rad, piece.stiffness);
  scale_each(coupling.branch_stiffness_Nm_rad, piece.stiffness);
  scale_each(coupling.slip_Nm, piece.inner_friction);
}

void spread(RubberSheet& rubber, const SpecimenDraws& piece) noexcept {
  shift(rubber.asymmetry_Nm_rad, piece.asymmetry * rubber.stiffness_Nm_rad.value);
  scale(rubber.asymmetry_Nm_rad, piece.stiffness);
  scale(rubber.stiffness_Nm_rad, piece.stiffness);
  scale(rubber.slip_Nm, piece.inner_friction);
}

void spread(TubeSheet& tube, const SpecimenDraws& piece) noexcept {
  scale(tube.stiffness_Nm_rad, piece.stiffness);
}

void spread(const GearSheet& /*gear*/, const SpecimenDraws& /*piece*/) noexcept {}
void spread(const ClutchSheet& /*clutch*/, const SpecimenDraws& /*piece*/) noexcept {}

}  // namespace

void spread_specimen(DataSheet& sheet) {
  if (!sheet.serial) return;
  const SpecimenDraws piece(text_hash(sheet.name) + *sheet.serial);
  const auto spread_part = [&](auto& part) { spread(part, piece); };
  std::visit(spread_part, sheet.first);
  std::visit(spread_part, sheet.second);
  scale(sheet.friction.coulomb_Nm, piece.coulomb);
  scale(sheet.joint.bearing_friction_Nm, piece.coulomb);
  shift(sheet.sensors.motor_zero_rad, piece.motor_zero_rad);
  shift(sheet.sensors.middle_zero_rad, piece.middle_zero_rad);
  shift(sheet.sensors.joint_zero_rad, piece.joint_zero_rad);
  if (sheet.sensors.twist_sensor_bits.value > 0.0)
    shift(sheet.sensors.twist_zero_rad, piece.twist_zero_rad);
}

}  // namespace torsio
