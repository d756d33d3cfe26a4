#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/report_output.hpp"
#include "control/design/loop_design.hpp"
#include "core/quantity.hpp"
#include "report/html/loop_report.hpp"
#include "report/json_text.hpp"
#include "torsio/actuator/controller_file.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/deflection_controller.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr double kSpeedCutoff_Hz = 40.0;  // filter of the speed for the impedance's damping
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kContact_rad_s = kTurn;  // 1 Hz: contact with a person or a table

struct TuneFlags {
  std::string actuator = "dfki-120";
  std::string bandwidth = "7.96Hz";
  double damping = torsio::DeflectionController::Settings{}.damping;
  std::string observer;
  std::string rate = "1kHz";
  std::string load_inertia = "0kg_m2";
  std::string lowest;
  std::string highest;
  std::string load = "0Nm";
  std::string controller;
  bool overwrite = false;
  JsonOutput json;
  ReportOutput report;
};

/// Margins and passivity of a loop with these gains.
struct Tuned {
  double rate_Hz;
  torsio::DeflectionController controller;
  torsio::JointFeedback feedback;
  torsio::Margins locked;
  torsio::Margins free;
  torsio::Passivity passive;
  std::optional<double> observer_Hz;
  double passive_Nm_rad = 0.0;  ///< stiffest impedance, passive up to `kContact_rad_s`
};

/// @throws torsio::UsageError if it is negative.
double not_negative(const std::string& text, const char* unit, const char* flag) {
  const double value = torsio::signed_quantity_with_unit(text, unit, flag);
  if (value >= 0.0) return value;
  throw torsio::UsageError({.place = flag, .expected = "0 or more", .found = text});
}

Tuned tuned(const TuneFlags& flags) {
  using torsio::JointOutput;
  torsio::DeflectionController::Settings settings{
      .joint = torsio::series_elastic_joint(torsio::find_data_sheet(flags.actuator)),
      .bandwidth_rad_s = angular_frequency_rad_s(flags.bandwidth, "--bandwidth"),
      .damping = above_zero(flags.damping, "--damping")};
  settings.joint.joint_inertia_kg_m2 += not_negative(flags.load_inertia, "kg_m2", "--load-inertia");
  torsio::TorqueLoopCore::Settings loop{.deflection = settings};
  if (!flags.observer.empty())
    loop.observer_cutoff_Hz = above_zero(
        torsio::signed_quantity_with_unit(flags.observer, "Hz", "--observer"), "--observer");
  const double rate_Hz =
      above_zero(torsio::signed_quantity_with_unit(flags.rate, "Hz", "--rate"), "--rate");
  const torsio::TorqueLoopCore core(loop, rate_Hz);
  const torsio::DeflectionController& controller = core.deflection();
  return {.rate_Hz = rate_Hz,
          .controller = controller,
          .feedback = core.feedback(),
          .locked = core.margins_of(JointOutput::locked),
          .free = core.margins_of(JointOutput::free),
          .passive = torsio::passivity(settings.joint, core.feedback()),
          .observer_Hz = loop.observer_cutoff_Hz,
          .passive_Nm_rad =
              torsio::passive_stiffness(controller, 0.0, kContact_rad_s, kSpeedCutoff_Hz)};
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("none");
}

std::string passivity_text(const torsio::Passivity& passive, double rate_Hz) {
  if (passive.passive_to_rad_s >= std::numbers::pi * rate_Hz)
    return "passive at every frequency: stable in contact with any passive environment\n";
  const std::string below =
      passive.passive_to_rad_s > 0.0
          ? fmt::format(
                "passive up to {:.4g} Hz: contact with a passive environment cannot excite "
                "a slower oscillation;\n",
                passive.passive_to_rad_s / kTurn)
          : std::string("not passive, even at low frequencies;\n");
  return below + fmt::format(
                     "least real part of the impedance {:.3g} Nms/rad at {:.4g} Hz: unstable in "
                     "contact with some\nenvironments, not with all\n",
                     passive.least_Nms_rad, passive.least_rad_s / kTurn);
}

