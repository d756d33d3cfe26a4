// The stages of the kernels of PlantBatch; included once for each instruction set.
//
// The equations are those of the classes in torsio/actuator/ and of Plant, on several plants at
// once; comments here describe only the vectorisation. Shortcuts are taken when all lanes allow
// them, and change no bit of any lane.

#if defined(TORSIO_SIM_STAGE_KERNELS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TORSIO_SIM_STAGE_KERNELS_INL_HPP
#undef TORSIO_SIM_STAGE_KERNELS_INL_HPP
#else
#define TORSIO_SIM_STAGE_KERNELS_INL_HPP
#endif

// clang-format off
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#include "sim/plant/plant_rows.hpp"

HWY_BEFORE_NAMESPACE();
namespace torsio::plant_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kPlantLanes>;
using V = hn::Vec<D>;

HWY_INLINE V get(const Row& row, std::size_t at) { return hn::Load(D(), row.lane.data() + at); }
HWY_INLINE void put(V value, Row& row, std::size_t at) {
  hn::Store(value, D(), row.lane.data() + at);
}
HWY_INLINE V of(double value) { return hn::Set(D(), value); }
HWY_INLINE V zero() { return hn::Zero(D()); }
HWY_INLINE V clamp(V value, V lowest, V highest) {
  return hn::Min(hn::Max(value, lowest), highest);
}
HWY_INLINE V within(V value, V limit) { return clamp(value, hn::Neg(limit), limit); }

// Highway reduces an angle without error up to some 2^27 pi; beyond, its polynomial would explode.
HWY_INLINE V sine(V angle) {
  const auto is_known = hn::Le(hn::Abs(angle), of(4e8));
  return hn::IfThenElseZero(is_known, hn::Sin(D(), hn::IfThenElseZero(is_known, angle)));
}
HWY_INLINE V cosine(V angle) {
  const auto is_known = hn::Le(hn::Abs(angle), of(4e8));
  return hn::IfThenElseZero(is_known, hn::Cos(D(), hn::IfThenElseZero(is_known, angle)));
}

// 1 + excess exp(-(speed / stribeck speed)^2)
HWY_INLINE V stribeck(V speed, V excess, V inverse_stribeck_squared) {
  const V farthest = of(40.0);  // exp(-40) is below the last bit of 1
  const V exponent = hn::Mul(hn::Mul(speed, speed), inverse_stribeck_squared);
  const auto is_near = hn::And(hn::Le(exponent, farthest), hn::Gt(excess, zero()));
  const V one = of(1.0);
  if (hn::AllFalse(D(), is_near)) return one;
  const V rise = hn::Exp(D(), hn::Neg(hn::Min(exponent, farthest)));
  return hn::IfThenElse(is_near, hn::MulAdd(excess, rise, one), one);
}

HWY_INLINE V step_motor(MotorRows& rows, std::size_t at, V wanted_A, V angle, V speed) {
  const V k = get(rows.torque_constant, at);
  const V supply = get(rows.supply_V, at);
  const V back_emf = hn::Mul(k, speed);
  const V per_ohm = get(rows.inverse_resistance, at);
  V reference = clamp(wanted_A, hn::Mul(hn::Sub(hn::Neg(supply), back_emf), per_ohm),
                      hn::Mul(hn::Sub(supply, back_emf), per_ohm));
  reference = within(reference, get(rows.peak_A, at));
  const V current =
      hn::MulAdd(hn::Sub(get(rows.current_A, at), reference), get(rows.decay, at), reference);
  put(current, rows.current_A, at);
  const V ripple = sine(hn::Mul(get(rows.ripple_order, at), angle));
  return hn::MulAdd(get(rows.ripple_Nm, at), ripple, hn::Mul(k, current));
}

