#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "numerics/student_t.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/identify/drive/write_drive.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

// The servo of BAM with a pendulum.

std::vector<Recording> servo_logs(const Progress& progress) {
  Manifest places;
  places.file = "identify-servo";
  places.roots = {"${TORSIO_DATA}", "../shared/data"};
  const std::filesystem::path folder =
      std::filesystem::path(data_folder(places)) / "xl330_pendulum";
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().string().ends_with(".json.gz")) files.push_back(entry.path().string());
  std::ranges::sort(files);
  std::vector<Recording> recordings;
  LoadOptions options;
  options.progress = progress;
  for (const std::string& file : files)
    for (Recording& recording : load_recordings(file, options))
      recordings.push_back(std::move(recording));
  return recordings;
}

LoadSheet servo_load() {
  return parse_load_sheet(
      "load: {pendulum: {mass: mass_kg, length: length_m, arm_mass: arm_mass_kg}}", "load.yaml");
}

void add_row(QuantityTable& table, std::string condition, std::string quantity, double value,
             std::string unit, std::string remark = {}) {
  table.rows.push_back({.condition = std::move(condition),
                        .quantity = std::move(quantity),
                        .value = value,
                        .unit = std::move(unit),
                        .remark = std::move(remark)});
}

std::string spread_text(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax(values);
  return fmt::format("{:.4f} to {:.4f} over {} seeds", low, high, values.size());
}

double mean_of(const std::vector<double>& values) {
  double mean = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  return mean;
}

/// Largest distance from the mean over the mean.
double relative_spread(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value - mean) / std::abs(mean));
  return most;
}

void add_held_out(QuantityTable& table, const std::vector<Recording>& recordings,
                  const std::string& group_by, const StudyOptions& study,
                  const Progress& progress) {
  const LoadSheet load = servo_load();
  const DriveSheet drive = assumed_drive_sheet(recordings.front());
  const std::string condition = "left out by " + group_by;
  std::vector<double> nested;
  std::vector<double> held_out;
  std::vector<double> torque_constant;
  std::vector<double> armature;
  DriveIdentification last;
  for (std::size_t r = 0; r < study.repeats; ++r) {
    report_progress(progress, static_cast<double>(r) / static_cast<double>(study.repeats),
                    condition);
    last = identify_drive(
        recordings, load, drive,
        {.group_by = group_by, .has_standard_errors = false, .seed = study.seed + r});
    nested.push_back(last.nested_mae_rad);
    held_out.push_back(last.held_out_mae_rad);
    torque_constant.push_back(at(last.values, DriveParameter::torque_constant));
    armature.push_back(at(last.values, DriveParameter::armature));
  }
  add_row(table, condition, "mean |error|, nested", mean_of(nested), "rad", spread_text(nested));
  add_row(table, condition, "mean |error|, held out", mean_of(held_out), "rad",
          spread_text(held_out));
  add_row(table, condition, "torque constant, largest distance from the mean",
          100.0 * relative_spread(torque_constant), "%");
  add_row(table, condition, "armature, largest distance from the mean",
          100.0 * relative_spread(armature), "%");
  for (const BamComparison& bam : compare_with_bam(last, recordings, {.seed = study.seed}))
    add_row(table, condition, "mean |error|, held out, BAM " + bam.model + " by the same search",
            bam.held_out_mae_rad, "rad");
}

/// Shares of differences between fits of disjoint halves within the 95 % interval of their jackknife.
void add_coverage(QuantityTable& table, const std::vector<Recording>& recordings,
                  const StudyOptions& study, const Progress& progress) {
  constexpr std::size_t kPairs = 6;
  const DriveSheet drive = assumed_drive_sheet(recordings.front());
  Random random(study.seed);
  std::size_t within = 0;
  std::size_t count = 0;
  const std::size_t pairs = study.is_quick ? 1 : kPairs;
  for (std::size_t pair = 0; pair < pairs; ++pair) {
    report_progress(progress, static_cast<double>(pair) / static_cast<double>(pairs), "halves");
    std::vector<std::size_t> order(recordings.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size() - 1; k > 0; --k)
      std::swap(order[k],
                order[static_cast<std::size_t>(random.uniform() * static_cast<double>(k + 1))]);
    std::array<std::vector<IdentifiedDriveParameter>, 2> halves;
    for (std::size_t half = 0; half < 2; ++half) {
      std::vector<Recording> logs;
      for (std::size_t k = half; k < order.size(); k += 2) logs.push_back(recordings[order[k]]);
      const DriveTerms terms = drive_terms({DriveTerm::base, DriveTerm::delay,
                                            DriveTerm::load_friction, DriveTerm::load_stribeck,
                                            DriveTerm::resistance_rise, DriveTerm::duty_exponent});
      halves[half] = identify_drive(logs, servo_load(), drive, {.terms = terms, .seed = study.seed})
                         .parameters;
    }
    const std::size_t logs = recordings.size() / 2;
    for (std::size_t p = 0; p < halves[0].size(); ++p) {
      const IdentifiedDriveParameter& a = halves[0][p];
      const IdentifiedDriveParameter& b = halves[1][p];
      const bool is_positive = drive_parameter_info(a.parameter).is_positive;
      const double difference = is_positive ? std::log(a.value / b.value) : a.value - b.value;
      const double error = is_positive
                               ? std::hypot(a.standard_error / a.value, b.standard_error / b.value)
                               : std::hypot(a.standard_error, b.standard_error);
      within += std::abs(difference) <= student_t(0.95, logs - 1) * error ? 1 : 0;
      ++count;
    }
  }
  add_row(table, "disjoint halves", "differences within their 95 % interval",
          100.0 * static_cast<double>(within) / static_cast<double>(count), "%",
          fmt::format("of {}", count));
}

