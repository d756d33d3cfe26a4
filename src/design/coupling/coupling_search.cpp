#include "torsio/design/coupling/coupling_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "sim/campaign/unit_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio::design {
namespace {

using Json = nlohmann::json;

constexpr double kFirst_deg = 4.0;
constexpr double kLargest_deg = 20.0;
constexpr int kRuns = 4;
constexpr std::size_t kCoarse = 2;  // index in `coupling_meshes`
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
  for (CouplingCandidate& each : candidates)
    each.is_on_front =
        each.at_limit && std::ranges::none_of(candidates, [&](const CouplingCandidate& other) {
          return other.at_limit && dominates(*other.at_limit, *each.at_limit);
        });
}

double gain_of(const LimitPoint& point, const LimitPoint& reference) {
  return std::min(point.torque_Nm / reference.torque_Nm, point.angle_deg / reference.angle_deg) -
         1.0;
}

/// The candidate with the largest gain over a reference.
std::size_t best_over(const std::vector<CouplingCandidate>& candidates,
                      const LimitPoint& reference) {
  std::size_t best = 0;
  double largest = -1.0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!candidates[i].at_limit) continue;
    const double gain = gain_of(*candidates[i].at_limit, reference);
    if (gain <= largest) continue;
    largest = gain;
    best = i;
  }
  return best;
}

std::size_t reference_of(const std::vector<CouplingCandidate>& seven) {
  const auto work = [](const CouplingCandidate& each) {
    return each.at_limit ? each.at_limit->work_J : -1.0;
  };
  const auto most = std::ranges::max_element(seven, {}, work);
  if (!most->at_limit)
    throw Error({.place = "search for a coupling",
                 .problem = "none of the seven geometries reaches the strain limit",
                 .advice = "Take a smaller limit."});
  return static_cast<std::size_t>(most - seven.begin());
}

}  // namespace

std::optional<LimitPoint> limit_point(CouplingDemand demand, double shear_modulus_MPa,
                                      const CouplingLimit& limit, const Progress& progress) {
  constexpr double kRoom = 1.15;
  demand.angle_deg = kFirst_deg;
  for (int run = 0; run < kRuns; ++run) {
    const CouplingTwist twist = twist_coupling(demand, progress);
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
  return gain_of(*best, *reference);
}

CouplingSearch search_couplings(const CouplingSearchSettings& settings, const Progress& progress) {
  constexpr double kWidest = 0.2;
  constexpr double kNarrowest = 0.02;
  Evaluator evaluator(settings);
  CouplingSearch search;
  const std::size_t all = paper_lobes().size() + settings.shapes + 2 * kCoarse;
  std::size_t done = 0;
  const auto evaluated = [&](const LobeShape& shape, std::size_t mesh) {
    const auto point = evaluator.at(shape, mesh, [&](double fraction, std::string_view) {
      return !progress ||
             progress((static_cast<double>(done) + fraction) / static_cast<double>(all),
                      fmt::format("shape {} of {}", done + 1, all));
    });
    ++done;
    return point;
  };
  for (const NamedLobe& lobe : paper_lobes()) {
    LobeShape shape = lobe.shape;
    const double scale = settings.demand.shape.outer_radius_mm / shape.outer_radius_mm;
    for (double LobeShape::*length :
         {&LobeShape::outer_radius_mm, &LobeShape::root_radius_mm, &LobeShape::half_width_mm,
          &LobeShape::flank_radius_mm, &LobeShape::taper_mm})
      shape.*length *= scale;
    search.candidates.push_back({.name = std::string(lobe.name), .shape = shape});
    search.candidates.back().at_limit = evaluated(shape, kCoarse);
  }
  search.reference = reference_of(search.candidates);
  const LimitPoint reference = *search.candidates[search.reference].at_limit;
  Random random(settings.seed);
  for (std::size_t i = 0; i < settings.shapes; ++i) {
    find_front(search.candidates);
    // Every second one from the shape with the largest gain, the others from anywhere on the front.
    std::vector<std::size_t> front;
    for (std::size_t k = 0; k < search.candidates.size(); ++k)
      if (search.candidates[k].is_on_front) front.push_back(k);
    const auto any = static_cast<std::size_t>(random.uniform() * static_cast<double>(front.size()));
    const std::size_t parent = i % 2 == 0 ? best_over(search.candidates, reference) : front[any];
    const double share = static_cast<double>(i) / static_cast<double>(settings.shapes);
    const double scatter = kWidest * std::pow(kNarrowest / kWidest, share);
    CouplingCandidate next{
        .name = {},
        .shape = drawn(search.candidates[parent].shape, scatter, settings.least_jaw_mm, random)};
    next.at_limit = evaluated(next.shape, kCoarse);
    search.candidates.push_back(std::move(next));
  }
  find_front(search.candidates);
  search.best = best_over(search.candidates, reference);
  const CouplingCandidate& best = search.candidates[search.best];
  search.gains.push_back({kMeshNames.at(kCoarse), best.at_limit, reference});
  for (std::size_t mesh = kCoarse; mesh-- > 0;) {
    CouplingGain gain{.mesh = kMeshNames.at(mesh), .best = {}, .reference = {}};
    gain.best = evaluated(best.shape, mesh);
    gain.reference = evaluated(search.candidates[search.reference].shape, mesh);
    search.gains.push_back(std::move(gain));
  }
  return search;
}

}  // namespace torsio::design
