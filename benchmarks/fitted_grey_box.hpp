#pragma once

#include <cmath>

#include "fit/grey_box/fit_grey_box.hpp"
#include "torsio/core/random.hpp"

namespace torsio::bench {

/// A fit of a stiffening spring with three slip elements, a branch, and friction of its rate: one of
/// the larger models.
inline GreyBox fitted_grey_box() {
  Random random(7);
  TrainingData data{
      .inputs = {{.expression = "spring_deflection_rad"},
                 {.expression = "lowpass(rate(spring_deflection_rad), 10Hz)", .is_rate = true},
                 {.expression = "lowpass(rate(joint_angle_rad), 10Hz)", .is_rate = true}},
      .target = "torque_Nm",
      .sample_rate_Hz = 1000.0,
      .sequences = {}};
  Sequence& record =
      data.sequences.emplace_back(Sequence{.recording = "bench", .features = Matrix(60000, 3)});
  double stops[] = {0.0, 0.0, 0.0};
  const double limits[] = {3e-4, 1e-3, 6e-3};
  double branch = 0.0;
  double last = 0.0;
  for (std::size_t n = 0; n < record.features.rows; ++n) {
    const double t_s = 1e-3 * static_cast<double>(n);
    const double x = 0.02 * std::sin(0.7 * t_s) + 0.01 * std::sin(3.1 * t_s);
    const double rate = 0.014 * std::cos(0.7 * t_s) + 0.031 * std::cos(3.1 * t_s);
    double torque = 573.0 * x + 1.5e5 * x * x * x + 0.4 * std::tanh(rate / 0.01);
    for (int i = 0; i < 3; ++i) {
      stops[i] = std::min(std::max(stops[i] + x - last, -limits[i]), limits[i]);
      torque += (0.5 + 20.0 * std::abs(x)) * stops[i] / limits[i];
    }
    branch = branch * std::exp(-1e-3 / 0.2) + (x - last);
    last = x;
    record.features(n, 0) = x;
    record.features(n, 1) = rate;
    record.features(n, 2) = 0.3 * std::cos(0.6 * t_s);
    record.target.push_back(torque + 80.0 * branch + 0.02 * random.normal());
  }
  record.use.assign(record.target.size(), 1);
  return GreyBox(fit_grey_box(data, {.residual = ResidualKind::none}).parameters);
}

}  // namespace torsio::bench
