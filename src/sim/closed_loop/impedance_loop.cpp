#include "sim/closed_loop/impedance_loop.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kImpedanceLoop = "impedance";
constexpr double kRadPerTurn = 2.0 * std::numbers::pi;
constexpr double kSpeedCutoff_Hz = 40.0;  // as that of `TubeImpedance`
/// An elastomer is a fast spring.
constexpr double kElastomerBandwidth_rad_s = 100.0;

DeflectionController deflection_of(const ImpedancePlan::Spring& spring) {
  return {spring.torque.deflection, kBenchRate_Hz};
}

JointFeedback feedback_of(const TubeImpedance::Settings& tube) {
  return TubeImpedance::feedback_of(tube, kBenchRate_Hz);
}
JointFeedback feedback_of(const ImpedancePlan::Spring& spring) {
  return impedance_feedback(deflection_of(spring), spring.gains, kSpeedCutoff_Hz);
}

SeriesElasticJoint joint_of(const TubeImpedance::Settings& tube) {
  return TubeImpedance::joint_of(tube);
}
SeriesElasticJoint joint_of(const ImpedancePlan::Spring& spring) {
  return spring.torque.deflection.joint;
}

/// From the torque reference to the current.
LinearSystem torque_path(const TubeImpedance::Settings& tube) {
  return LinearSystem::gain(tube.gains.torque_Nm_rad / tube.drive.torque_constant_Nm_A /
                                TubeImpedance::torque_per_twist(tube),
                            kBenchRate_Hz);
}
LinearSystem torque_path(const ImpedancePlan::Spring& spring) {
  return deflection_of(spring).reference_path() *
         LinearSystem::gain(1.0 / spring.torque.deflection.joint.stiffness_Nm_rad, kBenchRate_Hz);
}

SeriesElasticJoint joint_of(const ImpedancePlan& plan) {
  return std::visit([](const auto& controller) { return joint_of(controller); }, plan.controller);
}

JointFeedback feedback_of(const ImpedancePlan& plan) {
  return std::visit([](const auto& controller) { return feedback_of(controller); },
                    plan.controller);
}

std::optional<CorrectedParts> corrected(const ImpedancePlan& plan) {
  if (!plan.estimator) return std::nullopt;
  const auto gain = [](double value) { return LinearSystem::gain(value, kBenchRate_Hz); };
  LinearSystem impedance = gain(plan.stiffness_Nm_rad());
  if (plan.damping_Nms_rad() > 0.0)
    impedance = impedance + gain(plan.damping_Nms_rad()) *
                                (LinearSystem::lowpass(kSpeedCutoff_Hz, kBenchRate_Hz) *
                                 LinearSystem::difference(kBenchRate_Hz));
  return std::visit(
      [&](const auto& controller) {
        return corrected_parts(feedback_of(controller), impedance, torque_path(controller),
                               joint_of(controller).stiffness_Nm_rad,
                               plan.correction.bandwidth_rad_s);
      },
      plan.controller);
}

TubeImpedance::Settings tube_settings(const DataSheet& sheet, const ImpedanceSpec& spec) {
  if (spec.bandwidth_rad_s || spec.loop_damping)
    throw UsageError({.place = fmt::format("{} bandwidth", kImpedanceLoop),
                      .problem = "it belongs to a torque loop through a spring",
                      .expected = "none for " + sheet.name,
                      .advice = "The gain of this actuator's loop is the torque gain."});
  TubeImpedance::Settings settings = tube_impedance_settings(
      sheet, spec.kind == ImpedanceSpec::Kind::high ? TubeImpedance::kHigh : TubeImpedance::kZero);
  // A rigid tube twists too little for its encoders.
  if (sheet.variant == "rigid") settings.twist = TubeImpedance::Twist::tube_and_gear;
  settings.relies_on_friction = spec.kind == ImpedanceSpec::Kind::high;
  if (spec.kind == ImpedanceSpec::Kind::wanted)
    settings.gains = TubeImpedance::gains_for(
        settings, spec.stiffness_Nm_rad, spec.damping_Nms_rad,
        spec.torque_gain_Nm_rad.value_or(TubeImpedance::kZero.torque_Nm_rad));
  return settings;
}

