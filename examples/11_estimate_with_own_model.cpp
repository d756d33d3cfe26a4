// A model of your own inside torsio's estimator: a class that satisfies the concept `Model` gets
// the feature pipeline, the guards and the fault handling.
#include <array>
#include <cmath>
#include <cstdio>

#include "torsio/runtime.hpp"

namespace {

/// A hardening spring: torque = k x + k3 x^3.
class CubicSpring {
 public:
  struct Parameters {
    double k_Nm_rad = 0.0;
    double k3_Nm_rad3 = 0.0;
  };

  explicit CubicSpring(const Parameters& parameters) : parameters_(parameters) {}
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] static std::size_t input_count() noexcept { return 1; }
  [[nodiscard]] static std::size_t parameter_count() noexcept { return 2; }
  void reset() noexcept {}
  [[nodiscard]] torsio::Estimate step(torsio::Features x) const noexcept {
    return {.value = parameters_.k_Nm_rad * x[0] + parameters_.k3_Nm_rad3 * x[0] * x[0] * x[0]};
  }

 private:
  Parameters parameters_;
};
static_assert(torsio::Model<CubicSpring>);

torsio::EstimatorSettings settings() {
  torsio::EstimatorSettings settings;
  settings.features = {
      .inputs = {"spring_deflection_rad"},
      .definitions = {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}}};
  settings.sample_rate_Hz = 1000.0;
  settings.target = "torque_Nm";
  settings.ranges = {.lowest = {-0.1}, .highest = {0.1}};
  settings.fallback = {.intercept = 0.0, .slope = {500.0}};
  return settings;
}

}  // namespace

int main() {
  try {
    torsio::BasicEstimator<CubicSpring> estimator(
        settings(), CubicSpring({.k_Nm_rad = 500.0, .k3_Nm_rad3 = 2e4}));
    for (const double deflection_rad : {0.0, 0.05, 0.1, 0.5, std::nan("")}) {
      const std::array raw = {deflection_rad, 0.0};  // in the order of estimator.raw_inputs()
      const torsio::Estimate torque = estimator.step(raw);
      const std::string_view fault = torsio::name(torque.fault);
      std::printf("%5.2f rad: %7.2f Nm, fault %.*s\n", deflection_rad, torque.value,
                  static_cast<int>(fault.size()), fault.data());
    }
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
