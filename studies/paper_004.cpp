#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "published.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

// The paper's encoder sets (specification 3.4): the twist of the tube, the torque asked of the
// motor, the joint's acceleration; the third one looks through tube and gear together.
constexpr const char* kTwist = "motor_angle_rad / 2 - wave_generator_angle_rad";
constexpr const char* kTwistThroughGear =
    "lowpass(motor_angle_rad / 2 - 51 * joint_angle_rad, 10Hz)";
constexpr const char* kMotorTorque = "motor_torque_Nm";
constexpr const char* kAcceleration = "lowpass(rate(rate(joint_angle_rad)), 3Hz)";
constexpr const char* kTwistRate =
    "lowpass(rate(motor_angle_rad / 2 - wave_generator_angle_rad), 10Hz)";
constexpr const char* kGeneratorSpeed = "lowpass(rate(wave_generator_angle_rad), 10Hz)";

using InputSet = std::pair<std::string, std::vector<std::string>>;
const InputSet kSet1{"I", {kTwist, kMotorTorque, kAcceleration}};
const InputSet kSet2{"II", {kTwist, kMotorTorque}};
const InputSet kSet2Plus{"II+", {kTwist, kMotorTorque, kGeneratorSpeed}};
const InputSet kSet3{"III", {kTwistThroughGear, kMotorTorque}};

/// The paper's network and training on each input set (Table 2; stride, burn-in, learning rate and
/// clipping are assumed), compared with simple models: linear, a static
/// network, and linear with friction, which has the twist's rate in addition to set II.
std::vector<ModelChoice> choices_of(const Dataset& dataset, const StudyOptions& options) {
  const std::string models = fmt::format(
      "linear,mlp,lstm:layers={}:window=200:stride=20:burn_in=20:epochs=3:batch=64:"
      "learning_rate=0.001:clip=1:patience=0",
      options.is_quick ? 32 : 250);
  std::vector<ModelChoice> choices = model_choices(dataset, models, {});
  if (dataset.input_sets.front() == kSet2Plus) return choices;  // is compared with II already
  const std::vector<std::string> with_rate{kTwist, kMotorTorque, kTwistRate};
  for (ModelChoice& choice : model_choices(dataset, "linear_coulomb", with_rate))
    choices.insert(choices.begin(), std::move(choice));
  return choices;
}

/// A hand that pushes the output to and fro against the impedance controller.
struct Push {
  std::string actuator = "harmonic-drive";
  double torque_Nm = 20.0;
  bool is_impedance_zero = false;
  std::string condition = {};     ///< what a row of the table is called by
  std::uint64_t seed_offset = 0;  ///< the same recording in every comparison of a repeat
  Role role = Role::train;
};

struct PushData {
  Dataset dataset;
  StudyConditions conditions;
};

/// 150 s each, assumed: the paper prints no duration.
PushData record(const std::vector<Push>& pushes, const StudyOptions& options, std::uint64_t seed,
                const Progress& progress) {
  PushData data;
  for (const Push& push : pushes) {
    Recording recording = simulate({.actuator = push.actuator,
                                    .experiment = "human-torque",
                                    .seed = seed + push.seed_offset,
                                    .duration_s = options.is_quick ? 60.0 : 150.0,
                                    .torque_amplitude_Nm = push.torque_Nm,
                                    .is_impedance_zero = push.is_impedance_zero},
                                   progress);
    data.conditions.add(recording.name(), push.condition);
    const std::size_t samples = recording.size();
    data.dataset.records.push_back({std::move(recording), whole_record(samples, push.role)});
  }
  return data;
}

/// Five recordings, each held out once.
void cross_validate_into(StudyRows& rows, const Push& push, const std::vector<InputSet>& sets,
                         const StudyOptions& options, std::uint64_t seed,
                         const Progress& progress) {
  constexpr std::size_t kFolds = 5;
  std::vector<Push> pushes(kFolds, push);
  for (std::size_t k = 0; k < kFolds; ++k) pushes[k].seed_offset = k;
  PushData data = record(pushes, options, seed, progress);
  data.dataset.input_sets = sets;
  const auto choices = choices_of(data.dataset, options);
  const CrossValidation validation =
      cross_validate(data.dataset, choices, {.folds = kFolds}, seed, false, progress);
  rows.add(validation.results, data.dataset, Role::validation,
           [&](const std::string&) { return push.condition; });
}

void compare_into(StudyRows& rows, const std::vector<Push>& pushes, const InputSet& set,
                  const StudyOptions& options, std::uint64_t seed, const Progress& progress) {
  PushData data = record(pushes, options, seed, progress);
  data.dataset.input_sets = {set};
  const auto choices = choices_of(data.dataset, options);
  const Results results = compare(data.dataset, choices, seed, false, progress).results;
  rows.add(results, data.dataset, Role::test,
           [&](const std::string& recording) { return data.conditions.of(recording); });
}