ImpedancePlan::Spring spring_settings(const DataSheet& sheet, const ImpedanceSpec& spec,
                                      const AnyInverse& inverse) {
  if (spec.kind == ImpedanceSpec::Kind::high)
    throw UsageError({.place = kImpedanceLoop,
                      .problem = "its gains are those of paper 004 for harmonic-drive",
                      .expected = "a stiffness for " + sheet.name,
                      .found = "high"});
  if (spec.torque_gain_Nm_rad)
    throw UsageError({.place = fmt::format("{} torque gain", kImpedanceLoop),
                      .problem = "it belongs to an actuator with a torsion tube before its gear",
                      .expected = "none for " + sheet.name,
                      .advice = "The gains of this actuator's loop follow from its bandwidth."});
  const double bandwidth_rad_s =
      spec.bandwidth_rad_s.value_or(sheet.family == ActuatorFamily::elastomer
                                        ? kElastomerBandwidth_rad_s
                                        : TorqueLoopCore::Settings{}.deflection.bandwidth_rad_s);
  const bool is_zero = spec.kind == ImpedanceSpec::Kind::zero;
  return {.gains = {.stiffness_Nm_rad = is_zero ? 0.0 : spec.stiffness_Nm_rad,
                    .damping_Nms_rad = is_zero ? 0.0 : spec.damping_Nms_rad},
          .torque = {.deflection = {.joint = series_elastic_joint(sheet),
                                    .bandwidth_rad_s = bandwidth_rad_s,
                                    .damping = spec.loop_damping.value_or(0.9)},
                     .largest_torque_Nm = sheet.rating.torque_Nm.value},
          .inverse = inverse};
}

}  // namespace

double ImpedancePlan::stiffness_Nm_rad() const {
  if (const auto* const spring = std::get_if<Spring>(&controller))
    return spring->gains.stiffness_Nm_rad;
  const auto& tube = std::get<TubeImpedance::Settings>(controller);
  return tube.gains.position * TubeImpedance::torque_per_twist(tube);
}

double ImpedancePlan::damping_Nms_rad() const {
  if (const auto* const spring = std::get_if<Spring>(&controller))
    return spring->gains.damping_Nms_rad;
  const auto& tube = std::get<TubeImpedance::Settings>(controller);
  return tube.gains.damping_s * TubeImpedance::torque_per_twist(tube);
}

std::size_t ImpedancePlan::ticks_per_estimate() const {
  if (!estimator) return 1;
  return static_cast<std::size_t>(
      std::lround(kBenchRate_Hz / estimator->settings().sample_rate_Hz));
}

double ImpedancePlan::largest_passive_Nm_rad(double passive_to_Hz) const {
  const double rad_s = kRadPerTurn * passive_to_Hz;
  if (const auto* const spring = std::get_if<Spring>(&controller))
    return passive_stiffness(deflection_of(*spring), damping_Nms_rad(), rad_s, kSpeedCutoff_Hz);
  return passive_stiffness(std::get<TubeImpedance::Settings>(controller), damping_Nms_rad(), rad_s,
                           kBenchRate_Hz);
}

ImpedancePlan impedance_plan(const DataSheet& sheet, const ImpedanceSpec& spec,
                             const ImpedanceModel* model, const LinearInverse& line) {
  const AnyInverse* const inverse =
      model == nullptr ? nullptr : std::get_if<AnyInverse>(&model->use);
  ImpedancePlan plan{.sheet = &sheet, .controller = TubeImpedance::Settings{}};
  if (sheet.family == ActuatorFamily::harmonic_drive)
    plan.controller = tube_settings(sheet, spec);
  else
    plan.controller = spring_settings(sheet, spec, inverse != nullptr ? *inverse : line);
  if (model != nullptr && inverse == nullptr) {
    plan.estimator = std::get<Estimator>(model->use);
    plan.correction = {.bandwidth_rad_s = spec.correction_rad_s.value_or(
                           EstimateCorrection::Settings{}.bandwidth_rad_s),
                       .torque_Nm = sheet.rating.torque_Nm.value};
  }
  return plan;
}

LinearImpedance::LinearImpedance(const ImpedancePlan& plan)
    : joint_(joint_of(plan)),
      ticks_per_estimate_(plan.ticks_per_estimate()),
      corrected_(corrected(plan)),
      feedback_(corrected_ ? all_parts(*corrected_, ticks_per_estimate_) : feedback_of(plan)) {}

bool LinearImpedance::is_stable() const {
  const auto is_stable_for = [&](JointOutput output) {
    return corrected_ ? is_stable_held(joint_, corrected_->others, corrected_->estimate,
                                       ticks_per_estimate_, output)
                      : is_stable_closed(open_loop(joint_, feedback_, output));
  };
  return is_stable_for(JointOutput::locked) && is_stable_for(JointOutput::free);
}

