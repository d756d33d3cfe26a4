#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "arm/arm_source.hpp"
#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "report/html/arm_figures.hpp"
#include "report/json_text.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/write.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;

struct ArmFlags {
  ArmSource source;
  std::string program;
  std::string contacts;
  std::string output;
  std::string folder;
  std::vector<std::string> faults;
  std::uint64_t seed = kDefaultSeed;
  bool has_rigid_gears = false;
  bool with_truth = false;
  bool is_described = false;
  JsonOutput json;
  ReportOutput report;
};

/// JOINT:WHAT=AMOUNT@TIME, for each joint the faults of it.
std::vector<torsio::FaultSchedule> faults_of(const ArmFlags& flags, const torsio::ArmSetup& setup) {
  std::vector<torsio::FaultSchedule> schedules;
  if (flags.faults.empty()) return schedules;
  schedules.resize(setup.joints.size());
  for (const std::string& text : flags.faults) {
    const std::size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    const auto joint = std::ranges::find(setup.arm.joints, name, &torsio::ArmJoint::name);
    if (colon == std::string::npos || joint == setup.arm.joints.end()) {
      std::vector<std::string> names;
      for (const torsio::ArmJoint& of : setup.arm.joints) names.push_back(of.name);
      throw torsio::UsageError({.place = "--fault " + text,
                                .expected = fmt::format("JOINT:WHAT=AMOUNT@TIME, JOINT one of {}",
                                                        fmt::join(names, ", ")),
                                .found = fmt::format("'{}'", name),
                                .advice = "For example --fault joint2:gear_angle=freeze@3s"});
    }
    const auto j = static_cast<std::size_t>(joint - setup.arm.joints.begin());
    schedules[j].faults.push_back(
        torsio::parse_injection(text.substr(colon + 1), setup.joints[j].sheet));
  }
  return schedules;
}

std::string description(const torsio::ArmSetup& setup) {
  torsio::TextTable table;
  table.header({"joint", "actuator", "model", "limits [deg]", "speed [deg/s]", "weight [Nm]",
                "of the rating [%]"});
  const std::vector<double> weight_Nm = torsio::largest_gravity_torques(setup.arm);
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    const torsio::ArmJoint& joint = setup.arm.joints[j];
    const torsio::ArmJointSetup& of = setup.joints[j];
    table.row({joint.name, torsio::full_name(of.sheet),
               (of.model.empty() ? "linear" : of.model) +
                   (of.monitor.empty() ? std::string() : ", " + of.monitor),
               fmt::format("{:.0f} to {:.0f}", torsio::deg_from_rad(joint.lowest_rad),
                           torsio::deg_from_rad(joint.highest_rad)),
               fmt::format("{:.0f}", torsio::deg_from_rad(joint.speed_rad_s)),
               fmt::format("{:.1f}", weight_Nm[j]),
               fmt::format("{:.0f}", 100.0 * weight_Nm[j] / of.sheet.rating.torque_Nm.value)});
  }
  const torsio::Vector3& gravity = setup.arm.gravity_m_s2;
  const double tilt_deg =
      torsio::deg_from_rad(std::atan2(std::hypot(gravity[0], gravity[1]), -gravity[2]));
  return fmt::format(
      "{}: {} joints, a payload of {:.3g} kg{}\n{}weight: the largest torque of gravity in any "
      "pose\n",
      setup.arm.name, setup.joints.size(), setup.arm.payload.mass_kg,
      tilt_deg > 0.0 ? fmt::format(", the base tilted by {:.4g} deg", tilt_deg) : std::string(),
      table.text());
}

