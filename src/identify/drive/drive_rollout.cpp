#include "identify/drive/drive_rollout.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "identify/drive/drive_rollout.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
#include "identify/drive/command_lanes-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::drive_rollout::HWY_NAMESPACE {

HWY_INLINE V within(V value, V limit) { return hn::Min(hn::Max(value, hn::Neg(limit)), limit); }
HWY_INLINE V decay(V speed, V inverse_speed) {  // exp(-|v| / v_s)
  return hn::Exp(D(), hn::Max(hn::Neg(hn::Mul(hn::Abs(speed), inverse_speed)), constant(-700.0)));
}
// Highway's sine is exact up to some 2^27 pi.
HWY_INLINE V sine(V angle) { return hn::Sin(D(), within(angle, constant(4e8))); }

// The parameters of the lanes from `at` on.
struct Constants {
  Constants(const DriveLanes& lanes, std::size_t at) : lanes_(lanes), at_(at) {}
  HWY_INLINE V operator()(DriveParameter parameter) const {
    return hn::Load(D(), lanes_.of[static_cast<std::size_t>(parameter)].data() + at_);
  }

 private:
  const DriveLanes& lanes_;
  std::size_t at_;
};

// What is stepped through at once: a vector of lanes through a run.
class Rollout {
 public:
  HWY_INLINE Rollout(const DriveLog& log, const DriveRun& run, const DriveLanes& lanes,
                     std::size_t at, const RolloutOptions& options)
      : log_(log),
        run_(run),
        of_(lanes, at),
        at_(at),
        has_delay_(has(options.terms, DriveTerm::delay)),
        is_second_order_(options.integrator == DriveIntegrator::midpoint_speed),
        implicit_share_(implicit_share(options.integrator)),
        substeps_(substeps_of(log, options)),
        step_s_(log.sample_period_s / static_cast<double>(substeps_)),
        kick_s_(is_second_order_ ? 0.5 * step_s_ : step_s_),
        command_(log, delays_law() ? hn::Zero(D()) : delay()),
        ring_(delay(), longest_delay_s(lanes), step_s_) {
    set_terms(options.terms);
    set_constants();
    angle_ = constant(run.angle_rad);
    speed_ = constant(run.speed_rad_s);
    filtered_speed_ = speed_;
    joint_angle_ = has_spring_ ? hanging_joint() : angle_;
    joint_speed_ = speed_;
    if (is_second_order_) command_.move_to(static_cast<double>(run.first));
  }

  HWY_INLINE void run(const RolloutOutput& output) {
    for (std::size_t n = 0; n < run_.samples; ++n) {
      store(angle_, output.angle_rad, n);
      store(joint_angle_, output.joint_angle_rad, n);
      if (n + 1 == run_.samples && output.joint_torque_Nm == nullptr) return;
      const std::size_t sample = run_.first + n;
      const double power = power_at(sample);
      // A kick around a sample has half of its time before it.
      power_ = is_second_order_ && n > 0 ? 0.5 * (power + power_at(sample - 1)) : power;
      for (std::size_t k = 0; k < substeps_; ++k) {
        step(static_cast<double>(sample) + static_cast<double>(k) / static_cast<double>(substeps_));
        if (k == 0) store(joint_torque_, output.joint_torque_Nm, n);
        kick_s_ = step_s_;
        power_ = power;
      }
    }
  }

 private:
  static double implicit_share(DriveIntegrator integrator) {
    switch (integrator) {
      case DriveIntegrator::midpoint_speed: return 0.5;
      case DriveIntegrator::implicit_damping: return 1.0;
      case DriveIntegrator::semi_implicit_euler: break;
    }
    return 0.0;
  }

  static std::size_t substeps_of(const DriveLog& log, const RolloutOptions& options) {
    const double steps = std::ceil(log.sample_period_s / options.step_s - 1e-6);
    return std::max<std::size_t>(static_cast<std::size_t>(steps), 1);
  }

  static double longest_delay_s(const DriveLanes& lanes) {
    return std::max(
        0.0, *std::ranges::max_element(lanes.of[static_cast<std::size_t>(DriveParameter::delay)]));
  }

