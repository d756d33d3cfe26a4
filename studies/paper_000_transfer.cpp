#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "data/resample.hpp"
#include "sim/experiments/torque_references.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr double kTransferRate_Hz = 100.0;
constexpr double kBase_s = 540.0;
constexpr double kTest_s = 180.0;
constexpr double kOffset_s = 1.0;                   // 100 samples
constexpr double kNew_s = 20.0;                     // for our methods
constexpr std::array kLoads{0.15, 0.3, 0.4, 0.55};  // shares of the rated torque
constexpr double kTestLoad = 0.45;
constexpr std::size_t kShown = 4000;  // samples in the picture
constexpr std::size_t kShownEvery = 4;
constexpr const char* kBase = "dfki-300#03";

/// The bars of Figure 12.
constexpr std::array kJoints{"dfki-300#03", "dfki-300#06", "dfki-120#01", "dfki-50#01"};

Recording sweep(const std::string& actuator, double load, double duration_s, std::uint64_t seed) {
  return resample(simulate({.actuator = actuator,
                            .experiment = "sweep",
                            .seed = seed,
                            .duration_s = duration_s,
                            .lever_m = lever_m(data_sheet(actuator), load)}),
                  kTransferRate_Hz);
}

TrainedModel base_model(const StudyOptions& options, std::uint64_t seed, const Progress& progress) {
  Dataset dataset;
  for (std::size_t k = 0; k < kLoads.size(); ++k) {
    Recording recording = sweep(kBase, kLoads[k], options.is_quick ? 60.0 : kBase_s, seed + k);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
  // Deflection, its rate, speed and position, as (12).
  const std::vector<std::string> inputs{"spring_deflection_rad",
                                        "lowpass(spring_deflection_rate_rad_s, 10Hz)",
                                        "lowpass(joint_speed_rad_s, 10Hz)", "joint_angle_rad"};
  return train_model(
      dataset,
      {.family = "dgmm",
       .options = {{"components", options.is_quick ? "300" : "5000"}, {"em_iterations", "0"}},
       .features = resolve_inputs(dataset, inputs)},
      seed, progress);
}

/// Means over the repeats for one joint.
struct JointErrors {
  std::vector<std::pair<std::string, std::pair<RunningMean, RunningMean>>> of;  ///< RMSE, STD

  void add(const std::string& method, const Metrics& metrics) {
    auto found = std::ranges::find(of, method, &decltype(of)::value_type::first);
    if (found == of.end()) {
      of.push_back({method, {}});
      found = of.end() - 1;
    }
    found->second.first.add(metrics.rmse);
    found->second.second.add(metrics.std_abs);
  }
};

/// A row of Figure 11: the measured loop and that of (14).
XyFigure loop_figure(const std::string& joint, const ModelFile& transferred,
                     const Recording& recording) {
  const EstimatedRecording estimated = estimate_recording(make_estimator(transferred), recording);
  std::vector<double> deflection_deg;
  std::vector<double> measured_Nm;
  std::vector<double> estimated_Nm;
  for (std::size_t n = 0; n < std::min(recording.size(), kShown); n += kShownEvery) {
    const auto at = [n](const Recording& of, const std::string& channel) {
      return of.channel(channel).values[n];
    };
    deflection_deg.push_back(
        deg_from_rad(at(recording, "gear_angle_rad") - at(recording, "joint_angle_rad")));
    measured_Nm.push_back(at(recording, "torque_Nm"));
    estimated_Nm.push_back(at(estimated.channels, estimate_channel("torque_Nm")));
  }
  return {
      .title = joint,
      .x = {"deflection [deg]"},
      .y = {"torque [Nm]"},
      .series = {
          {.label = "measured",
           .role = CurveRole::measured,
           .x = deflection_deg,
           .y = std::move(measured_Nm)},
          {.label = "base with offset (14)", .x = deflection_deg, .y = std::move(estimated_Nm)}}};
}

void add_joint(const std::string& joint, const ModelFile& base, const StudyOptions& options,
               std::uint64_t seed, JointErrors& errors, std::vector<ReportFigure>* figures) {
  Dataset dataset;
  Recording recording = sweep(joint, kTestLoad, options.is_quick ? 60.0 : kTest_s, seed);
  const std::size_t samples = recording.size();
  const auto at = [](double time_s) { return static_cast<std::size_t>(time_s * kTransferRate_Hz); };
  // All methods are scored on what follows the longer part.
  dataset.records.push_back({std::move(recording),
                             {{.begin = 0, .end = at(kOffset_s), .role = Role::train},
                              {.begin = at(kNew_s), .end = samples, .role = Role::test}}});
  const TransferEvaluation papers =
      evaluate_transfer(base, dataset, {.method = TransferMethod::offset}, seed);
  dataset.records[0].segments[0].end = at(kNew_s);
  const TransferOptions ours{.ratios = transfer_ratios(data_sheet(kBase), data_sheet(joint))};
  const TransferEvaluation evaluation = evaluate_transfer(base, dataset, ours, seed);
  errors.add("base as it is", evaluation.find("none")->test.metrics);
  errors.add("offset of 100 samples, (12) to (14)", papers.find("offset")->test.metrics);
  for (const char* const method : {"gain_offset", "data_sheets", "scaled", "refit"})
    errors.add(fmt::format("{} of {:g} s", method, kNew_s), evaluation.find(method)->test.metrics);
  errors.add(fmt::format("chosen of {:g} s", kNew_s), evaluation.chosen().test.metrics);
  if (const auto* const own = evaluation.find("own"))
    errors.add(fmt::format("own model of {:g} s", kNew_s), own->test.metrics);
  if (figures != nullptr)
    figures->emplace_back(
        loop_figure(joint, papers.transfer.best().file, dataset.records[0].recording));
}

}  // namespace

Study transfer_000(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol = fmt::format(
          "base: mixture of {} components of {} from position-controlled swings with four loads of "
          "{:g} s at {:g} Hz; each joint then swings with another load. The offset is the mean of "
          "the first 100 samples; our methods have {:g} s; all are scored on what follows these",
          options.is_quick ? 300 : 5000, kBase, options.is_quick ? 60.0 : kBase_s, kTransferRate_Hz,
          kNew_s),
      .unit = "Nm",
      .options = options};
  std::vector<JointErrors> errors(kJoints.size());
  for (const char* const joint : kJoints) study.plants.push_back(study_plant(joint));
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    const ModelFile base =
        base_model(options, seed, nth_of(progress, k, options.repeats, "base")).file;
    for (std::size_t j = 0; j < kJoints.size(); ++j)
      add_joint(kJoints[j], base, options, seed + 50 + j, errors[j],
                k == 0 ? &study.figures : nullptr);
  }
  QuantityTable table;
  for (std::size_t j = 0; j < kJoints.size(); ++j)
    for (const auto& [method, means] : errors[j].of) {
      const std::string condition = j == 0 ? fmt::format("{}, new load", kJoints[j]) : kJoints[j];
      table.rows.push_back({.condition = condition,
                            .quantity = "RMSE, " + method,
                            .value = means.first.mean(),
                            .unit = "Nm"});
      table.rows.push_back({.condition = condition,
                            .quantity = "STD of |e|, " + method,
                            .value = means.second.mean(),
                            .unit = "Nm"});
    }
  study.table = std::move(table);
  study.figure_columns = 2;
  study.notes.emplace_back(
      "Figures 10 to 12 have no numbers; the paper states their order: itself with a new load "
      "best, then 300#06 and 120#01, 50#01 worst.");
  return study;
}

}  // namespace torsio
