#include "drive_stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

#include "figure_curves.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/evaluate/attribution.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr const char* kTwist = "motor_angle_rad / 2 - wave_generator_angle_rad";
constexpr const char* kMotorTorque = "motor_torque_Nm";
constexpr const char* kGeneratorSpeed = "lowpass(rate(wave_generator_angle_rad), 10Hz)";

constexpr std::size_t kPapersCells = 250;
constexpr std::size_t kFolds = 5;
// Shapley values of a network take windows x background x coalitions x 200 steps.
constexpr AttributionOptions kAttribution{.windows = 20, .background = 10, .repeats = 1};
constexpr Thinning kDriveThinning{.rate_Hz = 100.0, .step = 5};
constexpr double kDriveTrace_s = 40.0;

std::string acceleration(const DriveFilters& filters) {
  return fmt::format("lowpass(rate(rate(joint_angle_rad)), {:g}Hz)", filters.acceleration_Hz);
}
/// Through tube and gear together, as seen from the tube.
std::string twist_through_gear(const DriveFilters& filters) {
  return fmt::format("lowpass(motor_angle_rad / 2 - 51 * joint_angle_rad, {:g}Hz)",
                     filters.gear_twist_Hz);
}

/// What stage 2 compares: all features that the paper names.
InputSet candidate_inputs() {
  return {"candidates",
          {kTwist, kMotorTorque, acceleration({}), kGeneratorSpeed, twist_through_gear({})}};
}

std::string_view input_name(const std::string& expression) {
  if (expression == kTwist) return "twist of the tube";
  if (expression == kMotorTorque) return "motor torque";
  if (expression == kGeneratorSpeed) return "speed of the wave generator";
  return expression.find("rate(rate(") != std::string::npos ? "acceleration of the joint"
                                                            : "twist of tube and gear";
}

/// "twist of the tube 61.2 %, motor torque 38.8 %".
std::string shares_of(const ModelFile& file, const Dataset& dataset, std::uint64_t seed) {
  AttributionOptions options = kAttribution;
  options.seed = seed;
  const Attribution attribution =
      attribute(AnyModel(file.parameters), training_data(dataset, file.settings.features), options);
  std::string text;
  for (const InputAttribution& input : attribution.inputs)
    text += fmt::format("{}{} {:.1f} %", text.empty() ? "" : ", ", input_name(input.input),
                        100.0 * input.share);
  return text;
}

bool is_papers(const ComparedModel& model) { return model.family == "lstm"; }

std::size_t cells_of(const StudyOptions& options) { return options.is_quick ? 32 : kPapersCells; }

std::string label_of(const ComparedModel& model, const StudyOptions& options) {
  return fmt::format("lstm {}, {}", cells_of(options), model.input_set);
}

std::vector<ModelChoice> choices_of(const Dataset& dataset, const StudyOptions& options) {
  const std::vector<std::string>& first = dataset.input_sets.front().second;
  std::vector<ModelChoice> choices =
      model_choices(dataset, "linear_coulomb",
                    {first[0], first[1], fmt::format("lowpass(rate({}), 10Hz)", first[0])});
  const auto append = [&](const std::string& models, const std::vector<std::string>& inputs) {
    std::ranges::move(model_choices(dataset, models, inputs), std::back_inserter(choices));
  };
  append("grey_box", {first[0], first[1], kGeneratorSpeed});
  append(fmt::format("linear,mlp,gru:layers={}:epochs={},{}", options.is_quick ? 16 : 64,
                     options.is_quick ? 2 : 15, papers_network(cells_of(options))),
         {});
  return choices;
}

void append(Dataset& to, const Dataset& from, Role role) {
  for (const DatasetRecord& record : from.records)
    to.records.push_back({record.recording, whole_record(record.recording.size(), role)});
}

