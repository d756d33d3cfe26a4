#include "torsio/identify/drive/write_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "data/names.hpp"
#include "identify/drive/bam_rollout.hpp"
#include "identify/drive/choose_structure.hpp"
#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_logs.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, 3> kTargetNames{"bam", "mjcf", "isaaclab"};

std::vector<DriveLog> grouped_logs(const DriveIdentification& identified,
                                   const std::vector<Recording>& recordings) {
  std::vector<DriveLog> logs = drive_logs(recordings, identified.load, identified.drive);
  for (std::size_t k = 0; k < logs.size(); ++k) logs[k].group = identified.recordings[k].group;
  return logs;
}

DriveFitOptions fit_options(const IdentifyOptions& options) {
  return {.starts = options.starts, .seed = options.seed, .progress = options.progress};
}

DriveValues typical_bam() {
  DriveValues values{};
  for (std::size_t row = 0; row < bam_parameters().size(); ++row)
    values[row] = bam_parameters()[row].typical;
  return values;
}

double bam_held_out(const GroupedLogs& logs, BamModel model, const DriveFitOptions& options,
                    std::size_t threads) {
  std::vector<DriveSolution> fits(logs.groups);
  for_each_chunk(logs.groups, threads, [&](std::size_t group) {
    fits[group] = fit_problem(bam_problem(logs.without(group), model), typical_bam(), options);
  });
  double mean = 0.0;
  for (std::size_t k = 0; k < logs.logs.size(); ++k)
    mean += score_drive(bam_problem({logs.logs[k]}, model), fits[logs.group[k]].values).mae_rad /
            static_cast<double>(logs.logs.size());
  return mean;
}

void require_position(const DriveIdentification& identified) {
  if (identified.drive.law == DriveLaw::position) return;
  throw UsageError({.place = "--write bam",
                    .expected = "a drive of the law 'position', the only one that BAM has",
                    .found = std::string(name(identified.drive.law)),
                    .advice = "Use --write mjcf."});
}

std::vector<std::string> other_terms(const DriveTerms& terms, const DriveTerms& kept) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < kDriveTerms; ++k)
    if (terms.test(k) && !kept.test(k)) names.emplace_back(name(static_cast<DriveTerm>(k)));
  return names;
}

std::string joined_terms(const std::vector<std::string>& names) {
  return names.empty() ? "nothing" : joined(names);
}

WrittenDrive write_bam(const DriveIdentification& identified, const std::vector<DriveLog>& logs,
                       const std::string& actuator, const IdentifyOptions& options) {
  require_position(identified);
  const GroupedLogs all = grouped(pointers_to(logs));
  const DriveFitOptions fit = fit_options(options);
  std::size_t best = kBamModels - 1;
  double least = HUGE_VAL;
  for (std::size_t m = 0; m < kBamModels && all.groups > 1; ++m) {
    const double error = bam_held_out(all, static_cast<BamModel>(m), fit, options.threads);
    if (error < least) {
      least = error;
      best = m;
    }
  }
  const auto model = static_cast<BamModel>(best);
  const DriveProblem problem = bam_problem(all.logs, model);
  const DriveSolution solution = fit_problem(problem, typical_bam(), fit);
  WrittenDrive written{
      .text = "{\n",
      .mae_rad = score_drive(problem, solution.values).mae_rad,
      .own_mae_rad = identified.mae_rad,
      .model = std::string(name(model)),
      .not_expressed = other_terms(
          identified.terms,
          drive_terms({DriveTerm::base, DriveTerm::load_friction, DriveTerm::load_stribeck,
                       DriveTerm::stribeck, DriveTerm::direction}))};
  written.text +=
      fmt::format("  \"model\": \"{}\",\n  \"actuator\": \"{}\",\n", written.model, actuator);
  for (const std::size_t row : bam_rows(model))
    written.text +=
        fmt::format("  \"{}\": {:.9g},\n", bam_parameters()[row].key, solution.values[row]);
  written.text += fmt::format(
      "  \"torsio_note\": \"refitted at a step of {:.4g} s; mean |error| {:.5f} rad in free runs, "
      "{:.5f} rad "
      "in torsio's equations; not expressed: {}\"\n}}\n",
      logs.front().sample_period_s, written.mae_rad, written.own_mae_rad,
      joined_terms(written.not_expressed));
  return written;
}

