#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "fitted_grey_box.hpp"
#include "rows.hpp"
#include "torsio.h"
#include "torsio/files/model_file.hpp"

namespace torsio::bench {
namespace {

ModelFile model_file() {
  return {.card = {},
          .settings = {.features = {.inputs = {"spring_deflection_rad",
                                               "lowpass(rate(spring_deflection_rad), 10Hz)",
                                               "lowpass(rate(joint_angle_rad), 10Hz)"},
                                    .definitions = {{"spring_deflection_rad",
                                                     "gear_angle_rad - joint_angle_rad"}}},
                       .sample_rate_Hz = 1000.0,
                       .target = "torque_Nm",
                       .zeroed_channels = {},
                       .ranges = {.lowest = {-0.05, -1.0, -1.0}, .highest = {0.05, 1.0, 1.0}},
                       .fallback = {.intercept = 0.0, .slope = {573.0, 0.0, 0.0}},
                       .residuals = {.edges = {-30.0, 0.0, 30.0}, .std_dev = {0.1, 0.1}}},
          .parameters = fitted_grey_box().parameters()};
}

}  // namespace

/// One step of an estimator through libtorsio.so; the floor is the same step of the C++ library.
Row c_step() {
  constexpr std::size_t kSteps = 4096;
  const ModelFile file = model_file();
  std::vector<std::array<double, 2>> rows;
  for (std::size_t n = 0; n < kSteps; ++n)
    rows.push_back({0.03 * std::sin(0.0031 * static_cast<double>(n)), 0.0});
  Estimator direct = make_estimator(file);
  const std::vector<std::byte> bytes = model_bytes(file);
  torsio_estimator* const through_c = torsio_load_bytes(bytes.data(), bytes.size(), nullptr);
  double sum = 0.0;
  double c_sum = 0.0;
  const double direct_s = best_seconds([&] {
    for (const auto& row : rows) sum += direct.step(row).value;
  });
  const double c_s = best_seconds([&] {
    for (const auto& row : rows) c_sum += torsio_step(through_c, row.data(), row.size()).value;
  });
  torsio_free(through_c);
  const bool is_valid = std::isfinite(sum) && std::isfinite(c_sum) && c_sum != 0.0;
  return {
      .value = is_valid ? 1e9 * c_s / kSteps : 0.0, .unit = "ns", .floor = 1e9 * direct_s / kSteps};
}

}  // namespace torsio::bench
