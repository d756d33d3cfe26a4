#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "torsio/design/coupling/lobe_mesh.hpp"

namespace torsio::design {

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
