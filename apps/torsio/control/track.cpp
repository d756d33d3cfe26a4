#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "control/track_impedance.hpp"
#include "core/quantity.hpp"
#include "report/html/loop_report.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/write.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "verbs.hpp"

namespace {

constexpr std::size_t kMaxSeeds = 100;

struct TrackFlags {
  std::string actuator = "dfki-120";
  std::string output = "locked";
  std::string reference = "chirp";
  std::string replayed;
  std::string amplitude;
  std::string duration;
  std::string lever;
  std::string bandwidth;
  double damping = torsio::TrackingSpec{}.damping;
  double friction = 0.0;
  std::string observer;
  bool feeds_rate_forward = false;
  std::string limits;
  std::string acts_on = "current";
  std::string velocity_bandwidth;
  bool has_damping = false;  ///< --damping was given
  std::vector<std::string> models;
  DataFlags data;  ///< options for the replayed recording
  std::string faults;
  std::string record;
  std::uint64_t seed = kDefaultSeed;
  std::size_t seeds = 1;
  ImpedanceFlags impedance;
  JsonOutput json;
  ReportOutput report;
};

/// A model file and its path.
struct NamedModel {
  std::string path;
  torsio::ModelFile file;
};

void check_replayed(const std::string& file, const torsio::TorqueReference& reference) {
  const auto gap = std::ranges::find_if_not(reference.recorded_Nm,
                                            [](double value) { return std::isfinite(value); });
  if (gap == reference.recorded_Nm.end()) return;
  const auto sample = static_cast<double>(gap - reference.recorded_Nm.begin());
  throw torsio::UsageError({.place = fmt::format("{}: torque_Nm {:g} s from its start", file,
                                                 sample / reference.recorded_Hz),
                            .expected = "a number: a replayed reference has no gaps",
                            .found = fmt::format("{}", *gap)});
}

/// The replayed recording is read with the mapping of the models, if they have one.
std::vector<torsio::DatasetRecord> replayed_records(const TrackFlags& flags,
                                                    const std::vector<NamedModel>& models,
                                                    const torsio::Progress& progress) {
  DataFlags data = flags.data;
  data.recordings = {flags.replayed};
  const NamedModel* mapped = nullptr;
  for (const NamedModel& model : models) {
    if (model.file.card.mapping.empty()) continue;
    if (mapped != nullptr && mapped->file.card.mapping != model.file.card.mapping &&
        data.mapping.empty())
      throw torsio::UsageError({.place = "--replay",
                                .problem = "the models were trained with different mappings",
                                .found = mapped->path + " and " + model.path,
                                .advice = "Give the mapping of the recording: --mapping FILE, or "
                                          "none."});
    mapped = &model;
  }
  if (mapped != nullptr)
    data.use_model_mapping(mapped->file.card.mapping, mapped->path);
  else
    data.use_model_mapping({}, {});
  return data.load_inputs({"torque_Nm"}, progress).records;
}

torsio::TorqueReference reference_of(const TrackFlags& flags, const std::vector<NamedModel>& models,
                                     const torsio::Progress& progress) {
  torsio::TorqueReference reference{.kind = torsio::find_reference(flags.reference)};
  const bool is_replay = reference.kind == torsio::TorqueReference::Kind::replay;
  if (is_replay == flags.replayed.empty())
    throw torsio::UsageError({.place = "--replay",
                              .expected = "a recording, with --reference replay",
                              .advice = "Give both or neither."});
  if (is_replay) {
    const std::vector<torsio::DatasetRecord> records = replayed_records(flags, models, progress);
    if (records.size() != 1)
      throw torsio::UsageError({.place = "--replay",
                                .expected = "one recording",
                                .found = fmt::format("{}", records.size())});
    const torsio::Recording& recording = records.front().recording;
    reference.recorded_Nm = recording.channel("torque_Nm").values;
    reference.recorded_Hz = recording.sample_rate_Hz();
    check_replayed(flags.replayed, reference);
  }
  if (!flags.amplitude.empty())
    reference.amplitude_Nm =
        torsio::signed_quantity_with_unit(flags.amplitude, "Nm", "--amplitude");
  if (!flags.duration.empty())
    reference.duration_s = torsio::signed_quantity_with_unit(flags.duration, "s", "--duration");
  return reference;
}

/// position=LOW..HIGH or position=HIGH (then LOW is its negative), speed=SPEED, in any order.
torsio::DriveLimits limits_of(const std::string& text) {
  torsio::DriveLimits limits;
  const auto refuse = [&](std::string problem) {
    throw torsio::UsageError({.place = "--limits",
                              .problem = std::move(problem),
                              .advice = "For example --limits position=-20deg..45deg,speed=1rad_s, "
                                        "or position=0.5rad for -0.5 to 0.5 rad."});
  };
  std::set<std::string> given;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::size_t first = std::min(text.find_first_not_of(' ', begin), end);
    const std::string part = text.substr(first, end - first);
    begin = end + 1;
    const std::size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    if (equals == std::string::npos || (name != "position" && name != "speed"))
      refuse("unknown limit '" + part + "'");
    if (!given.insert(name).second) refuse(name + " is given twice");
    const std::string value = part.substr(equals + 1);
    if (name == "speed") {
      limits.speed_rad_s = above_zero(
          torsio::signed_quantity_with_unit(value, "rad_s", "--limits speed"), "--limits speed");
    } else if (const std::size_t dots = value.find(".."); dots == std::string::npos) {
      limits.highest_rad =
          above_zero(torsio::signed_quantity_with_unit(value, "rad", "--limits position"),
                     "--limits position");
      limits.lowest_rad = -limits.highest_rad;
    } else {
      limits.lowest_rad =
          torsio::signed_quantity_with_unit(value.substr(0, dots), "rad", "--limits position");
      limits.highest_rad =
          torsio::signed_quantity_with_unit(value.substr(dots + 2), "rad", "--limits position");
      if (!(limits.lowest_rad < limits.highest_rad))
        refuse("position: the lower limit comes first, found '" + value + "'");
      if (!(limits.lowest_rad < 0.0 && limits.highest_rad > 0.0))
        refuse("position: the run starts at 0 rad, which is not between the limits '" + value +
               "'");
    }
  }
  return limits;
}

