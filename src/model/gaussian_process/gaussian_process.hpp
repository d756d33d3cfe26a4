#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// An exact Gaussian process over N training points X, in standardised coordinates:
///
///     K = k(X, X) + sigma^2 I = L L^T,   q = k(X, x)
///     value = q . alpha,   alpha = K^-1 y
///     std_dev^2 = k(x, x) - |L^-1 q|^2 + sigma^2
///     novelty = 1 - |L^-1 q|^2 / k(x, x)
///
/// Novelty is the share of the prior variance that the training points have not explained: 0 at
/// them, 1 far away. Source: Rasmussen and Williams 2006, chapter 2.
///
/// Cost: N kernel values for the mean; N^2 / 2 more multiply-adds for the rest, which may be left
/// out. L is not stored: constructing factorises K again, N^3 / 3 operations.
class GaussianProcess {
 public:
  static constexpr std::string_view kFamily = "gaussian_process";
  static constexpr std::size_t kMaxPoints = 65536;
  static constexpr std::size_t kMaxPointsWithStdDev = 4096;

  struct Parameters {
    using Family = GaussianProcess;
    NetworkScaling scaling;
    KernelExpression kernel;
    double noise_variance = 0.0;  ///< sigma^2, of the standardised target
    Matrix points;                ///< X: N x inputs, standardised
    std::vector<double> weights;  ///< alpha
    bool with_std_dev = true;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("scaling", self.scaling);
      visit("kernel", self.kernel);
      visit("noise_variance", self.noise_variance);
      visit("points", self.points);
      visit("weights", self.weights);
      visit("with_std_dev", self.with_std_dev);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if shapes disagree, a number is not finite, a scale or the noise is not positive,
  /// there are more points than the two limits above, the kernel is none, or its matrix is not
  /// positive definite.
  explicit GaussianProcess(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return kernel_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return parameters_.weights.size() * (1 + input_count()) + kernel_.parameter_count() + 1;
  }

  void reset() noexcept {}
  /// Features that are not finite, or so large that the kernel is not, give the target's centre and
  /// a fault.
  Estimate step(Features features) noexcept TORSIO_REALTIME;

 private:
  Parameters parameters_;
  Kernel kernel_;
  PackedPoints points_;
  detail::AlignedVector<double> weights_;
  detail::AlignedVector<double> factor_;  ///< L, row after row, as `whitened_square` reads it
  detail::AlignedVector<double> input_;
  detail::AlignedVector<double> values_;
};

}  // namespace torsio
