#include "torsio/arm/momentum_observer.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/all_finite.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "momentum observer";
constexpr double kHighestShare = 0.2;  // highest bandwidth over the sample rate

}  // namespace

MomentumObserver::MomentumObserver(std::size_t joints, const Settings& settings,
                                   double sample_rate_Hz)
    : count_(joints),
      bandwidth_rad_s_(settings.bandwidth_rad_s),
      period_s_(1.0 / sample_rate_Hz),
      share_(-std::expm1(-settings.bandwidth_rad_s / sample_rate_Hz)) {
  require_positive(kPlace, "the sample rate", sample_rate_Hz);
  require_parameter(joints > 0 && joints <= kMaxArmJoints, kPlace,
                    fmt::format("1 to {} joints", kMaxArmJoints), static_cast<double>(joints));
  require_parameter(
      settings.bandwidth_rad_s > 0.0 && settings.bandwidth_rad_s <= kHighestShare * sample_rate_Hz,
      kPlace,
      fmt::format("a bandwidth above 0 and at most {} rad/s, a fifth of the sample rate",
                  kHighestShare * sample_rate_Hz),
      settings.bandwidth_rad_s);
}

Fault MomentumObserver::step(const ArmDynamics& dynamics, std::span<const double> angle_rad,
                             std::span<const double> speed_rad_s,
                             std::span<const double> torque_Nm) noexcept {
  ArmDynamics::PerJoint momentum_Nms;
  ArmDynamics::PerJoint gradient_Nm;
  ArmDynamics::PerJoint gravity_Nm;
  dynamics.momentum(angle_rad, speed_rad_s, momentum_Nms, gradient_Nm, gravity_Nm);
  if (!all_finite(std::span(momentum_Nms).first(count_)) ||
      !all_finite(std::span(gradient_Nm).first(count_)) || !all_finite(torque_Nm.first(count_))) {
    is_started_ = false;
    return Fault::input_not_finite;
  }
  if (!is_started_) {
    // The residual continues from where it was.
    for (std::size_t j = 0; j < count_; ++j)
      expected_Nms_[j] = momentum_Nms[j] - residual_Nm_[j] / bandwidth_rad_s_;
    is_started_ = true;
  }
  for (std::size_t j = 0; j < count_; ++j) {
    residual_Nm_[j] = bandwidth_rad_s_ * (momentum_Nms[j] - expected_Nms_[j]);
    expected_Nms_[j] +=
        period_s_ * (torque_Nm[j] + gradient_Nm[j] - gravity_Nm[j] + residual_Nm_[j]);
    external_Nm_[j] += share_ * (residual_Nm_[j] - external_Nm_[j]);
  }
  return Fault::none;
}

}  // namespace torsio
