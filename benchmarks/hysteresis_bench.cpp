#include <array>
#include <cmath>
#include <vector>

#include "fitted_grey_box.hpp"
#include "model/hysteresis/slip_bank.hpp"
#include "rows.hpp"

namespace torsio::bench {

Row slip_bank_step() {
  constexpr std::size_t kSteps = 10000;
  constexpr std::size_t kElements = 8;
  std::vector<double> stiffness;
  std::vector<double> limit;
  for (std::size_t i = 0; i < kElements; ++i) {
    const auto number = static_cast<double>(i + 1);
    stiffness.push_back(100.0 / number);
    limit.push_back(0.1 * number);
  }
  SlipBank bank(stiffness, limit, "bench");
  std::vector<double> increments(kSteps);
  for (std::size_t n = 0; n < kSteps; ++n)
    increments[n] = 1e-3 * std::sin(3e-3 * static_cast<double>(n));
  std::vector<double> torques(kSteps);
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < kSteps; ++n) torques[n] = bank.step(increments[n]);
  });
  // A multiply-add, two comparisons with the cost of one, and the sum.
  const double floor_s = 4.0 * kElements / multiply_adds_per_second();
  return {.value = seconds / kSteps * 1e9, .unit = "ns", .floor = floor_s * 1e9};
}

Row grey_box_step() {
  constexpr std::size_t kSteps = 10000;
  GreyBox box = fitted_grey_box();
  std::vector<double> torques(kSteps);
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < kSteps; ++n) {
      const double phase = 3e-3 * static_cast<double>(n);
      torques[n] = box.step(std::array{0.025 * std::sin(phase), 0.07 * std::cos(phase), 0.1}).value;
    }
  });
  return {.value = seconds / kSteps * 1e9, .unit = "ns"};
}

}  // namespace torsio::bench
