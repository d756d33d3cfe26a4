#include "torsio/design/spring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "bound_search.hpp"
#include "core/did_you_mean.hpp"
#include "spring_kinds.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using std::numbers::pi;
constexpr std::array<std::string_view, 4> kShapeNames{"rod", "tube", "coils", "discs"};
constexpr std::array kKinds{SpringKind::rod, SpringKind::tube, SpringKind::coils,
                            SpringKind::discs};

std::string infeasible(const SpringDemand& d, SpringKind kind) {
  using D = SpringDemand;
  std::vector<DesignBound<D>> bounds{
      {"largest diameter", &D::largest_diameter_m, 5.0 * d.largest_diameter_m, 1e3, "mm"},
      {"largest length", &D::largest_length_m, 5.0 * d.largest_length_m, 1e3, "mm"},
      {"torque", &D::torque_Nm, 0.01 * d.torque_Nm, 1.0, "Nm"},
      {"angle", &D::angle_rad, 0.01 * d.angle_rad, 180.0 / pi, "deg"}};
  if (d.bore_m > 0.0) bounds.push_back({"bore", &D::bore_m, 0.0, 1e3, "mm"});
  if (d.safety > 1.0) bounds.push_back({"safety factor", &D::safety, 1.0, 1.0, ""});
  return bounds_to_move<D>(d, bounds,
                           [kind](const D& moved) { return best_of(moved, kind).has_value(); });
}

void check(const SpringDemand& d) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UsageError({.place = fmt::format("spring: {}", name),
                        .expected = "a finite number above 0",
                        .found = fmt::format("{}", value)});
  };
  positive("torque", d.torque_Nm);
  positive("angle", d.angle_rad);
  positive("largest diameter", d.largest_diameter_m);
  positive("largest length", d.largest_length_m);
  positive("load inertia", d.load_inertia_kg_m2);
  positive("allowed stress", d.material.allowed_shear_Pa);
  if (!(d.angle_rad <= 0.5 * pi / 2.0))
    throw UsageError({.place = "spring: angle",
                      .expected = "at most 45 deg",
                      .found = fmt::format("{:.4g} deg", d.angle_rad * 180.0 / pi)});
  if (!(d.largest_diameter_m <= 10.0 && d.largest_length_m <= 10.0))
    throw UsageError(
        {.place = "spring: envelope",
         .expected = "at most 10 m",
         .found = fmt::format("{:g} and {:g} m", d.largest_diameter_m, d.largest_length_m)});
  if (!(d.bore_m >= 0.0 && d.bore_m < d.largest_diameter_m))
    throw UsageError({.place = "spring: bore",
                      .expected = fmt::format("less than the largest diameter of {:g} mm",
                                              d.largest_diameter_m * 1e3),
                      .found = fmt::format("{:g} mm", d.bore_m * 1e3),
                      .advice = "The bounds contradict each other."});
  if (!(d.safety >= 1.0 && d.safety <= 100.0))
    throw UsageError({.place = "spring: safety factor",
                      .expected = "1 to 100",
                      .found = fmt::format("{}", d.safety)});
  if (!(d.encoder_bits >= 8.0 && d.encoder_bits <= 32.0))
    throw UsageError({.place = "spring: encoder",
                      .expected = "8 to 32 bits",
                      .found = fmt::format("{}", d.encoder_bits)});
}

}  // namespace

std::optional<SpringDesign> best_of(const SpringDemand& d, SpringKind kind) {
  switch (kind) {
    case SpringKind::rod: return best_rod(d);
    case SpringKind::tube: return best_tube(d);
    case SpringKind::coils: return best_coils(d);
    case SpringKind::discs: return best_discs(d);
  }
  return std::nullopt;
}

std::string_view name_of(SpringKind kind) noexcept {
  return kShapeNames.at(static_cast<std::size_t>(kind));
}

SpringKind spring_kind(std::string_view name) {
  const auto* const found = std::ranges::find(kShapeNames, name);
  if (found != kShapeNames.end())
    return kKinds.at(static_cast<std::size_t>(found - kShapeNames.begin()));
  throw UsageError({.place = "spring kind",
                    .expected = fmt::format("one of {}", fmt::join(kShapeNames, ", ")),
                    .found = "'" + std::string(name) + "'",
                    .advice = did_you_mean(name, kShapeNames)});
}

SpringDesign design_spring(const SpringDemand& demand, SpringKind kind) {
  check(demand);
  if (auto best = best_of(demand, kind)) return *best;
  return {.kind = kind,
          .infeasible = fmt::format("{}: {}", name_of(kind), infeasible(demand, kind))};
}

std::vector<SpringDesign> design_springs(const SpringDemand& demand) {
  std::vector<SpringDesign> designs;
  designs.reserve(kKinds.size());
  for (const SpringKind kind : kKinds) designs.push_back(design_spring(demand, kind));
  return designs;
}

SpringDesign lightest_spring(std::span<const SpringDesign> designs) {
  const SpringDesign* best = nullptr;
  SpringDesign none;
  for (const SpringDesign& each : designs) {
    if (each.is_feasible && (best == nullptr || each.mass_kg < best->mass_kg)) best = &each;
    none.infeasible += (none.infeasible.empty() ? "" : "; ") + each.infeasible;
  }
  return best == nullptr ? none : *best;
}

SpringDesign design_lightest_spring(const SpringDemand& demand) {
  check(demand);
  std::vector<SpringDesign> found;
  for (const SpringKind kind : kKinds)
    if (auto design = best_of(demand, kind)) found.push_back(*std::move(design));
  return lightest_spring(found.empty() ? design_springs(demand) : found);
}

}  // namespace torsio
