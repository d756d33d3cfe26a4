#include "torsio/control/estimate_correction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "estimate correction";
constexpr double kFastest = 0.1;  // share of the sample rate

}  // namespace

EstimateCorrection::EstimateCorrection(const Settings& settings, double sample_rate_Hz)
    : gain_(settings.bandwidth_rad_s / sample_rate_Hz),
      max_Nm_(settings.torque_Nm),
      fault_keep_(std::exp(-1.0 / (settings.fault_decay_s * sample_rate_Hz))) {
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  require_positive(kPlace, "bandwidth_rad_s", settings.bandwidth_rad_s);
  require_positive(kPlace, "fault_decay_s", settings.fault_decay_s);
  require<Error>(settings.torque_Nm > 0.0, fmt::format("{} torque_Nm", kPlace), "above 0 Nm",
                 settings.torque_Nm);
  require<Error>(gain_ <= kFastest, fmt::format("{} bandwidth_rad_s", kPlace),
                 fmt::format("at most {:g} rad/s", kFastest * sample_rate_Hz),
                 settings.bandwidth_rad_s);
}

double EstimateCorrection::step(double wanted_Nm, const Estimate& estimate,
                                bool is_limited) noexcept {
  const double error_Nm = wanted_Nm - estimate.value;
  if (estimate.fault != Fault::none || !std::isfinite(error_Nm))
    correction_Nm_ *= fault_keep_;
  else if (!is_limited)
    correction_Nm_ = std::clamp(correction_Nm_ + gain_ * error_Nm, -max_Nm_, max_Nm_);
  return correction_Nm_;
}

CorrectedParts corrected_parts(const JointFeedback& loop, const LinearSystem& impedance,
                               const LinearSystem& torque_path, double stiffness_Nm_rad,
                               double bandwidth_rad_s) {
  const double rate_Hz = torque_path.sample_rate_Hz();
  const auto gain = [&](double value) { return LinearSystem::gain(value, rate_Hz); };
  const LinearSystem correction =
      torque_path * (gain(bandwidth_rad_s) * LinearSystem::integrator(rate_Hz));
  JointFeedback others = loop;
  others.joint = others.joint + correction * impedance;
  return {std::move(others), correction * gain(stiffness_Nm_rad)};
}

JointFeedback all_parts(const CorrectedParts& parts, std::size_t ticks_per_estimate) {
  JointFeedback all = parts.others;
  all.deflection = all.deflection +
                   parts.estimate * slow_hold(ticks_per_estimate, all.deflection.sample_rate_Hz());
  return all;
}

JointFeedback corrected_feedback(const JointFeedback& loop, const LinearSystem& impedance,
                                 const LinearSystem& torque_path, double stiffness_Nm_rad,
                                 double bandwidth_rad_s, std::size_t ticks_per_estimate) {
  return all_parts(corrected_parts(loop, impedance, torque_path, stiffness_Nm_rad, bandwidth_rad_s),
                   ticks_per_estimate);
}

}  // namespace torsio
