#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/design/report.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {

enum class SpringKind { rod, tube, coils, discs };
[[nodiscard]] std::string_view name_of(SpringKind kind) noexcept;
/// @throws UsageError that lists the names.
[[nodiscard]] SpringKind spring_kind(std::string_view name);

/// What the spring of a joint has to do, SI.
struct SpringDemand {
  double torque_Nm = 0.0;
  double angle_rad = 0.0;           ///< deflection under the torque
  double largest_diameter_m = 0.0;  ///< envelope
  double largest_length_m = 0.0;    ///< envelope along the axis
  double bore_m = 0.0;              ///< diameter that stays free for a cable
  double safety = 1.0;              ///< on the allowed stress
  double load_inertia_kg_m2 = 0.15;
  double encoder_bits = 19.0;  ///< resolution of the encoders around the spring
  SpringMaterial material = {};
  std::vector<BellevilleWasher> washers = {};  ///< for discs
};

struct SpringDesign {
  SpringKind kind = SpringKind::rod;
  bool is_feasible = false;
  std::string infeasible = {};
  double stiffness_Nm_rad = 0.0;  ///< torque over deflection at the torque of the demand
  double mass_kg = 0.0;
  double outer_m = 0.0;  ///< diameter: of a rod or tube
  double inner_m = 0.0;
  double length_m = 0.0;    ///< along the axis
  double envelope_m = 0.0;  ///< diameter of the circle around it
  double stress_Pa = 0.0;   ///< largest; of discs the compressive one at the middle of the section
  double fatigue_margin = kNotMeasured;  ///< for fully reversed torque; NaN: not computed (discs)
  double friction_share = 0.0;           ///< dry friction over the elastic torque (assumed)
  std::vector<std::pair<double, double>> curve =
      {};  ///< deflection [rad], torque [Nm]; empty: a line
  DesignSection dimensions = {};
};

/// Stiffness of a rod or tube [Nm/rad]: G π (do⁴ − di⁴) / (32 L).
[[nodiscard]] double rod_stiffness(double outer_m, double inner_m, double length_m,
                                   double shear_modulus_Pa);
/// Shear stress of a twisted rod or tube [Pa]: 16 T do / (π (do⁴ − di⁴)).
[[nodiscard]] double rod_stress(double outer_m, double inner_m, double torque_Nm);
/// Shear stress [Pa] at which a long tube buckles: E / (3 √2 (1 − ν²)^¾) (t/r)^1.5, r in the middle of
/// the wall.
[[nodiscard]] double buckling_stress(double outer_m, double inner_m, double elastic_modulus_Pa,
                                     double poisson);
/// Rate of a coil spring [N/m]: G d⁴ / (8 D³ n).
[[nodiscard]] double coil_rate(double wire_m, double coil_m, double active_coils,
                               double shear_modulus_Pa);
/// Shear stress in the wire [Pa] with the factor of Wahl, c = D/d:
/// 8 F D / (π d³) ((4 c − 1)/(4 c − 4) + 0.615/c).
[[nodiscard]] double coil_stress(double wire_m, double coil_m, double force_N);
/// Torque [Nm] of two stacks of discs on both sides of a lever:
/// r cos θ p (F(s0 + x/i) − F(s0 − x/i)), x = r sin θ.
[[nodiscard]] double disc_lever_torque(const BellevilleWasher& washer, double radius_m,
                                       double preload_m, int parallel, int series,
                                       double angle_rad);

/// The lightest spring of a kind (rod and tube: the thinnest). All formulae neglect end effects. Wires have
/// preferred sizes (R'20 of ISO 497), bores those of drills (ISO 235), outer diameters and lengths steps of
/// 0.1 mm; stiffness and stress are those of the rounded dimensions.
/// @throws UsageError for a demand that is not finite or contradicts itself.
[[nodiscard]] SpringDesign design_spring(const SpringDemand& demand, SpringKind kind);
/// A design of each kind, in the order of `SpringKind`, with the reason where it is infeasible.
[[nodiscard]] std::vector<SpringDesign> design_springs(const SpringDemand& demand);
/// The lightest of them that is feasible; if there is none, an infeasible one with the reasons of all.
[[nodiscard]] SpringDesign lightest_spring(std::span<const SpringDesign> designs);
/// `lightest_spring` of `design_springs`, in less time.
[[nodiscard]] SpringDesign design_lightest_spring(const SpringDemand& demand);

/// The design with encoder resolution as torque, resonance and fatigue margin.
/// @param kinds designs of all kinds, for the table; the row of the design's kind is marked
[[nodiscard]] DesignReport spring_report(const SpringDemand& demand, const SpringDesign& design,
                                         std::span<const SpringDesign> kinds = {});

/// Adds a note with the options that make a spring last which does not: a safety factor, and, where the
/// stronger spring does not fit, the envelope that it needs. They were designed with.
/// @param can_choose_kind whether the caller has an option --kind; else the lightest kind is designed
void note_fatigue(DesignReport& report, const SpringDemand& demand, const SpringDesign& design,
                  bool can_choose_kind);

/// A data sheet for `torsio simulate` with this spring in the drive of the papers that is next in
/// torque (assumed). @param name of the sheet
[[nodiscard]] DataSheet spring_sheet(const SpringDemand& demand, const SpringDesign& design,
                                     const std::string& name);
/// Replaces the spring of a sheet.
void set_spring(DataSheet& sheet, const SpringDemand& demand, const SpringDesign& design);

}  // namespace torsio
