#include "torsio/design/rubber_spring.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "bound_search.hpp"
#include "powers.hpp"
#include "ring_constraint.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using std::numbers::pi;
constexpr double kMm = 1e-3;
constexpr double kSoftest = 30.0;  // Shore A
constexpr double kHardest = 80.0;
constexpr int kSearch = 4000;       // radii between the bounds
constexpr double kRounding = 1e-9;  // relative, in comparisons with a bound

/// Modulus with the measured correction.
double modulus(const RubberSpringDemand& demand) {
  return demand.correction * demand.shear_modulus_Pa;
}
/// c of r1⁴ − r2⁴ = c L.
double volume_factor(const RubberSpringDemand& demand) {
  return 2.0 * demand.torque_Nm / demand.angle_rad / (pi * modulus(demand));
}

/// The shortest ring of an outer radius, if there is one.
std::optional<RubberRing> shortest(const RubberSpringDemand& demand, double outer) {
  const double c = volume_factor(demand);
  const double thin = fourth(outer) - fourth(std::max(0.0, outer - demand.least_wall_m));
  const double length = std::max(
      {demand.least_length_m,
       modulus(demand) * demand.angle_rad * outer * demand.safety / demand.allowed_stress_Pa,
       thin / c});
  const double inner = fourth(outer) - c * length;
  if (length > demand.largest_length_m * (1.0 + kRounding)) return std::nullopt;
  if (inner < fourth(demand.least_inner_m) * (1.0 - kRounding) - kRounding * fourth(outer))
    return std::nullopt;
  return RubberRing{outer, std::pow(std::max(inner, 0.0), 0.25), length};
}

/// The ring with the least objective of those that it was given.
class BestRing {
 public:
  explicit BestRing(const RubberSpringDemand& demand) : demand_(&demand) {}

  void take(const std::optional<RubberRing>& ring) {
    if (!ring) return;
    const double value = objective(*ring, *demand_);
    if (best_ && value >= value_) return;
    best_ = ring;
    value_ = value;
  }
  /// Tries values of a dimension beside that of the best one so far, in ever smaller steps.
  /// @param at (value) -> ring, if there is one
  template <class At>
  void refine(double RubberRing::*dimension, double step, int halvings, const At& at) {
    double width = step;
    for (int i = 0; best_ && i < halvings; ++i, width *= 0.5) {
      const double middle = (*best_).*dimension;
      take(at(middle - 0.5 * width));
      take(at(middle + 0.5 * width));
    }
  }
  [[nodiscard]] const std::optional<RubberRing>& ring() const { return best_; }

 private:
  const RubberSpringDemand* demand_;
  std::optional<RubberRing> best_;
  double value_ = 0.0;
};

/// The radii that can be an optimum or the only feasible one: both bounds, and where the stress
/// reaches the longest ring; between them the search.
std::optional<RubberRing> best_ring(const RubberSpringDemand& demand) {
  constexpr int kHalvings = 40;
  const auto at = [&](double outer) {
    return outer > 0.0 && outer <= demand.largest_outer_m ? shortest(demand, outer) : std::nullopt;
  };
  const double from = demand.least_inner_m;
  const double step = (demand.largest_outer_m - from) / kSearch;
  BestRing best(demand);
  best.take(at(demand.largest_outer_m));
  best.take(at(demand.largest_length_m * demand.allowed_stress_Pa /
               (demand.safety * modulus(demand) * demand.angle_rad)));
  for (int i = 1; i < kSearch; ++i) best.take(at(from + i * step));
  best.refine(&RubberRing::outer_m, step, kHalvings, at);
  return best.ring();
}

using Constraints = std::vector<RingConstraint>;

bool holds(Constraints& constraints, const RubberRing& ring, const RubberSpringDemand& demand) {
  constexpr double kSmallSlack = 1e-12;
  return std::ranges::all_of(
      constraints, [&](RingConstraint& each) { return each.slack(ring, demand) >= -kSmallSlack; });
}