std::string stop_text(const torsio::ArmRun& run) {
  if (run.cause == torsio::ArmStopCause::none && run.refused_s > 0.0)
    return fmt::format(
        "The program ended, but was not carried out: from {:.3f} s on its reference was refused "
        "for {:.2f} s, since it began too far from the measured angles, and the arm held.",
        run.refused_from_s, run.refused_s);
  if (run.cause == torsio::ArmStopCause::none && !run.contacts.empty() &&
      run.contacts.back().reaction != torsio::ContactReaction::none)
    return fmt::format("The reaction to a contact ended the program: {}.",
                       torsio::name(run.contacts.back().reaction));
  if (run.cause == torsio::ArmStopCause::none) return "The program was carried out to its end.";
  const std::string cause(torsio::name(run.cause));
  return fmt::format(
      "The arm stopped at {:.3f} s: {} in {}; {}, the flange moved by {:.1f} mm.", run.stopped_s,
      run.stop_reason == cause ? cause : cause + " (" + run.stop_reason + ")", run.stopped_joint,
      run.at_rest_s ? fmt::format("at rest after {:.2f} s", *run.at_rest_s)
                    : std::string("not at rest"),
      1e3 * run.largest_drop_m);
}

std::optional<torsio::ContactDetector::Settings> contacts_of(const ArmFlags& flags,
                                                             const torsio::ArmSetup& setup) {
  if (flags.contacts.empty()) return {};
  const torsio::ContactsFile file = torsio::read_contacts(flags.contacts);
  torsio::require_contacts_of(file, setup.arm, torsio::MomentumObserver::Settings().bandwidth_rad_s,
                              flags.contacts);
  return file.settings();
}

/// One line for each contact, and the forces of a plate.
std::string contact_text(const torsio::ArmRun& run) {
  std::string text;
  for (const torsio::ArmContact& contact : run.contacts)
    text += fmt::format(
        "Contact at {:.3f} s in {}, {}; reaction: {}.\n", contact.found_s, contact.joint,
        contact.latency_s ? fmt::format("{:.0f} ms after it began", 1e3 * *contact.latency_s)
                          : std::string("a false alarm"),
        torsio::name(contact.reaction));
  if (!run.impact) return text;
  const torsio::ArmImpact& impact = *run.impact;
  const auto force = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.0f} N", *value) : std::string("not reached");
  };
  return text + fmt::format(
                    "Plate touched at {:.3f} s: first peak {:.0f} N, largest {:.0f} N after "
                    "{:.0f} ms, largest later than 80 ms {}, after 0.5 s {}.\n",
                    impact.touched_s, impact.first_peak_N, impact.peak_N, 1e3 * impact.peak_after_s,
                    force(impact.largest_late_N), force(impact.rest_N));
}

std::string score_text(const torsio::ArmRun& run) {
  return torsio::arm_scores(run).text() +
         "position, torque, external torque: RMSE to the truth; the position of the links in moves "
         "and holds\n";
}

Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json plate_json(const torsio::ArmRun& run) {
  if (!run.impact) return nullptr;
  const torsio::ArmImpact& impact = *run.impact;
  return {{"touched_s", impact.touched_s},
          {"first_peak_N", impact.first_peak_N},
          {"peak_N", impact.peak_N},
          {"peak_after_s", impact.peak_after_s},
          {"largest_after_80_ms_N", number_or_null(impact.largest_late_N)},
          {"after_500_ms_N", number_or_null(impact.rest_N)}};
}

