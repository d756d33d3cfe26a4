#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <variant>

#include "parts/creep_chain.hpp"
#include "parts/maxwell_branches.hpp"
#include "plant_rows.hpp"
#include "sim/plant/plant.hpp"

// One plant's parts and start written into the rows of its block, part by part.

namespace torsio {

/// One plant's number in a row.
struct Lane {
  std::size_t index = 0;
  double& operator()(Row& row) const noexcept { return row.lane[index]; }
  double operator()(const Row& row) const noexcept { return row.lane[index]; }
  template <std::size_t kCount>
  void set(std::array<Row, kCount>& rows, const std::array<double, kCount>& to) const noexcept {
    for (std::size_t i = 0; i < kCount; ++i) rows[i].lane[index] = to[i];
  }
};

/// The class whose equations these rows feed.
template <class Rows>
struct PartOf;
template <>
struct PartOf<SlipRows<4>> {
  using Type = MaxwellSlip<4>;
};
template <>
struct PartOf<BoucWenRows> {
  using Type = BoucWen;
};
template <>
struct PartOf<LuGreSlipRows> {
  using Type = LuGreSlip;
};
template <>
struct PartOf<GearRows> {
  using Type = Gear;
};
template <>
struct PartOf<ClutchRows> {
  using Type = SlipClutch;
};
template <class Friction>
struct PartOf<SpringRows<Friction>> {
  using Type = Spring;
};
template <>
struct PartOf<RubberRows> {
  using Type = RubberSpring;
};
template <bool kBonded>
struct PartOf<ElastomerRows<kBonded>> {
  using Type = ElastomerCoupling;
};

/// The alternative that belongs to these rows: PlantLanes has seen that each plant has it.
template <class Rows, class Variant>
const auto& part(const Variant& stage) noexcept {
  return *std::get_if<typename PartOf<Rows>::Type>(&stage);
}

// What a plant is made of.

inline void set_parts(MotorRows& rows, Lane lane, const Motor::Parameters& of) noexcept {
  lane(rows.torque_constant) = of.torque_constant_Nm_A;
  lane(rows.peak_A) = of.peak_current_A;
  lane(rows.supply_V) = of.supply_V;
  lane(rows.inverse_resistance) = 1.0 / of.resistance_Ohm;
  lane(rows.ripple_Nm) = of.ripple * of.torque_constant_Nm_A * of.peak_current_A;
  lane(rows.ripple_order) = of.ripple_order;
}

inline void set_parts(FrictionRows& rows, Lane lane, const LuGreFriction::Parameters& of) noexcept {
  lane(rows.coulomb_Nm) = of.coulomb_Nm;
  lane(rows.load_factor) = of.load_factor;
  lane(rows.viscous) = of.viscous_Nms_rad;
  lane(rows.static_excess) = of.static_ratio - 1.0;
  lane(rows.inverse_stribeck_squared) = 1.0 / (of.stribeck_rad_s * of.stribeck_rad_s);
  lane(rows.stiffness) = LuGreFriction(of).stiffness();
}

template <std::size_t kElements>
void set_parts(SlipRows<kElements>& rows, Lane lane,
               const typename MaxwellSlip<kElements>::Parameters& of) noexcept {
  lane(rows.constant_Nm) = of.constant_Nm;
  lane(rows.load_factor) = of.load_factor;
  for (std::size_t i = 0; i < kElements; ++i) {
    lane(rows.share[i]) = of.share[i];
    lane(rows.share_per_rad[i]) = of.share[i] / of.break_away_rad[i];
  }
}

inline void set_parts(BoucWenRows& rows, Lane lane, const BoucWen::Parameters& of) noexcept {
  lane(rows.constant_Nm) = of.constant_Nm;
  lane(rows.load_factor) = of.load_factor;
  lane(rows.per_knee) = 1.0 / of.knee_rad;
}

inline void set_parts(LuGreSlipRows& rows, Lane lane, const LuGreSlip::Parameters& of) noexcept {
  lane(rows.constant_Nm) = of.constant_Nm;
  lane(rows.load_factor) = of.load_factor;
  lane(rows.static_excess) = of.static_ratio - 1.0;
  lane(rows.inverse_stribeck_squared) = 1.0 / (of.stribeck_rad_s * of.stribeck_rad_s);
  lane(rows.per_bristle) = 1.0 / of.bristle_rad;
}

inline void set_parts(GearRows& rows, Lane lane, const Gear& gear) noexcept {
  const Gear::Parameters& of = gear.parameters();
  lane(rows.inverse_ratio) = 1.0 / of.ratio;
  lane(rows.stiffness) = of.stiffness_Nm_rad;
  lane(rows.damping) = of.damping_Nms_rad;
  for (std::size_t i = 0; i < of.error_rad.size(); ++i) {
    lane(rows.in_phase[i]) = of.error_rad[i] * std::cos(of.error_phase_rad[i]);
    lane(rows.quadrature[i]) = of.error_rad[i] * std::sin(of.error_phase_rad[i]);
  }
  lane(rows.error_rad) = of.error_rad[0] + of.error_rad[1];
  set_parts(
      rows.hysteresis, lane,
      {.constant_Nm = of.hysteresis_Nm, .share = {1.0}, .break_away_rad = {of.break_away_rad}});
}

inline void set_parts(ClutchRows& rows, Lane lane, const SlipClutch& clutch) noexcept {
  const SlipClutch::Parameters& of = clutch.parameters();
  lane(rows.inverse_ratio) = 1.0 / of.ratio;
  lane(rows.stiffness) = of.stiffness_Nm_rad;
  lane(rows.damping) = of.damping_Nms_rad;
  lane(rows.static_Nm) = of.static_torque_Nm;
  lane(rows.sliding_Nm) = of.sliding_ratio * of.static_torque_Nm;
}

template <class Friction>
void set_parts(SpringRows<Friction>& rows, Lane lane, const Spring& spring) noexcept {
  const ElasticCurve::Parameters& of = spring.elastic().parameters();
  lane(rows.stiffness_up) = of.stiffness_Nm_rad * (1.0 + of.asymmetry);
  lane(rows.stiffness_down) = of.stiffness_Nm_rad * (1.0 - of.asymmetry);
  lane(rows.half_gap_rad) = of.half_gap_rad;
  lane(rows.per_half_gap) = of.half_gap_rad > 0.0 ? 1.0 / of.half_gap_rad : 0.0;
  lane(rows.stage_rad) = of.stage_rad;
  lane(rows.stage_stiffness) = of.stage_stiffness_Nm_rad;
  lane(rows.viscosity) = spring.viscosity();
  set_parts(rows.friction, lane, part<Friction>(spring.friction()).parameters());
}

inline void set_parts(RubberRows& rows, Lane lane, const RubberSpring& rubber) noexcept {
  const RubberSpring::Parameters& of = rubber.parameters();
  lane(rows.stiffness) = of.elastic_share * of.stiffness_Nm_rad;
  lane(rows.asymmetry) = of.elastic_share * of.asymmetry_Nm_rad;
  lane(rows.per_blend) = 1.0 / of.blend_rad;
  set_parts(rows.slip, lane, of.slip);
}

template <bool kBonded>
void set_parts(ElastomerRows<kBonded>& rows, Lane lane,
               const ElastomerCoupling& coupling) noexcept {
  const ElastomerCoupling::Parameters& of = coupling.parameters();
  const ElastomerCoupling::OutputCurve curve = coupling.output_curve();
  lane(rows.stiffness) = coupling.chain().stiffness();
  lane.set(rows.relaxed, coupling.chain().relaxed(1.0));
  lane(rows.quadratic) = curve.quadratic;
  lane(rows.cubic) = curve.cubic;
  lane(rows.lowest_Nm) = curve.lowest_Nm;
  lane(rows.highest_Nm) = curve.highest_Nm;
  lane(rows.per_slip_load) = 1.0 / of.slip_load_Nm;
  lane(rows.creep_per_cycle) = of.creep_per_cycle;
  lane(rows.dead_band_rad) = of.cycle_dead_band_rad;
  set_parts(rows.slip, lane, of.slip);
}

// What depends on the step.

inline void set_period(GearRows& /*rows*/, Lane /*lane*/, const Gear& /*gear*/,
                       double /*dt_s*/) noexcept {}
inline void set_period(ClutchRows& /*rows*/, Lane /*lane*/, const SlipClutch& /*clutch*/,
                       double /*dt_s*/) noexcept {}
template <class Friction>
void set_period(SpringRows<Friction>& /*rows*/, Lane /*lane*/, const Spring& /*spring*/,
                double /*dt_s*/) noexcept {}

inline void set_period(RubberRows& rows, Lane lane, const RubberSpring& rubber,
                       double dt_s) noexcept {
  const MaxwellBranches<3>::Parameters& of = rubber.parameters().branches;
  for (std::size_t i = 0; i < rows.decay.size(); ++i) {
    const double a = dt_s / of.relaxation_s[i];
    lane(rows.decay[i]) = std::exp(-a);
    lane(rows.gain[i]) = of.stiffness_Nm_rad[i] * mean_decay(a);
  }
}

template <bool kBonded>
void set_period(ElastomerRows<kBonded>& rows, Lane lane, const ElastomerCoupling& coupling,
                double dt_s) noexcept {
  CreepChain chain = coupling.chain();
  chain.set_period(dt_s);
  lane.set(rows.push, chain.push());
  lane.set(rows.recovery, chain.recovery());
  for (std::size_t j = 0; j < rows.transition.size(); ++j)
    lane.set(rows.transition[j], chain.transition()[j]);
}

// The initial state of a plant is that after Plant::reset.

template <std::size_t kElements>
void start(SlipRows<kElements>& rows, Lane lane) noexcept {
  for (Row& force : rows.force_Nm) lane(force) = 0.0;
}
inline void start(auto& friction, Lane lane) noexcept { lane(friction.force_Nm) = 0.0; }

inline void start(GearRows& rows, Lane lane, const Gear& gear, double /*twist_rad*/) noexcept {
  lane(rows.twist_rad) = gear.twist();
  start(rows.hysteresis, lane);
}

inline void start(ClutchRows& rows, Lane lane, const SlipClutch& clutch,
                  double /*twist_rad*/) noexcept {
  lane(rows.twist_rad) = clutch.twist();
  lane(rows.cable_Nm) = clutch.hysteresis_torque();
  lane(rows.slip_rad) = clutch.slip();
  lane(rows.is_slipping) = 0.0;
}

template <class Friction>
void start(SpringRows<Friction>& rows, Lane lane, const Spring& /*spring*/,
           double twist_rad) noexcept {
  lane(rows.twist_rad) = twist_rad;
  start(rows.friction, lane);
}

inline void start(RubberRows& rows, Lane lane, const RubberSpring& /*rubber*/,
                  double twist_rad) noexcept {
  lane(rows.twist_rad) = twist_rad;
  for (Row& force : rows.branch_Nm) lane(force) = 0.0;
  start(rows.slip, lane);
}

template <bool kBonded>
void start(ElastomerRows<kBonded>& rows, Lane lane, const ElastomerCoupling& coupling,
           double twist_rad) noexcept {
  const CreepChain& chain = coupling.chain();
  for (std::size_t i = 0; i < rows.lobes.size(); ++i) {
    double pressed_rad = twist_rad;
    if (!kBonded) pressed_rad = i == 0 ? std::max(twist_rad, 0.0) : std::min(twist_rad, 0.0);
    lane.set(rows.lobes[i].creep_rad, chain.relaxed(pressed_rad));
    lane(rows.lobes[i].torque_Nm) = chain.relaxed_stiffness() * pressed_rad;
  }
  lane(rows.twist_rad) = twist_rad;
  lane(rows.max_measured_load_Nm) = coupling.friction_torque();
  lane(rows.glue) = 1.0;
  lane(rows.glue_after_cycle) = 1.0;
  lane(rows.last_side) = 0.0;
  lane(rows.turns) = 0.0;
  start(rows.slip, lane);
}

}  // namespace torsio
