#include "preferred_sizes.hpp"

#include <array>
#include <cmath>

namespace torsio {
namespace {

constexpr auto kPreferredWires_mm = std::to_array<double>(
    {0.5, 0.56, 0.63, 0.71, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 1.6,  1.8,  2.0,  2.2,  2.5, 2.8,
     3.2, 3.6,  4.0,  4.5,  5.0, 5.6, 6.3, 7.1, 8.0,  9.0, 10.0, 11.0, 12.5, 14.0, 16.0});

/// Up to a diameter the drills follow each other by a step.
struct DrillRange {
  double end_mm;
  double step_mm;
};
constexpr std::array kDrillRanges{DrillRange{14.0, 0.1}, DrillRange{32.0, 0.25},
                                  DrillRange{50.0, 0.5}};
constexpr double kWidestStep_mm = 1.0;
constexpr double kRoundOff = 1e-9;  // a multiple of a step in floating point has this error

double drill_step_mm(double diameter_mm) {
  for (const DrillRange& range : kDrillRanges)
    if (diameter_mm < range.end_mm) return range.step_mm;
  return kWidestStep_mm;
}

}  // namespace

std::span<const double> preferred_wires_mm() noexcept { return kPreferredWires_mm; }

double drill_at_most_m(double diameter_m) noexcept {
  const double diameter_mm = 1e3 * diameter_m;
  if (!(diameter_mm > 0.0)) return 0.0;
  const double step_mm = drill_step_mm(diameter_mm + kRoundOff);
  return 1e-3 * step_mm * std::floor(diameter_mm / step_mm + kRoundOff);
}

double drill_below_m(double diameter_m) noexcept {
  constexpr double kLess_m = 1e-6;  // far below a step, far above the round-off
  return drill_at_most_m(diameter_m - kLess_m);
}

}  // namespace torsio
