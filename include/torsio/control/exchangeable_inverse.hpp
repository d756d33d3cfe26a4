#pragma once

#include <utility>

#include "torsio/control/model_inverse.hpp"
#include "torsio/control/pid.hpp"

namespace torsio {

/// An inverse that is exchanged while a controller uses it. The wanted deflection continues from its last value, and the
/// difference to that of the new inverse decays (`BumplessTransfer`).
class ExchangeableInverse {
 public:
  /// Both are positive.
  ExchangeableInverse(AnyInverse inverse, double transfer_s, double sample_rate_Hz) noexcept
      : inverse_(std::move(inverse)), transfer_(transfer_s, sample_rate_Hz) {}

  /// @param other is used from the next step on; on return it is the one before
  void exchange(AnyInverse& other) noexcept TORSIO_REALTIME {
    std::swap(inverse_, other);
    is_exchanged_ = true;
  }
  void reset() noexcept {
    inverse_.reset();
    transfer_.reset();
    added_rad_ = 0.0;
    is_exchanged_ = false;
  }
  Estimate step(double torque_Nm, const JointSample& sample) noexcept TORSIO_REALTIME {
    Estimate wanted = inverse_.step(torque_Nm, sample);
    if (is_exchanged_) {
      transfer_.reset();
      transfer_.add(last_rad_ - wanted.value);
      is_exchanged_ = false;
    }
    added_rad_ = transfer_.step();
    wanted.value += added_rad_;
    last_rad_ = wanted.value;
    return wanted;
  }
  void follow(double asked_rad) noexcept TORSIO_REALTIME {
    inverse_.follow(asked_rad - added_rad_);
  }

 private:
  AnyInverse inverse_;
  detail::BumplessTransfer transfer_;
  double added_rad_ = 0.0;
  double last_rad_ = 0.0;
  bool is_exchanged_ = false;
};

}  // namespace torsio
