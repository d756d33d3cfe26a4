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

/// A Gaussian process that represents its data by the values u ~ N(m, S) at M inducing points Z, in
/// standardised coordinates:
///
///     K = k(Z, Z),   q = k(Z, x)
///     value = q . alpha,                         alpha = K^-1 m
///     std_dev^2 = k(x, x) - q . C q + sigma^2,   C = K^-1 - K^-1 S K^-1
///     novelty = 1 - q . C q / k(x, x)
///
/// The estimate of u may come from either method: sample by sample (paper 002), or as the
/// optimum of a variational bound. Novelty is the share of the prior variance that the data have
/// not explained.
///
/// Source: paper 002 with the errata of specification 1, specification 3.3. Cost: M kernel values, and M^2
/// multiply-adds for the std_dev.
class ParametricGp {
 public:
  static constexpr std::string_view kFamily = "parametric_gp";
  static constexpr std::size_t kMaxPoints = 4096;

  struct Parameters {
    using Family = ParametricGp;
    NetworkScaling scaling;
    KernelExpression kernel;
    double noise_variance = 0.0;  ///< sigma^2, of the standardised target
    Matrix inducing_points;       ///< Z: M x inputs, standardised
    std::vector<double> weights;  ///< alpha
    Matrix explained;             ///< C: M x M, symmetric; 0 x 0: only values, no std_dev

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("scaling", self.scaling);
      visit("kernel", self.kernel);
      visit("noise_variance", self.noise_variance);
      visit("inducing_points", self.inducing_points);
      visit("weights", self.weights);
      visit("explained", self.explained);
    }
    bool operator==(const Parameters&) const = default;

    [[nodiscard]] bool has_std_dev() const noexcept { return explained.rows > 0; }
  };

  /// @throws Error if shapes disagree, a number is not finite, a scale or the noise is not positive,
  /// the kernel is none, or has no value between two of the points (an alpha below 0).
  explicit ParametricGp(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return kernel_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    const std::size_t m = parameters_.weights.size();
    const std::size_t spread = parameters_.has_std_dev() ? m * (m + 1) / 2 + 1 : 0;
    return m * (1 + input_count()) + spread + kernel_.parameter_count();
  }

  void reset() noexcept {}
  /// Features that are not finite, or lie where the kernel is not, give the target's centre and a
  /// fault.
  Estimate step(Features features) noexcept TORSIO_REALTIME;

 private:
  Parameters parameters_;
  Kernel kernel_;
  PackedPoints points_;
  detail::AlignedVector<double> weights_;    ///< padded with 0
  detail::AlignedVector<double> explained_;  ///< M rows, padded with 0
  detail::AlignedVector<double> input_;
  detail::AlignedVector<double> values_;
};

}  // namespace torsio