/// The identified drive with fewer terms and the target's step.
struct Refitted {
  DriveTerms terms;
  DriveValues values{};
  double step_s = 0.0;
  double mae_rad = 0.0;
};

Refitted refitted(const DriveIdentification& identified, const std::vector<DriveLog>& logs,
                  const DriveTerms& kept, double step_s, const IdentifyOptions& options) {
  Refitted result{.terms = identified.terms & kept};
  DriveFitOptions fit = fit_options(options);
  const double steps = std::max(1.0, std::ceil(logs.front().sample_period_s / step_s - 1e-6));
  fit.step_s = logs.front().sample_period_s / steps;
  fit.integrator = DriveIntegrator::semi_implicit_euler;  // as in MuJoCo and Isaac Lab
  result.step_s = fit.step_s;
  const DriveLogs all = pointers_to(logs);
  result.values = fit_drive(all, result.terms, fit).values;
  result.mae_rad = score_drive(drive_problem(all, result.terms, fit), result.values).mae_rad;
  return result;
}

/// Gains of a servo on torque: stiffness, damping by back-EMF, and the largest torque.
struct ServoGains {
  double stiffness_Nm_rad = 0.0;
  double damping_Nms_rad = 0.0;
  double limit_Nm = 0.0;
};

ServoGains servo_gains(const DriveLog& log, const DriveValues& values) {
  if (log.kind == CommandKind::goal_to_torque) return {log.gain, log.speed_gain, log.limit};
  const double kt = at(values, DriveParameter::torque_constant);
  const double resistance = at(values, DriveParameter::resistance);
  const double torque_for_duty = kt * log.supply_V / resistance;
  return {torque_for_duty * log.gain, kt * kt / resistance, torque_for_duty * log.limit};
}

void require_servo(DriveTarget target, const DriveLog& log) {
  if (log.kind == CommandKind::goal_to_duty || log.kind == CommandKind::goal_to_torque) return;
  throw UsageError({.place = fmt::format("--write {}", name(target)),
                    .expected = "a drive of the law 'position' or 'pd'",
                    .found = "a law whose command is not an angle"});
}

/// A body of the load's gravity and inertia: a mass on half the length that its inertia as a point would have.
std::string load_body(const JointLoad& load, double zero_rad) {
  const double first_moment_kg_m = load.gravity_Nm / kLoadGravity_m_s2;
  const double arm_m = first_moment_kg_m > 0.0 ? 0.5 * load.inertia_kg_m2 / first_moment_kg_m : 0.0;
  const double mass_kg = arm_m > 0.0 ? first_moment_kg_m / arm_m : 1e-3;
  const double own = load.inertia_kg_m2 - mass_kg * arm_m * arm_m;
  return fmt::format(
      R"(<inertial pos="{:.9g} 0 {:.9g}" mass="{:.9g}" diaginertia="{:.9g} {:.9g} {:.9g}"/>)",
      -arm_m * std::sin(zero_rad), -arm_m * std::cos(zero_rad), mass_kg, own, own, own);
}

