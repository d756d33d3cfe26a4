#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/model_run.hpp"
#include "sim/experiments/torque_references.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr double kFewData_s = 10.0;
constexpr double kReference_s = 60.0;
constexpr unsigned kFirstSpecimen = 11;
constexpr std::size_t kSpecimens = 5;
constexpr double kWalkShare = 0.2;   // share of the rated torque: its peaks reach 0.45
constexpr double kSweepShare = 0.4;  // share of the rated torque, of the lever in a test

struct Pair {
  const char* base;
  const char* joint;
};
constexpr std::array kPairs{Pair{"dfki-50", "dfki-50"},   Pair{"dfki-120", "dfki-120"},
                            Pair{"dfki-300", "dfki-300"}, Pair{"dfki-300", "dfki-120"},
                            Pair{"dfki-300", "dfki-50"},  Pair{"dfki-120", "dfki-50"},
                            Pair{"dfki-50", "dfki-300"}};

void add(Dataset& dataset, const ExperimentSpec& spec, Role role) {
  Recording recording = simulate(spec);
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

double rated_Nm(const std::string& actuator) { return data_sheet(actuator).rating.torque_Nm.value; }

/// The calibration of the base: sweeps, a chirp and a walk, up to half the rated torque.
ModelFile base_model(const std::string& actuator, std::uint64_t seed, const Progress& progress) {
  Dataset dataset;
  const std::string name = actuator + "#03";
  for (const double share : {0.2, 0.35, 0.5})
    add(dataset,
        {.actuator = name,
         .experiment = "sweep",
         .seed = seed++,
         .lever_m = lever_m(data_sheet(actuator), share)},
        Role::train);
  add(dataset,
      {.actuator = name,
       .experiment = "chirp",
       .seed = seed++,
       .torque_amplitude_Nm = 0.5 * rated_Nm(actuator)},
      Role::train);
  add(dataset,
      {.actuator = name,
       .experiment = "random-walk",
       .seed = seed++,
       .torque_amplitude_Nm = 0.25 * rated_Nm(actuator)},
      Role::train);
  return train_model(dataset, {.family = "grey_box", .features = resolve_inputs(dataset, {})}, 1,
                     progress)
      .file;
}

/// What a new joint records for its transfer, and in the tests.
Dataset new_joint(const std::string& actuator, unsigned serial, double chirp_s,
                  std::uint64_t seed) {
  Dataset dataset;
  const std::string name = fmt::format("{}#{:02}", actuator, serial);
  add(dataset, {.actuator = name, .experiment = "short-chirp", .seed = seed, .duration_s = chirp_s},
      Role::train);
  add(dataset,
      {.actuator = name,
       .experiment = "sweep",
       .seed = seed + 1,
       .lever_m = lever_m(data_sheet(actuator), kSweepShare)},
      Role::test);
  add(dataset,
      {.actuator = name,
       .experiment = "random-walk",
       .seed = seed + 2,
       .torque_amplitude_Nm = kWalkShare * rated_Nm(actuator)},
      Role::test);
  return dataset;
}

/// Error of the model itself: guards that were trained on a locked joint exclude a moving one.
double unguarded_rmse(const ModelFile& file, const Dataset& dataset) {
  return evaluate(AnyModel(file.parameters),
                  training_data(dataset, file.settings.features, Role::test))
      .rmse;
}

struct Means {
  double sum = 0.0;
  double largest = 0.0;
  void add(double value) {
    sum += value / static_cast<double>(kSpecimens);
    largest = std::max(largest, value);
  }
};

void add_pair(QuantityTable& table, const Pair& pair, const ModelFile& base, std::uint64_t seed,
              std::size_t specimens, const Progress& progress) {
  const TransferOptions options{.ratios =
                                    transfer_ratios(data_sheet(pair.base), data_sheet(pair.joint))};
  Means offset;
  Means transferred;
  Means own_10;
  Means own_60;
  Means ratio;
  Means guarded;
  std::string methods;
  for (std::size_t k = 0; k < specimens; ++k) {
    const auto serial = kFirstSpecimen + static_cast<unsigned>(k);
    const Dataset few = new_joint(pair.joint, serial, kFewData_s, seed + 100 * (k + 1));
    const TransferEvaluation evaluation = evaluate_transfer(base, few, options, 1, progress);
    const Dataset more = new_joint(pair.joint, serial, kReference_s, seed + 100 * (k + 1) + 50);
    // A locked joint has no speed to learn from.
    const FeatureSpec features = resolve_inputs(
        more, {"spring_deflection_rad", "lowpass(spring_deflection_rate_rad_s, 10Hz)"});
    const ModelFile own =
        train_model(more, {.family = "grey_box", .features = features}, 1, progress).file;
    const double reference = unguarded_rmse(own, few);
    const Score& score = evaluation.chosen().test;
    own_60.add(reference);
    transferred.add(score.metrics.rmse);
    ratio.add(score.metrics.rmse / reference);
    guarded.add(100.0 * static_cast<double>(score.guarded_samples) /
                static_cast<double>(score.metrics.samples));
    offset.add(evaluation.find("offset")->test.metrics.rmse);
    if (const auto* const own_few = evaluation.find("own")) own_10.add(own_few->test.metrics.rmse);
    methods += (k == 0 ? "" : ", ") + evaluation.chosen().method;
  }
  const double scale = static_cast<double>(kSpecimens) / static_cast<double>(specimens);
  const std::string condition = fmt::format("{} to {}", pair.base, pair.joint);
  const auto row = [&](const char* quantity, double value, const char* unit,
                       std::string remark = {}) {
    table.rows.push_back({.condition = condition,
                          .quantity = quantity,
                          .value = value,
                          .unit = unit,
                          .remark = std::move(remark)});
  };
  row("RMSE, base with the constant offset of (12) to (14)", scale * offset.sum, "Nm");
  row("RMSE, transferred with 10 s", scale * transferred.sum, "Nm", methods);
  row("RMSE, own grey box of these 10 s", scale * own_10.sum, "Nm");
  row("RMSE, own grey box of 60 s, without its guards", scale * own_60.sum, "Nm");
  row("ratio of transferred to own of 60 s, mean", scale * ratio.sum, "");
  row("ratio of transferred to own of 60 s, largest", ratio.largest, "");
  row("guarded, largest", guarded.largest, "%");
}

}  // namespace

Study few_data_transfer(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol = fmt::format(
          "base: grey box of specimen #03, sweeps, chirp and walk up to half the rated torque; new "
          "joint: {:g} s of a locked chirp of half the rated torque, 0.05 to 0.3 Hz; test: sweep "
          "and walk within that range; reference: its own grey box of {:g} s of the same chirp; "
          "{} specimens",
          kFewData_s, kReference_s, kSpecimens),
      .unit = "Nm",
      .options = options};
  QuantityTable table;
  const std::size_t pairs = options.is_quick ? 1 : kPairs.size();
  std::string trained;
  std::optional<ModelFile> base;
  for (std::size_t p = 0; p < pairs; ++p) {
    report_progress(progress, static_cast<double>(p) / static_cast<double>(pairs), "transferring");
    if (trained != kPairs[p].base) {
      trained = kPairs[p].base;
      base = base_model(trained, 1000 * options.seed, {});
      study.plants.push_back(study_plant(trained));
    }
    add_pair(table, kPairs[p], *base, 1000 * options.seed + 10 * p,
             options.is_quick ? 1 : kSpecimens, {});
  }
  study.table = std::move(table);
  return study;
}

}  // namespace torsio
