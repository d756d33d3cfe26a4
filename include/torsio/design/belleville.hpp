#pragma once

#include <string>

namespace torsio {

/// A disc spring of one thickness, SI.
struct BellevilleWasher {
  std::string name;
  std::string source;  ///< "printed: ...", "assumed: ..."
  double inner_diameter_m = 0.0;
  double outer_diameter_m = 0.0;
  double thickness_m = 0.0;
  double cone_height_m = 0.0;  ///< h0, the travel to flat
  double elastic_modulus_Pa = 206e9;
  double poisson = 0.3;
};

/// Force [N] at a travel of one washer, equation of Almen and Laszlo (DIN EN 16984):
///
///     F(s) = 4 E / (1 − ν²) · t⁴ / (K1 De²) · s/t · ((h0/t − s/t)(h0/t − s/2t) + 1)
[[nodiscard]] double force(const BellevilleWasher& washer, double travel_m);
[[nodiscard]] double rate(const BellevilleWasher& washer, double travel_m);  ///< dF/ds [N/m]
/// Travel [m] of a force, up to flat. @throws Error beyond the force at flat, which it names.
[[nodiscard]] double travel(const BellevilleWasher& washer, double force_N);
/// Compressive stress [Pa] at the middle of the section (σ_OM): 4 E/(1 − ν²) t²/(K1 De²) s/t 3/π.
[[nodiscard]] double stress(const BellevilleWasher& washer, double travel_m);
/// @throws UsageError unless all dimensions are possible, and h0 <= √2 t, where F rises with s.
void check(const BellevilleWasher& washer);

}  // namespace torsio