WrittenDrive write_mjcf(const DriveIdentification& identified, const std::vector<DriveLog>& logs,
                        const std::string& actuator, const IdentifyOptions& options) {
  using enum DriveParameter;
  const DriveLog& log = logs.front();
  require_servo(DriveTarget::mjcf, log);
  // The hinge of the load turns against the motor, so that it cannot have the friction of the joint's bearing.
  const DriveTerms kept =
      drive_terms({DriveTerm::base, DriveTerm::spring, DriveTerm::joint_inertia});
  const Refitted fit = refitted(identified, logs, kept, 0.002, options);
  const ServoGains gains = servo_gains(log, fit.values);
  const bool has_spring = has(fit.terms, DriveTerm::spring);
  WrittenDrive written{.text = {},
                       .mae_rad = fit.mae_rad,
                       .own_mae_rad = identified.mae_rad,
                       .model = {},
                       .not_expressed = other_terms(identified.terms, kept)};
  const bool has_passive = std::ranges::any_of(logs, [](const DriveLog& one) {
    return std::ranges::any_of(one.enabled, [](double on) { return on == 0.0; });
  });
  if (has_passive)
    written.not_expressed.emplace_back("the open winding without power: damping remains");
  if (log.speed_filter_rad_s > 0.0)
    written.not_expressed.emplace_back("the low-pass of the law's speed");
  JointLoad load = log.load.load;
  load.inertia_kg_m2 += at(fit.values, joint_inertia);
  const std::string inertial = load_body(load, load.zero_rad + at(fit.values, zero));
  std::string& text = written.text;
  text = fmt::format(
      "<!-- Written by torsio identify for the load and the gain of {}. Refitted at this time "
      "step: mean "
      "|error| {:.5f} rad in "
      "free runs, {:.5f} rad in torsio's equations.\n     Not expressed: {}. -->\n",
      log.name, written.mae_rad, written.own_mae_rad, joined_terms(written.not_expressed));
  text += fmt::format(
      "<mujoco model=\"{}\">\n  <option timestep=\"{:.9g}\" integrator=\"Euler\" gravity=\"0 0 "
      "-{}\"/>\n"
      "  <worldbody>\n    <body name=\"{}_motor\">\n",
      actuator, fit.step_s, kLoadGravity_m_s2, actuator);
  const std::string motor_joint = fmt::format(
      "<joint name=\"{}_{}\" type=\"hinge\" axis=\"0 1 0\" armature=\"{:.9g}\" damping=\"{:.9g}\" "
      "frictionloss=\"{:.9g}\"/>",
      actuator, has_spring ? "motor" : "joint", at(fit.values, armature),
      at(fit.values, viscous) +
          (log.kind == CommandKind::goal_to_duty ? gains.damping_Nms_rad : 0.0),
      at(fit.values, coulomb));
  if (has_spring) {
    text += fmt::format(
        "      {}\n      <inertial pos=\"0 0 0\" mass=\"1e-6\" diaginertia=\"1e-9 1e-9 1e-9\"/>\n"
        "      <body name=\"{}_load\">\n        <joint name=\"{}_spring\" type=\"hinge\" axis=\"0 "
        "1 0\" "
        "stiffness=\"{:.9g}\" damping=\"{:.9g}\"/>\n        {}\n      </body>\n",
        motor_joint, actuator, actuator, at(fit.values, stiffness), at(fit.values, spring_damping),
        inertial);
  } else {
    text += fmt::format("      {}\n      {}\n", motor_joint, inertial);
  }
  const double law_damping = log.kind == CommandKind::goal_to_torque ? gains.damping_Nms_rad : 0.0;
  text += fmt::format(
      "    </body>\n  </worldbody>\n  <actuator>\n    <general name=\"{}\" joint=\"{}_{}\" "
      "biastype=\"affine\" "
      "gainprm=\"{:.9g}\" biasprm=\"0 {:.9g} {:.9g}\"{}/>\n  </actuator>\n</mujoco>\n",
      actuator, actuator, has_spring ? "motor" : "joint", gains.stiffness_Nm_rad,
      -gains.stiffness_Nm_rad, -law_damping,
      gains.limit_Nm < 1e8 ? fmt::format(R"( forcelimited="true" forcerange="{:.9g} {:.9g}")",
                                         -gains.limit_Nm, gains.limit_Nm)
                           : std::string());
  return written;
}

