#include "comparison_cases.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "studies/study.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

/// The samples of a DFKI bench's load cell (125 Hz), without its known latency: a log of 1 kHz
/// contains no more information about the torque, at eight times the cost.
Recording at_load_cell(const Recording& log, const DataSheet& sheet) {
  const Channel& torque = log.channel("torque_Nm");
  const double tick_s = 1.0 / log.sample_rate_Hz();
  const auto late =
      static_cast<std::size_t>(std::lround(sheet.sensors.torque_latency_s.value / tick_s));
  std::vector<std::size_t> fresh;
  for (std::size_t n = late; n < log.size(); ++n)
    if (torque.is_fresh(n)) fresh.push_back(n);
  const double period_s = tick_s * static_cast<double>(fresh[2] - fresh[1]);
  Recording thinned(log.name(), 1.0 / period_s);
  for (const Channel& channel : log.channels()) {
    Channel own{.name = channel.name, .values = {}, .fresh = {}};
    for (const std::size_t n : fresh)
      own.values.push_back(channel.values[channel.name == torque.name ? n : n - late]);
    thinned.add(std::move(own));
  }
  return thinned;
}

void thin_out(Dataset& dataset, const DataSheet& sheet) {
  for (DatasetRecord& record : dataset.records) {
    const Role role = record.segments.front().role;
    record.recording = at_load_cell(record.recording, sheet);
    record.segments = whole_record(record.recording.size(), role);
  }
}

/// Adds a run; a test run with a separate condition names it.
void add(ComparisonCase& to, const ExperimentSpec& spec, Role role, const Progress& progress,
         const std::string& condition = {}) {
  Recording recording = simulate(spec, progress);
  const std::size_t samples = recording.size();
  if (!condition.empty()) to.conditions.emplace_back(recording.name(), condition);
  to.dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

ComparisonCase sweeps(const std::string& actuator, std::uint64_t seed, const Progress& progress) {
  ComparisonCase made{.dataset = sweep_dataset(actuator, seed, progress)};
  thin_out(made.dataset, data_sheet(actuator));
  return made;
}

/// A torque loop on a locked output: two chirps of other amplitudes, then noise.
ComparisonCase torque_loop(const std::string& actuator, std::uint64_t seed,
                           const Progress& progress) {
  ComparisonCase made;
  const double rated_Nm = data_sheet(actuator).rating.torque_Nm.value;
  const auto run = [&](const char* experiment, double share, Role role) {
    add(made,
        {.actuator = actuator,
         .experiment = experiment,
         .seed = seed + (role == Role::test ? kFirstTestSeed : 10 + made.dataset.records.size()),
         .torque_amplitude_Nm = share * rated_Nm},
        role, progress);
  };
  run("chirp", 0.8, Role::train);
  run("chirp", 0.3, Role::train);
  run("random-walk", 0.25, Role::test);  // whose peaks reach 0.6
  thin_out(made.dataset, data_sheet(actuator));
  return made;
}

ComparisonCase elastomer(const std::string& actuator, std::uint64_t seed,
                         const Progress& progress) {
  ComparisonCase made{
      .inputs = {"spring_deflection_rad", "lowpass(rate(spring_deflection_rad), 10Hz)"}};
  made.dataset.initialise_samples = 0;  // every run starts at rest
  add(made, {.actuator = actuator, .experiment = "triangles", .seed = seed}, Role::train, progress);
  add(made, {.actuator = actuator, .experiment = "random-walk", .seed = seed + kFirstTestSeed},
      Role::test, progress, actuator + ", random walk");
  add(made,
      {.actuator = actuator,
       .experiment = "slow-cycles",
       .seed = seed + kFirstTestSeed + 1,
       .duration_s = 100.0},
      Role::test, progress, actuator + ", slow cycles");
  return made;
}

ComparisonCase rubber(std::uint64_t seed, const Progress& progress) {
  constexpr const char* kActuator = "rubber-clutch";
  ComparisonCase made{.inputs = {"input_angle_rad - joint_angle_rad",
                                 "lowpass(rate(input_angle_rad - joint_angle_rad), 10Hz)"}};
  made.dataset.initialise_samples = 0;
  add(made, {.actuator = kActuator, .experiment = "grid", .seed = seed}, Role::train, progress);
  for (std::size_t k = 0; k < 4; ++k)
    add(made, {.actuator = kActuator, .experiment = "multisine", .seed = seed + kFirstTestSeed + k},
        Role::test, progress);
  return made;
}

/// Pushes of 10 and 20 Nm under either impedance, then of 15 Nm.
ComparisonCase pushes(const std::string& actuator, double duration_s, std::uint64_t seed,
                      const Progress& progress) {
  // The twist of the tube; that of a rigid one cannot be measured: the twist of gear and tube
  // replaces it (specification 3.4).
  const bool is_rigid = actuator.ends_with("rigid");
  const std::string twist = is_rigid ? "lowpass(motor_angle_rad / 2 - 51 * joint_angle_rad, 10Hz)"
                                     : "motor_angle_rad / 2 - wave_generator_angle_rad";
  ComparisonCase made{
      .inputs = {twist, "motor_torque_Nm", "lowpass(rate(wave_generator_angle_rad), 10Hz)"}};
  for (const bool is_zero : {false, true}) {
    const auto push = [&](double torque_Nm, Role role, const std::string& condition) {
      add(made,
          {.actuator = actuator,
           .experiment = "human-torque",
           .seed = seed + made.dataset.records.size() + (role == Role::test ? kFirstTestSeed : 0),
           .duration_s = duration_s,
           .torque_amplitude_Nm = torque_Nm,
           .is_impedance_zero = is_zero},
          role, progress, condition);
    };
    push(10.0, Role::train, {});
    push(20.0, Role::train, {});
    push(15.0, Role::test, fmt::format("{}, {} impedance", actuator, is_zero ? "zero" : "high"));
  }
  return made;
}

// As in tests/real_data, where comments give the reasons.
constexpr std::string_view kAnkle = R"yaml(
target: torque_Nm
root: ["${TORSIO_DATA}", ../shared/data]
input_sets: {plain: "angle_rad, lowpass(rate(angle_rad), 10Hz)"
}
)yaml";