Json run_json(const ArmFlags& flags, const torsio::ArmRun& run) {
  Json document{
      {"arm", flags.source.arm},
      {"program", flags.program},
      {"seed", flags.seed},
      {"gear_stage", !flags.has_rigid_gears},
      {"duration_s", run.duration_s},
      {"stop", torsio::name(run.cause)},
      {"stopped_joint", run.stopped_joint.empty() ? Json(nullptr) : Json(run.stopped_joint)},
      {"stop_reason", run.stop_reason.empty() ? Json(nullptr) : Json(run.stop_reason)},
      {"stopped_s", run.cause == torsio::ArmStopCause::none ? Json(nullptr) : Json(run.stopped_s)},
      {"at_rest_after_s", run.at_rest_s ? Json(*run.at_rest_s) : Json(nullptr)},
      {"flange_moved_m", run.largest_drop_m},
      {"reference_refused_s", run.refused_s},
      {"recording", flags.output},
      {"contacts", Json::array()},
      {"plate", plate_json(run)},
      {"joints", Json::array()}};
  for (const torsio::ArmContact& contact : run.contacts)
    document["contacts"].push_back({{"found_s", contact.found_s},
                                    {"joint", contact.joint},
                                    {"reaction", torsio::name(contact.reaction)},
                                    {"latency_s", number_or_null(contact.latency_s)}});
  for (const torsio::ArmJointScore& score : run.scores)
    document["joints"].push_back(
        {{"joint", score.joint},
         {"actuator", score.actuator},
         {"position_rmse_rad", number_or_null(score.position_rmse_rad)},
         {"torque_rmse_Nm", number_or_null(score.torque_rmse_Nm)},
         {"external_torque_rmse_Nm", number_or_null(score.external_rmse_Nm)},
         {"largest_torque_Nm", score.largest_torque_Nm},
         {"largest_share", score.largest_share},
         {"limited_s", score.limited_s}});
  return document;
}

/// What the result does not show by itself.
void remark_on(const torsio::ArmRun& run, const torsio::ArmSetup& setup,
               std::span<const torsio::FaultSchedule> faults) {
  for (const torsio::ArmJointScore& score : run.scores)
    if (score.largest_share > 1.0)
      remark(
          fmt::format("warning: {} reached {:.0f} % of its rating; an actuator of this size cannot "
                      "do this for long",
                      score.joint, 100.0 * score.largest_share));
  if (run.cause != torsio::ArmStopCause::none) return;
  for (std::size_t j = 0; j < faults.size(); ++j)
    for (const torsio::ScheduledFault& fault : faults[j].faults)
      if (fault.start_s >= run.duration_s)
        remark(
            fmt::format("warning: the fault of {} at {:g} s is after the end of the program at "
                        "{:.3f} s",
                        setup.arm.joints[j].name, fault.start_s, run.duration_s));
}

std::string joint_file(const std::string& folder, std::size_t joint) {
  return (std::filesystem::path(folder) / fmt::format("joint{}.csv", joint + 1)).string();
}

/// No output replaces a file that the arm or the program names.
void check_all_outputs(const ArmFlags& flags, const torsio::ArmSetup& setup,
                       const torsio::ArmProgram& program) {
  std::vector<std::string> inputs = setup.files;
  inputs.insert(inputs.end(), program.files.begin(), program.files.end());
  std::vector<std::string> outputs = {flags.output, flags.json.destination,
                                      flags.report.destination, flags.report.plot};
  // In a new folder no file is replaced.
  if (std::filesystem::is_directory(flags.folder))
    for (std::size_t j = 0; j < setup.joints.size(); ++j)
      outputs.push_back(joint_file(flags.folder, j));
  DataFlags().check_outputs(outputs, inputs);
}

void write_joints(const ArmFlags& flags, const torsio::ArmRun& run,
                  const torsio::Progress& progress) {
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    torsio::write_recording(run.joints[j], joint_file(flags.folder, j), progress);
  }
  remark(fmt::format("{}: joint1.csv to joint{}.csv, for check, fit and evaluate", flags.folder,
                     run.joints.size()));
}

