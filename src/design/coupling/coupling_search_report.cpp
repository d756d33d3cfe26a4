#include <fmt/format.h>

#include <algorithm>

#include "torsio/design/coupling/coupling_search.hpp"

namespace torsio::design {
namespace {

constexpr double kUseful = 0.1;  // gain that the search looks for

DesignSection seven_section(const CouplingSearch& search) {
  DesignSection section{"geometries_of_paper_003"};
  for (const CouplingCandidate& each : search.candidates) {
    if (each.name.empty()) continue;
    const auto& point = each.at_limit[kCoarseMesh];
    section.figures.push_back(
        {each.name + "_torque", point ? point->torque_Nm : kNotMeasured, "Nm",
         point ? fmt::format("at {:.4g} deg, {:.3g} J stored{}", point->angle_deg, point->work_J,
                             each.is_on_front ? ", on the front" : "")
               : std::string(),
         point ? "" : "not reached"});
  }
  return section;
}

DesignSection shape_section(const LobeShape& s) {
  return {
      "best_shape",
      {{"outer_radius", s.outer_radius_mm, "mm"},
       {"root_radius", s.root_radius_mm, "mm"},
       {"half_width", s.half_width_mm, "mm", "of the slot at the root radius"},
       {"slot_angle", s.slot_angle_deg, "deg"},
       {"flank_radius", s.flank_radius_mm, "mm", "0: straight, > 0: concave jaw, < 0: convex jaw"},
       {"taper", s.taper_mm, "mm"},
       {"thinnest_jaw", thinnest_jaw_mm(s), "mm"}}};
}

DesignSection gain_section(const CouplingGain& gain, const std::string& reference) {
  DesignSection section{gain.mesh + "_mesh"};
  const auto add = [&](const std::string& name, const std::optional<LimitPoint>& point) {
    section.figures.push_back({name + "_torque", point ? point->torque_Nm : kNotMeasured, "Nm", "",
                               point ? "" : "not reached"});
    section.figures.push_back({name + "_angle", point ? point->angle_deg : kNotMeasured, "deg", "",
                               point ? "" : "not reached"});
  };
  add("best", gain.best);
  add(reference, gain.reference);
  const auto add_gain = [&](const char* name, const std::optional<double>& share,
                            const char* remark) {
    section.figures.push_back(
        {name, share ? 100.0 * *share : kNotMeasured, "%", remark, share ? "" : "none"});
  };
  add_gain("gain", gain.gain(), "torque and twist are larger by at least this");
  add_gain("work_gain", gain.work_gain(), "of the work stored up to the limit");
  return section;
}

XyFigure front_figure(const CouplingSearch& search) {
  XySeries tried{.label = "shapes of the search", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries seven{.label = "geometries of paper 003",
                 .style = CurveStyle::points,
                 .role = CurveRole::measured,
                 .x = {},
                 .y = {}};
  std::vector<LimitPoint> front;
  for (const CouplingCandidate& each : search.candidates) {
    const auto& point = each.at_limit[kCoarseMesh];
    if (!point) continue;
    XySeries& series = each.name.empty() ? tried : seven;
    series.x.push_back(point->angle_deg);
    series.y.push_back(point->torque_Nm);
    if (!each.name.empty()) series.names.push_back(each.name);
    if (each.is_on_front) front.push_back(*point);
  }
  std::ranges::sort(front, {}, &LimitPoint::angle_deg);
  XySeries line{.label = "Pareto front", .role = CurveRole::limit, .x = {}, .y = {}};
  for (const LimitPoint& point : front) {
    line.x.push_back(point.angle_deg);
    line.y.push_back(point.torque_Nm);
  }
  return {.title = "Torque and twist at the strain limit, coarse mesh",
          .x = {"twist [deg]"},
          .y = {"torque [Nm]"},
          .series = {tried, seven, line}};
}

}  // namespace

DesignReport coupling_search_report(const CouplingSearchSettings& settings,
                                    const CouplingSearch& search) {
  DesignReport report{.design = "coupling"};
  const std::string& reference = search.candidates[search.reference].name;
  report.sections.push_back({"search",
                             {{"shapes", static_cast<double>(search.candidates.size()), "",
                               "the seven of paper 003 and those of the search, on all meshes"},
                              {"seed", static_cast<double>(settings.seed)},
                              {"strain_limit", 100.0 * settings.limit.strain, "%"},
                              {"shear_modulus", settings.shear_modulus_MPa, "MPa"},
                              {"length", settings.demand.length_mm, "mm"},
                              {"least_jaw", settings.least_jaw_mm, "mm"},
                              {"reference", kNotMeasured, "",
                               "the one of the seven that stores the most work", reference}}});
  report.sections.push_back(seven_section(search));
  const CouplingCandidate& best = search.candidates[search.best];
  report.sections.push_back(shape_section(best.shape));
  for (const CouplingGain& gain : search.gains)
    if (gain.best ||
        gain.mesh != "coarse")  // shapes of the later meshes are not tried on the coarse one
      report.sections.push_back(gain_section(gain, reference));
  report.pictures = {front_figure(search)};
  const auto least = [&](const auto& of) {
    return std::min(of(search.gains.at(1)).value_or(-1.0), of(search.gains.at(2)).value_or(-1.0));
  };
  const double both = least([](const CouplingGain& gain) { return gain.gain(); });
  const double work = least([](const CouplingGain& gain) { return gain.work_gain(); });
  report.notes.push_back(
      fmt::format("On the medium and the fine mesh the best shape has at least {:.1f} % more "
                  "torque and twist than "
                  "{} and stores at least {:.1f} % more work{}",
                  100.0 * both, reference, 100.0 * work,
                  both >= 0.0 && work >= kUseful ? "." : ": no gain of 10 %, try more shapes."));
  report.notes.emplace_back(
      "Strains at the ends of a bond are singular: gains hold for the metric of the limit. Plane "
      "strain, six bonded lobes without the inner ring.");
  return report;
}

}  // namespace torsio::design
