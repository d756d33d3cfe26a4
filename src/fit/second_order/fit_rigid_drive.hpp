#pragma once

#include <cstddef>
#include <string>

#include "fit/common/fitted.hpp"
#include "fit/second_order/fit_dynamic_bouc_wen.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct RigidDriveOptions {
  double gain = 1.0;  ///< g, known beforehand: it only scales the other parameters
  /// Besides J, Fv, Fc and offset: some of "stribeck", "lugre", "asymmetry", "quadratic", "spring",
  /// "position", "load", "dwell", "heating", joined by +; "none"; "auto": added as long as they help on held-out blocks.
  std::string terms = "none";
  std::size_t substeps = 1;
  std::size_t input_order = 3;
  std::size_t first_horizon = 2000;  ///< samples that the first of the growing searches uses
  std::size_t iterations = 200;      ///< limit of the last search

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.gain,
          {.name = "gain",
           .minimum = -1e12,
           .maximum = 1e12,
           .help = "force of one unit of the first input; known beforehand, it scales the others"});
    visit(self.terms,
          {.name = "terms",
           .help =
               "besides inertia, viscous and Coulomb friction and offset: some of stribeck, "
               "lugre, asymmetry, quadratic, spring, position, load, dwell, heating, joined by +; "
               "auto: by held-out blocks"});
    visit_free_run_options(self, visit);
  }
};

/// Least squares of free runs, each from where the record's first 50 samples put it. The search
/// starts where the force is a linear function of acceleration, speed and direction (inverse dynamics,
/// differences over three widths). "auto": the training records in 4 blocks, each of them held out in
/// turn and simulated from its own first 50 samples; a term stays if it lowers that error by a tenth.
/// @throws UsageError for an unknown term, Error unless the first input and the target move
/// in both directions, and the search converges; Cancelled.
[[nodiscard]] Fitted<RigidDrive> fit_rigid_drive(const TrainingData& data,
                                                 const RigidDriveOptions& options,
                                                 const Progress& progress = {});

}  // namespace torsio