  [[nodiscard]] HWY_INLINE V delay() const {
    return has_delay_ ? of_(DriveParameter::delay) : hn::Zero(D());
  }
  // A law that commands torque acts late as a whole.
  [[nodiscard]] bool delays_law() const {
    return has_delay_ && log_.kind == CommandKind::goal_to_torque;
  }

  HWY_INLINE void set_terms(const DriveTerms& terms) {
    using enum DriveTerm;
    has_load_ = has(terms, load_friction);
    has_load_stribeck_ = has(terms, load_stribeck);
    has_stribeck_ = has(terms, stribeck);
    has_rise_ = has(terms, resistance_rise);
    has_exponent_ = has(terms, duty_exponent);
    has_speed_limit_ = has(terms, speed_limit);
    has_spring_ = has(terms, spring);
    has_hysteresis_ = has(terms, hysteresis);
    has_backlash_ = has(terms, backlash);
    has_presliding_ = has(terms, presliding);
  }

  HWY_INLINE void set_constants() {
    gravity_ = constant(log_.load.load.gravity_Nm);
    zero_ = hn::Add(of_(DriveParameter::zero), constant(log_.load.load.zero_rad));
    joint_inertia_ =
        hn::Add(constant(log_.load.load.inertia_kg_m2), of_(DriveParameter::joint_inertia));
    inertia_ = has_spring_ ? of_(DriveParameter::armature)
                           : hn::Add(joint_inertia_, of_(DriveParameter::armature));
    if (has_speed_limit_)
      speed_slope_ = hn::Div(of_(DriveParameter::stall_torque), of_(DriveParameter::no_load_speed));
    if (has_load_stribeck_)
      inverse_load_speed_ = hn::Div(constant(1.0), of_(DriveParameter::load_speed));
    if (has_stribeck_)
      inverse_stribeck_speed_ = hn::Div(constant(1.0), of_(DriveParameter::stribeck_speed));
    if (has_hysteresis_)
      inverse_width_ = hn::Div(constant(1.0), of_(DriveParameter::hysteresis_width));
    if (has_presliding_)
      inverse_presliding_ = hn::Div(constant(1.0), of_(DriveParameter::presliding));
    const double corner = log_.speed_filter_rad_s * step_s_;
    speed_share_ = constant(log_.speed_filter_rad_s > 0.0 ? 1.0 - std::exp(-corner) : 1.0);
  }

  HWY_INLINE void store(V value, double* out, std::size_t sample) const {
    if (out != nullptr) hn::Store(value, D(), out + sample * kDriveLanes + at_);
  }

  HWY_INLINE double power_at(std::size_t sample) const {
    return is_powered(log_, sample) ? 1.0 : 0.0;
  }

  // The spring carries the load, as if it were at rest; without a start of the joint in the log that is the best guess.
  // q + deflection sin(q + zero) = angle by Newton's method, by halves where that leaves the bounds; gravity has taken the
  // backlash to its side.
  HWY_INLINE V hanging_joint() const {
    const V deflection = hn::Div(gravity_, of_(DriveParameter::stiffness));
    V end = angle_;
    if (has_backlash_) {
      const V side = sine(hn::Add(angle_, zero_));
      const V play = hn::CopySign(of_(DriveParameter::backlash), side);
      end = hn::Sub(end, hn::IfThenElseZero(hn::Gt(gravity_, hn::Zero(D())), play));
    }
    V low = hn::Sub(end, deflection);
    V high = hn::Add(end, deflection);
    V joint = end;
    for (int k = 0; k < 30; ++k) {
      const V place = hn::Add(joint, zero_);
      const V error = hn::Sub(hn::MulAdd(deflection, sine(place), joint), end);
      const auto is_above = hn::Gt(error, hn::Zero(D()));
      high = hn::IfThenElse(is_above, joint, high);
      low = hn::IfThenElse(is_above, low, joint);
      const V slope =
          hn::MulAdd(deflection, sine(hn::Add(place, constant(0.5 * kPi))), constant(1.0));
      const V next = hn::Sub(joint, hn::Div(error, slope));
      const auto is_inside = hn::And(hn::Ge(next, low), hn::Le(next, high));  // no NaN
      const V before = joint;
      joint = hn::IfThenElse(is_inside, next, hn::Mul(constant(0.5), hn::Add(low, high)));
      if (hn::AllTrue(D(), hn::Le(hn::Abs(hn::Sub(joint, before)), constant(1e-12)))) break;
    }
    return joint;
  }