std::vector<Push> five_between(double low_Nm, double high_Nm, bool is_impedance_zero) {
  std::vector<Push> pushes(5);
  for (std::size_t k = 0; k < pushes.size(); ++k) {
    pushes[k].torque_Nm = low_Nm + 0.25 * static_cast<double>(k) * (high_Nm - low_Nm);
    pushes[k].is_impedance_zero = is_impedance_zero;
    pushes[k].seed_offset = k + (is_impedance_zero ? 10U : 0U);
  }
  return pushes;
}

}  // namespace

Study encoders_004(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "stiff tube, high impedance, pushes of 20 Nm: five recordings, each held "
                  "out once; inputs I tube twist, motor torque, joint acceleration, II "
                  "without the acceleration, III twist of tube and gear, motor torque",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant("harmonic-drive")}};
  StudyRows rows(kPublishedEncoders);
  for (std::size_t k = 0; k < options.repeats; ++k)
    cross_validate_into(rows, {.condition = "20 Nm"}, {kSet1, kSet2, kSet3}, options,
                        repeat_seed(options, k),
                        nth_of(progress, k, options.repeats, "encoder sets"));
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study torque_levels_004(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "stiff tube, high impedance: trained on pushes of 10 to 20 Nm, tested on "
                  "others; inputs II",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant("harmonic-drive")}};
  constexpr std::array kLevels_Nm{5.0, 20.0, 30.0, 40.0, 50.0};
  StudyRows rows(kPublishedTorqueLevels);
  for (std::size_t k = 0; k < options.repeats; ++k) {
    std::vector<Push> pushes = five_between(10.0, 20.0, false);
    for (const double level_Nm : kLevels_Nm)
      pushes.push_back({.torque_Nm = level_Nm,
                        .condition = fmt::format("{:g} Nm", level_Nm),
                        .seed_offset = kFirstTestSeed + pushes.size(),
                        .role = Role::test});
    compare_into(rows, pushes, kSet2, options, repeat_seed(options, k),
                 nth_of(progress, k, options.repeats, "torque levels"));
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study impedances_004(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "stiff tube, pushes of 10 to 20 Nm: trained under high, zero or both "
                  "impedances, tested on pushes of 15 Nm; inputs II, and II+ with the speed "
                  "of the wave generator where both are trained on",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant("harmonic-drive")}};
  struct Case {
    const char* name;
    bool has_high;
    bool has_zero;
    InputSet set;
  };
  const std::vector<Case> cases{{"high", true, false, kSet2},
                                {"zero", false, true, kSet2},
                                {"both", true, true, kSet2},
                                {"both", true, true, kSet2Plus}};
  StudyRows rows(kPublishedImpedances);
  for (std::size_t k = 0; k < options.repeats; ++k) {
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const Case& of = cases[c];
      std::vector<Push> pushes;
      if (of.has_high) pushes = five_between(10.0, 20.0, false);
      if (of.has_zero) {
        const std::vector<Push> zero = five_between(10.0, 20.0, true);
        pushes.insert(pushes.end(), zero.begin(), zero.end());
      }
      for (const bool is_zero : {false, true})
        pushes.push_back(
            {.torque_Nm = 15.0,
             .is_impedance_zero = is_zero,
             .condition = fmt::format("trained {}, tested {}", of.name, is_zero ? "zero" : "high"),
             .seed_offset = kFirstTestSeed + (is_zero ? 1 : 0),
             .role = Role::test});
      compare_into(rows, pushes, of.set, options, repeat_seed(options, k),
                   nth_of(progress, k * cases.size() + c, options.repeats * cases.size(),
                          fmt::format("impedance {}", of.name)));
    }
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study tubes_004(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "high impedance, pushes of 20 Nm, three tubes: five recordings each, each "
                  "held out once; inputs II, with the rigid tube III, whose twist it can "
                  "not measure",
              .unit = "Nm",
              .options = options};
  constexpr std::array kTubes{"soft", "stiff", "rigid"};
  StudyRows rows(kPublishedTubes);
  for (std::size_t t = 0; t < kTubes.size(); ++t) {
    const std::string actuator = std::string("harmonic-drive:") + kTubes[t];
    study.plants.push_back(study_plant(actuator));
    const InputSet& set = kTubes[t] == std::string_view("rigid") ? kSet3 : kSet2;
    for (std::size_t k = 0; k < options.repeats; ++k)
      cross_validate_into(
          rows, {.actuator = actuator, .condition = kTubes[t]}, {set}, options,
          repeat_seed(options, k),
          nth_of(progress, t * options.repeats + k, kTubes.size() * options.repeats, kTubes[t]));
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

}  // namespace torsio