void run(const ArmFlags& flags) {
  DataFlags().check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {flags.source.arm == ArmSource::kReady ? std::string() : flags.source.arm, flags.program,
       flags.contacts});
  ProgressBar progress;
  const torsio::ArmSetup setup = flags.source.setup(progress.listener());
  if (flags.is_described) {
    static_cast<void>(torsio::arm_controller_settings(setup));  // opens the models and monitors
    return print(description(setup));
  }
  if (flags.program.empty() && flags.source.arm != ArmSource::kReady)
    throw torsio::UsageError(
        {.place = "torsio arm",
         .expected = "--program FILE.yaml, what your arm does",
         .found = "none",
         .advice = "docs/robot/arm.md has the format; arm6 has a program of its own."});
  const torsio::ArmRunSpec spec{
      .program = flags.program.empty()
                     ? torsio::arm6_program()
                     : torsio::read_arm_program(flags.program, setup, progress.listener()),
      .faults = faults_of(flags, setup),
      .contacts = contacts_of(flags, setup),
      .seed = flags.seed,
      .has_gear_stage = !flags.has_rigid_gears,
      .with_truth = flags.with_truth};
  check_all_outputs(flags, setup, spec.program);
  if (!flags.folder.empty()) make_folder(flags.folder);
  const torsio::ArmRun done = torsio::run_arm(setup, spec, progress.listener());
  remark_on(done, setup, spec.faults);
  if (!flags.output.empty()) {
    torsio::write_recording(done.record, flags.output, progress.listener());
    remark(fmt::format("{}: {} samples at {:g} Hz", flags.output, done.record.size(),
                       done.record.sample_rate_Hz()));
  }
  if (!flags.folder.empty()) write_joints(flags, done, progress.listener());
  if (flags.json.wants_tables())
    print(score_text(done) + contact_text(done) + stop_text(done) + "\n");
  flags.json.write(torsio::json_text(run_json(flags, done)));
  if (flags.report.is_wanted())
    flags.report.write(torsio::arm_report(setup, done, {stop_text(done)}));
}

}  // namespace

void add_arm(CLI::App& app) {
  auto flags = std::make_shared<ArmFlags>();
  CLI::App* verb = app.add_subcommand(
      "arm", "move a simulated arm of series-elastic joints and record all of them");
  verb->footer(
      "Example: torsio arm -o arm.csv --report arm.html\n"
      "         torsio arm my_arm.yaml --program moves.yaml --joints recordings/\n"
      "         torsio arm --fault joint2:joint_angle=nan@9s\n"
      "         torsio arm identify arm.csv\n"
      "docs/robot/arm.md has the format of arms and programs.");
  flags->source.add(*verb);
  verb->add_option("--program", flags->program,
                   "FILE.yaml with moves, holds, hand guiding, impedances and pushes (default for "
                   "arm6: some of each)");
  verb->add_option(
      "-o,--output", flags->output,
      fmt::format("recording of all joints on one clock; its ending names the format: {}",
                  torsio::kRecordingEndings));
  verb->add_option(
      "--joints", flags->folder,
      "folder for one recording per joint, joint1.csv and so on, with the channels of a "
      "bench");
  verb->add_option("--fault", flags->faults,
                   "JOINT:WHAT=AMOUNT@TIME, a fault of a sensor or part of one joint: "
                   "joint2:gear_angle=freeze@3s; may be repeated");
  verb->add_option("--contacts", flags->contacts,
                   "FILE.json of torsio arm learn-contacts: contacts are looked for, and the "
                   "program's reaction takes place");
  add_seed(*verb, flags->seed, "seed of the sensors' noise");
  verb->add_flag(
      "--rigid-gears", flags->has_rigid_gears,
      "rotor and gear output turn together: faster, without the elasticity of the gears");
  verb->add_flag("--truth", flags->with_truth, "add the truth_ channels, which no sensor measures");
  verb->add_flag("--describe", flags->is_described,
                 "show the joints, their actuators and the largest torques of gravity");
  flags->json.add(*verb, "the result");
  flags->report.add(*verb);
  add_arm_calibrate(*verb);
  add_arm_excite(*verb);
  add_arm_identify(*verb);
  add_learn_contacts(*verb);
  for (CLI::App* part : verb->get_subcommands({}))
    part->preparse_callback([verb, part](std::size_t) {
      if (verb->get_option("ARM")->count() == 0) return;
      throw torsio::UsageError(
          {.place = "torsio arm " + part->get_name(),
           .expected = "nothing between the two words",
           .found = "'" + verb->get_option("ARM")->results().front() + "'",
           .advice = "The arm follows them: torsio arm " + part->get_name() + " --help."});
    });
  verb->callback([flags, verb] {
    if (verb->get_subcommands().empty()) run(*flags);
  });
}
