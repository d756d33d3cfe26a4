#pragma once

#include <array>
#include <vector>

#include "torsio/design/coupling/lobe.hpp"

namespace torsio::design {

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

}  // namespace torsio::design
