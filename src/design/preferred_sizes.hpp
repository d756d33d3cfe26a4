#pragma once

#include <span>

namespace torsio {

/// Diameters [mm] of spring wire that are in stock, rising: the preferred numbers R'20 of ISO 497 from
/// 0.5 to 16 mm, within the range of EN 10270-1 (0.05 to 20 mm).
[[nodiscard]] std::span<const double> preferred_wires_mm() noexcept;

/// The largest twist drill of ISO 235 that is not wider [m]: steps of 0.1 mm up to 14 mm, of 0.25 mm up
/// to 32 mm, of 0.5 mm up to 50 mm, and of 1 mm beyond. 0 below 0.1 mm.
[[nodiscard]] double drill_at_most_m(double diameter_m) noexcept;
/// The next smaller drill [m].
[[nodiscard]] double drill_below_m(double diameter_m) noexcept;

}  // namespace torsio