constexpr std::string_view kSupports = R"yaml(
target: torque_Nm
root: ["${TORSIO_DATA}", ../shared/data]
input_sets: {plain: "angle_rad, lowpass(rate(angle_rad), 10Hz), support_m"}
files:
  - {file: desr_foot/dualcam_x00.csv.gz, role: train, conditions: {support_mm: 0}}
  - {file: desr_foot/dualcam_x20.csv.gz, role: train, conditions: {support_mm: 20}}
  - {file: desr_foot/dualcam_x30.csv.gz, role: train, conditions: {support_mm: 30}}
  - {file: desr_foot/dualcam_x45.csv.gz, role: train, conditions: {support_mm: 45}}
  - {file: desr_foot/dualcam_x10.csv.gz, role: test, conditions: {support_mm: 10}}
  - {file: desr_foot/dualcam_x35.csv.gz, role: test, conditions: {support_mm: 35}}
)yaml";

constexpr std::string_view kCycloidal = R"yaml(
target: torque_Nm
root: ["${TORSIO_DATA}", ../shared/data]
mapping:
  channels: {output_angle_rad: pos_out_deg, torque_Nm: tau_motor_Nm}
  split_by: test_nr
  clock: {resample: 400Hz}
  zero: [{channel: output_angle_rad, mid_range: true}]
  computed_from: {torque_Nm: [iq_A, tau_cmd_Nm]}
input_sets: {plain: "output_angle_rad, lowpass(rate(output_angle_rad), 10Hz)"
}
)yaml";

Dataset recorded(const std::string& manifest, const std::string& name, const Progress& progress) {
  LoadOptions options;
  options.progress = progress;
  return load_manifest(parse_manifest(manifest, name), options);
}

ComparisonCase supports(const Progress& progress) {
  return {.dataset = recorded(std::string(kSupports), "desr_foot dual cam", progress),
          .schedule = "support_m",
          .conditions = {{"dualcam_x10", "dual cam, support 10 mm"},
                         {"dualcam_x35", "dual cam, support 35 mm"}}};
}

ComparisonCase one_cam(const std::string& cam, const Progress& progress) {
  const std::string split = "split: {interleaved_blocks: 60, test_every: 5, embargo: 50ms}\n";
  return {.dataset =
              recorded(fmt::format("{}{}files: [desr_foot/{}_x33.csv.gz]\n", kAnkle, split, cam),
                       cam, progress)};
}