// Simulated joints with a spring, from the motor's encoder and the command.

struct SpringCase {
  const char* actuator;
  double lever_m;
  const char* torque_channel;  ///< true torque
  double torque_ratio = 1.0;   ///< from that channel to the joint
  bool fits_joint_inertia = false;
  double highest_Hz = 8.0;  ///< above the joint's resonance
};

constexpr std::array<SpringCase, 3> kSpringCases{
    {{.actuator = "dfki-50", .lever_m = 0.2, .torque_channel = "truth_spring_torque_Nm"},
     {.actuator = "dfki-120:bouc-wen", .lever_m = 0.35, .torque_channel = "truth_spring_torque_Nm"},
     // Its spring is a tube before the harmonic drive, whose own inertia is on the joint's side.
     {.actuator = "harmonic-drive:soft",
      .lever_m = 0.6,
      .torque_channel = "truth_tube_torque_Nm",
      .torque_ratio = 51.0,
      .fits_joint_inertia = true,
      .highest_Hz = 15.0}}};

Recording in_air(const SpringCase& of, const std::string& experiment, std::uint64_t seed,
                 double amplitude_share) {
  ExperimentSpec spec{.actuator = of.actuator,
                      .experiment = experiment,
                      .seed = seed,
                      .duration_s = 30.0,
                      .lever_m = of.lever_m,
                      .with_truth = true};
  constexpr double kAmplitude_deg = 20.0;
  spec.angle_amplitude_rad = amplitude_share * rad_from_deg(kAmplitude_deg);
  if (experiment != "air-steps") spec.highest_frequency_Hz = of.highest_Hz;
  return simulate(spec);
}

/// One frequency of a motion that begins and ends near rest; a window would take the ends of the chirp out.
double amplitude_at(const std::vector<double>& values, double phase_step) {
  std::complex<double> sum;
  for (std::size_t n = 0; n < values.size(); ++n)
    sum += std::polar(values[n], -phase_step * static_cast<double>(n));
  return std::abs(sum);
}

struct Peak {
  double frequency_Hz = 0.0;
  double height = 0.0;
};

/// Largest ratio of joint over goal from 1 Hz to the end of the chirp.
Peak peak_of(const std::vector<double>& joint, const Recording& chirp, double highest_Hz) {
  const std::vector<double>& goal = chirp.channel("goal_angle_rad").values;
  std::vector<std::pair<double, double>> curve;
  constexpr double kStep = 1.004;
  const auto steps = static_cast<int>(std::log(0.93 * highest_Hz) / std::log(kStep));
  for (int step = 0; step <= steps; ++step) {
    const double frequency_Hz = std::pow(kStep, step);
    const double phase = 2.0 * std::numbers::pi * frequency_Hz / chirp.sample_rate_Hz();
    curve.emplace_back(frequency_Hz,
                       amplitude_at(joint, phase) / std::max(amplitude_at(goal, phase), 1e-12));
  }
  Peak peak;
  constexpr std::size_t kReach = 4;  // neighbours whose mean takes out the ripple of one window
  for (std::size_t k = kReach; k + kReach < curve.size(); ++k) {
    double mean = 0.0;
    for (std::size_t j = k - kReach; j <= k + kReach; ++j)
      mean += curve[j].second / (2.0 * kReach + 1.0);
    if (mean > peak.height) peak = {curve[k].first, mean};
  }
  return peak;
}

/// A recording that no fit used, and what its row is called.
struct NewMotion {
  const char* name;
  Recording recording;
};

void add_torque_error(QuantityTable& table, const SpringCase& of, const char* structure,
                      const DriveIdentification& found, const NewMotion& motion) {
  const DriveTrace trace = simulate_drive(found, motion.recording);
  const std::vector<double>& truth = motion.recording.channel(of.torque_channel).values;
  double square = 0.0;
  double size = 0.0;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    const double torque_Nm = of.torque_ratio * truth[n];
    square += std::pow(trace.joint_torque_Nm[n] - torque_Nm, 2) / static_cast<double>(truth.size());
    size += torque_Nm * torque_Nm / static_cast<double>(truth.size());
  }
  add_row(table, of.actuator, fmt::format("spring torque RMSE, {}, {}", motion.name, structure),
          100.0 * std::sqrt(square / size), "% of its RMS",
          fmt::format("{:.3g} of {:.3g} Nm", std::sqrt(square), std::sqrt(size)));
}

