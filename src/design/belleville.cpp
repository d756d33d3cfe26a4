#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "torsio/core/error.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {
namespace {

/// 4 E / (1 − ν²) / (K1 De²)
double factor(const BellevilleWasher& w) {
  const double d = w.outer_diameter_m / w.inner_diameter_m;
  const double share = (d - 1.0) / d;
  const double k1 =
      share * share / (std::numbers::pi * ((d + 1.0) / (d - 1.0) - 2.0 / std::log(d)));
  return 4.0 * w.elastic_modulus_Pa / (1.0 - w.poisson * w.poisson) /
         (k1 * w.outer_diameter_m * w.outer_diameter_m);
}

}  // namespace

double force(const BellevilleWasher& w, double travel_m) {
  const double s = travel_m / w.thickness_m;
  const double h = w.cone_height_m / w.thickness_m;
  return factor(w) * std::pow(w.thickness_m, 4) * s * ((h - s) * (h - 0.5 * s) + 1.0);
}

double rate(const BellevilleWasher& w, double travel_m) {
  const double s = travel_m / w.thickness_m;
  const double h = w.cone_height_m / w.thickness_m;
  return factor(w) * std::pow(w.thickness_m, 3) * (h * h - 3.0 * h * s + 1.5 * s * s + 1.0);
}

double travel(const BellevilleWasher& w, double force_N) {
  const double flat = force(w, w.cone_height_m);
  if (!(force_N >= 0.0 && force_N <= flat))
    throw Error({.place = "washer " + w.name,
                 .expected = fmt::format("a force of at most {:.4g} N, that at flat", flat),
                 .found = fmt::format("{:.4g} N", force_N)});
  double low = 0.0;
  double high = w.cone_height_m;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (force(w, middle) < force_N ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double stress(const BellevilleWasher& w, double travel_m) {
  return factor(w) * w.thickness_m * travel_m * 3.0 / std::numbers::pi;
}

void check(const BellevilleWasher& w) {
  const bool is_possible = w.inner_diameter_m > 0.0 && w.outer_diameter_m > w.inner_diameter_m &&
                           w.thickness_m > 0.0 && w.cone_height_m > 0.0 &&
                           w.elastic_modulus_Pa > 0.0 && w.poisson >= 0.0 && w.poisson < 0.5 &&
                           std::isfinite(w.outer_diameter_m * w.elastic_modulus_Pa);
  if (!is_possible)
    throw UsageError({.place = "washer " + w.name,
                      .expected = "diameters, thickness, height and modulus above 0, the outer "
                                  "diameter larger than the inner one",
                      .found = fmt::format("{:g} x {:g} x {:g} mm, h0 {:g} mm",
                                           w.outer_diameter_m * 1e3, w.inner_diameter_m * 1e3,
                                           w.thickness_m * 1e3, w.cone_height_m * 1e3)});
  if (w.cone_height_m > std::numbers::sqrt2 * w.thickness_m)
    throw UsageError({.place = "washer " + w.name,
                      .expected = "h0 of at most 1.414 t: beyond it the force has a maximum",
                      .found = fmt::format("{:.4g} t", w.cone_height_m / w.thickness_m)});
}

}  // namespace torsio