/// A printed drive: trained on one preload, tested on two others.
struct PrintedDrive {
  const char* name;
  std::array<const char*, 3> files;
};
constexpr std::array kPrintedDrives{
    PrintedDrive{"base910_reamed",
                 {"2024-07-17__12-24-38__torqueramp__base910_reamed1",
                  "2024-07-17__12-40-35__torqueramp__base910_reamed5",
                  "2024-07-17__12-45-13__torqueramp__base910_reamed6"}},
    PrintedDrive{"base_onyx_runin",
                 {"2024-07-18__10-58-26__torqueramp__base_onyx_runin1",
                  "2024-07-18__11-02-28__torqueramp__base_onyx_runin5",
                  "2024-07-18__11-17-26__torqueramp__base_onyx_runin6"}},
    PrintedDrive{"split_onyx_runin",
                 {"2024-07-18__16-28-57__torqueramp__split_onyx_runin1",
                  "2024-07-18__16-32-24__torqueramp__split_onyx_runin5",
                  "2024-07-18__16-49-32__torqueramp__split_onyx_runin6"}},
    PrintedDrive{"split_onyx_6pre",
                 {"2024-07-18__18-30-11__torqueramp__split_onyx_6pre1",
                  "2024-07-18__18-33-20__torqueramp__split_onyx_6pre5",
                  "2024-07-18__18-36-30__torqueramp__split_onyx_6pre6"}}};

ComparisonCase cycloidal(const PrintedDrive& drive, const Progress& progress) {
  std::string manifest = std::string(kCycloidal) + "files:\n";
  for (std::size_t i = 0; i < drive.files.size(); ++i)
    manifest += fmt::format("  - {{file: cycloidal/{}.csv.gz, role: {}, name: variant_{}}}\n",
                            drive.files[i], i == 0 ? "train" : "test", i);
  return {.dataset = recorded(manifest, drive.name, progress)};
}

}  // namespace

std::vector<ComparisonPlan> simulated_plans(bool is_quick) {
  std::vector<ComparisonPlan> plans;
  const auto plan = [&](std::string name, std::string plant, auto make) {
    plans.push_back({std::move(name), std::move(plant), std::move(make)});
  };
  constexpr double kPush_s = 100.0;
  constexpr double kShortPush_s = 20.0;
  if (is_quick) {
    plan("harmonic-drive:stiff", "harmonic-drive:stiff", [](auto seed, const Progress& progress) {
      return pushes("harmonic-drive:stiff", kShortPush_s, seed, progress);
    });
    plan("elastomer:bonded", "elastomer:bonded", [](auto seed, const Progress& progress) {
      return elastomer("elastomer:bonded", seed, progress);
    });
    return plans;
  }
  for (const char* size : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    for (const char* variant : {"maxwell-slip", "bouc-wen", "lugre"}) {
      const std::string actuator = fmt::format("{}:{}", size, variant);
      plan(actuator + ", new lever", actuator,
           [=](auto seed, const Progress& progress) { return sweeps(actuator, seed, progress); });
      plan(actuator + ", random walk", actuator, [=](auto seed, const Progress& progress) {
        return torque_loop(actuator, seed, progress);
      });
    }
  }
  for (const char* coupling : {"bonded", "unbonded", "creeping"}) {
    const std::string actuator = fmt::format("elastomer:{}", coupling);
    plan(actuator, actuator,
         [=](auto seed, const Progress& progress) { return elastomer(actuator, seed, progress); });
  }
  plan("rubber-clutch, multisine", "rubber-clutch",
       [](auto seed, const Progress& progress) { return rubber(seed, progress); });
  for (const char* tube : {"stiff", "soft", "rigid"}) {
    const std::string actuator = fmt::format("harmonic-drive:{}", tube);
    plan(actuator, actuator, [=](auto seed, const Progress& progress) {
      return pushes(actuator, kPush_s, seed, progress);
    });
  }
  return plans;
}

std::vector<ComparisonPlan> recorded_plans() {
  std::vector<ComparisonPlan> plans;
  plans.push_back({"dual cam", "", [](std::uint64_t /*seed*/, const Progress& progress) {
                     return supports(progress);
                   }});
  for (const char* cam : {"cam1", "cam2"})
    plans.push_back(
        {fmt::format("{}, held-out blocks", cam), "",
         [=](std::uint64_t /*seed*/, const Progress& progress) { return one_cam(cam, progress); }});
  for (const PrintedDrive& drive : kPrintedDrives)
    plans.push_back({fmt::format("cycloidal {}, other preloads", drive.name), "",
                     [&drive](std::uint64_t /*seed*/, const Progress& progress) {
                       return cycloidal(drive, progress);
                     }});
  return plans;
}

}  // namespace torsio
