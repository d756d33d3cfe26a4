#include "torsio/arm/contact_detector.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/all_finite.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kDetectorPlace = "contact detector";
constexpr double kFading_s =
    0.2;  // links of 1 to 50 kg m² on springs of 300 to 2300 Nm/rad, damped

}  // namespace

ExternalTorqueMotion::ExternalTorqueMotion(double sample_rate_Hz) {
  require_positive(kDetectorPlace, "the sample rate", sample_rate_Hz);
  kept_ = std::exp(-1.0 / (kFading_s * sample_rate_Hz));
}

std::span<const ExternalTorqueTerms> ExternalTorqueMotion::step(
    const ArmDynamics& dynamics, std::span<const double> angle_rad,
    std::span<const double> speed_rad_s, std::span<const double> acceleration_rad_s2) noexcept {
  const std::size_t n = dynamics.size();
  ArmDynamics::JointMatrix mass_kg_m2;
  ArmDynamics::PerJoint bias_Nm;
  dynamics.equation(angle_rad, speed_rad_s, mass_kg_m2, bias_Nm);
  for (std::size_t i = 0; i < n; ++i) {
    double row = 0.0;
    double inertial_Nm = 0.0;
    for (std::size_t j = 0; j < n; ++j) {
      const double mass = mass_kg_m2[i * n + j];
      row += mass * mass;
      inertial_Nm += mass * acceleration_rad_s2[j];
    }
    const double torque_Nm = inertial_Nm + bias_Nm[i];
    const auto fading = [this](double before, double now) {
      return std::isfinite(now) ? std::max(before * kept_, now) : before * kept_;
    };
    terms_[i] = {1.0, row, fading(terms_[i][2], torque_Nm * torque_Nm),
                 fading(terms_[i][3], inertial_Nm * inertial_Nm)};
  }
  return {terms_.data(), n};
}

ContactDetector::ContactDetector(const Settings& settings, double sample_rate_Hz)
    : count_(settings.joints.size()), motion_(sample_rate_Hz) {
  require_not_negative(kDetectorPlace, "the time until the observer has settled",
                       settings.settling_s);
  require(count_ > 0 && count_ <= kMaxArmJoints, kDetectorPlace,
          fmt::format("1 to {} joints", kMaxArmJoints), fmt::format("{}", count_));
  settling_ticks_ = static_cast<std::size_t>(settings.settling_s * sample_rate_Hz);
  for (std::size_t j = 0; j < count_; ++j) {
    const Joint& joint = settings.joints[j];
    const std::string place = fmt::format("{}: joint {}", kDetectorPlace, j + 1);
    double sum = 0.0;
    for (const double coefficient : joint.error.coefficients) {
      require_not_negative(place, "a coefficient of the error bar", coefficient);
      sum += coefficient;
    }
    require_positive(place, "the sum of the coefficients of the error bar", sum);
    require_positive(place, "the factor of the threshold", joint.factor);
    joints_[j] = joint;
  }
}

const ContactDetector::Output& ContactDetector::step(const ArmDynamics& dynamics,
                                                     std::span<const double> angle_rad,
                                                     std::span<const double> speed_rad_s,
                                                     std::span<const double> acceleration_rad_s2,
                                                     std::span<const double> external_Nm) noexcept {
  const auto terms = motion_.step(dynamics, angle_rad, speed_rad_s, acceleration_rad_s2);
  output_.largest_share = 0.0;
  output_.joint = 0;
  for (std::size_t j = 0; j < count_; ++j) {
    output_.std_dev_Nm[j] = std::sqrt(joints_[j].error.variance(terms[j]));
    const double share = std::abs(external_Nm[j]) / (joints_[j].factor * output_.std_dev_Nm[j]);
    if (!(share > output_.largest_share)) continue;
    output_.largest_share = share;
    output_.joint = j;
  }
  const bool is_settled = since_ticks_ >= settling_ticks_;
  if (!is_settled) ++since_ticks_;
  output_.is_contact =
      is_settled && std::isfinite(output_.largest_share) && output_.largest_share > 1.0;
  return output_;
}

}  // namespace torsio
