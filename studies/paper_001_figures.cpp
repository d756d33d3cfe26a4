#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "figure_curves.hpp"
#include "paper_figures.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "tracking_models.hpp"

// Paper 001: the loop of Figure 2, the models of Figure 4 and the traces of Figure 6.

namespace torsio {
namespace {

constexpr const char* kLearned = "dfki-50";
constexpr double kTrace_s = 160.0;
constexpr Chirp::Parameters kChirp{
    .amplitude = 13.0, .start_Hz = 0.01, .end_Hz = 0.3, .duration_s = kTrace_s};
constexpr std::array kBands_Hz{0.01, 0.06, 0.12, 0.18, 0.24, 0.3};
constexpr std::array kTrackingFamilies{kLoopMixture, kLoopNetwork, kLoopLine};
constexpr std::array kPrintedChirp{paper_figure("001", "Fig. 6", "chirp: DGMM", "RMSE"),
                                   paper_figure("001", "Fig. 6", "chirp: NN", "RMSE"),
                                   paper_figure("001", "Fig. 6", "chirp: linear", "RMSE")};
constexpr std::array kPrintedWalk{paper_figure("001", "Fig. 6", "random walk: DGMM", "RMSE"),
                                  paper_figure("001", "Fig. 6", "random walk: NN", "RMSE"),
                                  paper_figure("001", "Fig. 6", "random walk: linear", "RMSE")};

/// The torque that the linear model estimates on the recording that it is fitted to.
std::vector<double> linear_torque(const Recording& cycle, std::uint64_t seed) {
  Dataset dataset;
  dataset.records.push_back({cycle, whole_record(cycle.size(), Role::train)});
  const TrainedModel line = train_model(
      dataset, {.family = "linear", .features = resolve_inputs(dataset, {"spring_deflection_rad"})},
      seed);
  return estimate_recording(make_estimator(line.file), cycle)
      .channels.channel(estimate_channel("torque_Nm"))
      .values;
}

/// Figure 2: the motor is held, a torque pulls both ways.
void add_static_loop(Study& study, QuantityTable& table) {
  const Recording cycle =
      simulate({.actuator = kLearned, .experiment = "static-cycle", .seed = study.options.seed});
  const std::vector<double> deflection_deg = deflection_curve(cycle);
  const std::vector<double> torque_Nm = every(cycle.channel("torque_Nm").values, Thinning{}.step);
  const auto [low_deg, high_deg] = std::ranges::minmax(deflection_deg);
  const auto row = [&](const char* quantity, double value, const char* unit, std::string remark) {
    table.rows.push_back({.condition = "Figure 2",
                          .quantity = quantity,
                          .value = value,
                          .unit = unit,
                          .remark = std::move(remark)});
  };
  row("lowest deflection", low_deg, "deg", "axis of the paper: -4 to 5 deg");
  row("highest deflection", high_deg, "deg", {});
  row("width of the loop", loop_measures(deflection_deg, torque_Nm).width_Nm, "Nm", {});
  const std::vector<double> line_Nm =
      every(linear_torque(cycle, study.options.seed), Thinning{}.step);
  double squares = 0.0;
  for (std::size_t n = 0; n < line_Nm.size(); ++n)
    squares += (line_Nm[n] - torque_Nm[n]) * (line_Nm[n] - torque_Nm[n]);
  row("RMSE of a linear model of this loop",
      std::sqrt(squares / static_cast<double>(line_Nm.size())), "Nm", {});
  XyFigure figure = loop_figure("Figure 2");
  add_loop(figure, "measured", deflection_deg, torque_Nm);
  add_loop(figure, "linear", deflection_deg, line_Nm, CurveRole::model);
  study.figures.emplace_back(std::move(figure));
}

/// Section 4.2: the paper prints 771 numbers for a network of 50, 20 and 10 units, which has more.
void add_parameters(QuantityTable& table, const std::string& layers, const ModelFile& file) {
  constexpr PaperFigure kPrinted =
      paper_figure("001", "section 4.2", "network 50-20-10", "parameters");
  const bool is_papers = layers.find("50-20-10") != std::string::npos;
  const auto count = static_cast<double>(AnyModel(file.parameters).parameter_count());
  table.rows.push_back(
      {.condition = "section 4.2",
       .quantity = fmt::format("numbers of a network, {}", layers),
       .value = count,
       .unit = "-",
       .published = is_papers ? std::optional(kPrinted) : std::nullopt,
       .remark = !is_papers && count == kPrinted.value ? "the printed number" : ""});
}

/// Figure 4: loops on a new sweep, and errors. The network with the printed number of parameters is a fourth model.
void add_models(Study& study, QuantityTable& table, const Progress& progress) {
  const Dataset dataset = sweep_dataset(kLearned, study.options.seed, progress);
  const Comparison compared = compare(
      dataset, model_choices(dataset, "linear,dgmm,mlp:layers=50-20-10,mlp:layers=50-10-5", {}),
      study.options.seed, false, progress);
  const auto test = std::ranges::find_if(dataset.records, [](const auto& record) {
    return record.segments.front().role == Role::test;
  });
  const auto loop_of = [](const Recording& of, const std::string& channel) {
    return every(of.channel(channel).values, Thinning{}.step);
  };
  const std::vector<double> deflection_deg = deflection_curve(test->recording);
  XySeries columns{.label = "RMSE", .style = CurveStyle::columns, .x = {}, .y = {}};
  XyFigure loops = loop_figure("Figure 4: loops");
  add_loop(loops, "measured", deflection_deg, loop_of(test->recording, "torque_Nm"));
  for (const ComparedModel& model : compared.models) {
    const std::string label =
        model.variant.empty() ? model.family : fmt::format("{}, {}", model.family, model.variant);
    if (model.family == "mlp") add_parameters(table, model.variant, model.file);
    const EstimatedRecording estimated =
        estimate_recording(make_estimator(model.file), test->recording);
    add_loop(loops, label, deflection_deg,
             loop_of(estimated.channels, estimate_channel("torque_Nm")), CurveRole::model);
    for (const ResultRow& row : compared.results.rows) {
      if (row.family != model.family || row.variant != model.variant || row.split != Role::test ||
          row.recording)
        continue;
      columns.x.push_back(static_cast<double>(columns.x.size()));
      columns.y.push_back(row.score.metrics.rmse);
      columns.names.push_back(label);
      table.rows.push_back({.condition = "Figure 4",
                            .quantity = "RMSE, " + label,
                            .value = row.score.metrics.rmse,
                            .unit = "Nm",
                            .remark = "axis of the paper: 0 to 2.5 Nm"});
    }
  }
  study.figures.emplace_back(std::move(loops));
  study.figures.emplace_back(XyFigure{.title = "Figure 4: errors",
                                      .x = {"model"},
                                      .y = {"RMSE [Nm]"},
                                      .series = {std::move(columns)}});
}

/// The chirp of a reference takes 100 s; this one has the same band over the whole figure.
TorqueReference chirp_reference(const Chirp::Parameters& parameters) {
  Chirp chirp(parameters, kBenchRate_Hz);
  TorqueReference reference{.kind = TorqueReference::Kind::replay};
  for (std::size_t n = 0; n < static_cast<std::size_t>(parameters.duration_s * kBenchRate_Hz); ++n)
    reference.recorded_Nm.push_back(chirp.step());
  return reference;
}

/// The runs through every inverse with one reference, drawn. @returns the errors [Nm]
std::vector<std::vector<double>> run_references(Study& study, QuantityTable& table,
                                                const TorqueReference& reference, const char* name,
                                                std::span<const AnyInverse> inverses,
                                                std::span<const PaperFigure> printed,
                                                const Progress& progress) {
  XyFigure torques = trace_figure(fmt::format("Figure 6: {}", name), "torque [Nm]");
  XyFigure differences = trace_figure(fmt::format("Figure 6: errors, {}", name), "error [Nm]");
  std::vector<std::vector<double>> errors_Nm;
  for (std::size_t i = 0; i < inverses.size(); ++i) {
    const TrackingRun run =
        track(data_sheet(kLearned), {.reference = reference, .measures_bandwidth = false},
              inverses[i], study.options.seed + kFirstTestSeed, progress);
    const char* const family = kTrackingFamilies[i].papers_name;
    table.rows.push_back({.condition = fmt::format("Figure 6, {}", name),
                          .quantity = fmt::format("RMSE, {}", family),
                          .value = run.has_diverged ? kNotMeasured : run.score.rmse,
                          .unit = "Nm",
                          .published = printed[i],
                          .remark = run.has_diverged ? "diverged" : ""});
    if (i == 0)
      add_trace(torques, "reference", run.record.channel("wanted_torque_Nm").values,
                CurveRole::measured);
    add_trace(torques, family, run.record.channel("truth_torque_Nm").values);
    errors_Nm.push_back(tracking_error(run.record));
    add_trace(differences, family, errors_Nm.back());
  }
  study.figures.emplace_back(std::move(torques));
  study.figures.emplace_back(std::move(differences));
  return errors_Nm;
}

/// The chirp's errors over its frequency.
void add_bands(Study& study, QuantityTable& table,
               const std::vector<std::vector<double>>& errors_Nm, const Chirp::Parameters& chirp) {
  XyFigure figure{.title = "Figure 6: error over frequency",
                  .x = {"frequency [Hz]"},
                  .y = {"RMS of the error [Nm]"},
                  .series = {}};
  for (std::size_t i = 0; i < errors_Nm.size(); ++i) {
    XySeries curve{.label = kTrackingFamilies[i].papers_name, .x = {}, .y = {}};
    for (const auto& [frequency_Hz, rms_Nm] :
         rms_by_frequency(errors_Nm[i], kBenchRate_Hz, chirp, kBands_Hz)) {
      curve.x.push_back(frequency_Hz);
      curve.y.push_back(rms_Nm);
      table.rows.push_back(
          {.condition = fmt::format("Figure 6, chirp, {}", curve.label),
           .quantity = fmt::format("RMS of the error about {:.3g} Hz", frequency_Hz),
           .value = rms_Nm,
           .unit = "Nm"});
    }
    figure.series.push_back(std::move(curve));
  }
  study.figures.emplace_back(std::move(figure));
}

/// Figure 6: 160 s of a chirp and of a random walk through three inverses.
void add_tracking(Study& study, QuantityTable& table, const Progress& progress) {
  const StudyOptions& options = study.options;
  constexpr double kQuick_s = 20.0;
  Chirp::Parameters chirp = kChirp;
  if (options.is_quick) chirp.duration_s = kQuick_s;
  Dataset dataset = sweep_dataset(kLearned, options.seed, progress);
  add_torque_mode(dataset,
                  {.actuator = kLearned,
                   .amplitude_Nm = kChirp.amplitude,
                   .seed = options.seed,
                   .duration_s = options.is_quick ? std::optional(kQuick_s) : std::nullopt});
  std::vector<AnyInverse> inverses;
  inverses.reserve(kTrackingFamilies.size());
  for (const LoopFamily& family : kTrackingFamilies)
    inverses.push_back(learned_inverse(family, dataset, options.seed));
  const auto errors_Nm = run_references(study, table, chirp_reference(chirp), "chirp", inverses,
                                        kPrintedChirp, progress);
  run_references(study, table,
                 {.kind = TorqueReference::Kind::random_walk,
                  .amplitude_Nm = kChirp.amplitude,
                  .duration_s = chirp.duration_s},
                 "random walk", inverses, kPrintedWalk, progress);
  add_bands(study, table, errors_Nm, chirp);
}

}  // namespace

Study figures_001(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "Figure 2: torque ramps on a 50 Nm joint with its rotor held. Figure 4: models "
                  "on a new sweep. Figure 6: 160 s "
                  "of a chirp of 0.01 to 0.3 Hz and of noise below 1 Hz with its RMS, both of 13 "
                  "Nm (the paper prints neither), "
                  "followed through their inverses, trained on sweeps and on chirps. One seed",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant(kLearned)}};
  QuantityTable table;
  add_static_loop(study, table);
  add_models(study, table, nth_of(progress, 0, 2, "models"));
  add_tracking(study, table, nth_of(progress, 1, 2, "tracking"));
  study.table = std::move(table);
  study.figure_columns = 2;
  return study;
}

}  // namespace torsio
