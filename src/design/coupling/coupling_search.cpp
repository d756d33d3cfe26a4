#include "torsio/design/coupling/coupling_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "files/unit_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio::design {
namespace {

using Json = nlohmann::json;

constexpr double kFirst_deg = 4.0;
constexpr double kLargest_deg = 20.0;
constexpr int kRuns = 4;
constexpr std::array kMeshNames{"fine", "medium", "coarse"};

/// A dimension that the search varies. The flank is varied by its curvature, which is continuous where
/// a flank is straight.
struct Dimension {
  double low;
  double high;
  double (*of)(const LobeShape& shape);
  void (*set)(LobeShape& shape, double value);
};

double curvature(const LobeShape& shape) {
  return shape.flank_radius_mm == 0.0 ? 0.0 : 1.0 / shape.flank_radius_mm;
}
void set_curvature(LobeShape& shape, double value_1_mm) {
  constexpr double kStraight_1_mm = 0.005;
  shape.flank_radius_mm = std::abs(value_1_mm) < kStraight_1_mm ? 0.0 : 1.0 / value_1_mm;
}

// Over the outer radius but for the angle; the curvature times it.
const std::array kDimensions{
    Dimension{0.08, 0.28, [](const LobeShape& s) { return s.half_width_mm / s.outer_radius_mm; },
              [](LobeShape& s, double v) { s.half_width_mm = v * s.outer_radius_mm; }},
    Dimension{-10.0, 55.0, [](const LobeShape& s) { return s.slot_angle_deg; },
              [](LobeShape& s, double v) { s.slot_angle_deg = v; }},
    Dimension{-1.2, 1.2, [](const LobeShape& s) { return curvature(s) * s.outer_radius_mm; },
              [](LobeShape& s, double v) { set_curvature(s, v / s.outer_radius_mm); }},
    Dimension{0.35, 0.7, [](const LobeShape& s) { return s.root_radius_mm / s.outer_radius_mm; },
              [](LobeShape& s, double v) { s.root_radius_mm = v * s.outer_radius_mm; }},
    Dimension{0.0, 0.15, [](const LobeShape& s) { return s.taper_mm / s.outer_radius_mm; },
              [](LobeShape& s, double v) { s.taper_mm = v * s.outer_radius_mm; }}};

/// A shape near another one that can be built.
LobeShape drawn(const LobeShape& from, double scatter, double least_jaw_mm, Random& random) {
  constexpr int kAttempts = 1000;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    LobeShape shape = from;
    for (const Dimension& each : kDimensions) {
      const double value = each.of(from) + scatter * (each.high - each.low) * random.normal();
      each.set(shape, std::clamp(value, each.low, each.high));
    }
    try {
      check_lobe(shape, least_jaw_mm);
      return shape;
    } catch (const UsageError&) {
      continue;
    }
  }
  return from;
}

std::string key_of(const LobeShape& s, std::size_t mesh) {
  return fmt::format("{} {} {} {} {} {} {}", kMeshNames.at(mesh), s.outer_radius_mm,
                     s.root_radius_mm, s.half_width_mm, s.slot_angle_deg, s.flank_radius_mm,
                     s.taper_mm);
}

std::string text_of(const std::optional<LimitPoint>& point) {
  if (!point) return Json(nullptr).dump();
  return Json{point->angle_deg, point->torque_Nm, point->work_J}.dump();
}

std::optional<LimitPoint> point_in(const std::string& text) {
  const Json json = Json::parse(text);
  if (json.is_null()) return std::nullopt;
  return LimitPoint{json.at(0), json.at(1), json.at(2)};
}

std::string identity_of(const CouplingSearchSettings& s) {
  return Json{{"search", "coupling"},
              {"length_mm", s.demand.length_mm},
              {"bulk_ratio", s.demand.bulk_ratio},
              {"layers", s.demand.layers},
              {"shear_modulus_MPa", s.shear_modulus_MPa},
              {"strain", s.limit.strain},
              {"metric", static_cast<int>(s.limit.metric)}}
      .dump();
}

/// Evaluates shapes, or takes what the resume file has.
class Evaluator {
 public:
  explicit Evaluator(const CouplingSearchSettings& settings)
      : settings_(settings), known_(settings.resume, identity_of(settings)) {}

  std::optional<LimitPoint> at(const LobeShape& shape, std::size_t mesh, const Progress& progress) {
    const std::string key = key_of(shape, mesh);
    if (const std::string* const known = known_.find(key)) return point_in(*known);
    CouplingDemand demand = settings_.demand;
    demand.shape = shape;
    demand.finest_mesh = mesh;
    const auto found = limit_point(demand, settings_.shear_modulus_MPa, settings_.limit, progress);
    known_.add(key, text_of(found));
    return found;
  }