/// The ring of the outer radius of the shortest one and a length, if it is within the bounds.
std::optional<RubberRing> longer(const RubberSpringDemand& demand, const RubberRing& shortest,
                                 double length) {
  if (length < shortest.length_m || length > demand.largest_length_m) return std::nullopt;
  const double inner = fourth(shortest.outer_m) - volume_factor(demand) * length;
  if (inner < fourth(demand.least_inner_m)) return std::nullopt;
  return RubberRing{shortest.outer_m, std::pow(inner, 0.25), length};
}

/// The ring of an outer radius with the least objective that meets the constraints.
std::optional<RubberRing> best_length(const RubberSpringDemand& demand, Constraints& constraints,
                                      double outer, int steps) {
  constexpr int kHalvings = 30;
  const auto least = shortest(demand, outer);
  if (!least) return std::nullopt;
  const auto at = [&](double length) {
    const auto ring = longer(demand, *least, length);
    return ring && holds(constraints, *ring, demand) ? ring : std::nullopt;
  };
  const double step = (demand.largest_length_m - least->length_m) / steps;
  BestRing best(demand);
  for (int i = 0; i <= steps; ++i) best.take(at(least->length_m + i * step));
  best.refine(&RubberRing::length_m, step, kHalvings, at);
  return best.ring();
}

std::optional<RubberRing> best_constrained(const RubberSpringDemand& demand,
                                           Constraints& constraints) {
  const auto free = best_ring(demand);
  if (!free || holds(constraints, *free, demand)) return free;
  constexpr int kRadii = 400;
  constexpr int kLengths = 200;
  constexpr int kHalvings = 30;
  const auto at = [&](double outer) {
    return outer > 0.0 && outer <= demand.largest_outer_m
               ? best_length(demand, constraints, outer, kLengths)
               : std::nullopt;
  };
  const double step = (demand.largest_outer_m - demand.least_inner_m) / kRadii;
  BestRing best(demand);
  for (int i = kRadii; i > 0; --i) best.take(at(demand.least_inner_m + i * step));
  best.refine(&RubberRing::outer_m, step, kHalvings, at);
  return best.ring();
}

/// The largest slack of a constraint over the rings within the bounds.
double largest_slack(const RubberSpringDemand& demand, RingConstraint& constraint) {
  constexpr int kSteps = 100;
  double largest = -std::numeric_limits<double>::infinity();
  for (int i = 1; i <= kSteps; ++i) {
    const double outer =
        demand.least_inner_m + (demand.largest_outer_m - demand.least_inner_m) * i / kSteps;
    const auto least = shortest(demand, outer);
    if (!least) continue;
    for (int j = 0; j <= kSteps; ++j) {
      const auto ring =
          longer(demand, *least,
                 least->length_m + (demand.largest_length_m - least->length_m) * j / kSteps);
      if (ring) largest = std::max(largest, constraint.slack(*ring, demand));
    }
  }
  return largest;
}

std::string bounds_of_ring_to_move(const RubberSpringDemand& demand) {
  using D = RubberSpringDemand;
  const std::array<DesignBound<D>, 6> bounds{
      {{"largest outer radius", &D::largest_outer_m, 20.0 * demand.largest_outer_m, 1e3, "mm"},
       {"least length", &D::least_length_m, 0.0, 1e3, "mm"},
       {"largest length", &D::largest_length_m, 20.0 * demand.largest_length_m, 1e3, "mm"},
       {"least inner radius", &D::least_inner_m, 0.0, 1e3, "mm"},
       {"least wall", &D::least_wall_m, 0.0, 1e3, "mm"},
       {"allowed stress", &D::allowed_stress_Pa, 20.0 * demand.allowed_stress_Pa, 1e-6, "MPa"}}};
  return bounds_to_move<D>(demand, bounds,
                           [](const D& moved) { return best_ring(moved).has_value(); });
}