/// Stage 2: what each feature contributes to a small network that has all of them.
void select_features(Study& study, const std::string& where, const Dataset& collected,
                     std::uint64_t seed, const Progress& progress) {
  Dataset dataset = collected;
  dataset.input_sets = {candidate_inputs()};
  const std::string model =
      study.options.is_quick ? "lstm:layers=8:epochs=1" : "lstm:layers=32:epochs=10";
  const TrainedModel trained =
      train_model(dataset, model_choices(dataset, model, {}).front(), seed, progress);
  study.notes.push_back(
      fmt::format("{}stage 2, shares of the mean |Shapley value| in {} with all features: {}",
                  where, model, shares_of(trained.file, dataset, seed)));
}

/// Stage 3: each of the recordings held out once.
void validate_in_folds(Study& study, StudyRows& rows, const Dataset& collected, std::uint64_t seed,
                       const Progress& progress) {
  const std::vector<ModelChoice> choices =
      model_choices(collected, papers_network(cells_of(study.options)), {});
  const CrossValidation validation =
      cross_validate(collected, choices, {.folds = kFolds}, seed, false, progress);
  rows.add(validation.results, collected, Role::validation,
           [](const std::string&) { return "stage 3, held-out folds"; });
}

/// Its ranges, limits and fallback no longer replace the network.
ModelFile without_guards(ModelFile file) {
  FeatureRanges& ranges = file.settings.ranges;
  ranges.lowest.assign(ranges.lowest.size(), -kOpenRange);
  ranges.highest.assign(ranges.highest.size(), kOpenRange);
  file.settings.disturbances.largest_step.clear();
  file.settings.output.largest_target = kNotMeasured;
  return file;
}

/// One of the rows of the figures: what was measured, and two estimates of it.
void draw(Study& study, const std::string& title, const DataSheet& sheet,
          const Recording& recording,
          const std::vector<std::pair<std::string, ModelFile>>& models) {
  const auto samples = std::min(
      recording.size(), static_cast<std::size_t>(kDriveTrace_s * recording.sample_rate_Hz()));
  const auto first = [&](std::vector<double> values) {
    values.resize(samples);
    return values;
  };
  XyFigure trace = trace_figure(title, "torque [Nm]");
  XyFigure loop = loop_figure(title);
  std::vector<double> twist_deg = measured_twist(sheet, recording);
  for (double& twist : twist_deg) twist = deg_from_rad(twist);
  twist_deg = every(first(std::move(twist_deg)), kDriveThinning.step);
  const auto add = [&](const std::string& label, const std::vector<double>& torque_Nm,
                       CurveRole role) {
    add_trace(trace, label, torque_Nm, role, kDriveThinning);
    add_loop(loop, label, twist_deg, every(torque_Nm, kDriveThinning.step), role);
  };
  add("measured", first(recording.channel("torque_Nm").values), CurveRole::measured);
  for (const auto& [label, file] : models)
    add(label,
        first(estimate_recording(make_estimator(file), recording)
                  .channels.channel(estimate_channel("torque_Nm"))
                  .values),
        CurveRole::model);
  study.figures.emplace_back(std::move(trace));
  study.figures.emplace_back(std::move(loop));
}

}  // namespace

InputSet drive_inputs(std::string_view set, const DriveFilters& filters) {
  std::vector<std::string> inputs{kTwist, kMotorTorque};
  if (set == "I") inputs.push_back(acceleration(filters));
  if (set == "II+") inputs.emplace_back(kGeneratorSpeed);
  if (set == "III") inputs.front() = twist_through_gear(filters);
  return {std::string(set), std::move(inputs)};
}

std::vector<Push> collected_pushes(bool is_impedance_zero) {
  std::vector<Push> pushes(kFolds);
  for (std::size_t k = 0; k < pushes.size(); ++k) {
    pushes[k].torque_Nm = 10.0 + 2.5 * static_cast<double>(k);
    pushes[k].is_impedance_zero = is_impedance_zero;
    pushes[k].seed_offset = k + (is_impedance_zero ? 10U : 0U);
  }
  return pushes;
}

Push online_push(bool is_impedance_zero) {
  return {.torque_Nm = 15.0,
          .is_impedance_zero = is_impedance_zero,
          .seed_offset = is_impedance_zero ? 30U : 20U};
}

