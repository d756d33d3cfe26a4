#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "figure_curves.hpp"
#include "published.hpp"
#include "sensor_bench.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio {
namespace {

constexpr const char* kMultisine = "multisine";

constexpr const char* kPapersModel = "improved PGPR";

/// Its kernel after learning, as printed in Table II.
constexpr const char* kTable2 =
    "21.5113/11.8339/-5.4362/-6.5416/-8.7194/5.9948/-2.5506/-5.3729/-5.1467";

/// The candidates of the paper: n_y = n_u = 8 (Table II), that is 7 past torques and 8 twists,
/// trained one step ahead with the number of updates of Algorithm 1.
std::vector<SensorCandidate> papers_candidates(bool is_quick) {
  const std::string one_step = "input_lags=7:output_lags=7:training=one_step";
  const int updates = is_quick ? 2000 : 200000;
  const auto pgpr = [&](const char* family, const char* kernel) {
    return fmt::format("narx_parametric_gp{}:{}:updates={}{}", family, one_step, updates, kernel);
  };
  constexpr const char* kPlain = ":kernel=se";
  return {
      {"GP", fmt::format("narx_gaussian_process:{}:kernel=se:std_dev=false:samples={}", one_step,
                         is_quick ? 100 : 1000)},
      {"NN", fmt::format("narx_mlp:{}:epochs={}", one_step, is_quick ? 3 : 30)},
      {"PGPR", pgpr("_paper", kPlain)},
      {"LSTM", fmt::format("narx_lstm:{}:layers={}:epochs={}", one_step, is_quick ? 8 : 32,
                           is_quick ? 2 : 30)},
      {kPapersModel, pgpr("_paper", "")},
      {"improved PGPR, Table II",
       fmt::format("narx_parametric_gp:{}:updates={}:kernel_plain={}", one_step, updates, kTable2)},
      {"PGPR, corrected", pgpr("", kPlain)},
      {"improved PGPR, corrected", pgpr("", "")}};
}

/// The same models, but that they learn to forget errors of what is fed back to them.
std::vector<SensorCandidate> our_candidates(bool is_quick) {
  const std::string noise = "input_lags=7:output_lags=7:training=noise:feedback_noise=0.05";
  return {{"NN, noise", fmt::format("narx_mlp:{}:epochs={}", noise, is_quick ? 3 : 30)},
          {"improved PGPR, noise",
           fmt::format("narx_parametric_gp:{}:updates={}", noise, is_quick ? 2000 : 20000)},
          {"GP, noise", fmt::format("narx_gaussian_process:{}:std_dev=false:samples={}", noise,
                                    is_quick ? 100 : 1000)},
          {"variational GP, noise",
           fmt::format("narx_parametric_gp_variational:{}:inducing_points={}:samples={}", noise,
                       is_quick ? 20 : 100, is_quick ? 500 : 5000)},
          {"LSTM, without feedback",
           fmt::format("lstm:layers={}:epochs={}", is_quick ? 8 : 32, is_quick ? 2 : 30)},
          {"GRU", fmt::format("gru:layers={}:epochs={}", is_quick ? 8 : 32, is_quick ? 2 : 30)}};
}

std::vector<SensorCandidate> baselines() {
  return {{"linear", "linear"},
          {"linear, friction", "linear_coulomb", true},
          {"ARX 5", "arx"},
          {"ARX 15", "arx:input_lags=7:output_lags=7"}};
}

std::vector<SensorCandidate> all_candidates(bool is_quick) {
  std::vector<SensorCandidate> candidates = baselines();
  for (const auto& more : {papers_candidates(is_quick), our_candidates(is_quick)})
    candidates.insert(candidates.end(), more.begin(), more.end());
  return candidates;
}

/// The candidates of the other tests: none of them is still warming up when the clutch slips.
std::vector<SensorCandidate> few_candidates(bool is_quick) {
  std::vector<SensorCandidate> candidates = all_candidates(is_quick);
  constexpr std::array<std::string_view, 4> kFew{"linear", "ARX 5", "improved PGPR, corrected",
                                                 "variational GP, noise"};
  std::erase_if(candidates, [&](const SensorCandidate& candidate) {
    return std::ranges::find(kFew, candidate.label) == kFew.end();
  });
  return candidates;
}

/// Where the clutch begins to slip; the end if it holds.
std::size_t first_slip(const Recording& recording) {
  constexpr double kSlipped_rad = 1e-3;
  const std::vector<double>& slip = recording.channel("truth_clutch_slip_rad").values;
  return static_cast<std::size_t>(
      std::ranges::find_if(slip, [](double rad) { return std::abs(rad) > kSlipped_rad; }) -
      slip.begin());
}

const ErrorRow& best_of(const std::vector<ErrorRow>& rows, std::string_view named) {
  return *std::ranges::min_element(rows, {}, [&](const ErrorRow& row) {
    return std::pair(!row.model.starts_with(named), row.rmse);
  });
}

/// The abstract's claim about the largest errors of the paper's own five models.
std::string improvement_text(const std::vector<ErrorRow>& rows) {
  double proposed_Nm = kNotMeasured;
  double largest_Nm = 0.0;
  for (const ErrorRow& row : rows) {
    if (row.model == kPapersModel) proposed_Nm = row.max_abs;
    if (row.model == "GP" || row.model == "NN" || row.model == "PGPR" || row.model == "LSTM")
      largest_Nm = std::max(largest_Nm, row.max_abs);
  }
  return fmt::format(
      "largest error of {} below the largest of GP, NN, PGPR and LSTM by {:.2f} % of FS; printed: "
      "up to {}",
      kPapersModel, 100.0 * (largest_Nm - proposed_Nm) / kSensorFullScale_Nm,
      paper_figure("002", "section V", "against other models", "MAE improvement").text);
}

/// The results of one condition compared with the paper's claim.
std::vector<std::string> verdicts(const std::vector<ErrorRow>& rows) {
  const ErrorRow& arx = best_of(rows, "ARX");
  std::vector<std::string> notes;
  for (const ErrorRow& row : rows) {
    if (row.blank > 0)
      notes.push_back(fmt::format("{}: no better than the mean torque in {} of {} runs", row.model,
                                  row.blank, row.runs));
    if (row.model.find("PGPR") == std::string::npos) continue;
    notes.push_back(fmt::format("{}: {} a linear ARX ({:.2f} % of FS against {:.2f} of {})",
                                row.model, row.rmse < arx.rmse ? "beats" : "does not beat",
                                100.0 * row.rmse / kSensorFullScale_Nm,
                                100.0 * arx.rmse / kSensorFullScale_Nm, arx.model));
  }
  const ErrorRow& best = best_of(rows, "");
  notes.push_back(
      fmt::format("best: {}, {:.2f} % of FS", best.model, 100.0 * best.rmse / kSensorFullScale_Nm));
  return notes;
}

Study study_of(std::string protocol, const StudyOptions& options,
               const std::vector<SensorCandidate>& candidates) {
  Study study{.protocol = std::move(protocol),
              .unit = "Nm",
              .options = options,
              .plants = {study_plant(kSensorActuator)}};
  for (const SensorCandidate& candidate : candidates)
    study.notes.push_back(fmt::format("model {}: {}", candidate.label, candidate.model));
  return study;
}

ErrorTable sensor_table(const StudyRows& rows) {
  return {.rows = rows.errors(), .full_scale = kSensorFullScale_Nm};
}

/// Figure 11: the measured torque of one multisine, and the paper's five models on it.
XyFigure validation_figure(const SensorBench& bench, const std::vector<SensorCandidate>& candidates,
                           const std::vector<ComparedModel>& models) {
  constexpr std::array<std::string_view, 5> kDrawn{"GP", "NN", "PGPR", "LSTM", kPapersModel};
  const Recording& recording = bench.dataset.records.at(1).recording;
  const Thinning thinning{.rate_Hz = recording.sample_rate_Hz(), .step = 5};
  XyFigure figure = trace_figure("Figure 11", "torque [Nm]");
  add_trace(figure, "measured", recording.channel("torque_Nm").values, CurveRole::measured,
            thinning);
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (std::ranges::find(kDrawn, candidates[i].label) == kDrawn.end()) continue;
    const EstimatedRecording estimated =
        estimate_recording(make_estimator(models[i].file), recording);
    add_trace(figure, candidates[i].label,
              estimated.channels.channel(estimate_channel("torque_Nm")).values, CurveRole::model,
              thinning);
  }
  return figure;
}

