#include "sim/plant/plant_kernels.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/plant/plant_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "sim/plant/stage_kernels-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::plant_kernels::HWY_NAMESPACE {

// Wear and the hard stop of the second stage.
HWY_INLINE void apply_condition(StageRows& rows, std::size_t at, V factor, V stop_rad,
                                V stop_stiffness) {
  const V twist = get(rows.twist_rad, at);
  const V beyond = hn::Max(hn::Sub(hn::Abs(twist), stop_rad), zero());
  const V stop = hn::CopySign(hn::Mul(stop_stiffness, beyond), twist);
  put(hn::MulAdd(factor, get(rows.output_Nm, at), stop), rows.output_Nm, at);
  put(hn::MulAdd(factor, get(rows.input_Nm, at), hn::Mul(stop, get(rows.slope, at))), rows.input_Nm,
      at);
}

template <class Chain>
HWY_INLINE V wall_torque(const Chain& rows, std::size_t at, V angle, V speed) {
  const V depth = hn::Sub(angle, get(rows.wall_angle_rad, at));
  const V push =
      hn::MulAdd(get(rows.wall_stiffness, at), depth, hn::Mul(get(rows.wall_damping, at), speed));
  return hn::IfThenElseZero(hn::Gt(depth, zero()), hn::Max(zero(), push));
}

HWY_INLINE void move_body(BodyRows& rows, std::size_t at, V speed, V dt) {
  put(speed, rows.speed_rad_s, at);
  put(hn::MulAdd(dt, speed, get(rows.angle_rad, at)), rows.angle_rad, at);
}

template <class Chain>
HWY_INLINE void step_lanes(Chain& rows, std::size_t at, V dt) {
  const V rotor_speed = get(rows.rotor.speed_rad_s, at);
  const V middle_speed = get(rows.middle.speed_rad_s, at);
  const V joint_speed = get(rows.joint.speed_rad_s, at);
  const V joint_angle = get(rows.joint.angle_rad, at);

  const V motor = hn::Mul(get(rows.torque_constant_factor, at),
                          step_motor(rows.motor, at, get(rows.wanted_A, at),
                                     get(rows.rotor.angle_rad, at), rotor_speed));
  step_stage(rows.second, at, {rows.middle, rows.joint});
  apply_condition(rows.second, at, get(rows.second_factor, at), get(rows.stop_rad, at),
                  get(rows.stop_stiffness, at));
  step_stage(rows.first, at, {rows.rotor, rows.middle});
  const V second = get(rows.second.output_Nm, at);
  const V first = get(rows.first.output_Nm, at);
  const V friction_factor = get(rows.friction_factor, at);
  const V rotor_friction =
      hn::Mul(friction_factor, step_friction(rows.rotor_friction, at, rotor_speed, first, dt));
  const V middle_friction =
      hn::Mul(friction_factor, step_friction(rows.middle_friction, at, middle_speed, second, dt));
  const V bearing = step_friction(rows.bearing, at, joint_speed, zero(), dt);
  const V wall = wall_torque(rows, at, joint_angle, joint_speed);
  const V cell = hn::Sub(second, bearing);
  put(motor, rows.motor.torque_Nm, at);
  put(rotor_friction, rows.rotor_friction.torque_Nm, at);
  put(middle_friction, rows.middle_friction.torque_Nm, at);
  put(bearing, rows.bearing.torque_Nm, at);
  put(wall, rows.wall_Nm, at);
  put(cell, rows.joint_Nm, at);

  const V on_rotor = hn::Sub(hn::Sub(motor, rotor_friction), get(rows.first.input_Nm, at));
  const V on_middle = hn::Sub(hn::Sub(first, middle_friction), get(rows.second.input_Nm, at));
  V on_joint = hn::Sub(hn::Add(cell, get(rows.external_Nm, at)), wall);
  on_joint = hn::NegMulAdd(get(rows.joint_viscous, at), joint_speed, on_joint);
  on_joint = hn::NegMulAdd(get(rows.gravity_Nm, at), sine(joint_angle), on_joint);
  const V rotor_moves = hn::MulAdd(get(rows.rotor.dt_over_inertia, at), on_rotor, rotor_speed);
  const V joint_moves = hn::MulAdd(get(rows.joint.dt_over_inertia, at), on_joint, joint_speed);
  move_body(rows.rotor, at,
            hn::IfThenElseZero(hn::Ne(get(rows.is_rotor_free, at), zero()), rotor_moves), dt);
  move_body(rows.middle, at,
            hn::MulAdd(get(rows.middle.dt_over_inertia, at), on_middle, middle_speed), dt);
  move_body(rows.joint, at,
            hn::IfThenElseZero(hn::Ne(get(rows.is_joint_free, at), zero()), joint_moves), dt);
}

// In turn: one step of a block is a chain of dependent operations, and that of the next fills its
// gaps.
template <class Chain>
HWY_INLINE void step_blocks(Chain* HWY_RESTRICT blocks, std::size_t count, std::size_t steps,
                            double dt_s) {
  const V dt = of(dt_s);
  for (std::size_t b = 0; b < count; ++b) {
    for (std::size_t at = 0; at < kPlantLanes; at += hn::Lanes(D())) {
      const V inertia = hn::Add(get(blocks[b].joint_inertia, at), get(blocks[b].load_inertia, at));
      put(hn::Div(dt, inertia), blocks[b].joint.dt_over_inertia, at);
    }
  }
  for (std::size_t i = 0; i < steps; ++i)
    for (std::size_t b = 0; b < count; ++b)
      for (std::size_t at = 0; at < kPlantLanes; at += hn::Lanes(D()))
        step_lanes(blocks[b], at, dt);
}

void step_maxwell(MaxwellChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_bouc_wen(BoucWenChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_lugre(LuGreChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_bonded(BondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_unbonded(UnbondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_clutch(ClutchChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}
void step_gears(GearChain* blocks, std::size_t count, std::size_t steps, double dt_s) {
  step_blocks(blocks, count, steps, dt_s);
}

}  // namespace torsio::plant_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::plant_kernels {

HWY_EXPORT(step_maxwell);
HWY_EXPORT(step_bouc_wen);
HWY_EXPORT(step_lugre);
HWY_EXPORT(step_bonded);
HWY_EXPORT(step_unbonded);
HWY_EXPORT(step_clutch);
HWY_EXPORT(step_gears);

void step(MaxwellChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_maxwell)(blocks, count, steps, dt_s);
}
void step(BoucWenChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_bouc_wen)(blocks, count, steps, dt_s);
}
void step(LuGreChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_lugre)(blocks, count, steps, dt_s);
}
void step(BondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_bonded)(blocks, count, steps, dt_s);
}
void step(UnbondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_unbonded)(blocks, count, steps, dt_s);
}
void step(ClutchChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_clutch)(blocks, count, steps, dt_s);
}
void step(GearChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept {
  HWY_DYNAMIC_DISPATCH(step_gears)(blocks, count, steps, dt_s);
}

}  // namespace torsio::plant_kernels
#endif