Dataset recorded_pushes(const DataSheet& sheet, const std::vector<Push>& pushes, Role role,
                        const StudyOptions& options, std::uint64_t seed, const Progress& progress) {
  Dataset dataset;
  for (const Push& push : pushes) {
    Recording recording = simulate(sheet,
                                   {.experiment = "human-torque",
                                    .seed = seed + push.seed_offset,
                                    .duration_s = options.is_quick ? 60.0 : 150.0,
                                    .torque_amplitude_Nm = push.torque_Nm,
                                    .is_impedance_zero = push.is_impedance_zero},
                                   progress);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, role)});
  }
  return dataset;
}

std::string papers_network(std::size_t cells) {
  return fmt::format(
      "lstm:layers={}:window=200:stride=20:burn_in=20:epochs=3:batch=64:learning_rate=0.001:clip=1:"
      "patience=0",
      cells);
}

void run_stages(Study& study, StudyRows& rows, const DriveStages& stages, std::uint64_t seed,
                bool is_first, const Progress& progress) {
  const StudyOptions& options = study.options;
  Dataset collected =
      recorded_pushes(stages.sheet, stages.collected, Role::train, options, seed, progress);
  collected.input_sets = stages.sets;
  const std::string where = stages.name.empty() ? "" : stages.name + ", ";
  if (is_first) select_features(study, where, collected, seed, progress);
  if (is_first && stages.has_folds) validate_in_folds(study, rows, collected, seed, progress);

  const Dataset validated =
      recorded_pushes(stages.sheet, stages.validated, Role::test, options, seed, progress);
  StudyConditions conditions;
  for (std::size_t i = 0; i < validated.records.size(); ++i)
    conditions.add(validated.records[i].recording.name(), stages.validated[i].condition);
  const auto condition_of = [&](const std::string& recording) { return conditions.of(recording); };
  Dataset dataset = collected;
  append(dataset, validated, Role::test);
  const Comparison offline = compare(dataset, choices_of(dataset, options), seed, false, progress);
  rows.add(offline.results, dataset, Role::test, condition_of);

  Dataset online =
      recorded_pushes(stages.sheet, stages.online, Role::train, options, seed, progress);
  append(online, validated, Role::test);
  const std::optional<ModelFile> grey_box = [&]() -> std::optional<ModelFile> {
    const auto found = std::ranges::find(offline.models, "grey_box", &ComparedModel::family);
    return found == offline.models.end() ? std::nullopt : std::optional(found->file);
  }();
  for (const ComparedModel& model : offline.models) {
    if (!is_papers(model)) continue;
    const std::string label = label_of(model, options);
    const AdaptedModel adapted =
        adapt_model(model.file, online, adaptation_settings("auto", {}), progress);
    const auto add_online = [&](const ModelFile& file, const std::string& name) {
      rows.add(evaluate_model(file, validated, progress), validated, Role::test, condition_of,
               [&](const ResultRow&) { return name; });
    };
    add_online(adapted.file, label + ", online");
    if (stages.runs_without_guards)
      add_online(without_guards(adapted.file), label + ", online, alone");
    if (!is_first) continue;
    study.notes.push_back(fmt::format("{}stage 3, the same in {}: {}", where, label,
                                      shares_of(model.file, collected, seed)));
    study.notes.push_back(
        fmt::format("{}stage 4, {}: {} updates of the last layer; RMSE before each {:.4g} Nm, "
                    "without any {:.4g} Nm",
                    where, label, adapted.counts.updates(), adapted.as_it_ran.back().adapted.rmse,
                    adapted.as_it_ran.back().frozen.rmse));
    if (stages.figure.empty()) continue;
    for (const DatasetRecord& record : validated.records) {
      std::vector<std::pair<std::string, ModelFile>> drawn{{label + ", online", adapted.file}};
      if (grey_box) drawn.emplace_back("grey_box", *grey_box);
      draw(study,
           fmt::format("{}: set {}, {}", stages.figure, model.input_set,
                       condition_of(record.recording.name())),
           stages.sheet, record.recording, drawn);
    }
  }
}

}  // namespace torsio
