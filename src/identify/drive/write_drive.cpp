#include "torsio/identify/drive/write_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
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
  if (recordings.empty())
    throw UsageError({.place = "write_drive", .expected = "recordings", .found = "none"});
  if (!std::ranges::equal(recordings, identified.recordings, {}, &Recording::name,
                          &DriveRecordingScore::recording))
    throw UsageError({.place = "write_drive",
                      .expected = "the recordings of the identified drive, in their order",
                      .found = fmt::format("{} other recordings", recordings.size()),
                      .advice = "Evaluate the drive on them first (evaluate_drive)."});
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

bool has_passive_run(const std::vector<DriveLog>& logs) {
  return !std::ranges::all_of(logs, is_always_powered);
}

void require_identifier(const std::string& name) {
  const bool is_good = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  }) && std::isdigit(static_cast<unsigned char>(name.front())) == 0;
  if (!is_good)
    throw UsageError({.place = "the actuator's name",
                      .expected = "letters, digits and underscores, no digit first",
                      .found = name});
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

/// The model with the least held-out error; without groups the one with all terms.
BamModel best_bam_model(const GroupedLogs& logs, const DriveFitOptions& options,
                        std::size_t threads) {
  std::size_t best = kBamModels - 1;
  double least = HUGE_VAL;
  for (std::size_t m = 0; m < kBamModels && logs.groups > 1; ++m) {
    const double error = bam_held_out(logs, static_cast<BamModel>(m), options, threads);
    if (error < least) {
      least = error;
      best = m;
    }
  }
  return static_cast<BamModel>(best);
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
  const GroupedLogs all = grouped(pointers_to(logs));
  const DriveFitOptions fit = fit_options(options);
  const BamModel model = best_bam_model(all, fit, options.threads);
  const DriveProblem problem = bam_problem(all.logs, model);
  const DriveSolution solution = fit_problem(problem, typical_bam(), fit);
  WrittenDrive written{.text = "{\n",
                       .mae_rad = score_drive(problem, solution.values).mae_rad,
                       .own_mae_rad = identified.mae_rad,
                       .model = std::string(name(model)),
                       .not_expressed = other_terms(identified.terms, terms_of_bam(model))};
  if (identified.drive.brakes_when_off && has_passive_run(logs))
    written.not_expressed.emplace_back("the shorted winding without power");
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
  DriveFitOptions options = {};
  double mae_rad = 0.0;
};

