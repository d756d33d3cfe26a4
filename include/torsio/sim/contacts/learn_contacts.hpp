#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/arm/arm_controller.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

struct ContactLearning {
  double hours = 1.0;  ///< duration of the motion from which the thresholds are learned
  double false_alarms_per_hour =
      0.0;  ///< wanted; 0: 3 / hours, the lowest rate that these hours support
  std::uint64_t seed = 1;
  bool has_gear_stage = false;  ///< else rotor and gear output turn together: half the cost
  std::size_t threads = 0;      ///< 0: as many as the machine has; no bit depends on it
};

struct LearnedContacts {
  ContactsFile file;
  /// How one joint was in the motion.
  struct Joint {
    double rmse_Nm = 0.0;              ///< external torque
    double mean_variance_ratio = 0.0;  ///< mean of (τ_ext / σ)²: 1 if the error bar is right
    double largest_ratio = 0.0;        ///< largest |τ_ext| / σ
    double largest_std_dev_Nm = 0.0;
  };
  std::vector<Joint> joints = {};
};

/// Moves the simulated arm at random without contacts (`ArmFreeMotion`). A tenth of `hours`, at least six minutes, is for
/// the coefficients of `ExternalTorqueError` (largest likelihood); then `hours` for the factors: the largest |τ_ext| / σ in
/// blocks of 10 s has the tail of a generalised Pareto distribution, at most an exponential one. k is what is exceeded at a
/// third of the wanted rate divided by the number of joints, since a threshold from the hours that just support a rate is
/// exceeded about twice as often in other hours; it is at least the largest ratio of all blocks.
/// @throws UsageError if hours are below 0.02 or above 1000, or do not support the rate: without a false alarm in T hours
/// the rate is below 3 / T with 95 % confidence and nothing lower is known. Error if the arm stops; Cancelled.
[[nodiscard]] LearnedContacts learn_contacts(const ArmSetup& setup, const ContactLearning& learning,
                                             const Progress& progress = {});
/// The same with another controller than that of `arm_controller_settings`.
[[nodiscard]] LearnedContacts learn_contacts(const ArmSetup& setup,
                                             const ArmController::Settings& settings,
                                             const ContactLearning& learning,
                                             const Progress& progress = {});

}  // namespace torsio
