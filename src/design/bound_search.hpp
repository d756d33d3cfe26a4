#pragma once

#include <fmt/format.h>

#include <span>
#include <string>

namespace torsio {

/// A bound of a demand, for the message of a design that is infeasible.
template <class Demand>
struct DesignBound {
  const char* name;
  double Demand::*value;
  double loosest;  ///< how far it is moved at most
  double scale;    ///< from SI to the unit
  const char* unit;
};

/// The bounds that alone could make the design possible, with the value that each would need.
/// Feasible or not is monotonic in each bound.
/// @param is_feasible (demand) -> bool
template <class Demand, class Feasible>
[[nodiscard]] std::string bounds_to_move(const Demand& demand,
                                         std::span<const DesignBound<Demand>> bounds,
                                         const Feasible& is_feasible) {
  constexpr int kHalvings = 40;
  std::string text;
  for (const DesignBound<Demand>& bound : bounds) {
    Demand moved = demand;
    double loose = bound.loosest;
    double tight = demand.*bound.value;
    moved.*bound.value = loose;
    if (!is_feasible(moved)) continue;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (loose + tight);
      moved.*bound.value = middle;
      (is_feasible(moved) ? loose : tight) = middle;
    }
    const std::string unit = *bound.unit == '\0' ? std::string() : fmt::format(" {}", bound.unit);
    text += fmt::format("{}the {} of {:.4g}{} would have to move to {:.4g}{}",
                        text.empty() ? "" : ", or ", bound.name, demand.*bound.value * bound.scale,
                        unit, loose * bound.scale, unit);
  }
  return "infeasible: " +
         (text.empty() ? std::string("no single bound that is moved makes it possible") : text);
}

}  // namespace torsio
