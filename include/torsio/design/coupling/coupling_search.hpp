#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/design/coupling/coupling.hpp"
#include "torsio/design/report.hpp"

namespace torsio::design {

inline constexpr std::size_t kCoarseMesh = 2;  ///< index in `coupling_meshes`

/// A shape at the strain limit.
struct LimitPoint {
  double angle_deg = 0.0;
  double torque_Nm = 0.0;
  double work_J = 0.0;  ///< stored up to there: the integral of the torque over the twist
};

/// The twist at which a shape reaches the limit on the mesh `demand.finest_mesh`; the angle of the demand has
/// no effect. None if the solver does not converge that far on it, or the limit is beyond 20 degrees.
/// @throws as `twist_coupling`
[[nodiscard]] std::optional<LimitPoint> limit_point(CouplingDemand demand, double shear_modulus_MPa,
                                                    const CouplingLimit& limit,
                                                    const Progress& progress = {});

struct CouplingSearchSettings {
  CouplingDemand demand = {};  ///< outer radius, length, material, limits of the solver
  double shear_modulus_MPa = 4.0;
  CouplingLimit limit = {};
  std::size_t shapes = 60;  ///< shapes to try besides the seven of paper 003
  std::uint64_t seed = 1;
  double least_jaw_mm = 1.0;
  std::string resume = {};  ///< file that keeps each result; empty: none
};

struct CouplingCandidate {
  std::string name;  ///< "delta"; empty for a shape of the search
  LobeShape shape = {};
  /// On the fine, medium and coarse mesh, as `coupling_meshes`; those that were not tried are empty.
  std::array<std::optional<LimitPoint>, 3> at_limit = {};
  bool is_on_front = false;  ///< no other shape has at least as much torque and twist, coarse mesh
};

/// A shape beside the best of the seven on one mesh.
struct CouplingGain {
  std::string mesh;  ///< "medium"
  std::optional<LimitPoint> best;
  std::optional<LimitPoint> reference;
  /// Least of the ratios of torque and of twist, less 1: both are larger by at least this share.
  [[nodiscard]] std::optional<double> gain() const;
  /// Ratio of the stored work, less 1.
  [[nodiscard]] std::optional<double> work_gain() const;
};

struct CouplingSearch {
  std::vector<CouplingCandidate> candidates;  ///< the seven first, in their order
  std::size_t reference = 0;                  ///< the one of the seven with the most work
  /// Largest gain over the reference on the medium and the fine mesh, the smaller one of both.
  std::size_t best = 0;
  std::vector<CouplingGain> gains;  ///< coarse, medium, fine
};

/// Shapes of more torque and twist at a strain limit within diameter and length. The seven geometries are
/// evaluated first. Then shapes are drawn around those on the Pareto front of torque and twist and
/// evaluated on the coarse mesh, one after the other; the scatter falls from a fifth to a fiftieth of each
/// dimension's range. Since coarse meshes hide strains, the four best are evaluated on the medium mesh,
/// where a third as many shapes are drawn around the best one, and the four best of those on the fine mesh,
/// with a sixth as many. Deterministic for a seed.
/// @throws as `twist_coupling`; Error if none of the seven reaches the limit, or the resume file is of
/// another search.
[[nodiscard]] CouplingSearch search_couplings(const CouplingSearchSettings& settings,
                                              const Progress& progress = {});

[[nodiscard]] DesignReport coupling_search_report(const CouplingSearchSettings& settings,
                                                  const CouplingSearch& search);

}  // namespace torsio::design