/// The bounds alone permit a ring, the constraints do not.
std::string constraints_to_move(const RubberSpringDemand& demand, Constraints& constraints) {
  std::string text = "infeasible: no ring within the bounds meets the constraints";
  for (RingConstraint& each : constraints) {
    const double slack = largest_slack(demand, each);
    if (slack < 0.0)
      text += fmt::format("; '{}' would have to be relaxed by at least {:.4g} (SI)", each.text(),
                          -slack);
  }
  return text;
}

/// Whether a ring of the grid meets all bounds but the stiffness.
bool is_within(const RubberSpringDemand& demand, const RubberRing& ring) {
  const auto at_most = [](double value, double bound) { return value <= bound + kRounding * kMm; };
  return at_most(ring.outer_m, demand.largest_outer_m) &&
         at_most(demand.least_inner_m, ring.inner_m) &&
         at_most(demand.least_length_m, ring.length_m) &&
         at_most(ring.length_m, demand.largest_length_m) &&
         at_most(demand.least_wall_m, ring.outer_m - ring.inner_m) &&
         shear_stress(ring, demand.torque_Nm) <= demand.allowed_stress_Pa / demand.safety;
}

/// The nearest ring of the grid; if that leaves a bound, the neighbour within them whose stiffness
/// is nearest.
std::optional<RubberRing> rounded(const RubberSpringDemand& demand, Constraints& constraints,
                                  const RubberRing& exact) {
  const auto on_grid = [&](double value, int offset) {
    return (std::round(value / demand.grid_m) + offset) * demand.grid_m;
  };
  const double wanted = demand.torque_Nm / demand.angle_rad;
  std::optional<RubberRing> best;
  double least = 0.0;
  for (int n = 0; n < 125; ++n) {
    const int index = (n + 62) % 125;  // the nearest first
    const RubberRing ring{on_grid(exact.outer_m, index % 5 - 2),
                          on_grid(exact.inner_m, index / 5 % 5 - 2),
                          on_grid(exact.length_m, index / 25 - 2)};
    if (ring.inner_m < 0.0 || ring.length_m <= 0.0 || ring.outer_m <= ring.inner_m) continue;
    if (!is_within(demand, ring) || !holds(constraints, ring, demand)) continue;
    if (n == 0) return ring;
    const double error = std::abs(std::log(stiffness(ring, modulus(demand)) / wanted));
    if (!best || error < least) {
      best = ring;
      least = error;
    }
  }
  return best;
}

using Values = std::function<double(const RubberRing&)>;

Eigen::Vector3d gradient(const Values& of, const RubberRing& ring) {
  constexpr double kStep = 1e-8;  // m
  Eigen::Vector3d slope;
  const std::array members{&RubberRing::outer_m, &RubberRing::inner_m, &RubberRing::length_m};
  for (int i = 0; i < 3; ++i) {
    RubberRing more = ring;
    RubberRing less = ring;
    more.*members[static_cast<std::size_t>(i)] += kStep;
    less.*members[static_cast<std::size_t>(i)] -= kStep;
    slope[i] = (of(more) - of(less)) / (2.0 * kStep) * kMm;  // per mm
  }
  return slope;
}