HWY_INLINE V step_friction(FrictionRows& rows, std::size_t at, V speed, V load, V dt) {
  const V viscous = hn::Mul(get(rows.viscous, at), speed);
  const V coulomb = get(rows.coulomb_Nm, at);
  if (hn::AllTrue(D(), hn::Eq(coulomb, zero()))) return viscous;
  const V level = hn::MulAdd(get(rows.load_factor, at), hn::Abs(load), coulomb);
  const V excess = get(rows.static_excess, at);
  const V limit = hn::Mul(level, stribeck(speed, excess, get(rows.inverse_stribeck_squared, at)));
  V force = get(rows.force_Nm, at);
  const V target = hn::CopySignToAbs(limit, speed);
  const V distance = hn::Sub(force, target);
  const auto is_moving = hn::Ne(speed, zero());
  const auto is_far = hn::Ge(hn::Abs(distance), hn::Mul(of(1e-15), limit));
  force = hn::IfThenElse(is_moving, target, force);
  const auto relaxes = hn::And(is_moving, is_far);
  if (!hn::AllFalse(D(), relaxes)) {
    const V travel = hn::Mul(hn::Mul(hn::Abs(speed), dt), get(rows.stiffness, at));
    // A lane without dry friction has neither limit nor stiffness.
    const V over = hn::Div(travel, hn::IfThenElse(hn::Gt(limit, zero()), limit, of(1.0)));
    force =
        hn::IfThenElse(relaxes, hn::MulAdd(distance, hn::Exp(D(), hn::Neg(over)), target), force);
  }
  force = within(force, hn::MulAdd(excess, level, level));
  put(force, rows.force_Nm, at);
  return hn::Add(force, viscous);
}

template <std::size_t kElements>
HWY_INLINE V step_inner(SlipRows<kElements>& rows, std::size_t at, V increment, V /*rate*/,
                        V load) {
  const V limit = hn::MulAdd(get(rows.load_factor, at), hn::Abs(load), get(rows.constant_Nm, at));
  const V pull = hn::Mul(limit, increment);
  V total = zero();
  for (std::size_t i = 0; i < kElements; ++i) {
    const V moved = hn::MulAdd(pull, get(rows.share_per_rad[i], at), get(rows.force_Nm[i], at));
    const V force = within(moved, hn::Mul(get(rows.share[i], at), limit));
    put(force, rows.force_Nm[i], at);
    total = hn::Add(total, force);
  }
  return total;
}

template <std::size_t kElements>
HWY_INLINE V shed(SlipRows<kElements>& rows, std::size_t at, V limit) {
  V total = zero();
  for (std::size_t i = 0; i < kElements; ++i) {
    const V force = within(get(rows.force_Nm[i], at), hn::Mul(get(rows.share[i], at), limit));
    put(force, rows.force_Nm[i], at);
    total = hn::Add(total, force);
  }
  return total;
}

HWY_INLINE V bouc_wen_slope(V share) { return hn::NegMulAdd(share, hn::Sqrt(share), of(1.0)); }

HWY_INLINE V advance_bouc_wen(V share, V travel) {
  const V one = of(1.0);
  const V elastic = hn::Max(of(-1.0), hn::Add(share, travel));
  const auto unloads = hn::Lt(share, zero());
  const auto is_elastic = hn::And(unloads, hn::Le(travel, hn::Neg(share)));
  travel = hn::IfThenElse(unloads, hn::Add(travel, share), travel);
  share = hn::IfThenZeroElse(unloads, share);
  const auto is_settled = hn::Or(hn::Ge(share, one), hn::Ge(travel, of(24.0)));
  // A lane that is settled or elastic takes no steps; each other its own number.
  const auto is_short = hn::Or(is_elastic, is_settled);
  const V steps = hn::IfThenZeroElse(is_short, hn::Add(one, hn::Floor(hn::Mul(travel, of(2.0)))));
  const V step = hn::Div(travel, hn::Max(steps, one));
  const V half_step = hn::Mul(of(0.5), step);
  for (V done = zero();; done = hn::Add(done, one)) {
    const auto goes_on = hn::Lt(done, steps);
    if (hn::AllFalse(D(), goes_on)) break;
    const V middle = hn::MulAdd(half_step, bouc_wen_slope(share), share);
    share = hn::IfThenElse(goes_on, hn::MulAdd(step, bouc_wen_slope(middle), share), share);
  }
  return hn::IfThenElse(is_elastic, elastic, hn::IfThenElse(is_settled, one, hn::Min(share, one)));
}

