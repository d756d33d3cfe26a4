#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "data/resample.hpp"
#include "figure_curves.hpp"
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

/// The joints of Figure 12, and the other joint of Figure 11.
constexpr std::array kJoints{"dfki-300#03", "dfki-300#06", "dfki-120#01", "dfki-50#01",
                             "dfki-300#01"};
constexpr std::size_t kColumns = 4;
constexpr const char* kAsItIs = "base as it is";
constexpr const char* kPapersOffset = "offset of 100 samples, (12) to (14)";

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

/// The offset (13) of the first samples, and the spread of the differences whose mean it is.
std::pair<double, double> first_offset(const ModelFile& base, const Recording& recording) {
  constexpr std::size_t kOffsetSamples = 100;
  const EstimatedRecording estimated = estimate_recording(make_estimator(base), recording);
  const std::vector<double>& torque_Nm = recording.channel("torque_Nm").values;
  const std::vector<double>& estimate_Nm =
      estimated.channels.channel(estimate_channel("torque_Nm")).values;
  RunningMean difference_Nm;
  for (std::size_t n = 0; n < kOffsetSamples; ++n)
    if (std::isfinite(estimate_Nm[n])) difference_Nm.add(torque_Nm[n] - estimate_Nm[n]);
  return {difference_Nm.mean(), difference_Nm.std_dev()};
}

/// Means over the repeats for one joint.
struct JointErrors {
  struct Method {
    std::string name;
    RunningMean rmse = {};
    RunningMean std_abs = {};
  };
  std::vector<Method> methods;
  RunningMean offset_Nm;      ///< size of (13)
  RunningMean offset_std_Nm;  ///< standard deviation of the samples whose mean it is

  [[nodiscard]] const Method& of(std::string_view name) const {
    return *std::ranges::find(methods, name, &Method::name);
  }
  void add(const std::string& name, const Metrics& metrics) {
    auto found = std::ranges::find(methods, name, &Method::name);
    if (found == methods.end()) found = methods.insert(found, {.name = name});
    found->rmse.add(metrics.rmse);
    found->std_abs.add(metrics.std_abs);
  }
};

/// Figure 10 (a): the measured loops of the base, with four loads, and of the joint of 50 Nm.
XyFigure measured_figure(const StudyOptions& options) {
  XyFigure figure = loop_figure("Figure 10: base with four loads, and the new joint");
  const auto add = [&](const std::string& actuator, double load) {
    const Recording recording = sweep(actuator, load, 60.0, options.seed);
    add_loop(figure, fmt::format("{}, {:g} of the rating", actuator, load),
             deflection_curve(recording, kShownEvery),
             every(recording.channel("torque_Nm").values, kShownEvery));
  };
  for (const double load : kLoads) add(kBase, load);
  add("dfki-50#01", kTestLoad);
  return figure;
}

/// Figure 12: errors and their spread with the paper's offset.
XyFigure column_figure(const std::vector<JointErrors>& errors) {
  XySeries rmse{.label = "RMSE", .style = CurveStyle::columns, .x = {}, .y = {}};
  XySeries spread{.label = "STD of |e|", .style = CurveStyle::columns, .x = {}, .y = {}};
  for (std::size_t j = 0; j < kColumns; ++j) {
    const JointErrors::Method& method = errors[j].of(kPapersOffset);
    for (const auto& [series, value] :
         {std::pair{&rmse, method.rmse.mean()}, std::pair{&spread, method.std_abs.mean()}}) {
      series->x.push_back(static_cast<double>(j));
      series->y.push_back(value);
      series->names.emplace_back(kJoints[j]);
    }
  }
  return {.title = "Figure 12: error with the offset",
          .x = {"joint"},
          .y = {"torque [Nm]"},
          .series = {std::move(rmse), std::move(spread)}};
}

/// One joint of Figure 11: the measured loop and that of (14).
XyFigure joint_figure(const std::string& joint, const ModelFile& transferred,
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
  const auto [offset_Nm, offset_std_Nm] = first_offset(base, recording);
  errors.offset_Nm.add(std::abs(offset_Nm));
  errors.offset_std_Nm.add(offset_std_Nm);
  // All methods are scored on what follows the longer part.
  dataset.records.push_back({std::move(recording),
                             {{.begin = 0, .end = at(kOffset_s), .role = Role::train},
                              {.begin = at(kNew_s), .end = samples, .role = Role::test}}});
  const TransferEvaluation papers =
      evaluate_transfer(base, dataset, {.method = TransferMethod::offset}, seed);
  dataset.records[0].segments[0].end = at(kNew_s);
  const TransferOptions ours{.ratios = transfer_ratios(data_sheet(kBase), data_sheet(joint))};
  const TransferEvaluation evaluation = evaluate_transfer(base, dataset, ours, seed);
  errors.add(kAsItIs, evaluation.find("none")->test.metrics);
  errors.add(kPapersOffset, papers.find("offset")->test.metrics);
  for (const char* const method : {"gain_offset", "data_sheets", "scaled", "refit"})
    errors.add(fmt::format("{} of {:g} s", method, kNew_s), evaluation.find(method)->test.metrics);
  errors.add(fmt::format("chosen of {:g} s", kNew_s), evaluation.chosen().test.metrics);
  if (const auto* const own = evaluation.find("own"))
    errors.add(fmt::format("own model of {:g} s", kNew_s), own->test.metrics);
  if (figures != nullptr)
    figures->emplace_back(
        joint_figure(joint, papers.transfer.best().file, dataset.records[0].recording));
}

void add_joint_rows(QuantityTable& table, const std::string& condition, const JointErrors& errors) {
  const auto row = [&](std::string quantity, double value, std::string remark = {}) {
    table.rows.push_back({.condition = condition,
                          .quantity = std::move(quantity),
                          .value = value,
                          .unit = "Nm",
                          .remark = std::move(remark)});
  };
  row("size of the offset (13)", errors.offset_Nm.mean(),
      fmt::format("standard deviation of its 100 samples {:.3g} Nm", errors.offset_std_Nm.mean()));
  for (const JointErrors::Method& method : errors.methods) {
    row("RMSE, " + method.name, method.rmse.mean());
    row("STD of |e|, " + method.name, method.std_abs.mean());
  }
}

std::string offset_note(const std::string& condition, const JointErrors& errors) {
  const double before_Nm = errors.of(kAsItIs).rmse.mean();
  const double after_Nm = errors.of(kPapersOffset).rmse.mean();
  return fmt::format(
      "{}: the constant offset, which the paper calls a significant improvement, {} the RMSE: "
      "{:.3g} -> {:.3g} Nm",
      condition, after_Nm < before_Nm ? "lowers" : "raises", before_Nm, after_Nm);
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
  for (std::size_t j = 0; j < kJoints.size(); ++j) {
    const std::string condition = j == 0 ? fmt::format("{}, new load", kJoints[j]) : kJoints[j];
    add_joint_rows(table, condition, errors[j]);
    study.notes.push_back(offset_note(condition, errors[j]));
  }
  study.table = std::move(table);
  study.figures.insert(study.figures.begin(), measured_figure(options));
  study.figures.emplace_back(column_figure(errors));
  study.figure_columns = 2;
  study.notes.emplace_back(
      "Figures 10 to 12 have no numbers; the paper states their order: itself with a new load "
      "best, then 300#06 and 120#01, 50#01 worst.");
  return study;
}

}  // namespace torsio
