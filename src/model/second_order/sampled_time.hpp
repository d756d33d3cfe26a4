#pragma once

#include <cstddef>

namespace torsio {

/// How a model given by a differential equation runs between two samples.
struct SampledTime {
  double sample_period_s = 0.0;
  std::size_t substeps = 2;     ///< integrator steps per sample period
  std::size_t input_order = 3;  ///< polynomial order between samples, `CausalPolynomial`

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("sample_period_s", self.sample_period_s);
    visit("substeps", self.substeps);
    visit("input_order", self.input_order);
  }
  bool operator==(const SampledTime&) const = default;
};

}  // namespace torsio
