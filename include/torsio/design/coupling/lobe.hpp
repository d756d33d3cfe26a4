#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace torsio::design {

/// One rubber lobe of a jaw coupling, symmetric about the x axis, with the coupling's axis at the
/// origin (specification of paper 003, section 3). Lengths are in millimetres, as in the solver.
///
/// The half width on the chord of a flank is `half_width_mm + (x - root_radius_mm) tan(angle / 2)`;
/// the flank is the arc of `flank_radius_mm` through the chord's ends on both radii. Paper 003
/// prints the outer radius, the angles and the flank radii; all other defaults are assumed.
struct LobeShape {
  double outer_radius_mm = 10.0;
  double root_radius_mm = 5.5;   ///< radius of the jaw's tip; assumed
  double half_width_mm = 1.7;    ///< half of the slot at `root_radius_mm`; assumed
  double slot_angle_deg = 0.0;   ///< included angle of the two flanks of a slot
  double flank_radius_mm = 0.0;  ///< 0: straight; > 0: concave jaw, < 0: convex jaw
  double taper_mm = 0.0;         ///< recess of the free outer face; assumed where it is not 0
  /// Inner radius of the ring of rubber that joins the lobes, bonded to the tips of the jaws; 0: no ring.
  double ring_radius_mm = 0.0;
};

struct NamedLobe {
  std::string_view name;
  LobeShape shape;
};

/// The seven geometries of paper 003, Figure 3: alpha, beta, gamma, delta, epsilon, zeta, eta.
[[nodiscard]] const std::vector<NamedLobe>& paper_lobes();

/// @throws UsageError if the name is none of the seven.
[[nodiscard]] const LobeShape& paper_lobe(std::string_view name);

/// Angle [rad] between the lobe's axis and its flank at a radius from the coupling's axis, exact
/// for straight and circular flanks.
[[nodiscard]] double flank_angle_rad(const LobeShape& shape, double radius_mm);

/// Smallest thickness [mm] of the jaw between two of the six lobes.
[[nodiscard]] double thinnest_jaw_mm(const LobeShape& shape);

/// @throws UsageError for a shape that cannot be built: radii or widths that are not positive or
///         not finite, flanks that cross the lobe's axis, an arc shorter than its chord, jaws
///         thinner than `least_jaw_mm`, a taper deeper than half of the lobe.
void check_lobe(const LobeShape& shape, double least_jaw_mm = 1.0);

/// Divisions of the mapped mesh. `grading` > 1 makes the elements smaller at the bonded flanks and
/// at the free faces.
struct MeshDensity {
  int radial = 20;
  int across = 14;
  double grading = 1.2;
};

struct MeshNode {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

/// Triangles of six nodes: three corners counter-clockwise, then the middles of the edges 1-2, 2-3
/// and 3-1. The numbers of nodes start at 0.
struct LobeMesh {
  std::vector<MeshNode> nodes;
  std::vector<std::array<int, 6>> triangles;
  std::vector<int> upper_flank;  ///< nodes with y > 0 that move with a jaw
  std::vector<int> lower_flank;  ///< nodes with y < 0 that move with a jaw
  std::vector<int> bond_ends;    ///< where strains are singular: ends of bonds, edges of jaws
  /// Layers of wedges between the middle of the lobe's length, a plane of symmetry, and its free end;
  /// 0: plane strain.
  int layers = 0;
  double half_length_mm = 0.0;  ///< if there are layers
};

/// Maps a grid of quadrilaterals onto the lobe, and one onto its share of the ring, if there is one,
/// which is cut in the middle of the jaws, where it moves with them; splits each into two triangles; at every end of
/// a bond two triangles share the corner, which delays the inversion of the corner's element.
/// Every node of a flank lies on its arc or line, every node of a face on its arc.
/// @throws UsageError for a lobe that `check_lobe` refuses, or for fewer than 2 divisions, an odd
///         number of them or a grading outside 1 to 3.
[[nodiscard]] LobeMesh mesh_lobe(const LobeShape& shape, const MeshDensity& density);

/// Smallest determinant of the map from the reference triangle [mm^2] over all six nodes. Where it
/// is positive, no element is inverted.
[[nodiscard]] double smallest_jacobian_mm2(const LobeMesh& mesh);

/// Area of the curved triangles [mm^2], by quadrature that is exact for them.
[[nodiscard]] double mesh_area_mm2(const LobeMesh& mesh);

/// Nearly incompressible neo-Hooke rubber, W = G/2 (I1 - 3) + K/2 (J - 1)^2.
struct Rubber {
  double shear_modulus_MPa = 1.0;
  double bulk_modulus_MPa = 2000.0;  ///< assumed; CalculiX would take K = 20 G where it is missing
};

/// Limits of one run of the solver.
struct SolverLimits {
  std::string program = "ccx";
  double time_s = 120.0;
  std::size_t memory_MiB = 2048;
};

/// One converged step of one lobe.
struct TwistStep {
  double twist_deg = 0.0;                    ///< > 0: the lobe is compressed, < 0: stretched
  double torque_N = 0.0;                     ///< torque over length, Nmm/mm, of the upper flank
  double strain = 0.0;                       ///< largest logarithmic principal strain anywhere
  double strain_outside_300um = 0.0;         ///< farther than 0.3 mm from every end of a bond
  double strain_outside_800um = 0.0;         ///< farther than 0.8 mm; converges with the mesh
  std::vector<double> element_strains = {};  ///< largest of each triangle, in their order
};

/// The steps up to the last one that converged, and why the solver stopped there.
struct TwistCurve {
  std::vector<TwistStep> steps;
  std::string stopped_by;  ///< empty if every twist was reached
};

/// Input deck of CalculiX 2.20: both bonded flanks turn by half of each twist, and do not move along the
/// axis. The material needs finite, positive moduli.
/// @throws UsageError for such a material, or for twists that are none or beyond 30 degrees.
[[nodiscard]] std::string twist_deck(const LobeMesh& mesh, const Rubber& rubber,
                                     const std::vector<double>& twists_deg);

/// Reads the text of a `.dat` file. A step counts only if its blocks are complete and finite, both
/// flanks' torques balance within 1e-4 and every volume ratio is within 0.9 to 1.1; reading stops
/// at the first step that fails.
[[nodiscard]] TwistCurve read_twists(const LobeMesh& mesh, const std::vector<double>& twists_deg,
                                     const std::string& dat_text);

/// Runs the solver as a process of its own in a temporary folder, which is removed afterwards. The
/// exit code is not trusted: steps come from the output alone.
/// @param stop kills the solver within some milliseconds
/// @throws Error if the solver is not installed or its input cannot be written; Cancelled.
[[nodiscard]] TwistCurve twist_lobe(const LobeMesh& mesh, const Rubber& rubber,
                                    const std::vector<double>& twists_deg,
                                    const SolverLimits& limits, const std::stop_token& stop = {});

}  // namespace torsio::design
