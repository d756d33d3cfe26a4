#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "torsio/control/design/linear_system.hpp"

namespace torsio {

/// `LinearSystem::response` of one input and one output at many frequencies: A is transformed to upper
/// Hessenberg form once, so that a frequency costs order² instead of order³ operations. Source: Laub,
/// Efficient multivariable frequency response computations (1981).
class FrequencyResponse {
 public:
  explicit FrequencyResponse(const LinearSystem& system, std::size_t output = 0,
                             std::size_t input = 0);

  [[nodiscard]] std::complex<double> at(double rad_s);

 private:
  std::size_t order_;
  double period_s_;
  double direct_;                           ///< D
  std::vector<double> hessenberg_;          ///< Qᵀ A Q, row by row
  std::vector<double> input_;               ///< Qᵀ B
  std::vector<double> output_;              ///< C Q
  std::vector<std::complex<double>> rows_;  ///< z − Qᵀ A Q, and its triangle
  std::vector<std::complex<double>> states_;
};

}  // namespace torsio
