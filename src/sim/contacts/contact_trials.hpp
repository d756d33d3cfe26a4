#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "torsio/arm/arm_controller.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// @param settings with thresholds of contacts
/// @returns how often the controller finds a contact in random motion without any
/// @throws Error if the arm stops; Cancelled.
[[nodiscard]] std::size_t count_false_alarms(const ArmSetup& setup,
                                             const ArmController::Settings& settings, double hours,
                                             std::uint64_t seed, const Progress& progress = {});

/// One push on the flange of an arm in random motion.
struct PushTrial {
  bool is_above = false;       ///< |Jᵀ F| is above `kPushErrorBars` error bars at some joint
  bool is_in_contact = false;  ///< the contact before had not ended: the push is part of it
  std::optional<double> latency_s = {};  ///< until it was found; none: not while it lasted
};
inline constexpr double kPushErrorBars = 5.0;

struct PushTrials {
  std::size_t count = 300;
  double force_N = 30.0;
  double rise_s = 0.002;
  double duration_s = 0.1;
  std::uint64_t seed = 1;
};

/// Forces of random direction in random poses. The moves, times and directions depend on the seed alone, so that trials of
/// two controllers correspond to each other.
/// @throws Error if the arm stops; Cancelled.
[[nodiscard]] std::vector<PushTrial> push_trials(const ArmSetup& setup,
                                                 const ArmController::Settings& settings,
                                                 const PushTrials& trials,
                                                 const Progress& progress = {});

}  // namespace torsio