/// A study of experiments that the clutch may slip in, until it does and once it has.
Study beyond_slip(Study study, const std::vector<std::string>& experiments,
                  const Progress& progress) {
  const StudyOptions& options = study.options;
  StudyRows rows;
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    SensorBench bench = trained_on_grid(seed);
    for (const std::string& experiment : experiments) {
      const Recording recording = sensor_recording(experiment, seed + kFirstTestSeed);
      const std::size_t slip = first_slip(recording);
      bench.add_test(recording, experiment + ", clutch holds", 0, slip);
      if (slip < recording.size())
        bench.add_test(recording, experiment + ", has slipped", slip, recording.size());
    }
    compare_into(rows, bench, few_candidates(options.is_quick), seed,
                 nth_of(progress, k, options.repeats, "beyond slip"));
  }
  study.table = sensor_table(rows);
  return study;
}

}  // namespace

Study sensor_models_002(const StudyOptions& options, const Progress& progress) {
  const std::vector<SensorCandidate> candidates = all_candidates(options.is_quick);
  Study study = study_of(
      "trained on the grid of sines, 0.05 to 1 Hz and 4 to 9 deg, tested in free run on other "
      "multisines from rest, scored after 4 s; no measured torque is fed back; input: twist of "
      "cable and rubber, 50 Hz",
      options, candidates);
  StudyRows rows(kPublishedSensorModels);
  const std::size_t multisines = options.is_quick ? 2 : 8;
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    SensorBench bench = trained_on_grid(seed);
    for (std::size_t i = 0; i < multisines; ++i) {
      const Recording recording = sensor_recording(kMultisine, seed + kFirstTestSeed + i);
      bench.add_test(recording, kMultisine, kSensorWarmUp, recording.size());
    }
    const std::vector<ComparedModel> models = compare_into(
        rows, bench, candidates, seed, nth_of(progress, k, options.repeats, kSensorActuator));
    if (k == 0) study.figures.emplace_back(validation_figure(bench, candidates, models));
  }
  const ErrorTable table = sensor_table(rows);
  study.table = table;
  study.notes.emplace_back(
      "paper %, paper max %: Table III, measured on its own hardware; the paper prints no "
      "normaliser and no "
      "parameters of its multisine, and trained its GP on part of the data");
  study.notes.push_back(improvement_text(table.rows));
  std::ranges::move(verdicts(table.rows), std::back_inserter(study.notes));
  return study;
}

Study slow_loops_002(const StudyOptions& options, const Progress& progress) {
  return beyond_slip(study_of("trained on the grid of sines; tested at 1 rad/min to +-15 deg, "
                              "twice in each direction, until "
                              "the clutch first slips, which no sensor measures, and after it",
                              options, few_candidates(options.is_quick)),
                     {"slow-cycles"}, progress);
}

Study collision_002(const StudyOptions& options, const Progress& progress) {
  return beyond_slip(
      study_of(
          "trained on the grid of sines; tested at 10 deg/s beyond slip (slip, ours: not in the "
          "paper) and in a driven link's collision with a wall (collision; the paper drops a mass "
          "on a sensor with a fixed input), until the clutch first slips and after it",
          options, few_candidates(options.is_quick)),
      {"slip", "collision"}, progress);
}

}  // namespace torsio
