#include "model/gaussian_process/covariance.hpp"

#include <algorithm>
#include <string>

#include "torsio/core/error.hpp"

namespace torsio {

void fill_covariance(const Kernel& kernel, const Matrix& points, const PackedPoints& packed,
                     double noise_variance, SquareMatrix& k) {
  for (std::size_t i = 0; i < points.rows; ++i) {
    kernel.row(points.row(i).data(), packed, i + 1, k.row(i));
    k(i, i) += noise_variance;
  }
}

double factorise_covariance(const Kernel& kernel, const Matrix& points, const PackedPoints& packed,
                            double noise_variance, Jitter jitter, SquareMatrix& factor) {
  constexpr double kSmallest = 1e-12;
  double share = jitter.first;
  while (share <= Jitter::kLargest) {
    fill_covariance(kernel, points, packed, noise_variance, factor);
    double trace = 0.0;
    for (std::size_t i = 0; i < factor.size(); ++i) trace += factor(i, i);
    const double added = share * trace / static_cast<double>(factor.size());
    for (std::size_t i = 0; i < factor.size(); ++i) factor(i, i) += added;
    if (cholesky(factor)) return share;
    share = std::max(10.0 * share, kSmallest);
  }
  return -1.0;
}

void refuse_covariance(std::string_view place) {
  throw Error(
      {.place = std::string(place),
       .problem = "the kernel's matrix is not positive definite, even with a jitter of 1e-4",
       .advice = "Raise the noise, lower the amplitudes or take another kernel."});
}

}  // namespace torsio