double LinearImpedance::passive_to_Hz() const {
  return is_stable() ? passivity(joint_, feedback_).passive_to_rad_s / kRadPerTurn : 0.0;
}

std::complex<double> LinearImpedance::at(double frequency_Hz) const {
  const double rad_s = kRadPerTurn * frequency_Hz;
  const std::complex<double> s(0.0, rad_s);
  return s * (impedance(joint_, feedback_, rad_s) + s * joint_.joint_inertia_kg_m2 +
              joint_.joint_viscous_Nms_rad);
}

ImpedanceLoop::ImpedanceLoop(const ImpedancePlan& plan)
    : family_(plan.sheet->family),
      inverse_ratio_(1.0 / drive_of(*plan.sheet).ratio),
      controller_([&]() -> std::variant<Tube, Spring> {
        if (const auto* const spring = std::get_if<ImpedancePlan::Spring>(&plan.controller))
          return Spring{
              JointImpedance({.gains = spring->gains}, kBenchRate_Hz),
              TorqueController<AnyInverse>(spring->inverse, spring->torque, kBenchRate_Hz),
              Differentiator(kBenchRate_Hz, kSpeedCutoff_Hz)};
        const auto& tube = std::get<TubeImpedance::Settings>(plan.controller);
        return Tube{TubeImpedance(tube, kBenchRate_Hz), TubeImpedance::torque_per_twist(tube)};
      }()),
      estimator_(plan.estimator) {
  if (!estimator_) return;
  correction_.emplace(plan.correction, kBenchRate_Hz);
  inputs_ = sensed_inputs(*plan.sheet, estimator_->raw_inputs(), kImpedanceLoop);
  raw_.resize(inputs_.size());
  ticks_per_estimate_ = plan.ticks_per_estimate();
}

ImpedanceLoop::Output ImpedanceLoop::step(double t_s, const Measurement& measured) noexcept {
  return detail::dispatch(controller_,
                          [&](auto& controller) { return step(controller, t_s, measured); });
}

JointSample ImpedanceLoop::joint_sample(double t_s, const Measurement& measured) const noexcept {
  const bool has_middle_encoder = family_ == ActuatorFamily::series_elastic;
  const double gear_rad =
      has_middle_encoder ? measured.middle_angle_rad : measured.motor_angle_rad * inverse_ratio_;
  // A coupling has a sensor of its twist instead of an encoder at the joint.
  const double joint_rad = family_ == ActuatorFamily::elastomer ? gear_rad - measured.twist_rad
                                                                : measured.joint_angle_rad;
  return {.t_s = t_s,
          .motor_angle_rad = measured.motor_angle_rad,
          .gear_angle_rad = gear_rad,
          .joint_angle_rad = joint_rad,
          .motor_current_A = measured.motor_current_A};
}

ImpedanceLoop::Output ImpedanceLoop::step(Spring& spring, double t_s,
                                          const Measurement& measured) noexcept {
  const JointSample sample = joint_sample(t_s, measured);
  const JointImpedance::Output wanted =
      spring.impedance.step({}, {.angle_rad = sample.joint_angle_rad,
                                 .speed_rad_s = spring.speed.step(sample.joint_angle_rad)});
  const double correction_Nm = correction_ ? correction_->correction_Nm() : 0.0;
  const TorqueLoopCore::Output out = spring.torque.step(wanted.torque_Nm + correction_Nm, sample);
  correct(wanted.torque_Nm, measured, out.is_limited);
  return {out.current_A, out.is_limited};
}

ImpedanceLoop::Output ImpedanceLoop::step(Tube& tube, double /*t_s*/,
                                          const Measurement& measured) noexcept {
  const TubeImpedance::Output out =
      tube.impedance.step(0.0, 0.0,
                          {.rotor_rad = measured.motor_angle_rad,
                           .middle_rad = measured.middle_angle_rad,
                           .joint_rad = measured.joint_angle_rad},
                          correction_ ? correction_->correction_Nm() : 0.0);
  correct(tube.torque_per_twist_Nm_rad * (out.position_rad + out.damping_rad), measured,
          out.is_limited);
  return {out.current_A, out.is_limited};
}

void ImpedanceLoop::correct(double wanted_Nm, const Measurement& measured,
                            bool is_limited) noexcept {
  if (!estimator_) return;
  if (tick_++ % ticks_per_estimate_ == 0) {
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      raw_[i] = inputs_[i].scale * measured.*inputs_[i].value;
    estimate_ = estimator_->step(raw_);
  }
  (void)correction_->step(wanted_Nm, estimate_, is_limited);
}

}  // namespace torsio