HWY_INLINE V step_inner(BoucWenRows& rows, std::size_t at, V increment, V /*rate*/, V load) {
  const V limit = hn::MulAdd(get(rows.load_factor, at), hn::Abs(load), get(rows.constant_Nm, at));
  const auto rubs = hn::Gt(limit, zero());
  const V direction = hn::CopySignToAbs(of(1.0), increment);
  const V share =
      hn::Div(hn::Mul(direction, get(rows.force_Nm, at)), hn::IfThenElse(rubs, limit, of(1.0)));
  const V travel = hn::Abs(hn::Mul(increment, get(rows.per_knee, at)));
  const V force =
      hn::IfThenElseZero(rubs, hn::Mul(hn::Mul(direction, limit), advance_bouc_wen(share, travel)));
  put(force, rows.force_Nm, at);
  return force;
}

HWY_INLINE V step_inner(LuGreSlipRows& rows, std::size_t at, V increment, V rate, V load) {
  const V limit = hn::MulAdd(get(rows.load_factor, at), hn::Abs(load), get(rows.constant_Nm, at));
  const V excess = get(rows.static_excess, at);
  const V over_limit = stribeck(rate, excess, get(rows.inverse_stribeck_squared, at));
  const V target = hn::CopySignToAbs(hn::Mul(limit, over_limit), increment);
  const V travel = hn::Div(hn::Mul(hn::Abs(increment), get(rows.per_bristle, at)), over_limit);
  V force = get(rows.force_Nm, at);
  force = hn::MulAdd(hn::Sub(force, target), hn::Expm1(D(), hn::Neg(travel)), force);
  force = within(force, hn::MulAdd(excess, limit, limit));
  put(force, rows.force_Nm, at);
  return force;
}

// Stages. Each takes the angles and speeds of the bodies at its two ends and fills its StageRows.
struct Ends {
  const BodyRows& input;
  const BodyRows& output;
};

HWY_INLINE void finish_stage(StageRows& rows, std::size_t at, V twist, V slope, V torque) {
  put(twist, rows.twist_rad, at);
  put(slope, rows.slope, at);
  put(torque, rows.output_Nm, at);
  put(hn::Mul(torque, slope), rows.input_Nm, at);
}

HWY_INLINE void step_stage(GearRows& rows, std::size_t at, const Ends& ends) {
  const V input = get(ends.input.angle_rad, at);
  V slope = get(rows.inverse_ratio, at);
  V moved = hn::Mul(input, slope);
  if (!hn::AllTrue(D(), hn::Eq(get(rows.error_rad, at), zero()))) {
    const V twice = hn::Add(input, input);
    const V sine2 = sine(twice);
    const V cosine2 = cosine(twice);
    const V double_sine = hn::Add(sine2, sine2);
    const V sine4 = hn::Mul(double_sine, cosine2);
    const V cosine4 = hn::NegMulAdd(double_sine, sine2, of(1.0));
    const V in_phase_2 = get(rows.in_phase[0], at);
    const V in_phase_4 = get(rows.in_phase[1], at);
    const V quadrature_2 = get(rows.quadrature[0], at);
    const V quadrature_4 = get(rows.quadrature[1], at);
    moved = hn::MulAdd(in_phase_2, sine2, hn::MulAdd(quadrature_2, cosine2, moved));
    moved = hn::MulAdd(in_phase_4, sine4, hn::MulAdd(quadrature_4, cosine4, moved));
    const V slope2 = hn::NegMulAdd(quadrature_2, sine2, hn::Mul(in_phase_2, cosine2));
    const V slope4 = hn::NegMulAdd(quadrature_4, sine4, hn::Mul(in_phase_4, cosine4));
    slope = hn::MulAdd(of(2.0), slope2, hn::MulAdd(of(4.0), slope4, slope));
  }
  const V twist = hn::Sub(moved, get(ends.output.angle_rad, at));
  const V increment = hn::Sub(twist, get(rows.twist_rad, at));
  const V rate =
      hn::MulSub(slope, get(ends.input.speed_rad_s, at), get(ends.output.speed_rad_s, at));
  const V hysteresis = step_inner(rows.hysteresis, at, increment, rate, zero());
  const V torque = hn::MulAdd(get(rows.stiffness, at), twist,
                              hn::MulAdd(get(rows.damping, at), rate, hysteresis));
  finish_stage(rows, at, twist, slope, torque);
}

