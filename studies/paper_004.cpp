#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drive_stages.hpp"
#include "published.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {
namespace {

constexpr const char* kDrive = "harmonic-drive";

constexpr const char* kStagesText =
    "in the five stages of the paper: collection (five recordings of pushes of 10 to 20 Nm), "
    "Shapley values, offline "
    "training, online training of the last layer on a recording of 15 Nm, validation on others; "
    "the Shapley values "
    "are those of the first repeat";

Study study_of(std::string_view what, const StudyOptions& options) {
  return {.protocol = fmt::format("{}, {}", what, kStagesText),
          .unit = "Nm",
          .options = options,
          .plants = {study_plant(kDrive)},
          .figure_columns = 2};
}

/// One push under high impedance, like those of the training but for its seed.
Push validation_push(double torque_Nm, std::string condition, std::size_t n) {
  return {
      .torque_Nm = torque_Nm, .condition = std::move(condition), .seed_offset = kFirstTestSeed + n};
}

}  // namespace

Study encoders_004(const StudyOptions& options, const Progress& progress) {
  Study study = study_of(
      "stiff tube, high impedance; inputs I tube twist, motor torque, joint acceleration, II "
      "without the "
      "acceleration, III twist of tube and gear, motor torque; the first repeat also with each "
      "recording held out once",
      options);
  StudyRows rows(kPublishedEncoders);
  for (std::size_t k = 0; k < options.repeats; ++k)
    run_stages(study, rows,
               {.sheet = data_sheet(kDrive),
                .collected = collected_pushes(false),
                .online = {online_push(false)},
                .validated = {validation_push(20.0, "20 Nm", 0)},
                .sets = {drive_inputs("I"), drive_inputs("II"), drive_inputs("III")},
                .figure = "Figures 9 and 10",
                .has_folds = true},
               repeat_seed(options, k), k == 0,
               nth_of(progress, k, options.repeats, "encoder sets"));
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study torque_levels_004(const StudyOptions& options, const Progress& progress) {
  Study study = study_of(
      "stiff tube, high impedance, tested on pushes of 5 to 50 Nm; inputs II; \"alone\": without "
      "the guards, which "
      "replace a network outside its range by a linear model",
      options);
  constexpr std::array kLevels_Nm{5.0, 20.0, 30.0, 40.0, 50.0};
  std::vector<Push> levels;
  for (const double level_Nm : kLevels_Nm)
    // NOLINTNEXTLINE(performance-inefficient-vector-operation): five of them
    levels.push_back(validation_push(level_Nm, fmt::format("{:g} Nm", level_Nm), levels.size()));
  StudyRows rows(kPublishedTorqueLevels);
  for (std::size_t k = 0; k < options.repeats; ++k)
    run_stages(study, rows,
               {.sheet = data_sheet(kDrive),
                .collected = collected_pushes(false),
                .online = {online_push(false)},
                .validated = levels,
                .sets = {drive_inputs("II")},
                .figure = "Figure 11",
                .runs_without_guards = true},
               repeat_seed(options, k), k == 0,
               nth_of(progress, k, options.repeats, "torque levels"));
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study impedances_004(const StudyOptions& options, const Progress& progress) {
  Study study = study_of(
      "stiff tube: trained under high, zero or both impedances, tested on pushes of 15 Nm; inputs "
      "II, and II+ with "
      "the speed of the wave generator where both are trained on",
      options);
  struct Case {
    const char* name;
    std::vector<bool> modes;  ///< whether the impedance is zero
    std::vector<InputSet> sets;
  };
  const std::array cases{Case{"high", {false}, {drive_inputs("II")}},
                         Case{"zero", {true}, {drive_inputs("II")}},
                         Case{"both", {false, true}, {drive_inputs("II"), drive_inputs("II+")}}};
  StudyRows rows(kPublishedImpedances);
  for (std::size_t k = 0; k < options.repeats; ++k) {
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const Case& of = cases[c];
      DriveStages stages{
          .sheet = data_sheet(kDrive), .name = fmt::format("trained {}", of.name), .sets = of.sets};
      for (const bool is_zero : of.modes) {
        for (const Push& push : collected_pushes(is_zero)) stages.collected.push_back(push);
        stages.online.push_back(online_push(is_zero));
      }
      for (const bool is_zero : {false, true}) {
        stages.validated.push_back(validation_push(
            15.0, fmt::format("trained {}, tested {}", of.name, is_zero ? "zero" : "high"),
            is_zero ? 1 : 0));
        stages.validated.back().is_impedance_zero = is_zero;
      }
      if (of.modes.size() == 2) stages.figure = "Figure 12";
      run_stages(study, rows, stages, repeat_seed(options, k), k == 0,
                 nth_of(progress, k * cases.size() + c, options.repeats * cases.size(),
                        fmt::format("impedance {}", of.name)));
    }
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

Study tubes_004(const StudyOptions& options, const Progress& progress) {
  Study study = study_of(
      "high impedance, three tubes; inputs II, with the rigid tube III, whose twist it cannot "
      "measure",
      options);
  study.plants.clear();
  constexpr std::array kTubes{"soft", "stiff", "rigid"};
  StudyRows rows(kPublishedTubes);
  for (std::size_t t = 0; t < kTubes.size(); ++t) {
    const std::string actuator = fmt::format("{}:{}", kDrive, kTubes[t]);
    study.plants.push_back(study_plant(actuator));
    const bool is_rigid = kTubes[t] == std::string_view("rigid");
    for (std::size_t k = 0; k < options.repeats; ++k)
      run_stages(
          study, rows,
          {.sheet = data_sheet(actuator),
           .name = fmt::format("{} tube", kTubes[t]),
           .collected = collected_pushes(false),
           .online = {online_push(false)},
           .validated = {validation_push(20.0, kTubes[t], 0)},
           .sets = {drive_inputs(is_rigid ? "III" : "II")},
           .figure = fmt::format("Figures 14 and 15, {} tube", kTubes[t])},
          repeat_seed(options, k), k == 0,
          nth_of(progress, t * options.repeats + k, kTubes.size() * options.repeats, kTubes[t]));
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

}  // namespace torsio