/// Lagrange multipliers of the bounds that the optimum lies on: ∇f = Σ λ ∇g.
std::vector<ActiveConstraint> active_constraints(const RubberSpringDemand& demand,
                                                 Constraints& constraints, const RubberRing& ring) {
  std::vector<std::pair<const char*, Values>> all{{"stiffness (1)", [&](const RubberRing& r) {
                                                     return std::log(stiffness(r, modulus(demand)));
                                                   }}};
  const auto add = [&](const char* name, double value, double bound, const Values& of) {
    if (std::abs(value - bound) <= 1e-6 * std::max(std::abs(bound), kMm))
      all.emplace_back(name, of);
  };
  const double allowed = demand.allowed_stress_Pa / demand.safety;
  add("largest outer radius", ring.outer_m, demand.largest_outer_m,
      [](const RubberRing& r) { return r.outer_m / kMm; });
  add("least length", ring.length_m, demand.least_length_m,
      [](const RubberRing& r) { return r.length_m / kMm; });
  add("largest length", ring.length_m, demand.largest_length_m,
      [](const RubberRing& r) { return r.length_m / kMm; });
  add("least inner radius", ring.inner_m, demand.least_inner_m,
      [](const RubberRing& r) { return r.inner_m / kMm; });
  add("least wall", ring.outer_m - ring.inner_m, demand.least_wall_m,
      [](const RubberRing& r) { return (r.outer_m - r.inner_m) / kMm; });
  add("stress (2)", shear_stress(ring, demand.torque_Nm) / allowed * kMm, kMm,
      [&](const RubberRing& r) { return std::log(shear_stress(r, demand.torque_Nm)); });
  const std::size_t bounds = all.size();
  for (RingConstraint& each : constraints) {
    // A share of its change over a millimetre of any dimension.
    const Values slack = [&](const RubberRing& r) { return each.slack(r, demand); };
    if (each.slack(ring, demand) <= 1e-5 * gradient(slack, ring).norm())
      all.emplace_back(each.text().c_str(), slack);
  }
  Eigen::MatrixXd slopes(3, static_cast<Eigen::Index>(all.size()));
  for (std::size_t i = 0; i < all.size(); ++i)
    slopes.col(static_cast<Eigen::Index>(i)) = gradient(all[i].second, ring);
  const Eigen::VectorXd multipliers = slopes.completeOrthogonalDecomposition().solve(
      gradient([&](const RubberRing& r) { return objective(r, demand); }, ring));
  std::vector<ActiveConstraint> active;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string name = all[i].first;
    active.push_back({name, multipliers[static_cast<Eigen::Index>(i)],
                      i >= bounds           ? "SI unit of its slack"
                      : name.ends_with(")") ? "unit of its logarithm"
                                            : "mm"});
  }
  return active;
}

/// Outer radius and the objective of the best ring with it.
std::vector<std::pair<double, double>> objective_over_radius(const RubberSpringDemand& demand,
                                                             Constraints& constraints) {
  constexpr int kRadii = 200;
  constexpr int kLengths = 50;
  std::vector<std::pair<double, double>> search;
  for (int i = 1; i <= kRadii; ++i) {
    const double outer =
        demand.least_inner_m + (demand.largest_outer_m - demand.least_inner_m) * i / kRadii;
    const auto ring = constraints.empty() ? shortest(demand, outer)
                                          : best_length(demand, constraints, outer, kLengths);
    if (ring) search.emplace_back(outer, objective(*ring, demand));
  }
  return search;
}

void check(const RubberSpringDemand& d) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UsageError({.place = fmt::format("rubber spring: {}", name),
                        .expected = "a finite number above 0",
                        .found = fmt::format("{}", value)});
  };
  positive("torque", d.torque_Nm);
  positive("angle", d.angle_rad);
  positive("shear modulus", d.shear_modulus_Pa);
  positive("correction factor", d.correction);
  positive("allowed stress", d.allowed_stress_Pa);
  positive("largest outer radius", d.largest_outer_m);
  positive("largest length", d.largest_length_m);
  positive("grid", d.grid_m);
  positive("weight of the volume", d.weight_volume);
  const auto ordered = [](const char* name, double low, double high, double scale,
                          const char* unit) {
    if (!(low >= 0.0 && low <= high))
      throw UsageError(
          {.place = fmt::format("rubber spring: {}", name),
           .expected = fmt::format("at least 0 and at most {:g} {}", high * scale, unit),
           .found = fmt::format("{:g} {}", low * scale, unit),
           .advice = "The bounds contradict each other."});
  };
  ordered("least length", d.least_length_m, d.largest_length_m, 1e3, "mm");
  ordered("least inner radius and wall", d.least_inner_m + d.least_wall_m, d.largest_outer_m, 1e3,
          "mm");
  ordered("least inner radius", d.least_inner_m, d.largest_outer_m, 1e3, "mm");
  ordered("hardness tolerance", d.hardness_tolerance, 100.0, 1.0, "Shore");
  ordered("tolerance of the dimensions", d.dimension_tolerance_m, d.largest_outer_m, 1e3, "mm");
  ordered("weight of the length", d.weight_length, 1e9, 1.0, "");
  if (!(d.safety >= 1.0))
    throw UsageError({.place = "rubber spring: safety factor",
                      .expected = "1 or more",
                      .found = fmt::format("{}", d.safety)});
}

}  // namespace