  // With steps of second order it is the mean over the kick, so that a jump acts at its time and not at that of the step.
  HWY_INLINE V command(double now) {
    if (!is_second_order_) {
      command_.move_to(now);
      return command_.value();
    }
    const double end = now + 0.5 * step_s_ / log_.sample_period_s;
    return hn::Mul(command_.integral_to(end), constant(log_.sample_period_s / kick_s_));
  }

  HWY_INLINE V law_torque(V goal) {
    filtered_speed_ = hn::MulAdd(speed_share_, hn::Sub(speed_, filtered_speed_), filtered_speed_);
    V wanted = hn::Mul(constant(log_.gain), hn::Sub(goal, angle_));
    wanted = hn::NegMulAdd(constant(log_.speed_gain), filtered_speed_, wanted);
    const V limited = within(wanted, constant(log_.limit));
    if (has_delay_) return ring_.delayed(limited);
    if (log_.speed_filter_rad_s <= 0.0)
      motor_damping_ = hn::IfThenElseZero(hn::Eq(limited, wanted), constant(log_.speed_gain));
    return limited;
  }

  HWY_INLINE V winding_torque(V duty) {
    if (power_ == 0.0 && !log_.brakes_when_off) return hn::Zero(D());
    const V size = hn::Abs(duty);
    if (has_exponent_) {
      constexpr double kSmallest = 1e-9;
      const V log_size = hn::Log(D(), hn::Max(size, constant(kSmallest)));
      const V power = hn::Exp(D(), hn::Mul(of_(DriveParameter::duty_exponent), log_size));
      duty = hn::IfThenElse(hn::Gt(size, constant(kSmallest)), hn::CopySign(power, duty),
                            hn::Zero(D()));
    }
    V resistance = of_(DriveParameter::resistance);
    if (has_rise_)
      resistance =
          hn::MulAdd(of_(DriveParameter::resistance_rise), hn::Mul(size, size), resistance);
    const V constant_Nm_A = of_(DriveParameter::torque_constant);
    // The power switches all of the torque of an open winding, and the duty of one that is shorted.
    const double closed = log_.brakes_when_off ? 1.0 : power_;
    const V torque_per_volt = hn::Mul(constant(closed), hn::Div(constant_Nm_A, resistance));
    motor_damping_ = hn::Mul(torque_per_volt, constant_Nm_A);
    const V voltage = hn::NegMulAdd(
        constant_Nm_A, speed_,
        hn::Mul(constant(log_.supply_V * (log_.brakes_when_off ? power_ : 1.0)), duty));
    return hn::Mul(torque_per_volt, voltage);
  }

  // What the supply leaves of a commanded torque at this speed.
  HWY_INLINE V within_supply(V torque) {
    if (!has_speed_limit_) return torque;
    const V stall = of_(DriveParameter::stall_torque);
    const V lost = hn::Mul(speed_slope_, speed_);
    const V limited = hn::Min(hn::Max(torque, hn::Neg(hn::Add(stall, lost))), hn::Sub(stall, lost));
    motor_damping_ = hn::IfThenElse(hn::Eq(limited, torque), motor_damping_, speed_slope_);
    return limited;
  }

  // The torque that acts in the share of the kick with power.
  HWY_INLINE V switched(V torque) {
    motor_damping_ = hn::Mul(constant(power_), motor_damping_);
    return hn::Mul(constant(power_), torque);
  }

