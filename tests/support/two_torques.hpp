#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "model/linear/linear.hpp"
#include "torsio/core/random.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio::test {

/// A model of one slope: the torque from `channel`.
inline ModelFile slope_model(const std::string& channel, double slope, double std_dev_Nm,
                             double rate_Hz = 1000.0) {
  Matrix coefficients(1, 2);
  coefficients(0, 1) = slope;
  return {.card = {},
          .settings = {.features = {.inputs = {channel}, .definitions = {}},
                       .sample_rate_Hz = rate_Hz,
                       .target = "torque_Nm",
                       .zeroed_channels = {},
                       .ranges = {.lowest = {-100.0}, .highest = {100.0}},
                       .disturbances = {.largest_step = {50.0}, .largest_travel = 50.0},
                       .fallback = {.slope = {slope}, .residual_std = 2.0 * std_dev_Nm},
                       .residuals = {.edges = {-1000.0, 1000.0}, .std_dev = {std_dev_Nm}}},
          .parameters = Linear::Parameters{.coefficients = {.values = coefficients}}};
}

/// Two sensors of one torque, 10 Nm/rad and 2 Nm/A, with errors of 0.2 and 0.4 Nm.
struct TwoTorques {
  ModelFile spring = slope_model("spring_deflection_rad", 10.0, 0.2);
  ModelFile current = slope_model("motor_current_A", 2.0, 0.4);

  [[nodiscard]] std::vector<SourceModel> models() const {
    return {{.torque = make_estimator(spring)}, {.torque = make_estimator(current)}};
  }
  [[nodiscard]] static MonitorPlan plan() {
    return {.sources = {{"spring", {"encoder", "clock"}}, {"current", {"current_sensor", "clock"}}},
            .signals = {
                {.name = "spring_deflection_rad"},
                {.name = "motor_current_A", .lowest = -9.0, .highest = 9.0, .largest_rate = 1e5}}};
  }
  /// A torque of 5 Nm at 1 Hz. @param gain of the current sensor from `fault_s` on
  [[nodiscard]] static Recording recording(double duration_s, std::uint64_t seed, double gain = 1.0,
                                           double fault_s = 0.0) {
    Random random(seed);
    Recording record("record", 1000.0);
    Channel spring{.name = "spring_deflection_rad", .values = {}};
    Channel current{.name = "motor_current_A", .values = {}};
    Channel torque{.name = "torque_Nm", .values = {}};
    const auto samples = static_cast<std::size_t>(duration_s * 1000.0);
    for (std::size_t n = 0; n < samples; ++n) {
      const double t_s = static_cast<double>(n) / 1000.0;
      const double torque_Nm = 5.0 * std::sin(6.28 * t_s);
      spring.values.push_back((torque_Nm + 0.2 * random.normal()) / 10.0);
      current.values.push_back((t_s >= fault_s ? gain : 1.0) * (torque_Nm + 0.4 * random.normal()) /
                               2.0);
      torque.values.push_back(torque_Nm);
    }
    record.add(std::move(spring));
    record.add(std::move(current));
    record.add(std::move(torque));
    return record;
  }
  [[nodiscard]] static Dataset fault_free(double duration_s, std::size_t records = 1) {
    Dataset dataset;
    for (std::size_t r = 0; r < records; ++r) {
      Recording record = recording(duration_s, r + 1);
      const std::size_t samples = record.size();
      dataset.records.push_back({std::move(record), whole_record(samples, Role::train)});
    }
    return dataset;
  }
};

}  // namespace torsio::test