WrittenDrive write_isaaclab(const DriveIdentification& identified,
                            const std::vector<DriveLog>& logs, const std::string& actuator,
                            const IdentifyOptions& options) {
  using enum DriveParameter;
  const DriveLog& log = logs.front();
  require_servo(DriveTarget::isaaclab, log);
  // DCMotorCfg has the limit of the supply, DelayedPDActuatorCfg the delay, and none both.
  const bool has_limit = has(identified.terms, DriveTerm::speed_limit);
  const DriveTerms kept = has_limit ? drive_terms({DriveTerm::base, DriveTerm::speed_limit})
                                    : drive_terms({DriveTerm::base, DriveTerm::delay});
  const Refitted fit = refitted(identified, logs, kept, 0.005, options);
  const ServoGains gains = servo_gains(log, fit.values);
  WrittenDrive written{.text = {},
                       .mae_rad = fit.mae_rad,
                       .own_mae_rad = identified.mae_rad,
                       .model = {},
                       .not_expressed = other_terms(identified.terms, kept)};
  const auto delay_steps =
      static_cast<long>(std::lround(std::max(at(fit.values, delay), 0.0) / fit.step_s));
  const bool is_delayed = delay_steps > 0;
  const double kt = at(fit.values, torque_constant);
  std::string& text = written.text;
  text = fmt::format(
      "# Written by torsio identify; not run with Isaac Lab. Refitted at a physics step of {:.4g} "
      "s: mean |error| "
      "{:.5f} rad in free runs,\n# {:.5f} rad in torsio's equations. Not expressed: {}.\n",
      fit.step_s, written.mae_rad, written.own_mae_rad, joined_terms(written.not_expressed));
  text += fmt::format(
      "from isaaclab.actuators import {0}\n\n{1} = {0}(\n    joint_names_expr=[\"{1}\"],\n",
      is_delayed ? "DelayedPDActuatorCfg" : "DCMotorCfg", actuator);
  if (is_delayed)
    text += fmt::format("    min_delay={0},\n    max_delay={0},\n", delay_steps);
  else
    text += fmt::format("    saturation_effort={:.9g},\n",
                        has_limit ? at(fit.values, stall_torque) : gains.limit_Nm);
  text += fmt::format("    effort_limit={:.9g},\n", gains.limit_Nm);
  if (log.kind == CommandKind::goal_to_duty)
    text += fmt::format("    velocity_limit={:.9g},\n", log.supply_V * log.limit / kt);
  else if (has_limit)
    text += fmt::format("    velocity_limit={:.9g},\n", at(fit.values, no_load_speed));
  text += fmt::format(
      "    stiffness={:.9g},\n    damping={:.9g},\n    armature={:.9g},\n    friction={:.9g},\n"
      "    viscous_friction={:.9g},\n)\n",
      gains.stiffness_Nm_rad, gains.damping_Nms_rad, at(fit.values, armature),
      at(fit.values, coulomb), at(fit.values, viscous));
  return written;
}

void require_identifier(const std::string& name) {
  const bool is_good = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  }) && std::isdigit(static_cast<unsigned char>(name.front())) == 0;
  if (!is_good)
    throw UsageError({.place = "--name",
                      .expected = "letters, digits and underscores, no digit first",
                      .found = name});
}

}  // namespace

std::string_view name(DriveTarget target) { return kTargetNames[static_cast<std::size_t>(target)]; }

DriveTarget drive_target(std::string_view text) {
  for (std::size_t k = 0; k < kTargetNames.size(); ++k)
    if (kTargetNames[k] == text) return static_cast<DriveTarget>(k);
  throw UsageError(
      {.place = "--write", .expected = "bam, mjcf or isaaclab", .found = std::string(text)});
}

WrittenDrive write_drive(DriveTarget target, const DriveIdentification& identified,
                         const std::vector<Recording>& recordings, const std::string& name,
                         const IdentifyOptions& options) {
  require_identifier(name);
  const std::vector<DriveLog> logs = grouped_logs(identified, recordings);
  if (target == DriveTarget::bam) return write_bam(identified, logs, name, options);
  if (target == DriveTarget::mjcf) return write_mjcf(identified, logs, name, options);
  return write_isaaclab(identified, logs, name, options);
}

std::vector<BamComparison> compare_with_bam(const DriveIdentification& identified,
                                            const std::vector<Recording>& recordings,
                                            const IdentifyOptions& options) {
  require_position(identified);
  const std::vector<DriveLog> logs = grouped_logs(identified, recordings);
  const GroupedLogs all = grouped(pointers_to(logs));
  const DriveFitOptions fit = fit_options(options);
  std::vector<BamComparison> rows;
  for (std::size_t m = 0; m < kBamModels; ++m) {
    const auto model = static_cast<BamModel>(m);
    const DriveProblem problem = bam_problem(all.logs, model);
    const DriveSolution solution = fit_problem(problem, typical_bam(), fit);
    rows.push_back(
        {std::string(name(model)), score_drive(problem, solution.values).mae_rad,
         all.groups > 1 ? bam_held_out(all, model, fit, options.threads) : kNotMeasured});
  }
  return rows;
}

}  // namespace torsio
