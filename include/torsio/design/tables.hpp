#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"

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

/// A material of metal springs, SI. The stresses are allowed values, not strengths.
struct SpringMaterial {
  std::string name;
  std::string source;  ///< "printed: ...", "assumed: ..."
  double elastic_modulus_Pa = 0.0;
  double shear_modulus_Pa = 0.0;
  double density_kg_m3 = 0.0;
  double allowed_shear_Pa = 0.0;  ///< static
  double fatigue_shear_Pa = 0.0;  ///< amplitude, fully reversed
  double poisson = 0.3;
};

/// A strain-wave gear of a table, SI.
struct GearChoice {
  std::string name;
  std::string source;
  double ratio = 0.0;
  double continuous_Nm = 0.0;
  double peak_Nm = 0.0;
  double stiffness_Nm_rad = 0.0;
  double friction_Nm = 0.0;      ///< Coulomb, at the output
  double viscous_Nms_rad = 0.0;  ///< at the output
  double mass_kg = 0.0;
};

/// A motor of a table, SI.
struct MotorChoice {
  std::string name;
  std::string source;
  double torque_constant_Nm_A = 0.0;
  double rotor_inertia_kg_m2 = 0.0;
  double resistance_Ohm = 0.0;
  double supply_V = 0.0;
  double continuous_A = 0.0;
  double peak_A = 0.0;
  double mass_kg = 0.0;
};

// Tables are YAML; every quantity has its unit, every entry its source. docs/design/tables.md has the
// formats. An empty path is the table that torsio ships (share/torsio/design).
// @throws Error naming file, line, what was expected and found; Cancelled.
[[nodiscard]] std::vector<BellevilleWasher> read_washers(const std::string& path,
                                                         const Progress& progress = {});
[[nodiscard]] std::vector<SpringMaterial> read_materials(const std::string& path,
                                                         const Progress& progress = {});
struct DriveTable {
  std::vector<GearChoice> gears;
  std::vector<MotorChoice> motors;
};
[[nodiscard]] DriveTable read_drives(const std::string& path, const Progress& progress = {});

/// The entry of that name. @throws UsageError that lists the names.
template <class Entry>
[[nodiscard]] const Entry& find_entry(const std::vector<Entry>& table, std::string_view name,
                                      std::string_view place);

}  // namespace torsio