/// Refuses flags that have no effect on the loop that was chosen.
void check_velocity_loop(const TrackFlags& flags) {
  const auto refuse = [](const char* flag, const char* problem, const char* advice) {
    throw torsio::UsageError({.place = flag, .problem = problem, .advice = advice});
  };
  if (flags.acts_on == "current") {
    if (!flags.velocity_bandwidth.empty())
      refuse("--velocity-bandwidth", "the loop acts on the current",
             "Give --acts-on velocity, too.");
    return;
  }
  const char* const problem = "it belongs to a loop on the current";
  const char* const advice = "Leave it out, or leave out --acts-on velocity.";
  if (!flags.observer.empty()) refuse("--observer", problem, advice);
  if (flags.feeds_rate_forward) refuse("--feed-forward", problem, advice);
  if (flags.has_damping) refuse("--damping", problem, advice);
}

torsio::TrackingSpec spec_of(const TrackFlags& flags, const std::vector<NamedModel>& models,
                             const torsio::DataSheet& sheet, const torsio::Progress& progress) {
  torsio::TrackingSpec spec{
      .output = flags.output == "free" ? torsio::JointOutput::free : torsio::JointOutput::locked,
      .reference = reference_of(flags, models, progress),
      .damping = above_zero(flags.damping, "--damping"),
      .feeds_rate_forward = flags.feeds_rate_forward};
  if (!flags.lever.empty()) {
    if (flags.output != "free")
      throw torsio::UsageError({.place = "--lever",
                                .problem = "the output is locked",
                                .advice = "Give --joint-output free, too."});
    spec.lever_m = torsio::signed_quantity_with_unit(flags.lever, "m", "--lever");
  }
  if (!flags.bandwidth.empty())
    spec.bandwidth_rad_s = angular_frequency_rad_s(flags.bandwidth, "--bandwidth");
  if (!(flags.friction >= 0.0 && flags.friction <= 1.0))
    throw torsio::UsageError({.place = "--friction",
                              .expected = "a share from 0 to 1",
                              .found = fmt::format("{}", flags.friction)});
  if (flags.friction != 0.0) spec.friction = {.share = flags.friction};
  if (!flags.observer.empty())
    spec.observer_cutoff_Hz = above_zero(
        torsio::signed_quantity_with_unit(flags.observer, "Hz", "--observer"), "--observer");
  if (!flags.limits.empty()) spec.limits = limits_of(flags.limits);
  check_velocity_loop(flags);
  if (flags.acts_on == "velocity")
    spec.actuation = torsio::DeflectionController::Actuation::velocity;
  if (!flags.velocity_bandwidth.empty())
    spec.velocity_rad_s = angular_frequency_rad_s(flags.velocity_bandwidth, "--velocity-bandwidth");
  if (!flags.faults.empty())
    spec.faults = torsio::read_fault_schedule(flags.faults, sheet, progress);
  return spec;
}

std::vector<NamedModel> load_models(const TrackFlags& flags) {
  std::vector<NamedModel> models;
  for (const std::string& path : flags.models)
    if (path != torsio::kSweepLineName)  // always run in addition to the models
      models.push_back({path, torsio::load_model(path)});
  return models;
}