 private:
  const CouplingSearchSettings& settings_;
  UnitFile known_;
};

bool dominates(const LimitPoint& one, const LimitPoint& other) {
  return one.torque_Nm >= other.torque_Nm && one.angle_deg >= other.angle_deg &&
         (one.torque_Nm > other.torque_Nm || one.angle_deg > other.angle_deg);
}

void find_front(std::vector<CouplingCandidate>& candidates) {
  for (CouplingCandidate& each : candidates) {
    const auto& point = each.at_limit[kCoarseMesh];
    each.is_on_front =
        point && std::ranges::none_of(candidates, [&](const auto& other) {
          return other.at_limit[kCoarseMesh] && dominates(*other.at_limit[kCoarseMesh], *point);
        });
  }
}

/// The gain on a mesh; on the fine one, the smaller one of that and of the medium one.
double gain_of(const CouplingCandidate& candidate, const CouplingCandidate& reference,
               std::size_t mesh) {
  const auto on = [&](std::size_t m) {
    return CouplingGain{"", candidate.at_limit.at(m), reference.at_limit.at(m)}.gain().value_or(
        -1.0);
  };
  return mesh == 0 ? std::min(on(0), on(1)) : on(mesh);
}

/// Candidates with the largest gains on a mesh, the best one first.
std::vector<std::size_t> best_on(const std::vector<CouplingCandidate>& candidates,
                                 std::size_t reference, std::size_t mesh, std::size_t count) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (candidates[i].at_limit[mesh]) order.push_back(i);
  std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t i) {
    return gain_of(candidates[i], candidates[reference], mesh);
  });
  order.resize(std::min(order.size(), count));
  return order;
}

std::size_t reference_of(const std::vector<CouplingCandidate>& seven) {
  const auto work = [](const CouplingCandidate& each) {
    return each.at_limit[kCoarseMesh] ? each.at_limit[kCoarseMesh]->work_J : -1.0;
  };
  const auto most = std::ranges::max_element(seven, {}, work);
  if (!most->at_limit[kCoarseMesh])
    throw Error({.place = "search for a coupling",
                 .problem = "none of the seven geometries reaches the strain limit",
                 .advice = "Take a smaller limit."});
  return static_cast<std::size_t>(most - seven.begin());
}

LobeShape scaled(LobeShape shape, double outer_radius_mm) {
  const double scale = outer_radius_mm / shape.outer_radius_mm;
  for (double LobeShape::*length :
       {&LobeShape::outer_radius_mm, &LobeShape::root_radius_mm, &LobeShape::half_width_mm,
        &LobeShape::flank_radius_mm, &LobeShape::taper_mm})
    shape.*length *= scale;
  return shape;
}

/// The shapes of one mesh that are drawn, and how far from each other.
struct Stage {
  std::size_t mesh;
  std::size_t shapes;
  double widest;
  double narrowest;
};

class Search {
 public:
  Search(const CouplingSearchSettings& settings, const Progress& progress)
      : settings_(settings),
        progress_(progress),
        evaluator_(settings),
        random_(settings.seed),
        stages_{{{kCoarseMesh, settings.shapes, 0.2, 0.02},
                 {1, settings.shapes / 3, 0.05, 0.02},
                 {0, settings.shapes / 6, 0.03, 0.01}}} {
    expected_ = paper_lobes().size() + stages_[0].shapes + stages_[1].shapes + stages_[2].shapes +
                2 * (kKept + 1);
  }

  CouplingSearch found() {
    auto& candidates = found_.candidates;
    for (const NamedLobe& lobe : paper_lobes()) {
      candidates.push_back({.name = std::string(lobe.name),
                            .shape = scaled(lobe.shape, settings_.demand.shape.outer_radius_mm)});
      evaluate(candidates.size() - 1, kCoarseMesh);
    }
    found_.reference = reference_of(candidates);
    for (const Stage& stage : stages_) run(stage);
    find_front(candidates);
    const auto best = best_on(candidates, found_.reference, 0, 1);
    found_.best = best.empty() ? found_.reference : best.front();
    for (std::size_t mesh = kCoarseMesh + 1; mesh-- > 0;)
      found_.gains.push_back({kMeshNames.at(mesh), candidates[found_.best].at_limit.at(mesh),
                              candidates[found_.reference].at_limit.at(mesh)});
    return std::move(found_);
  }

 private:
  static constexpr std::size_t kKept = 4;  // shapes that the next mesh takes over

