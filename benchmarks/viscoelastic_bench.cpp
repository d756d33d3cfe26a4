#include <cmath>
#include <cstddef>
#include <vector>

#include "model/viscoelastic/viscoelastic.hpp"
#include "rows.hpp"

namespace torsio::bench {

/// Model (a) of paper 003: two Kelvin-Voigt elements and a spring.
Row viscoelastic_step() {
  constexpr std::size_t kSteps = 100'000;
  Viscoelastic model(
      {.network = parse_network("003a"), .offset = 0.1, .sample_period_s = 5e-3, .inputs = 1});
  std::vector<double> deflection(kSteps);
  for (std::size_t n = 0; n < kSteps; ++n)
    deflection[n] = 0.1 * std::sin(0.01 * static_cast<double>(n));
  double last = 0.0;
  const double seconds = best_seconds([&] {
    for (const double& u : deflection) last = model.step({&u, 1}).value;
  });
  // Two branches of three multiply-adds, and as many for what does not relax.
  const double floor = 9.0 / multiply_adds_per_second();
  return {.value = std::isfinite(last) ? seconds / kSteps * 1e9 : last,
          .unit = "ns",
          .floor = floor * 1e9};
}

}  // namespace torsio::bench