std::vector<torsio::NamedInverse> inverses_of(const std::vector<NamedModel>& models) {
  std::vector<torsio::NamedInverse> inverses;
  for (const auto& [path, file] : models) {
    try {
      inverses.push_back({path, torsio::inverse_of(file)});
    } catch (const torsio::Error& error) {
      torsio::ErrorReport report = error.report();
      report.place = fmt::format("{}: {}", path, report.place);
      throw torsio::UsageError(std::move(report));
    }
  }
  return inverses;
}

void check(TrackFlags& flags) {
  std::vector<std::string> read = flags.models;
  read.push_back(flags.faults);
  read.push_back(flags.replayed);
  if (torsio::is_sheet_file(flags.actuator)) read.push_back(flags.actuator);
  flags.data.check_outputs(
      {flags.record, flags.json.destination, flags.report.destination, flags.report.plot}, read);
  if (flags.seeds < 1 || flags.seeds > kMaxSeeds)
    throw torsio::UsageError({.place = "--seeds",
                              .expected = fmt::format("1 to {}", kMaxSeeds),
                              .found = fmt::format("{}", flags.seeds)});
  if (!flags.record.empty() && flags.models.size() > 1)
    throw torsio::UsageError({.place = "--output",
                              .expected = "one --model",
                              .found = fmt::format("{}", flags.models.size()),
                              .advice = "Call track once for each model that is to be recorded."});
  require_ending("--output", flags.record, {".csv", ".gz"});
  for (auto model = flags.models.begin(); model != flags.models.end(); ++model)
    if (std::find(flags.models.begin(), model, *model) != model)
      throw torsio::UsageError({.place = "--model", .problem = *model + " is given twice"});
}

std::string refuse_output(const std::string& text) {
  if (text == "locked" || text == "free") return {};
  return "expected locked or free, found '" + text + "'";
}

std::string refuse_actuation(const std::string& text) {
  if (text == "current" || text == "velocity") return {};
  return "expected current or velocity, found '" + text + "'";
}

void run(TrackFlags& flags, const CLI::App& verb) {
  flags.impedance.check(verb);
  const bool is_impedance = !flags.impedance.impedance.empty();
  if (is_impedance && verb.get_option("--actuator")->count() == 0)
    flags.actuator = "harmonic-drive";
  check(flags);
  flags.has_damping = verb.get_option("--damping")->count() > 0;
  if (is_impedance)
    return run_impedance(
        flags.impedance,
        {.actuator = flags.actuator,
         .amplitude = flags.amplitude,
         .duration = flags.duration,
         .bandwidth = flags.bandwidth,
         .loop_damping = flags.has_damping ? std::optional(flags.damping) : std::nullopt,
         .models = flags.models,
         .seed = flags.seed,
         .record = flags.record,
         .json = flags.json,
         .report = flags.report});
  ProgressBar progress;
  const torsio::DataSheet sheet = torsio::find_data_sheet(flags.actuator, progress.listener());
  const std::vector<NamedModel> files = load_models(flags);
  const torsio::TrackingSpec spec = spec_of(flags, files, sheet, progress.listener());
  const std::vector<torsio::NamedInverse> models = inverses_of(files);
  torsio::check_tracking(sheet, spec,
                         flags.seed);  // before the sweeps for the linear model are run
  const torsio::LinearInverse linear = torsio::sweep_line(sheet, kDefaultSeed, progress.listener());
  for (const torsio::NamedInverse& model : models)
    warn_of_another_spring(model.name, model.inverse, linear, sheet,
                           0.5 * torsio::amplitude_of(spec.reference, sheet));
  std::vector<std::uint64_t> seeds;
  for (std::size_t k = 0; k < flags.seeds; ++k) seeds.push_back(flags.seed + k);
  const std::vector<torsio::TrackingRow> rows =
      torsio::track_models(sheet, spec, linear, models, seeds, progress.listener());
  std::optional<torsio::Recording> recorded_run;
  if (!flags.record.empty() || flags.report.is_wanted()) {
    const torsio::AnyInverse inverse =
        models.empty() ? torsio::AnyInverse(linear) : models.front().inverse;
    torsio::TrackingSpec recorded = spec;
    recorded.measures_bandwidth = false;
    recorded_run = torsio::track(sheet, recorded, inverse, flags.seed, progress.listener()).record;
    if (!flags.record.empty()) torsio::write_recording(*recorded_run, flags.record);
  }
  if (flags.json.wants_tables()) print(torsio::tracking_text(rows));
  flags.json.write(torsio::tracking_json(rows));
  if (flags.report.is_wanted()) {
    torsio::ReportDocument document =
        torsio::tracking_report(rows, recorded_run ? &*recorded_run : nullptr);
    if (spec.actuation == torsio::DeflectionController::Actuation::current) {
      const torsio::DrawnLoop loop{"output " + flags.output, torsio::open_torque_loop(sheet, spec)};
      document.sections.push_back(torsio::loop_section({&loop, 1}));
    }
    flags.report.write(std::move(document));
  }
  for (const torsio::TrackingRow& row : rows)
    if (row.status == "failed") throw torsio::Error({.place = row.model, .problem = row.reason});
}

}  // namespace