  HWY_INLINE V motor_torque(double now) {
    motor_damping_ = hn::Zero(D());
    const V input = command(now);
    switch (log_.kind) {
      case CommandKind::goal_to_duty:
        return winding_torque(
            within(hn::Mul(constant(log_.gain), hn::Sub(input, angle_)), constant(log_.limit)));
      case CommandKind::duty: return winding_torque(input);
      case CommandKind::goal_to_torque: return switched(within_supply(law_torque(input)));
      case CommandKind::current:
        return switched(hn::Mul(of_(DriveParameter::torque_constant), input));
      case CommandKind::torque: return switched(within_supply(input));
    }
    return hn::Zero(D());
  }

  // What dry friction holds at most under a load.
  HWY_INLINE V dry_friction(V load) const {
    V friction = of_(DriveParameter::coulomb);
    if (has_load_) friction = hn::MulAdd(of_(DriveParameter::load_friction), load, friction);
    if (has_load_stribeck_)
      friction = hn::MulAdd(hn::Mul(of_(DriveParameter::load_stribeck), load),
                            decay(speed_, inverse_load_speed_), friction);
    if (has_stribeck_)
      friction = hn::MulAdd(of_(DriveParameter::stribeck), decay(speed_, inverse_stribeck_speed_),
                            friction);
    return friction;
  }

  // The inertia with which a kick by the torques at the old speed has the mean of `damping` over the step.
  HWY_INLINE V effective_inertia(V inertia, V damping) const {
    return hn::MulAdd(constant(implicit_share_ * kick_s_), damping, inertia);
  }

  // On the motor's side: what opposes `driving`, the sum of all other torques.
  HWY_INLINE V friction_torque(V driving, V load, V inertia) {
    const V viscous = of_(DriveParameter::viscous);
    if (has_presliding_) {
      const V moved = hn::Mul(hn::Mul(hn::Abs(speed_), constant(step_s_)), inverse_presliding_);
      const V kept = hn::Exp(D(), hn::Max(hn::Neg(moved), constant(-700.0)));
      const V end = hn::CopySign(constant(1.0), speed_);
      bristle_ = hn::MulAdd(hn::Sub(bristle_, end), kept, end);
      return hn::MulAdd(dry_friction(load), bristle_, hn::Mul(viscous, speed_));
    }
    const V bound = hn::MulAdd(viscous, hn::Abs(speed_), dry_friction(load));
    return within(stopping(driving, inertia, speed_), bound);
  }

  // The torque that stops a mass within the kick.
  HWY_INLINE V stopping(V driving, V inertia, V speed) const {
    return hn::MulAdd(hn::Mul(inertia, constant(1.0 / kick_s_)), speed, driving);
  }

  HWY_INLINE V kicked(V speed, V torque, V inertia) const {
    return hn::MulAdd(constant(kick_s_), hn::Div(torque, inertia), speed);
  }

  HWY_INLINE V motor_inertia() const {
    return effective_inertia(inertia_, hn::Add(motor_damping_, of_(DriveParameter::viscous)));
  }

  // `now`: time in samples.
  HWY_INLINE void step(double now) {
    const V motor = motor_torque(now);
    const V dt = constant(step_s_);
    if (has_spring_) return step_two(motor, dt);
    const V gravity = hn::Neg(hn::Mul(gravity_, sine(hn::Add(angle_, zero_))));
    const V one = constant(1.0);
    const V direction = of_(DriveParameter::direction);
    const V load = hn::Abs(hn::Sub(hn::Mul(motor, hn::Add(one, direction)),
                                   hn::Mul(gravity, hn::Sub(one, direction))));
    const V driving = hn::Add(motor, gravity);
    const V inertia = motor_inertia();
    const V friction = friction_torque(driving, load, inertia);
    joint_torque_ = hn::Sub(motor, friction);
    speed_ = kicked(speed_, hn::Sub(driving, friction), inertia);
    angle_ = hn::MulAdd(dt, speed_, angle_);
    joint_angle_ = angle_;
  }