  void run(const Stage& stage) {
    auto& candidates = found_.candidates;
    if (stage.mesh < kCoarseMesh) {
      evaluate(found_.reference, stage.mesh);
      for (const std::size_t i : best_on(candidates, found_.reference, stage.mesh + 1, kKept))
        evaluate(i, stage.mesh);
    }
    for (std::size_t i = 0; i < stage.shapes; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(stage.shapes);
      const double scatter = stage.widest * std::pow(stage.narrowest / stage.widest, share);
      const LobeShape& parent = candidates[parent_of(stage, i)].shape;
      candidates.push_back(
          {.name = {}, .shape = drawn(parent, scatter, settings_.least_jaw_mm, random_)});
      evaluate(candidates.size() - 1, stage.mesh);
      if (stage.mesh == 0) evaluate(candidates.size() - 1, 1);
    }
  }

  /// On the coarse mesh every second shape comes from anywhere on the front, all others from the best one.
  std::size_t parent_of(const Stage& stage, std::size_t i) {
    auto& candidates = found_.candidates;
    if (stage.mesh == kCoarseMesh && i % 2 == 1) {
      find_front(candidates);
      std::vector<std::size_t> front;
      for (std::size_t k = 0; k < candidates.size(); ++k)
        if (candidates[k].is_on_front) front.push_back(k);
      return front[static_cast<std::size_t>(random_.uniform() * static_cast<double>(front.size()))];
    }
    const auto best = best_on(candidates, found_.reference, stage.mesh, 1);
    return best.empty() ? found_.reference : best.front();
  }

  void evaluate(std::size_t candidate, std::size_t mesh) {
    auto& point = found_.candidates[candidate].at_limit.at(mesh);
    if (point) return;
    point = evaluator_.at(
        found_.candidates[candidate].shape, mesh, [&](double fraction, std::string_view) {
          return !progress_ || progress_(std::min(1.0, (static_cast<double>(done_) + fraction) /
                                                           static_cast<double>(expected_)),
                                         fmt::format("shape {}, {} mesh", found_.candidates.size(),
                                                     kMeshNames.at(mesh)));
        });
    ++done_;
  }

  const CouplingSearchSettings& settings_;
  const Progress& progress_;
  Evaluator evaluator_;
  Random random_;
  std::array<Stage, 3> stages_;
  CouplingSearch found_;
  std::size_t done_ = 0;
  std::size_t expected_ = 0;
};

}  // namespace

std::optional<LimitPoint> limit_point(CouplingDemand demand, double shear_modulus_MPa,
                                      const CouplingLimit& limit, const Progress& progress) {
  constexpr double kRoom = 1.15;
  demand.angle_deg = kFirst_deg;
  for (int run = 0; run < kRuns; ++run) {
    const CouplingTwist twist = twist_coupling(demand, progress);
    // A coarser mesh, which is tried where this one does not converge, hides strains.
    const int radial = coupling_meshes().at(demand.finest_mesh).radial;
    if (twist.compressed.density.radial != radial || twist.stretched.density.radial != radial)
      return std::nullopt;
    const auto curve = torque_curve(twist, demand.length_mm, shear_modulus_MPa);
    if (const auto angle_deg = angle_at_strain(twist, limit.strain, limit.metric)) {
      LimitPoint point{.angle_deg = *angle_deg, .torque_Nm = *torque_at(curve, *angle_deg)};
      for (std::size_t i = 1; i < curve.size() && curve[i - 1].first < *angle_deg; ++i) {
        const double to_deg = std::min(curve[i].first, *angle_deg);
        const double to_Nm = *torque_at(curve, to_deg);
        point.work_J += 0.5 * (curve[i - 1].second + to_Nm) * (to_deg - curve[i - 1].first) *
                        std::numbers::pi / 180.0;
      }
      return point;
    }
    // A lobe that stopped earlier would do so again.
    if (curve.back().first < demand.angle_deg - 1e-9 || demand.angle_deg >= kLargest_deg)
      return std::nullopt;
    const double reached = std::max(strain_of(twist.compressed.curve.steps.back(), limit.metric),
                                    strain_of(twist.stretched.curve.steps.back(), limit.metric));
    const double factor = std::clamp(kRoom * limit.strain / reached, 1.2, 3.0);
    demand.angle_deg = std::min(std::ceil(factor * demand.angle_deg), kLargest_deg);
  }
  return std::nullopt;
}

std::optional<double> CouplingGain::gain() const {
  if (!best || !reference) return std::nullopt;
  return std::min(best->torque_Nm / reference->torque_Nm, best->angle_deg / reference->angle_deg) -
         1.0;
}

std::optional<double> CouplingGain::work_gain() const {
  if (!best || !reference) return std::nullopt;
  return best->work_J / reference->work_J - 1.0;
}

CouplingSearch search_couplings(const CouplingSearchSettings& settings, const Progress& progress) {
  return Search(settings, progress).found();
}

}  // namespace torsio::design