Refitted refitted(const DriveIdentification& identified, const std::vector<DriveLog>& logs,
                  const DriveTerms& kept, double step_s, DriveIntegrator integrator,
                  const IdentifyOptions& options) {
  Refitted result{.terms = identified.terms & kept};
  DriveFitOptions fit = fit_options(options);
  const double steps = std::max(1.0, std::ceil(logs.front().sample_period_s / step_s - 1e-6));
  fit.step_s = logs.front().sample_period_s / steps;
  fit.integrator = integrator;
  result.step_s = fit.step_s;
  result.options = fit;
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

/// A text within a comment of XML, where two hyphens may not follow each other.
std::string in_comment(const std::string& text) {
  std::string clean;
  for (const char c : text) {
    if (c == '-' && !clean.empty() && clean.back() == '-') clean += ' ';
    clean += c;
  }
  return clean;
}

/// The actuators of both simulators have their gains at all times, and no filter.
void add_what_servos_lack(const std::vector<DriveLog>& logs, WrittenDrive& written) {
  if (has_passive_run(logs) && !logs.front().brakes_when_off)
    written.not_expressed.emplace_back(logs.front().kind == CommandKind::goal_to_duty
                                           ? "the open winding without power: damping remains"
                                           : "motions without power");
  if (logs.front().speed_filter_rad_s > 0.0)
    written.not_expressed.emplace_back("the low-pass of the law's speed");
}

std::string mjcf_joint(const DriveLog& log, const Refitted& fit, const ServoGains& gains,
                       const std::string& name) {
  using enum DriveParameter;
  const double back_emf_Nms_rad =
      log.kind == CommandKind::goal_to_duty ? gains.damping_Nms_rad : 0.0;
  return fmt::format(
      "<joint name=\"{}\" type=\"hinge\" axis=\"0 1 0\" armature=\"{:.9g}\" damping=\"{:.9g}\" "
      "frictionloss=\"{:.9g}\"/>",
      name, at(fit.values, armature), at(fit.values, viscous) + back_emf_Nms_rad,
      at(fit.values, coulomb));
}

/// What moves: the load on the motor's joint, or on a spring between them.
std::string mjcf_body(const DriveLog& log, const Refitted& fit, const std::string& joint,
                      const std::string& actuator) {
  using enum DriveParameter;
  JointLoad load = log.load.load;
  load.inertia_kg_m2 += at(fit.values, joint_inertia);
  const std::string inertial = load_body(load, load.zero_rad + at(fit.values, zero));
  if (!has(fit.terms, DriveTerm::spring))
    return fmt::format("      {}\n      {}\n", joint, inertial);
  return fmt::format(
      "      {}\n      <inertial pos=\"0 0 0\" mass=\"1e-6\" diaginertia=\"1e-9 1e-9 1e-9\"/>\n"
      "      <body name=\"{}_load\">\n        <joint name=\"{}_spring\" type=\"hinge\" axis=\"0 1 "
      "0\" "
      "stiffness=\"{:.9g}\" damping=\"{:.9g}\"/>\n        {}\n      </body>\n",
      joint, actuator, actuator, at(fit.values, stiffness), at(fit.values, spring_damping),
      inertial);
}

constexpr double kNoLimit_Nm = 1e8;  // a sheet without a limit has a larger one

std::string mjcf_actuator(const DriveLog& log, const ServoGains& gains, const std::string& joint,
                          const std::string& actuator) {
  const double law_damping_Nms_rad =
      log.kind == CommandKind::goal_to_torque ? gains.damping_Nms_rad : 0.0;
  const std::string limit = gains.limit_Nm < kNoLimit_Nm
                                ? fmt::format(R"( forcelimited="true" forcerange="{:.9g} {:.9g}")",
                                              -gains.limit_Nm, gains.limit_Nm)
                                : std::string();
  return fmt::format(
      "<general name=\"{}\" joint=\"{}\" biastype=\"affine\" gainprm=\"{:.9g}\" "
      "biasprm=\"0 {:.9g} {:.9g}\"{}/>",
      actuator, joint, gains.stiffness_Nm_rad, -gains.stiffness_Nm_rad, -law_damping_Nms_rad,
      limit);
}

WrittenDrive write_mjcf(const DriveIdentification& identified, const std::vector<DriveLog>& logs,
                        const std::string& actuator, const IdentifyOptions& options) {
  const DriveLog& log = logs.front();
  // The hinge of the load turns against the motor, so that it cannot have the friction of the joint's bearing.
  const DriveTerms kept =
      drive_terms({DriveTerm::base, DriveTerm::spring, DriveTerm::joint_inertia});
  const Refitted fit =
      refitted(identified, logs, kept, 0.002, DriveIntegrator::implicit_damping, options);
  const ServoGains gains = servo_gains(log, fit.values);
  WrittenDrive written{.text = {},
                       .mae_rad = fit.mae_rad,
                       .own_mae_rad = identified.mae_rad,
                       .model = {},
                       .not_expressed = other_terms(identified.terms, kept)};
  add_what_servos_lack(logs, written);
  const std::string joint = actuator + (has(fit.terms, DriveTerm::spring) ? "_motor" : "_joint");
  written.text = fmt::format(
      "<!-- Written by torsio identify for the load and the gain of {}. Refitted at this time "
      "step: mean |error| {:.5f} rad in free runs, {:.5f} rad in torsio's equations.\n"
      "     Not expressed: {}. -->\n"
      "<mujoco model=\"{}\">\n"
      "  <option timestep=\"{:.9g}\" integrator=\"Euler\" gravity=\"0 0 -{}\"/>\n"
      "  <worldbody>\n    <body name=\"{}_motor\">\n{}    </body>\n  </worldbody>\n"
      "  <actuator>\n    {}\n  </actuator>\n</mujoco>\n",
      in_comment(log.name), written.mae_rad, written.own_mae_rad,
      joined_terms(written.not_expressed), actuator, fit.step_s, kLoadGravity_m_s2, actuator,
      mjcf_body(log, fit, mjcf_joint(log, fit, gains, joint), actuator),
      mjcf_actuator(log, gains, joint, actuator));
  return written;
}

/// A configuration of Isaac Lab and the lines that only it has.
struct LabActuator {
  std::string_view configuration;
  std::string lines;
};

/// DCMotorCfg has the limit of the supply and needs its speed, DelayedPDActuatorCfg has the delay, and none has both.
LabActuator lab_actuator(const DriveLog& log, const Refitted& fit, const ServoGains& gains) {
  using enum DriveParameter;
  const auto delay_steps = std::lround(at(fit.values, delay) / fit.step_s);
  if (delay_steps > 0)
    return {"DelayedPDActuatorCfg",
            fmt::format("    min_delay={0},\n    max_delay={0},\n", delay_steps)};
  if (has(fit.terms, DriveTerm::speed_limit))
    return {"DCMotorCfg", fmt::format("    saturation_effort={:.9g},\n    velocity_limit={:.9g},\n",
                                      at(fit.values, stall_torque), at(fit.values, no_load_speed))};
  if (log.kind == CommandKind::goal_to_duty)
    return {"DCMotorCfg", fmt::format("    saturation_effort={:.9g},\n    velocity_limit={:.9g},\n",
                                      gains.limit_Nm,
                                      log.supply_V * log.limit / at(fit.values, torque_constant))};
  return {"IdealPDActuatorCfg", {}};
}

WrittenDrive write_isaaclab(const DriveIdentification& identified,
                            const std::vector<DriveLog>& logs, const std::string& actuator,
                            const IdentifyOptions& options) {
  using enum DriveParameter;
  const DriveLog& log = logs.front();
  const DriveTerms kept = has(identified.terms, DriveTerm::speed_limit)
                              ? drive_terms({DriveTerm::base, DriveTerm::speed_limit})
                              : drive_terms({DriveTerm::base, DriveTerm::delay});
  Refitted fit =
      refitted(identified, logs, kept, 0.005, DriveIntegrator::semi_implicit_euler, options);
  if (at(fit.values, delay) < 0.0 || has(kept, DriveTerm::speed_limit)) at(fit.values, delay) = 0.0;
  // The file has whole steps.
  at(fit.values, delay) = fit.step_s * std::round(at(fit.values, delay) / fit.step_s);
  fit.mae_rad =
      score_drive(drive_problem(pointers_to(logs), fit.terms, fit.options), fit.values).mae_rad;
  const ServoGains gains = servo_gains(log, fit.values);
  WrittenDrive written{.text = {},
                       .mae_rad = fit.mae_rad,
                       .own_mae_rad = identified.mae_rad,
                       .model = {},
                       .not_expressed = other_terms(identified.terms, kept)};
  const LabActuator lab = lab_actuator(log, fit, gains);
  if (has(fit.terms, DriveTerm::delay) && lab.configuration != "DelayedPDActuatorCfg")
    written.not_expressed.emplace_back("a delay shorter than half a physics step");
  if (log.kind == CommandKind::goal_to_duty && lab.configuration != "DCMotorCfg")
    written.not_expressed.emplace_back("the limit of the supply at speed");
  add_what_servos_lack(logs, written);
  const std::string effort = gains.limit_Nm < kNoLimit_Nm
                                 ? fmt::format("    effort_limit={:.9g},\n", gains.limit_Nm)
                                 : std::string();
  written.text = fmt::format(
      "# Written by torsio identify; not run with Isaac Lab. Refitted at a physics step of {:.4g} "
      "s: mean |error| {:.5f} rad in free runs,\n"
      "# {:.5f} rad in torsio's equations. Not expressed: {}.\n"
      "from isaaclab.actuators import {}\n\n{} = {}(\n    joint_names_expr=[\"{}\"],\n{}{}"
      "    stiffness={:.9g},\n    damping={:.9g},\n    armature={:.9g},\n    friction={:.9g},\n"
      "    viscous_friction={:.9g},\n)\n",
      fit.step_s, written.mae_rad, written.own_mae_rad, joined_terms(written.not_expressed),
      lab.configuration, actuator, lab.configuration, actuator, lab.lines, effort,
      gains.stiffness_Nm_rad, gains.damping_Nms_rad, at(fit.values, armature),
      at(fit.values, coulomb), at(fit.values, viscous));
  return written;
}

}  // namespace