std::string text_of(const TuneFlags& flags, const Tuned& loop) {
  const torsio::DeflectionController::Settings& settings = loop.controller.settings();
  const torsio::Pid::Gains& gains = loop.controller.gains();
  const torsio::SeriesElasticJoint& joint = settings.joint;
  torsio::TextTable of_gains;
  of_gains.header({"gain", "value", "unit"});
  of_gains.row({"proportional", number(gains.proportional), "A/rad"});
  of_gains.row({"integral", number(gains.integral), "A/(rad s)"});
  of_gains.row({"derivative", number(gains.derivative), "A s/rad"});
  of_gains.row(
      {"feed_forward", number(joint.stiffness_Nm_rad / joint.drive.torque_per_current()), "A/rad"});
  torsio::TextTable table;
  table.header({"output", "phase margin deg", "at Hz", "gain margin", "at Hz", "least gain"});
  const auto row = [&](const char* output, const torsio::Margins& of) {
    table.row({output, number(torsio::deg_from_rad(of.phase_rad)),
               number(of.crossover_rad_s / kTurn), number(of.gain), number(of.gain_rad_s / kTurn),
               number(of.least_gain)});
  };
  row("locked", loop.locked);
  row("free", loop.free);
  return fmt::format(
      "{}: deflection control on the current at {} Hz, bandwidth {:.4g} Hz, damping {:.3g}\n"
      "-3 dB from wanted to actual deflection at {:.4g} Hz with the output locked\n"
      "spring {:.4g} Nm/rad, drive {:.4g} kg m2 at the joint, {:.4g} Nm/A, derivative filtered at "
      "{:g} Hz\n{}\nstable for any gain between the least and the margin:\n{}\n{}"
      "an impedance on it{} is passive up to {:.3g} Hz with at most {} Nm/rad\n",
      flags.actuator, loop.rate_Hz, settings.bandwidth_rad_s / kTurn, settings.damping,
      loop.controller.cutoff_rad_s() / kTurn, joint.stiffness_Nm_rad, joint.drive.inertia(),
      joint.drive.torque_per_current(), settings.rate_cutoff_Hz, of_gains.text(), table.text(),
      passivity_text(loop.passive, loop.rate_Hz), loop.observer_Hz ? ", without the observer," : "",
      kContact_rad_s / kTurn, number(loop.passive_Nm_rad));
}

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json margins_json(const char* output, const torsio::Margins& of) {
  return {{"output", output},
          {"is_stable", of.is_stable},
          {"phase_deg", finite(torsio::deg_from_rad(of.phase_rad))},
          {"crossover_Hz", of.crossover_rad_s / kTurn},
          {"gain", finite(of.gain)},
          {"gain_Hz", of.gain_rad_s / kTurn},
          {"least_gain", of.least_gain}};
}

Json json_of(const TuneFlags& flags, const Tuned& loop) {
  const torsio::DeflectionController::Settings& settings = loop.controller.settings();
  const torsio::Pid::Gains& gains = loop.controller.gains();
  return {{"actuator", flags.actuator},
          {"sample_rate_Hz", loop.rate_Hz},
          {"bandwidth_Hz", settings.bandwidth_rad_s / kTurn},
          {"damping", settings.damping},
          {"cutoff_Hz", loop.controller.cutoff_rad_s() / kTurn},
          {"observer_Hz", loop.observer_Hz ? Json(*loop.observer_Hz) : Json(nullptr)},
          {"gains",
           {{"proportional_A_rad", gains.proportional},
            {"integral_A_rad_s", gains.integral},
            {"derivative_As_rad", gains.derivative},
            {"feed_forward_A_rad",
             settings.joint.stiffness_Nm_rad / settings.joint.drive.torque_per_current()}}},
          {"margins",
           Json::array({margins_json("locked", loop.locked), margins_json("free", loop.free)})},
          {"passivity",
           {{"passive_to_Hz", loop.passive.passive_to_rad_s / kTurn},
            {"least_Nms_rad", loop.passive.least_Nms_rad},
            {"least_Hz", loop.passive.least_rad_s / kTurn},
            {"stiffness_Nm_rad", loop.passive_Nm_rad},
            {"stiffness_passive_to_Hz", kContact_rad_s / kTurn}}}};
}

/// The controller of these gains, within the ratings of the actuator: friction and torque error up to a twentieth of the
/// rated torque, loads up to three fifths of it.
torsio::ControllerFile controller_of(const TuneFlags& flags, const Tuned& loop) {
  constexpr double kUnmeasuredShare = 0.05;
  constexpr double kMeasuredShare = 0.6;
  const torsio::DataSheet sheet = torsio::find_data_sheet(flags.actuator);
  const torsio::Drive& drive = loop.controller.settings().joint.drive;
  const double rated_Nm = drive.rated_current_A * drive.torque_per_current();
  torsio::ControllerFile file{
      .actuator = flags.actuator,
      .sample_rate_Hz = loop.rate_Hz,
      .settings = {.torque = {.deflection = loop.controller.settings(),
                              .observer_cutoff_Hz = loop.observer_Hz},
                   .limits = {.speed_rad_s = torsio::speed_limit_of(sheet),
                              .max_unmeasured_load_Nm = kUnmeasuredShare * rated_Nm,
                              .max_measured_load_Nm = kMeasuredShare * rated_Nm}},
      .stop = torsio::joint_stop_settings(sheet, not_negative(flags.load, "Nm", "--load"))};
  torsio::JointCascade::Limits& limits = file.settings.limits;
  if (!flags.lowest.empty())
    limits.lowest_rad = torsio::signed_quantity_with_unit(flags.lowest, "rad", "--lowest-angle");
  if (!flags.highest.empty())
    limits.highest_rad = torsio::signed_quantity_with_unit(flags.highest, "rad", "--highest-angle");
  return file;
}

