#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/design/coupling/lobe.hpp"
#include "torsio/design/report.hpp"
#include "torsio/design/spring.hpp"

namespace torsio::design {

/// Where strains near the ends of a bond, which are singular, are left out.
enum class StrainMetric { outside_800um, outside_300um, everywhere };
/// "0.8mm", "0.3mm" or "all". @throws UsageError that lists them.
[[nodiscard]] StrainMetric strain_metric(std::string_view name);
[[nodiscard]] double strain_of(const TwistStep& step, StrainMetric metric) noexcept;

/// Meshes from fine to coarse: a coarser one is tried where a finer one does not converge.
[[nodiscard]] const std::vector<MeshDensity>& coupling_meshes();

/// A coupling with six equal bonded lobes, of which each twist compresses three and stretches the
/// others: it is the same in both directions.
struct CouplingDemand {
  std::string geometry = "delta";  ///< as printed
  LobeShape shape = {};
  double angle_deg = 6.0;  ///< largest twist
  double length_mm = 10.0;
  double bulk_ratio = 500.0;    ///< K / G
  std::size_t finest_mesh = 1;  ///< index in `coupling_meshes`
  /// Layers of elements along half of the length, for a torque that is to be promised; 0: plane strain,
  /// for the comparison of shapes.
  int layers = 0;
  std::size_t jobs = 2;  ///< solvers at the same time; no more than 2 are used
  SolverLimits limits = {};
};

/// One lobe on the finest mesh that reached every twist, or the one that reached farthest.
struct LobeCurve {
  TwistCurve curve;
  MeshDensity density;
  LobeMesh mesh;
};

/// Both lobes for G = 1 MPa. All torques are proportional to G at equal K / G.
struct CouplingTwist {
  LobeCurve compressed;
  LobeCurve stretched;
};

/// @throws UsageError for a shape, angle, length or ratio that cannot be computed; Error if the
///         solver is not installed; Cancelled.
[[nodiscard]] CouplingTwist twist_coupling(const CouplingDemand& demand,
                                           const Progress& progress = {});

/// Twist [deg] and torque [Nm] of the coupling at the twists that both lobes reached, starting at
/// 0: T = 3 b G (Tc + Te), with the torques per length of a compressed and a stretched lobe.
[[nodiscard]] std::vector<std::pair<double, double>> torque_curve(const CouplingTwist& twist,
                                                                  double length_mm,
                                                                  double shear_modulus_MPa);

/// Torque [Nm] on the curve by lines between its points; none beyond its last point.
[[nodiscard]] std::optional<double> torque_at(const std::vector<std::pair<double, double>>& curve,
                                              double angle_deg);

/// Twist [deg] at which one of the lobes first has this strain, by lines between converged steps;
/// none if it is not reached.
[[nodiscard]] std::optional<double> angle_at_strain(const CouplingTwist& twist, double strain,
                                                    StrainMetric metric);

struct CouplingLimit {
  double strain = 0.6;
  StrainMetric metric = StrainMetric::outside_800um;
};

/// @param calibration how the modulus was found, as printed
[[nodiscard]] DesignReport coupling_report(const CouplingDemand& demand, const CouplingTwist& twist,
                                           double shear_modulus_MPa, const std::string& calibration,
                                           const std::optional<CouplingLimit>& limit);

/// A data sheet for `torsio simulate` with the torque curve as a table, in the drive of the papers
/// that is next in torque (assumed). Its friction, 5 % of the torque, is assumed.
[[nodiscard]] DataSheet coupling_sheet(const std::vector<std::pair<double, double>>& curve,
                                       const std::string& name);

}  // namespace torsio::design