HWY_INLINE void step_stage(ClutchRows& rows, std::size_t at, const Ends& ends) {
  const V slope = get(rows.inverse_ratio, at);
  const V twist = hn::MulSub(get(ends.input.angle_rad, at), slope, get(ends.output.angle_rad, at));
  const V increment = hn::Sub(twist, get(rows.twist_rad, at));
  const V rate =
      hn::MulSub(get(ends.input.speed_rad_s, at), slope, get(ends.output.speed_rad_s, at));
  const V stiffness = get(rows.stiffness, at);
  const V limit = get(rows.static_Nm, at);
  const V before = get(rows.cable_Nm, at);
  const auto turns_back = hn::Lt(hn::Mul(before, increment), zero());
  const auto slipped = hn::AndNot(turns_back, hn::Ne(get(rows.is_slipping, at), zero()));
  const V stuck = hn::Mul(stiffness, hn::Sub(twist, get(rows.slip_rad, at)));
  const V pulled = hn::IfThenElse(slipped, before, stuck);
  const auto slips = hn::Or(slipped, hn::Gt(hn::Abs(pulled), limit));
  const V cable = hn::IfThenElse(slips, hn::CopySign(get(rows.sliding_Nm, at), pulled), pulled);
  const V slip =
      hn::IfThenElse(slips, hn::Sub(twist, hn::Div(cable, stiffness)), get(rows.slip_rad, at));
  put(cable, rows.cable_Nm, at);
  put(slip, rows.slip_rad, at);
  put(hn::IfThenElseZero(slips, of(1.0)), rows.is_slipping, at);
  const V damped = within(hn::MulAdd(get(rows.damping, at), rate, cable), limit);
  finish_stage(rows, at, twist, slope, hn::IfThenElse(slips, cable, damped));
}

HWY_INLINE V twist_of(const Ends& ends, std::size_t at) {
  return hn::Sub(get(ends.input.angle_rad, at), get(ends.output.angle_rad, at));
}
HWY_INLINE V rate_of(const Ends& ends, std::size_t at) {
  return hn::Sub(get(ends.input.speed_rad_s, at), get(ends.output.speed_rad_s, at));
}

template <class Friction>
HWY_INLINE V elastic_torque(const SpringRows<Friction>& rows, std::size_t at, V angle) {
  const V gap = get(rows.half_gap_rad, at);
  const auto is_far = hn::Ge(hn::Abs(angle), hn::Mul(of(20.0), gap));
  V x = hn::Sub(angle, hn::CopySign(gap, angle));
  if (!hn::AllTrue(D(), is_far)) {
    const V play = hn::Tanh(D(), hn::Mul(angle, get(rows.per_half_gap, at)));
    x = hn::IfThenElse(is_far, x, hn::NegMulAdd(gap, play, angle));
  }
  const V stiffness =
      hn::IfThenElse(hn::Gt(x, zero()), get(rows.stiffness_up, at), get(rows.stiffness_down, at));
  const V excess = hn::Max(hn::Sub(hn::Abs(x), get(rows.stage_rad, at)), zero());
  const V second = hn::CopySign(hn::Mul(get(rows.stage_stiffness, at), excess), x);
  return hn::MulAdd(x, stiffness, second);
}