void write_controller(const TuneFlags& flags, const Tuned& loop) {
  require_writable(flags.controller);
  if (!flags.overwrite && std::filesystem::exists(flags.controller))
    throw torsio::UsageError({.place = flags.controller,
                              .problem = "the file exists",
                              .advice = "Take another name, or replace it with --overwrite."});
  write_text(flags.controller, torsio::controller_yaml(controller_of(flags, loop)));
  if (flags.json.wants_tables()) print(fmt::format("{} written\n", flags.controller));
}

torsio::ReportDocument report_of(const TuneFlags& flags, const Tuned& loop) {
  using torsio::JointOutput;
  const torsio::SeriesElasticJoint& joint = loop.controller.settings().joint;
  const std::vector<torsio::DrawnLoop> loops = {
      {"output locked", torsio::open_loop(joint, loop.feedback, JointOutput::locked)},
      {"output free", torsio::open_loop(joint, loop.feedback, JointOutput::free)}};
  torsio::ReportDocument document = torsio::text_report(
      "Torque loop of " + flags.actuator,
      {fmt::format("The loop with the gains for {:.4g} Hz has a phase margin of {} deg with the "
                   "output locked and of {} deg with the output free.",
                   loop.controller.settings().bandwidth_rad_s / kTurn,
                   number(torsio::deg_from_rad(loop.locked.phase_rad)),
                   number(torsio::deg_from_rad(loop.free.phase_rad))),
       "The margins are those of the data sheet's joint; a real one differs."},
      text_of(flags, loop));
  document.sections.insert(document.sections.begin(), torsio::loop_section(loops));
  return document;
}

void run(const TuneFlags& flags) {
  DataFlags().check_outputs({flags.json.destination, flags.report.destination, flags.report.plot});
  const Tuned loop = tuned(flags);
  if (flags.json.wants_tables()) print(text_of(flags, loop));
  flags.json.write(torsio::json_text(json_of(flags, loop)));
  if (!flags.controller.empty()) write_controller(flags, loop);
  if (flags.report.is_wanted()) flags.report.write(report_of(flags, loop));
}

}  // namespace

void add_tune_loop(CLI::App& app) {
  auto flags = std::make_shared<TuneFlags>();
  CLI::App* verb = app.add_subcommand(
      "tune-loop",
      "compute the gains of a torque loop for a bandwidth, with their stability margins");
  verb->footer(
      "Example: torsio tune-loop --actuator dfki-120 --bandwidth 8Hz --damping 0.9\n"
      "From the data sheet: spring, drive, current loop, delay of one sample; without dry "
      "friction.\n"
      "Unstable gains are refused; the message gives the margin. torsio track closes the loop.");
  verb->add_option("--actuator", flags->actuator,
                   "torsio simulate --list shows the names; or a data sheet, FILE.yaml")
      ->capture_default_str();
  verb->add_option("--bandwidth", flags->bandwidth,
                   "natural frequency of the closed loop, in Hz or rad_s")
      ->capture_default_str();
  verb->add_option("--damping", flags->damping, "damping of the closed loop")
      ->capture_default_str();
  verb->add_option("--observer", flags->observer,
                   "add a disturbance observer with this cut-off: 8Hz");
  verb->add_option("--rate", flags->rate, "sample rate of the loop")->capture_default_str();
  verb->add_option("--load-inertia", flags->load_inertia,
                   "inertia on the joint side for the free output: 0.15kgm2")
      ->capture_default_str();
  verb->add_option(
      "-o,--output", flags->controller,
      "write the controller with its limits to FILE.yaml, for torsio export --controller");
  verb->add_option("--lowest-angle", flags->lowest,
                   "limit of the motion in that file, such as -90deg; default: none");
  verb->add_option("--highest-angle", flags->highest, "the same upwards");
  verb->add_option("--load", flags->load,
                   "largest torque that pulls at the joint at rest, for the stop in that file")
      ->capture_default_str();
  verb->add_flag("--overwrite", flags->overwrite, "replace the file if it exists");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb, "magnitude");
  verb->callback([flags] { run(*flags); });
}