  HWY_INLINE V spring_torque(V dt) {
    V deflection = hn::Sub(angle_, joint_angle_);
    V rate = hn::Sub(speed_, joint_speed_);
    if (has_backlash_) {
      const V play = of_(DriveParameter::backlash);
      rate = hn::IfThenZeroElse(hn::Lt(hn::Abs(deflection), play), rate);
      deflection = hn::Sub(deflection, within(deflection, play));
    }
    V torque = hn::MulAdd(of_(DriveParameter::stiffness), deflection,
                          hn::Mul(of_(DriveParameter::spring_damping), rate));
    if (has_hysteresis_) {
      stop_ = within(hn::MulAdd(hn::Mul(rate, dt), inverse_width_, stop_), constant(1.0));
      torque = hn::MulAdd(of_(DriveParameter::hysteresis), stop_, torque);
    }
    return torque;
  }

  HWY_INLINE void step_two(V motor, V dt) {
    const V spring = spring_torque(dt);
    joint_torque_ = spring;
    const V driving = hn::Sub(motor, spring);
    const V inertia = motor_inertia();
    const V friction = friction_torque(driving, hn::Abs(spring), inertia);
    const V gravity = hn::Mul(gravity_, sine(hn::Add(joint_angle_, zero_)));
    const V on_joint = hn::Sub(spring, gravity);
    const V bound = hn::MulAdd(of_(DriveParameter::bearing_viscous), hn::Abs(joint_speed_),
                               of_(DriveParameter::bearing));
    const V joint_inertia = effective_inertia(joint_inertia_, of_(DriveParameter::bearing_viscous));
    const V bearing = within(stopping(on_joint, joint_inertia, joint_speed_), bound);
    speed_ = kicked(speed_, hn::Sub(driving, friction), inertia);
    angle_ = hn::MulAdd(dt, speed_, angle_);
    joint_speed_ = kicked(joint_speed_, hn::Sub(on_joint, bearing), joint_inertia);
    joint_angle_ = hn::MulAdd(dt, joint_speed_, joint_angle_);
  }

  static constexpr double kPi = std::numbers::pi;

  const DriveLog& log_;
  const DriveRun& run_;
  Constants of_;
  std::size_t at_;
  bool has_delay_;
  bool is_second_order_;
  double implicit_share_;  ///< share of the damping that acts at the new speed
  std::size_t substeps_;
  double step_s_;
  double kick_s_;       ///< time for which torques act on the speeds: half a step at first
  double power_ = 1.0;  ///< share of the kick in which the power is on
  LaneCommand command_;
  DelayRing ring_;
  bool has_load_, has_load_stribeck_, has_stribeck_, has_rise_, has_exponent_, has_speed_limit_,
      has_spring_;
  bool has_hysteresis_, has_backlash_, has_presliding_;
  V gravity_, zero_, inertia_, joint_inertia_;
  V inverse_load_speed_ = hn::Zero(D()), inverse_stribeck_speed_ = hn::Zero(D());
  V speed_slope_ = hn::Zero(D());
  V inverse_width_ = hn::Zero(D()), inverse_presliding_ = hn::Zero(D());
  V speed_share_;
  V angle_, speed_, filtered_speed_, joint_angle_, joint_speed_;
  V bristle_ = hn::Zero(D()), stop_ = hn::Zero(D()), joint_torque_ = hn::Zero(D());
  V motor_damping_ = hn::Zero(D());
};

void roll_out_lanes(const DriveLog& log, const DriveRun& run, const DriveLanes& parameters,
                    const RolloutOptions& options, const RolloutOutput& output) {
  for (std::size_t at = 0; at < kDriveLanes; at += hn::Lanes(D()))
    Rollout(log, run, parameters, at, options).run(output);
}

}  // namespace torsio::drive_rollout::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio {
namespace drive_rollout {

HWY_EXPORT(roll_out_lanes);

// Here, since a build for one instruction set finds no qualified name.
static void dispatch(const DriveLog& log, const DriveRun& run, const DriveLanes& parameters,
                     const RolloutOptions& options, const RolloutOutput& output) {
  HWY_DYNAMIC_DISPATCH(roll_out_lanes)(log, run, parameters, options, output);
}

}  // namespace drive_rollout

void roll_out(const DriveLog& log, const DriveRun& run, const DriveLanes& parameters,
              const RolloutOptions& options, const RolloutOutput& output) noexcept {
  drive_rollout::dispatch(log, run, parameters, options, output);
}

}  // namespace torsio
#endif