template <class Friction>
HWY_INLINE void step_stage(SpringRows<Friction>& rows, std::size_t at, const Ends& ends) {
  const V twist = twist_of(ends, at);
  const V rate = rate_of(ends, at);
  const V elastic = elastic_torque(rows, at, twist);
  const V increment = hn::Sub(twist, get(rows.twist_rad, at));
  const V friction = step_inner(rows.friction, at, increment, rate, elastic);
  const V torque = hn::Add(elastic, hn::MulAdd(get(rows.viscosity, at), rate, friction));
  finish_stage(rows, at, twist, of(1.0), torque);
}

HWY_INLINE void step_stage(RubberRows& rows, std::size_t at, const Ends& ends) {
  const V twist = twist_of(ends, at);
  const V increment = hn::Sub(twist, get(rows.twist_rad, at));
  const V magnitude = hn::Abs(twist);
  const V blend = hn::Tanh(D(), hn::Mul(magnitude, get(rows.per_blend, at)));
  V torque = hn::MulAdd(get(rows.stiffness, at), twist,
                        hn::Mul(hn::Mul(get(rows.asymmetry, at), magnitude), blend));
  for (std::size_t i = 0; i < rows.decay.size(); ++i) {
    const V branch = hn::MulAdd(get(rows.decay[i], at), get(rows.branch_Nm[i], at),
                                hn::Mul(get(rows.gain[i], at), increment));
    put(branch, rows.branch_Nm[i], at);
    torque = hn::Add(torque, branch);
  }
  torque = hn::Add(torque, step_inner(rows.slip, at, increment, zero(), zero()));
  finish_stage(rows, at, twist, of(1.0), torque);
}

template <bool kBonded>
HWY_INLINE V chain_torque(const ElastomerRows<kBonded>& rows, std::size_t at, V angle, V creep_0,
                          V creep_1, V creep_2) {
  return hn::Mul(get(rows.stiffness, at),
                 hn::Sub(hn::Sub(hn::Sub(angle, creep_0), creep_1), creep_2));
}

template <bool kBonded>
HWY_INLINE V loaded(const ElastomerRows<kBonded>& rows, std::size_t at, std::size_t element,
                    const typename ElastomerRows<kBonded>::Lobes& lobes, V twist) {
  const V from = get(rows.twist_rad, at);
  V next = hn::NegMulAdd(get(rows.push[element], at), hn::Sub(twist, from),
                         hn::Mul(get(rows.relaxed[element], at), twist));
  for (std::size_t l = 0; l < 3; ++l) {
    const V away = hn::NegMulAdd(get(rows.relaxed[l], at), from, get(lobes.creep_rad[l], at));
    next = hn::MulAdd(get(rows.transition[element][l], at), away, next);
  }
  return next;
}

// Lobes that are pressed and may lose contact, where `side` times their torque would turn negative;
// bonded ones, which have no side, never do.
template <bool kBonded>
HWY_INLINE V step_lobes(const ElastomerRows<kBonded>& rows, std::size_t at,
                        typename ElastomerRows<kBonded>::Lobes& lobes, double side, V twist) {
  V creep_0 = loaded(rows, at, 0, lobes, twist);
  V creep_1 = loaded(rows, at, 1, lobes, twist);
  V creep_2 = loaded(rows, at, 2, lobes, twist);
  V torque = chain_torque(rows, at, twist, creep_0, creep_1, creep_2);
  if constexpr (!kBonded) {
    const auto holds = hn::And(hn::Ne(get(lobes.torque_Nm, at), zero()),
                               hn::Ge(hn::Mul(of(side), torque), zero()));
    const V free_0 = hn::Mul(get(rows.recovery[0], at), get(lobes.creep_rad[0], at));
    const V free_1 = hn::Mul(get(rows.recovery[1], at), get(lobes.creep_rad[1], at));
    const V free_2 = hn::Mul(get(rows.recovery[2], at), get(lobes.creep_rad[2], at));
    const V touch = chain_torque(rows, at, twist, free_0, free_1, free_2);
    const V touched = hn::IfThenElseZero(hn::Gt(hn::Mul(of(side), touch), zero()), touch);
    creep_0 = hn::IfThenElse(holds, creep_0, free_0);
    creep_1 = hn::IfThenElse(holds, creep_1, free_1);
    creep_2 = hn::IfThenElse(holds, creep_2, free_2);
    torque = hn::IfThenElse(holds, torque, touched);
  }
  put(creep_0, lobes.creep_rad[0], at);
  put(creep_1, lobes.creep_rad[1], at);
  put(creep_2, lobes.creep_rad[2], at);
  put(torque, lobes.torque_Nm, at);
  return torque;
}