void add_track(CLI::App& app) {
  auto flags = std::make_shared<TrackFlags>();
  CLI::App* verb = app.add_subcommand(
      "track",
      "close a torque or impedance loop on a simulated joint and measure what it achieves");
  verb->footer(
      "Example: torsio track --actuator dfki-120 --reference chirp --amplitude 20Nm \\\n"
      "           --model joint.safetensors --seeds 3\n"
      "The loop controls the spring to the deflection that gives the reference torque. The "
      "deflection\n"
      "comes from a linear model fitted to sweeps of this bench (\"linear\", always run) and from "
      "each\n"
      "given model, which is inverted or was trained with --target spring_deflection_rad.\n"
      "\n"
      "Example: torsio track --impedance 2000Nm_rad --impedance-damping 30Nms_rad\n"
      "renders a stiffness and a damping at the output, by default of harmonic-drive: the table "
      "compares\n"
      "the wanted with the rendered impedance from 0.1 to 10 Hz, and the forces of a hand follow. "
      "A\n"
      "model (--model) is the inverse of the spring, or its estimate corrects the torque.");
  verb->add_option("--actuator", flags->actuator,
                   "dfki-28 to dfki-300, as NAME:VARIANT#SERIAL, or a data sheet, FILE.yaml")
      ->capture_default_str();
  verb->add_option("--joint-output", flags->output,
                   "output of the joint: locked, or free with a lever and 9 kg")
      ->check(refuse_output)
      ->capture_default_str();
  verb->add_option("--lever", flags->lever,
                   "free: distance of the 9 kg from the joint axis (default 0.8m)");
  verb->add_option("--reference", flags->reference, "chirp, random-walk, steps, sweep, replay")
      ->capture_default_str();
  verb->add_option("--replay", flags->replayed, "recording whose torque_Nm is the reference");
  flags->data.add_model_mapping(*verb);
  verb->add_option("--amplitude", flags->amplitude, "amplitude of the torque: 20Nm");
  verb->add_option("--duration", flags->duration, "duration of the reference: 30s");
  verb->add_option("--model", flags->models, "model file, or linear; may be given more than once");
  verb->add_option("--bandwidth", flags->bandwidth,
                   "bandwidth for which the gains are computed, as 8Hz or 50rad_s (default 50 "
                   "rad/s: 7.96Hz); torsio "
                   "tune-loop");
  verb->add_option("--damping", flags->damping, "damping for which the gains are computed")
      ->capture_default_str();
  verb->add_option("--friction", flags->friction,
                   "share of the drive's friction to compensate, 0 to 1")
      ->capture_default_str();
  verb->add_option("--observer", flags->observer, "cut-off of a disturbance observer: 10Hz");
  verb->add_flag("--feed-forward", flags->feeds_rate_forward,
                 "feed the rate of the reference torque forward: no lag");
  verb->add_option("--limits", flags->limits,
                   "limits of the rotor's angle and speed over the gear ratio, which override the "
                   "torque loop: position=-20deg..45deg,speed=1rad_s");
  verb->add_option("--acts-on", flags->acts_on,
                   "what the deflection controller commands: current, or the speed of a velocity "
                   "loop")
      ->check(refuse_actuation)
      ->capture_default_str();
  verb->add_option(
      "--velocity-bandwidth", flags->velocity_bandwidth,
      "bandwidth of the velocity loop, as 8Hz or 50rad_s, at most 200 rad/s (default four "
      "times that of the deflection controller)");
  verb->add_option("--faults", flags->faults,
                   "YAML schedule of faults (docs/simulation/faults.md)");
  add_seed(*verb, flags->seed, "seed of the first run's sensor noise and of a random walk");
  verb->add_option("--seeds", flags->seeds, "runs of each model, seed after seed")
      ->capture_default_str();
  verb->add_option("-o,--output,--record", flags->record,
                   "write all signals of the loop and each term of its command in the first run of "
                   "the only --model as CSV");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb);
  flags->impedance.add(*verb);
  verb->callback([flags, verb] { run(*flags, *verb); });
}
