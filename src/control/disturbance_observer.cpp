#include "torsio/control/torque_controller.hpp"

namespace torsio {

DisturbanceObserver::DisturbanceObserver(const SeriesElasticJoint& joint, double cutoff_Hz,
                                         double sample_rate_Hz)
    : joint_(joint),
      cutoff_Hz_(cutoff_Hz),
      inverse_ratio_(1.0 / joint.drive.ratio),
      inertia_As2_rad_(joint.drive.inertia() / joint.drive.torque_per_current()),
      stiffness_A_rad_(joint.stiffness_Nm_rad / joint.drive.torque_per_current()),
      speed_(sample_rate_Hz),
      acceleration_(sample_rate_Hz),
      lowpass_(cutoff_Hz, sample_rate_Hz) {
  joint.check();
  reset();
}

void DisturbanceObserver::reset() noexcept {
  speed_.reset();
  acceleration_.reset();
  // The disturbance is not known yet: the first raw difference is dominated by noise.
  lowpass_.reset();
  static_cast<void>(lowpass_.step(0.0));
}

double DisturbanceObserver::step(double applied_A, double motor_angle_rad,
                                 double deflection_rad) noexcept {
  const double speed_rad_s = speed_.step(motor_angle_rad * inverse_ratio_);
  if (!speed_.is_settled()) return 0.0;
  const double rad_s2 = acceleration_.step(speed_rad_s);
  if (!acceleration_.is_settled()) return 0.0;
  return lowpass_.step(applied_A - inertia_As2_rad_ * rad_s2 - stiffness_A_rad_ * deflection_rad);
}

// i = −C + Q z⁻¹ i − Q (J θ̈ + K δ) / N k_t, solved for i; the speed's difference over a tick is the
// second one of the angle, which lags by half a tick.
JointFeedback DisturbanceObserver::with(const JointFeedback& loop) const {
  const double rate_Hz = loop.deflection.sample_rate_Hz();
  const auto gain = [&](double value) { return LinearSystem::gain(value, rate_Hz); };
  const LinearSystem lowpass = LinearSystem::lowpass(cutoff_Hz_, rate_Hz);
  const LinearSystem delay = LinearSystem::delay(rate_Hz);
  const LinearSystem raised = gain(1.0) + gain(-1.0) * (gain(-1.0) * (delay * lowpass)).closed();
  const LinearSystem mean = gain(0.5) + gain(0.5) * delay;
  const LinearSystem inertia =
      gain(inertia_As2_rad_) * (lowpass * (mean * LinearSystem::difference(rate_Hz)));
  return {raised * (loop.deflection + gain(stiffness_A_rad_) * lowpass),
          raised * (loop.speed + inertia), raised * loop.joint};
}

}  // namespace torsio