// The glue after this step.
template <bool kBonded>
HWY_INLINE V step_glue(ElastomerRows<kBonded>& rows, std::size_t at, V angle, V before_Nm,
                       V max_measured_load_Nm) {
  const V creep = get(rows.creep_per_cycle, at);
  V glue = get(rows.glue, at);
  if (hn::AllTrue(D(), hn::Eq(creep, zero()))) return glue;
  const V one = of(1.0);
  const V last_side = get(rows.last_side, at);
  const V side = hn::CopySignToAbs(one, angle);
  const auto is_beyond = hn::Gt(hn::Abs(angle), get(rows.dead_band_rad, at));
  const auto turned = hn::And(is_beyond, hn::Lt(hn::Mul(side, last_side), zero()));
  const V turns = hn::Add(get(rows.turns, at), hn::IfThenElseZero(turned, one));
  const auto is_cycle = hn::And(turned, hn::Eq(turns, of(2.0)));
  V after = get(rows.glue_after_cycle, at);
  after = hn::IfThenElse(is_cycle, hn::Mul(after, hn::Sub(one, creep)), after);
  put(hn::IfThenZeroElse(is_cycle, turns), rows.turns, at);
  put(after, rows.glue_after_cycle, at);
  put(hn::IfThenElse(is_beyond, side, last_side), rows.last_side, at);
  glue = hn::IfThenElse(hn::Le(hn::Mul(max_measured_load_Nm, before_Nm), zero()), after, glue);
  put(glue, rows.glue, at);
  return glue;
}

template <bool kBonded>
HWY_INLINE void step_stage(ElastomerRows<kBonded>& rows, std::size_t at, const Ends& ends) {
  const V twist = twist_of(ends, at);
  V linear = step_lobes(rows, at, rows.lobes[0], 1.0, twist);
  if constexpr (!kBonded)
    linear = hn::Add(linear, step_lobes(rows, at, rows.lobes[1], -1.0, twist));
  linear = clamp(linear, get(rows.lowest_Nm, at), get(rows.highest_Nm, at));
  const V bend = hn::MulAdd(linear, get(rows.cubic, at), get(rows.quadratic, at));
  const V carried = hn::Mul(linear, hn::MulAdd(linear, bend, of(1.0)));
  const V before = get(rows.max_measured_load_Nm, at);
  put(carried, rows.max_measured_load_Nm, at);
  const V increment = hn::Sub(twist, get(rows.twist_rad, at));
  V slip = step_inner(rows.slip, at, increment, zero(), zero());
  if constexpr (!kBonded) {
    const V pressed = hn::Min(hn::Mul(hn::Abs(carried), get(rows.per_slip_load, at)), of(1.0));
    slip = shed(rows.slip, at, hn::Mul(pressed, get(rows.slip.constant_Nm, at)));
  }
  const V glue = step_glue(rows, at, twist, before, carried);
  finish_stage(rows, at, twist, of(1.0), hn::Mul(glue, hn::Add(carried, slip)));
}

}  // namespace torsio::plant_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
