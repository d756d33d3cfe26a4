#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/arm/arm_session.hpp"
#include "torsio/core/random.hpp"

namespace torsio {

/// The simulated arm in random moves without end: each to a random configuration within the limits of its joints, at 40 to
/// 100 % of the speeds of its moves, then at rest for up to a second.
class ArmFreeMotion {
 public:
  /// The brakes are open, and the observer has settled.
  /// @param setup lives longer
  /// @throws Error as `ArmSession`.
  ArmFreeMotion(const ArmSetup& setup, ArmController::Settings settings, FirstStageForm form,
                std::uint64_t seed);

  /// One tick is both, as of `ArmSession`. @throws Error if the arm stops.
  const ArmController::Output& control();
  void act(const ArmLoad& load) { session_.act(load); }

  [[nodiscard]] const ArmReference& reference() const noexcept { return reference_; }
  [[nodiscard]] const ArmSession& session() const noexcept { return session_; }

 private:
  [[nodiscard]] static std::vector<double> configuration(const ArmSetup& setup, Random& random);
  void next();

  const ArmSetup& setup_;
  Random random_;
  std::vector<double> at_rad_;
  ArmSession session_;
  std::optional<ArmMove> move_;
  ArmReference reference_;
  std::size_t rest_ticks_ = 0;
};

}  // namespace torsio