double shear_modulus_of_hardness(double shore_A) {
  if (!(shore_A >= kSoftest && shore_A <= kHardest))
    throw UsageError(
        {.place = "hardness",
         .expected = fmt::format("{:g} to {:g} Shore A, the range of the rule", kSoftest, kHardest),
         .found = fmt::format("{:g}", shore_A),
         .advice = "Give the measured shear modulus instead."});
  return 0.117e6 * std::exp(0.034 * shore_A);
}

double stiffness(const RubberRing& ring, double shear_modulus_Pa) {
  return pi * shear_modulus_Pa * (fourth(ring.outer_m) - fourth(ring.inner_m)) /
         (2.0 * ring.length_m);
}

double shear_stress(const RubberRing& ring, double torque_Nm) {
  return 2.0 * torque_Nm * ring.outer_m / (pi * (fourth(ring.outer_m) - fourth(ring.inner_m)));
}

double objective(const RubberRing& ring, const RubberSpringDemand& demand) {
  const double volume =
      pi * (ring.outer_m * ring.outer_m - ring.inner_m * ring.inner_m) * ring.length_m;
  return demand.weight_volume * volume * 1e9 / demand.torque_Nm +
         demand.weight_length * ring.length_m * 1e3;
}

double stiffness_tolerance(const RubberRing& ring, const RubberSpringDemand& demand) {
  const double area = fourth(ring.outer_m) - fourth(ring.inner_m);
  const double dr = demand.dimension_tolerance_m;
  const double outer = 4.0 * std::pow(ring.outer_m, 3) / area * dr;
  const double inner = 4.0 * std::pow(ring.inner_m, 3) / area * dr;
  return std::hypot(std::hypot(outer, inner),
                    std::hypot(dr / ring.length_m, 0.034 * demand.hardness_tolerance));
}

RubberSpringDesign design_rubber_spring(const RubberSpringDemand& demand) {
  check(demand);
  RubberSpringDesign design;
  Constraints constraints;
  constraints.reserve(demand.constraints.size());
  for (const std::string& text : demand.constraints) constraints.emplace_back(text);
  const auto exact = best_constrained(demand, constraints);
  if (!exact) {
    design.infeasible = best_ring(demand) ? constraints_to_move(demand, constraints)
                                          : bounds_of_ring_to_move(demand);
    return design;
  }
  design.exact = *exact;
  design.objective = objective(*exact, demand);
  design.active = active_constraints(demand, constraints, *exact);
  design.search = objective_over_radius(demand, constraints);
  const auto on_grid = rounded(demand, constraints, *exact);
  if (!on_grid) {
    design.infeasible = fmt::format(
        "infeasible: no ring on a grid of {:g} mm is within the bounds; the exact one is r1 "
        "{:.4g}, "
        "r2 {:.4g}, L {:.4g} mm: use a finer grid",
        demand.grid_m * 1e3, exact->outer_m * 1e3, exact->inner_m * 1e3, exact->length_m * 1e3);
    return design;
  }
  design.rounded = *on_grid;
  design.is_feasible = true;
  return design;
}

}  // namespace torsio
