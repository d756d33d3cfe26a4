#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "figure_curves.hpp"
#include "paper_figures.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "tracking_models.hpp"

// Paper 000: traces of Figure 8, loops of Figure 9, and the two actuations of section 4.

namespace torsio {
namespace {

constexpr const char* kTracked = "dfki-120";
constexpr std::array kControllers{kLoopMixture, kLoopLine};

/// What the paper prints of one amplitude.
struct PrintedChirp {
  double amplitude_Nm;
  std::array<PaperFigure, 2> mad;  ///< mixture, linear
  std::array<PaperFigure, 2> std_abs;
  std::array<PaperFigure, 2> percent;  ///< MAD over the amplitude
  PaperFigure ratio;                   ///< MAD of the mixture over that of the linear model
};

consteval PrintedChirp printed_chirp(double amplitude_Nm, std::string_view mixture,
                                     std::string_view linear, std::string_view both) {
  return {
      amplitude_Nm,
      {paper_figure("000", "Fig. 8", mixture, "MAD"), paper_figure("000", "Fig. 8", linear, "MAD")},
      {paper_figure("000", "Fig. 8", mixture, "STD"), paper_figure("000", "Fig. 8", linear, "STD")},
      {paper_figure("000", "section 6.1", mixture, "mean error ratio"),
       paper_figure("000", "section 6.1", linear, "mean error ratio")},
      paper_figure("000", "section 6.1", both, "MAD ratio")};
}
constexpr std::array kChirps{printed_chirp(70.0, "chirp of 70 Nm on the 120 Nm actuator: DGMM",
                                           "chirp of 70 Nm on the 120 Nm actuator: linear",
                                           "chirp of 70 Nm on the 120 Nm actuator"),
                             printed_chirp(20.0, "chirp of 20 Nm on the 120 Nm actuator: DGMM",
                                           "chirp of 20 Nm on the 120 Nm actuator: linear",
                                           "chirp of 20 Nm on the 120 Nm actuator")};

/// Means over the repeats of one controller.
struct TrackedErrors {
  RunningMean mad;
  RunningMean std_abs;
  std::size_t diverged = 0;
};
using ChirpErrors = std::array<TrackedErrors, kControllers.size()>;

/// The runs of one amplitude; those of the first repeat are drawn.
ChirpErrors run_chirps(Study& study, double amplitude_Nm, const Progress& progress) {
  const StudyOptions& options = study.options;
  const std::optional<double> duration_s = options.is_quick ? std::optional(20.0) : std::nullopt;
  const TrackingSpec spec{.reference = {.amplitude_Nm = amplitude_Nm, .duration_s = duration_s},
                          .measures_bandwidth = false};
  ChirpErrors errors{};
  XyFigure torques = trace_figure(fmt::format("Figure 8, {:g} Nm", amplitude_Nm), "torque [Nm]");
  XyFigure differences =
      trace_figure(fmt::format("Figure 8, error at {:g} Nm", amplitude_Nm), "error [Nm]");
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    Dataset dataset = sweep_dataset(kTracked, seed, progress);
    add_torque_mode(dataset, {.actuator = kTracked,
                              .amplitude_Nm = amplitude_Nm,
                              .seed = seed,
                              .duration_s = duration_s});
    for (std::size_t c = 0; c < kControllers.size(); ++c) {
      const TrackingRun run =
          track(data_sheet(kTracked), spec, learned_inverse(kControllers[c], dataset, seed),
                seed + kFirstTestSeed, progress);
      if (run.has_diverged) {
        ++errors[c].diverged;
      } else {
        errors[c].mad.add(run.score.mad);
        errors[c].std_abs.add(run.score.std_abs);
      }
      if (k > 0) continue;
      if (c == 0)
        add_trace(torques, "reference", run.record.channel("wanted_torque_Nm").values,
                  CurveRole::measured);
      add_trace(torques, kControllers[c].papers_name, run.record.channel("truth_torque_Nm").values);
      add_trace(differences, kControllers[c].papers_name, tracking_error(run.record));
    }
  }
  study.figures.emplace_back(std::move(torques));
  study.figures.emplace_back(std::move(differences));
  return errors;
}

void add_chirp_rows(QuantityTable& table, const PrintedChirp& printed, const ChirpErrors& errors) {
  const auto row = [&](std::string quantity, double value, const char* unit,
                       const PaperFigure& published, std::size_t diverged = 0) {
    table.rows.push_back(
        {.condition = fmt::format("Figure 8, chirp of {:g} Nm", printed.amplitude_Nm),
         .quantity = std::move(quantity),
         .value = value,
         .unit = unit,
         .published = published,
         .remark = diverged == 0 ? std::string() : fmt::format("{} runs diverged", diverged)});
  };
  for (std::size_t c = 0; c < kControllers.size(); ++c) {
    const TrackedErrors& of = errors[c];
    const char* const name = kControllers[c].papers_name;
    row(fmt::format("MAD, {}", name), of.mad.mean(), "Nm", printed.mad[c], of.diverged);
    row(fmt::format("STD of |e|, {}", name), of.std_abs.mean(), "Nm", printed.std_abs[c],
        of.diverged);
    row(fmt::format("MAD over the amplitude, {}", name),
        100.0 * of.mad.mean() / printed.amplitude_Nm, "%", printed.percent[c], of.diverged);
  }
  row("MAD, DGMM over linear", errors[0].mad.mean() / errors[1].mad.mean(), "-", printed.ratio);
}

/// The ends of a swing: a lever beyond 90 deg has a smaller torque there than on its way.
struct SwingEnds {
  double angle_deg = 0.0;     ///< the smaller one of both
  double torque_share = 0.0;  ///< |torque| there over the largest of that side, mean of both
};

SwingEnds swing_ends(const std::vector<double>& joint_rad, const std::vector<double>& torque_Nm) {
  const auto [low, high] = std::ranges::minmax_element(joint_rad);
  const auto [lowest_Nm, highest_Nm] = std::ranges::minmax(torque_Nm);
  double share = 0.0;
  for (const auto end : {low, high}) {
    const double torque = torque_Nm[static_cast<std::size_t>(end - joint_rad.begin())];
    share += 0.5 * torque / (torque < 0.0 ? lowest_Nm : highest_Nm);
  }
  return {.angle_deg = deg_from_rad(std::min(-*low, *high)), .torque_share = share};
}

/// Figure 9: the loops of position-controlled swings of the four actuators.
void add_swings(Study& study, QuantityTable& table) {
  for (const char* const actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    ExperimentSpec spec{.actuator = actuator, .experiment = "sweep", .seed = study.options.seed};
    if (study.options.is_quick) spec.duration_s = 40.0;
    const Recording swing = simulate(spec);
    const double rating_Nm = data_sheet(actuator).rating.torque_Nm.value;
    const std::size_t step = Thinning{}.step;
    const std::vector<double> deflection_deg = deflection_curve(swing);
    const std::vector<double> torque_Nm = every(swing.channel("torque_Nm").values, step);
    const LoopMeasures of = loop_measures(deflection_deg, torque_Nm);
    const SwingEnds ends =
        swing_ends(every(swing.channel("joint_angle_rad").values, step), torque_Nm);
    const std::string condition = fmt::format("Figure 9, {}", actuator);
    const auto row = [&](const char* quantity, double value, const char* unit,
                         std::string remark = {}) {
      table.rows.push_back({.condition = condition,
                            .quantity = quantity,
                            .value = value,
                            .unit = unit,
                            .remark = std::move(remark)});
    };
    row("width of the loop", of.width_Nm, "Nm");
    row("width over the rating", 100.0 * of.width_Nm / rating_Nm, "%");
    row("nonlinearity over the rating", 100.0 * of.nonlinear_Nm / rating_Nm, "%");
    row("largest angle of the joint", ends.angle_deg, "deg");
    row("torque at the ends of the swing over the largest", ends.torque_share, "-",
        "clearly below 1: another loop at each end, as the paper has beyond 90 deg");
    XyFigure figure = loop_figure(condition);
    add_loop(figure, "measured", deflection_deg, torque_Nm);
    study.figures.emplace_back(std::move(figure));
  }
}

struct Actuated {
  const char* label;
  DeflectionController::Actuation actuation;
  std::optional<double> velocity_rad_s;
  const char* papers_remark;
};
constexpr std::array kActuated{
    Actuated{"on the current", DeflectionController::Actuation::current, std::nullopt,
             "chosen by the paper"},
    Actuated{"on the velocity, 50 rad/s", DeflectionController::Actuation::velocity, 50.0,
             "the paper: oscillates"},
    Actuated{"on the velocity, 200 rad/s", DeflectionController::Actuation::velocity, 200.0,
             "the paper: oscillates"}};

/// Section 4: the deflection controller on the current and on the velocity, steps on the 50 Nm joint.
void add_actuations(Study& study, QuantityTable& table) {
  constexpr const char* kJoint = "dfki-50";
  XyFigure figure = trace_figure("section 4: steps of the torque", "torque [Nm]");
  const LinearInverse line = sweep_line(data_sheet(kJoint), study.options.seed);
  for (const Actuated& loop : kActuated) {
    const TrackingRun run = track(data_sheet(kJoint),
                                  {.reference = {.kind = TorqueReference::Kind::steps},
                                   .actuation = loop.actuation,
                                   .velocity_rad_s = loop.velocity_rad_s,
                                   .measures_bandwidth = false},
                                  line, study.options.seed + kFirstTestSeed);
    const auto row = [&](const char* quantity, double value, const char* unit, std::string remark) {
      table.rows.push_back({.condition = fmt::format("section 4, {}", loop.label),
                            .quantity = quantity,
                            .value = run.has_diverged ? kNotMeasured : value,
                            .unit = unit,
                            .remark = run.has_diverged ? "diverged" : std::move(remark)});
    };
    row("MAD", run.score.mad, "Nm", {});
    row("overshoot over the step", 100.0 * run.score.overshoot.value_or(kNotMeasured), "%", {});
    row("limit cycle at the end of a step (1: yes)", run.score.limit_cycle ? 1.0 : 0.0, "-",
        loop.papers_remark);
    if (figure.series.empty())
      add_trace(figure, "reference", run.record.channel("wanted_torque_Nm").values,
                CurveRole::measured);
    add_trace(figure, loop.label, run.record.channel("truth_torque_Nm").values);
  }
  study.figures.emplace_back(std::move(figure));
}

}  // namespace

Study figures_000(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "Figure 8: a 120 Nm joint with its output locked follows chirps of 70 and 20 Nm "
                  "through the inverse of a "
                  "mixture and of a linear model, trained on sweeps and on chirps of 1.1, 0.5 and "
                  "0.25 times the amplitude. "
                  "Figure 9: position-controlled swings of the four actuators. Section 4: steps "
                  "with the deflection controller "
                  "on the current and on the velocity. Figure 9 and section 4 have one seed",
              .unit = "Nm",
              .options = options};
  for (const char* const actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"})
    study.plants.push_back(study_plant(actuator));
  QuantityTable table;
  for (std::size_t c = 0; c < kChirps.size(); ++c)
    add_chirp_rows(table, kChirps[c],
                   run_chirps(study, kChirps[c].amplitude_Nm,
                              nth_of(progress, c, kChirps.size() + 1, "chirps")));
  add_swings(study, table);
  add_actuations(study, table);
  study.table = std::move(table);
  study.figure_columns = 2;
  return study;
}

}  // namespace torsio
