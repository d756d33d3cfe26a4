#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "report/html/arm_figures.hpp"
#include "report/json_text.hpp"
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
  std::string arm = kReadyArm;
  std::string program;
  std::string output;
  std::string folder;
  std::vector<std::string> faults;
  std::string payload;
  std::string tilt;
  std::uint64_t seed = kDefaultSeed;
  bool has_rigid_gears = false;
  bool with_truth = false;
  bool is_described = false;
  JsonOutput json;
  ReportOutput report;
};

torsio::ArmSetup setup_of(const ArmFlags& flags, const torsio::Progress& progress) {
  torsio::ArmSetup setup = arm_of(flags.arm, progress);
  if (!flags.tilt.empty())
    setup.arm.gravity_m_s2 =
        torsio::tilted_gravity(torsio::si_quantity(flags.tilt, "rad", "--tilt"));
  if (!flags.payload.empty()) {
    // The centre of mass stays; the inertia is that of a body of the same shape.
    const double mass_kg = torsio::si_quantity(flags.payload, "kg", "--payload");
    torsio::BodyInertia& payload = setup.arm.payload;
    const double scale = payload.mass_kg > 0.0 ? mass_kg / payload.mass_kg : 0.0;
    for (double& moment : payload.inertia_kg_m2) moment *= scale;
    payload.mass_kg = mass_kg;
  }
  torsio::require_carriable(setup,
                            flags.payload.empty() ? flags.arm : "--payload " + flags.payload);
  return setup;
}

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
    table.row({joint.name, torsio::full_name(of.sheet), of.model.empty() ? "linear" : of.model,
               fmt::format("{:.0f} to {:.0f}", torsio::deg_from_rad(joint.lowest_rad),
                           torsio::deg_from_rad(joint.highest_rad)),
               fmt::format("{:.0f}", torsio::deg_from_rad(joint.speed_rad_s)),
               fmt::format("{:.1f}", weight_Nm[j]),
               fmt::format("{:.0f}", 100.0 * weight_Nm[j] / of.sheet.rating.torque_Nm.value)});
  }
  return fmt::format(
      "{}: {} joints, a payload of {:.3g} kg\n{}weight: the largest torque of gravity in any "
      "pose\n",
      setup.arm.name, setup.joints.size(), setup.arm.payload.mass_kg, table.text());
}

std::string stop_text(const torsio::ArmRun& run) {
  if (run.cause == torsio::ArmStopCause::none) return "The program was carried out to its end.";
  return fmt::format("The arm stopped at {:.3f} s: {} in {}; {}, the flange moved by {:.1f} mm.",
                     run.stopped_s, torsio::name(run.cause), run.stopped_joint,
                     run.at_rest_s ? fmt::format("at rest after {:.2f} s", *run.at_rest_s)
                                   : std::string("not at rest"),
                     1e3 * run.largest_drop_m);
}

std::string score_text(const torsio::ArmRun& run) {
  return torsio::arm_scores(run).text() +
         "position, torque, external torque: RMSE to the truth; the position of the links in moves "
         "and holds\n";
}

Json run_json(const ArmFlags& flags, const torsio::ArmRun& run) {
  Json document{
      {"arm", flags.arm},
      {"program", flags.program},
      {"seed", flags.seed},
      {"gear_stage", !flags.has_rigid_gears},
      {"duration_s", run.duration_s},
      {"stop", torsio::name(run.cause)},
      {"stopped_joint", run.stopped_joint.empty() ? Json(nullptr) : Json(run.stopped_joint)},
      {"stopped_s", run.cause == torsio::ArmStopCause::none ? Json(nullptr) : Json(run.stopped_s)},
      {"at_rest_after_s", run.at_rest_s ? Json(*run.at_rest_s) : Json(nullptr)},
      {"flange_moved_m", run.largest_drop_m},
      {"recording", flags.output},
      {"joints", Json::array()}};
  for (const torsio::ArmJointScore& score : run.scores)
    document["joints"].push_back(
        {{"joint", score.joint},
         {"actuator", score.actuator},
         {"position_rmse_rad",
          score.position_rmse_rad ? Json(*score.position_rmse_rad) : Json(nullptr)},
         {"torque_rmse_Nm", score.torque_rmse_Nm},
         {"external_torque_rmse_Nm", score.external_rmse_Nm},
         {"largest_torque_Nm", score.largest_torque_Nm},
         {"largest_share", score.largest_share},
         {"limited_s", score.limited_s}});
  return document;
}

void write_joints(const ArmFlags& flags, const torsio::ArmRun& run,
                  const torsio::Progress& progress) {
  std::error_code error;
  std::filesystem::create_directories(flags.folder, error);
  if (error)
    throw torsio::Error(
        {.place = flags.folder, .problem = "the folder cannot be made: " + error.message()});
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    const std::string path =
        (std::filesystem::path(flags.folder) / fmt::format("joint{}.csv", j + 1)).string();
    torsio::write_recording(run.joints[j], path, progress);
  }
  remark(fmt::format("{}: joint1.csv to joint{}.csv, for check, fit and evaluate", flags.folder,
                     run.joints.size()));
}

void run(const ArmFlags& flags) {
  DataFlags().check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {flags.arm == kReadyArm ? std::string() : flags.arm, flags.program});
  ProgressBar progress;
  const torsio::ArmSetup setup = setup_of(flags, progress.listener());
  if (flags.is_described) return print(description(setup));
  if (flags.program.empty() && flags.arm != kReadyArm)
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
      .seed = flags.seed,
      .has_gear_stage = !flags.has_rigid_gears,
      .with_truth = flags.with_truth};
  const torsio::ArmRun done = torsio::run_arm(setup, spec, progress.listener());
  if (!flags.output.empty()) {
    torsio::write_recording(done.record, flags.output, progress.listener());
    remark(fmt::format("{}: {} samples at {:g} Hz", flags.output, done.record.size(),
                       done.record.sample_rate_Hz()));
  }
  if (!flags.folder.empty()) write_joints(flags, done, progress.listener());
  if (flags.json.wants_tables()) print(score_text(done) + stop_text(done) + "\n");
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
  verb->add_option(
          "ARM", flags->arm,
          "arm6, the arm of six joints of paper 000, or your own: FILE.yaml, which names a "
          "URDF file and the actuator of each joint")
      ->capture_default_str();
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
  verb->add_option("--payload", flags->payload, "mass in place of that of the arm's file: 3kg");
  verb->add_option("--tilt", flags->tilt, "tilt of the base about its y axis: 30deg");
  add_seed(*verb, flags->seed, "seed of the sensors' noise");
  verb->add_flag(
      "--rigid-gears", flags->has_rigid_gears,
      "rotor and gear output turn together: faster, without the elasticity of the gears");
  verb->add_flag("--truth", flags->with_truth, "add the truth_ channels, which no sensor measures");
  verb->add_flag("--describe", flags->is_described,
                 "show the joints, their actuators and the largest torques of gravity");
  verb->add_option("--json", flags->json.destination,
                   "write the result as JSON to a file, or - for standard output");
  flags->report.add(*verb);
  add_arm_calibrate(*verb);
  add_arm_excite(*verb);
  add_arm_identify(*verb);
  verb->callback([flags, verb] {
    if (verb->get_subcommands().empty()) run(*flags);
  });
}
