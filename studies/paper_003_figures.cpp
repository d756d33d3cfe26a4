#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "paper_figures.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/sim/experiments/experiment.hpp"

// Paper 003: the loops of Figure 7, and the coefficients of the models of sections 4 and 5 when they are fitted here.

namespace torsio {
namespace {

constexpr double kSlowCycle_s = 20.0;
constexpr double kSlowCycles = 30.0;
constexpr double kQuickCycles = 3.0;
constexpr double kBeginning_Nm = 1.0;
constexpr std::size_t kPointEvery = 20;  // samples of 200 Hz

struct Loops {
  std::vector<double> twist_deg;
  std::vector<double> torque_Nm;
  std::size_t cycle = 0;  ///< samples
};

Loops slow_loops(const std::string& actuator, double cycles, std::uint64_t seed) {
  const Recording recording = simulate({.actuator = actuator,
                                        .experiment = "slow-cycles",
                                        .seed = seed,
                                        .duration_s = cycles * kSlowCycle_s,
                                        .with_truth = true});
  Loops loops{.twist_deg = recording.channel("spring_deflection_rad").values,
              .torque_Nm = recording.channel("torque_Nm").values,
              .cycle = static_cast<std::size_t>(kSlowCycle_s * recording.sample_rate_Hz())};
  for (double& value : loops.twist_deg) value = deg_from_rad(value);
  return loops;
}

/// Half the range of the twist in one cycle.
double swing(const Loops& loops, std::size_t cycle) {
  const auto begin = loops.twist_deg.begin() + static_cast<std::ptrdiff_t>(cycle * loops.cycle);
  const auto [low, high] =
      std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(loops.cycle));
  return 0.5 * (*high - *low);
}

/// Torque over twist on the first load, at `kBeginning_Nm`; NaN where that is not reached.
double first_stiffness(const Loops& loops) {
  const auto begin = std::ranges::find_if(
      loops.torque_Nm, [](double torque_Nm) { return std::abs(torque_Nm) >= kBeginning_Nm; });
  if (begin == loops.torque_Nm.end()) return kNotMeasured;
  const auto at = static_cast<std::size_t>(begin - loops.torque_Nm.begin());
  return loops.torque_Nm[at] / loops.twist_deg[at];
}

/// Distance of the torques of one cycle where its twist passes 0, up and down.
double distance_at_origin(const Loops& loops, std::size_t cycle) {
  double up_Nm = kNotMeasured;
  double down_Nm = kNotMeasured;
  for (std::size_t n = cycle * loops.cycle + 1; n < (cycle + 1) * loops.cycle; ++n) {
    if (loops.twist_deg[n - 1] < 0.0 && loops.twist_deg[n] >= 0.0) up_Nm = loops.torque_Nm[n];
    if (loops.twist_deg[n - 1] > 0.0 && loops.twist_deg[n] <= 0.0) down_Nm = loops.torque_Nm[n];
  }
  return std::abs(up_Nm - down_Nm);
}

/// Figure 7: 30 slow cycles of a bonded coupling, one whose glue creeps, and one without glue.
void add_slow_cycles(Study& study, QuantityTable& table) {
  const double cycles = study.options.is_quick ? kQuickCycles : kSlowCycles;
  const auto last = static_cast<std::size_t>(cycles) - 1;
  const auto row = [&](const char* condition, const char* quantity, double value, const char* unit,
                       const std::optional<PaperFigure>& published = {}, std::string remark = {}) {
    table.rows.push_back({.condition = condition,
                          .quantity = quantity,
                          .value = value,
                          .unit = unit,
                          .published = published,
                          .remark = std::move(remark)});
  };
  const Loops bonded = slow_loops("elastomer:bonded", cycles, study.options.seed);
  const Loops creeping = slow_loops("elastomer:creeping", cycles, study.options.seed);
  const Loops unbonded = slow_loops("elastomer:unbonded", cycles, study.options.seed);
  constexpr const char* kOther = "the paper's is another coupling: geometry alpha, glued";
  row("Figure 7, bonded", "twist at 6 Nm", swing(bonded, 0), "deg",
      paper_figure("003", "Fig. 7", "bonded at 6 Nm", "twist"), kOther);
  row("Figure 7, unbonded", "twist at 6 Nm", swing(unbonded, 0), "deg",
      paper_figure("003", "Fig. 7", "unbonded at 6 Nm", "twist"), kOther);
  row("Figure 7, bonded against unbonded", "stiffness in the beginning",
      first_stiffness(bonded) / first_stiffness(unbonded), "-",
      paper_figure("003", "section 3.3", "bonded against unbonded", "stiffness ratio"),
      "the plant has it from the paper");
  row("Figure 7, bonded", "distance of the curves at the origin", distance_at_origin(bonded, last),
      "Nm", {}, "printed: they do not meet");
  row("Figure 7, unbonded", "distance of the curves at the origin",
      distance_at_origin(unbonded, last), "Nm", {}, "printed: they meet");
  const std::string of_load = fmt::format("at {:.3g} Nm, which the glue carries in the last cycle",
                                          *std::ranges::max_element(creeping.torque_Nm));
  row("Figure 7, creeping glue", "twist in the first cycle", swing(creeping, 0), "deg", {},
      of_load);
  row("Figure 7, creeping glue", "twist in the last cycle", swing(creeping, last), "deg", {},
      "printed: drifts towards the unbonded");
  XyFigure figure{.title = "Figure 7", .x = {"twist [deg]"}, .y = {"torque [Nm]"}, .series = {}};
  for (const auto& [label, loops] :
       {std::pair("bonded", &bonded), {"creeping glue", &creeping}, {"unbonded", &unbonded}}) {
    XySeries series{.label = label, .role = CurveRole::measured, .x = {}, .y = {}};
    for (std::size_t n = 0; n < loops->twist_deg.size(); n += kPointEvery) {
      // The first and the last cycle.
      if (n >= loops->cycle && n < last * loops->cycle) continue;
      series.x.push_back(loops->twist_deg[n]);
      series.y.push_back(loops->torque_Nm[n]);
    }
    figure.series.push_back(std::move(series));
  }
  study.figures.emplace_back(std::move(figure));
}

struct FittedNetwork {
  const char* choice;
  const char* condition;  ///< as in paper_figures.csv
};
constexpr std::array kNetworks{FittedNetwork{"viscoelastic:network=003a", "model (a)"},
                               FittedNetwork{"viscoelastic:network=003b", "model (b)"},
                               FittedNetwork{"viscoelastic:network=003c", "model (c)"},
                               FittedNetwork{"viscoelastic:network=003d", "model (d)"}};

/// Table 3 and the linear part of section 4.2.1: what the same models have when fitted to the plant.
void add_coefficients(Study& study, QuantityTable& table) {
  Dataset dataset;
  Recording triangles = simulate(
      {.actuator = "elastomer:bonded", .experiment = "triangles", .seed = study.options.seed});
  const std::size_t samples = triangles.size();
  dataset.records.push_back({std::move(triangles), whole_record(samples, Role::train)});
  dataset.initialise_samples = 0;
  const auto fitted = [&](const char* choice) {
    return train_model(dataset, model_choices(dataset, choice, {"spring_deflection_rad"}).front(),
                       study.options.seed);
  };
  const auto add = [&](const std::string& condition, const char* item, const char* papers_condition,
                       const FittedParameter& parameter) {
    const PaperFigure* const figure =
        find_paper_figure("003", item, papers_condition, parameter.name);
    if (figure == nullptr) return;
    // Table 3 has degrees.
    const bool has_angle = parameter.unit.find("/rad") != std::string::npos;
    table.rows.push_back(
        {.condition = condition,
         .quantity = parameter.name,
         .value = has_angle ? rad_from_deg(parameter.value) : parameter.value,
         .unit = std::string(figure->unit),
         .published = *figure,
         .remark = std::isfinite(parameter.std_error)
                       ? fmt::format("+- {:.2g}", has_angle ? rad_from_deg(parameter.std_error)
                                                            : parameter.std_error)
                       : "not determined by the data"});
  };
  for (const FittedNetwork& network : kNetworks)
    for (const FittedParameter& parameter : fitted(network.choice).table)
      add(fmt::format("Table 3, {}", network.condition), "Table 3", network.condition, parameter);
  for (const FittedParameter& parameter : fitted("hammerstein_wiener:structure=given").table)
    add("(5) and (6), Hammerstein-Wiener", "section 4.2.1", "linear part", parameter);
}

}  // namespace

Study figures_003(const StudyOptions& options, const Progress& /*progress*/) {
  Study study{.protocol =
                  "Figure 7: 30 slow cycles of 6 Nm of the simulated coupling, bonded, with "
                  "creeping glue and "
                  "unbonded. Coefficients: the models of sections 4 and 5 fitted to triangles of "
                  "0.4 to 4 Hz of "
                  "the bonded coupling. One seed",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant("elastomer:bonded"), study_plant("elastomer:unbonded")}};
  QuantityTable table;
  add_slow_cycles(study, table);
  add_coefficients(study, table);
  study.table = std::move(table);
  return study;
}

}  // namespace torsio