std::string_view name(DriveTarget target) { return kTargetNames[static_cast<std::size_t>(target)]; }

DriveTarget drive_target(std::string_view text) {
  for (std::size_t k = 0; k < kTargetNames.size(); ++k)
    if (kTargetNames[k] == text) return static_cast<DriveTarget>(k);
  throw UsageError({.place = "the target (--write)",
                    .expected = "bam, mjcf or isaaclab",
                    .found = std::string(text)});
}

void require_writable(DriveTarget target, DriveLaw law, const std::string& name) {
  require_identifier(name);
  if (law == DriveLaw::position || (law == DriveLaw::pd && target != DriveTarget::bam)) return;
  throw UsageError(
      {.place = fmt::format("a file for {}", kTargetNames[static_cast<std::size_t>(target)]),
       .expected = target == DriveTarget::bam
                       ? "a drive of the law 'position', the only one that BAM has"
                       : "a drive of the law 'position' or 'pd'",
       .found = fmt::format("the law '{}'", torsio::name(law)),
       .advice = law == DriveLaw::pd ? "Write it for mjcf." : ""});
}

WrittenDrive write_drive(DriveTarget target, const DriveIdentification& identified,
                         const std::vector<Recording>& recordings, const std::string& name,
                         const IdentifyOptions& options) {
  require_writable(target, identified.drive.law, name);
  const std::vector<DriveLog> logs = grouped_logs(identified, recordings);
  if (target == DriveTarget::bam) return write_bam(identified, logs, name, options);
  if (target == DriveTarget::mjcf) return write_mjcf(identified, logs, name, options);
  return write_isaaclab(identified, logs, name, options);
}

std::vector<BamComparison> compare_with_bam(const DriveIdentification& identified,
                                            const std::vector<Recording>& recordings,
                                            const IdentifyOptions& options) {
  require_writable(DriveTarget::bam, identified.drive.law, "servo");
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
