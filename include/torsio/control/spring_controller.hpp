#pragma once

#include <utility>

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/spring_inverse.hpp"

namespace torsio::detail {

/// What the controllers through the spring share: a core, which accepts a torque, and the inverse of
/// the spring, which gives the core the deflection for it. The core does not depend on the inverse.
template <SpringInverse I, class Core>
class SpringController {
 public:
  using Settings = typename Core::Settings;
  using Output = typename Core::Output;

  SpringController(I inverse, const Settings& settings, double sample_rate_Hz)
      : inverse_(std::move(inverse)), core_(settings, sample_rate_Hz) {}

  void reset() noexcept {
    inverse_.reset();
    core_.reset();
  }

  [[nodiscard]] I& inverse() noexcept { return inverse_; }
  [[nodiscard]] const Core& core() const noexcept { return core_; }

 protected:
  /// @param torque_Nm that the core accepted
  /// @param deflection_rad of the output: the one that an inverse with a memory follows
  Output step_with(double torque_Nm, const JointSample& sample,
                   double Output::*deflection_rad) noexcept TORSIO_REALTIME {
    const Output output = core_.step(inverse_.step(torque_Nm, sample), sample);
    if constexpr (requires { inverse_.follow(0.0); }) inverse_.follow(output.*deflection_rad);
    return output;
  }

  [[nodiscard]] Core& own_core() noexcept { return core_; }

 private:
  I inverse_;
  Core core_;
};

}  // namespace torsio::detail
