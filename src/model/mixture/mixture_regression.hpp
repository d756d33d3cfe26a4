#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/mixture/gaussian_mixture.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// The distribution of one of a mixture's quantities given the others.
struct Conditional {
  double mean = 0.0;         ///< the quantity's unit
  double variance = 0.0;     ///< unit squared
  double log_density = 0.0;  ///< ln p(z~) of the given quantities, standardised: no unit
};

/// Gaussian mixture regression: one quantity y of a mixture given all the others z, in any
/// direction from one mixture.
///
///     l_i = ln w_i - sum ln diag L_i - d/2 ln 2 pi - |L_i^-1 (z - mu_i^Z)|^2 / 2
///           with L_i L_i^T = S_i^ZZ
///     m_i = mu_i^Y + B_i (z - mu_i^Z),   B_i = S_i^YZ (S_i^ZZ)^-1
///     s_i^2 = S_i^YY - B_i S_i^ZY
///     pi_i = exp(l_i) / sum_j exp(l_j)
///     mean = sum pi_i m_i
///     variance = sum pi_i (s_i^2 + (m_i - mean)^2)
///
/// `query` scans all components in float32 for those whose weight can matter at all. Few are then
/// evaluated in double. Where many matter and float32 can be trusted, they are evaluated in
/// float32, with differences to the means that keep what rounding takes from them.
///
/// Accuracy: for each query a bound on the scan's rounding ensures that the dropped components hold
/// less than 1e-10 of the weight. Whether float32 is sufficient is an estimate from the size of the
/// numbers (a relevant log weight that is wrong by 5e-5), not a bound. Tests check that mean and
/// standard deviation differ by at most 1e-4 standard deviations of the output from `query_exact`,
/// which evaluates all components in double, one by one, and the log density by at most 1e-4. Where
/// the density of every component is too small for double, the results are NaN.
///
/// Source: specification 3.1 (paper 000, equations 8 to 11, with the variance of the mixture).
/// Cost of `query`: 4 (d + d(d+1)/2 + 1) bytes per component from cache, d given quantities, and
/// `bytes_read()` in all. Nothing is allocated after construction.
class MixtureRegression {
 public:
  /// @param output index of y among the mixture's quantities; z are the others in their order.
  /// @throws Error if the mixture is not sound (see `check`), has less than two quantities, or
  /// lacks `output`.
  /// @param reserve components that may be added by `set`.
  MixtureRegression(const GaussianMixture& mixture, std::size_t output, std::size_t reserve = 0);

  [[nodiscard]] std::size_t input_count() const noexcept { return inputs_; }
  [[nodiscard]] std::size_t size() const noexcept { return components_; }

  /// @param inputs `input_count()` values, physical units.
  [[nodiscard]] Conditional query(Features inputs) noexcept TORSIO_REALTIME;

  /// The same for each row of `inputs`, to the bit.
  void query(const Matrix& inputs, std::span<Conditional> results) noexcept TORSIO_REALTIME;

  /// The reference path.
  [[nodiscard]] Conditional query_exact(Features inputs) const noexcept TORSIO_REALTIME;

  /// Replaces a component, or adds one that was reserved. Queries are exact for the new parameters.
  /// @param weight relative to the sum given to `set_total`. @param mean, covariance as in
  /// `GaussianMixture`. @returns false, without effect, if the covariance is not positive definite.
  bool set(std::size_t component, double weight, std::span<const double> mean,
           std::span<const double> covariance) noexcept TORSIO_REALTIME;
  /// Takes a component out of the queries.
  void remove(std::size_t component) noexcept TORSIO_REALTIME;
  /// The sum of all weights: the density is divided by it.
  void set_total(double weights) noexcept TORSIO_REALTIME { log_total_ = std::log(weights); }
  /// Keeps the ranges of the components as they are now for `reset_bounds`, which returns to them when
  /// all components are as they were then.
  void keep_bounds() noexcept TORSIO_REALTIME { first_bounds_ = bounds_; }
  void reset_bounds() noexcept TORSIO_REALTIME { bounds_ = first_bounds_; }

  /// A component and its share of the density of the given quantities.
  struct Share {
    std::size_t component = 0;
    double log_weight = 0.0;  ///< ln of weight times density
    double share = 0.0;
  };
  /// The components with the largest shares in the last `query`, the largest first, from its float32
  /// scan; their log weights are then evaluated in double.
  /// @param least share. @returns how many of `found` were filled.
  std::size_t heaviest(double least, std::span<Share> found) const noexcept TORSIO_REALTIME;
  /// Standardised given quantities of the last `query`.
  [[nodiscard]] std::span<const double> standardised() const noexcept { return standardised_; }
  /// Log weights that `heaviest` compares after the last `query`.
  [[nodiscard]] std::size_t scanned() const noexcept { return last_blocks_ * last_lanes_; }

  /// Bytes that `query` read last: for measuring against the machine's floor.
  [[nodiscard]] std::size_t bytes_read() const noexcept { return bytes_read_; }

 private:
  /// Bounds from which `query` computes the largest error of a float32 log weight.
  struct Bounds {
    double mean = 0.0;
    double whitening = 0.0;
    double offset = 0.0;
  };

  void pack(const GaussianMixture& mixture, std::size_t reserve);
  void clear(std::size_t slot) noexcept;
  void store(std::size_t slot, std::span<const double> parameters) noexcept;
  [[nodiscard]] double log_weight(std::size_t slot) const noexcept;
  void standardise(Features inputs) noexcept;
  [[nodiscard]] bool float_is_enough(double largest) const noexcept;
  [[nodiscard]] double threshold(double largest) const noexcept;
  [[nodiscard]] Conditional physical(const Conditional& standardised) const noexcept;

  std::size_t inputs_ = 0;
  std::size_t components_ = 0;
  std::size_t output_ = 0;
  std::size_t few_blocks_ = 0;  ///< so many candidate blocks are evaluated in double in any case
  double log_total_ = 0.0;
  double output_centre_ = 0.0;
  double output_scale_ = 1.0;
  std::vector<double> input_centre_;
  std::vector<double> input_scale_;
  Bounds bounds_;
  Bounds first_bounds_;
  std::vector<std::size_t> slot_of_;       ///< per component
  std::vector<std::size_t> component_at_;  ///< per slot
  // The components; packed as described in src/model/mixture/mixture_kernels.hpp.
  detail::AlignedVector<float> scan_;
  detail::AlignedVector<float> rounded_;
  detail::AlignedVector<double> exact_;
  // Scratch of one query.
  std::size_t bytes_read_ = 0;
  std::size_t last_blocks_ = 0;  ///< in `candidates_`, of `last_lanes_` components each
  std::size_t last_lanes_ = 0;
  double last_log_density_ = 0.0;  ///< without `log_total_`
  float last_largest_ = 0.0F;
  std::vector<double> parameters_;  ///< parameters of one component
  std::vector<double> standardised_;
  detail::AlignedVector<float> scan_input_;
  detail::AlignedVector<float> scan_log_weights_;
  detail::AlignedVector<double> log_weights_;
  std::vector<std::size_t> candidates_;
};

}  // namespace torsio