struct SpringStructure {
  const char* name;
  DriveTerms terms;
  bool has_release = false;
};

std::vector<SpringStructure> spring_structures(const SpringCase& of) {
  DriveTerms two = drive_terms({DriveTerm::base, DriveTerm::delay, DriveTerm::load_friction,
                                DriveTerm::speed_limit, DriveTerm::spring, DriveTerm::hysteresis,
                                DriveTerm::bearing, DriveTerm::presliding});
  if (of.fits_joint_inertia) two |= drive_terms({DriveTerm::joint_inertia});
  return {{.name = "one mass",
           .terms = drive_terms({DriveTerm::base, DriveTerm::delay, DriveTerm::speed_limit})},
          {.name = "two masses", .terms = two},
          {.name = "two masses, and a release", .terms = two, .has_release = true}};
}

LoadSheet spring_load(const SpringCase& of) {
  const std::string inertia =
      of.fits_joint_inertia
          ? "fit"
          : fmt::format("{}kg_m2", data_sheet(of.actuator).joint.inertia_kg_m2.value);
  return parse_load_sheet(
      fmt::format("load: {{pendulum: {{mass: mass_kg, length: lever_m}}, joint_inertia: {}}}",
                  inertia),
      "load.yaml");
}

void add_spring(QuantityTable& table, const SpringCase& of, std::uint64_t seed,
                const StudyOptions& study, const Progress& progress) {
  const std::vector<Recording> training{in_air(of, "air-chirp", seed, 1.0),
                                        in_air(of, "air-multisine", seed + 1, 1.0),
                                        in_air(of, "air-steps", seed + 2, 1.0)};
  const std::vector<NewMotion> tests{
      {"chirp", in_air(of, "air-chirp", seed + 3, 1.0)},
      {"multisine 1.3 times as large", in_air(of, "air-multisine", seed + 4, 1.3)},
      {"multisine 0.7 times as large", in_air(of, "air-multisine", seed + 5, 0.7)}};
  const Recording& chirp = tests.front().recording;
  const Peak measured = peak_of(chirp.channel("joint_angle_rad").values, chirp, of.highest_Hz);
  add_row(table, of.actuator, "peak of joint over goal, true", measured.frequency_Hz, "Hz",
          fmt::format("height {:.3f}", measured.height));
  for (const SpringStructure& structure : spring_structures(of)) {
    report_progress(progress, 0.0, fmt::format("{}, {}", of.actuator, structure.name));
    std::vector<Recording> recordings = training;
    if (structure.has_release)
      recordings.push_back(simulate({.actuator = of.actuator,
                                     .experiment = "air-release",
                                     .seed = seed + 6,
                                     .lever_m = of.lever_m}));
    const DriveIdentification found = identify_drive(
        recordings, spring_load(of), assumed_drive_sheet(recordings.front()),
        {.terms = structure.terms, .has_standard_errors = false, .seed = study.seed});
    const Peak peak = peak_of(simulate_drive(found, chirp).joint_angle_rad, chirp, of.highest_Hz);
    add_row(table, of.actuator, fmt::format("peak, {}", structure.name), peak.frequency_Hz, "Hz",
            fmt::format("height {:.3f}; {:+.1f} %, {:+.1f} %", peak.height,
                        100.0 * (peak.frequency_Hz / measured.frequency_Hz - 1.0),
                        100.0 * (peak.height / measured.height - 1.0)));
    for (const NewMotion& motion : tests)
      add_torque_error(table, of, structure.name, found, motion);
    if (has(structure.terms, DriveTerm::spring))
      add_row(table, of.actuator, fmt::format("stiffness, {}", structure.name),
              at(found.values, DriveParameter::stiffness), "Nm/rad",
              fmt::format("armature {:.4g} kg m2", at(found.values, DriveParameter::armature)));
  }
}

}  // namespace

Study identify_servo_study(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "torsio identify on the 16 recordings of an XL330 servo with a pendulum (BAM), "
                  "free runs from the goals "
                  "alone; nested: without a group, terms chosen and fitted, the group simulated; "
                  "BAM's friction models "
                  "in its own equations, fitted by the same search to the same groups",
              .unit = "rad",
              .options = options};
  const std::vector<Recording> recordings = servo_logs(progress);
  QuantityTable table;
  add_held_out(table, recordings, "kp_1", options, progress);
  add_held_out(table, recordings, "trajectory", options, progress);
  add_coverage(table, recordings, options, progress);
  study.table = std::move(table);
  return study;
}

Study identify_spring_study(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "torsio identify on a lever of 9 kg in the air: a chirp, a multisine and steps of 30 s "
          "(and a release), fitted to the motor's encoder alone, from the goals; tested on "
          "another chirp and on multisines of other amplitudes against the true torque of "
          "the spring",
      .unit = "Nm",
      .options = options};
  QuantityTable table;
  for (const SpringCase& of : kSpringCases) {
    add_spring(table, of, 100 * options.seed, options, progress);
    study.plants.push_back(study_plant(of.actuator));
    if (options.is_quick) break;
  }
  study.table = std::move(table);
  return study;
}

}  // namespace torsio
