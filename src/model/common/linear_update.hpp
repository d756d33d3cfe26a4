#pragma once

#include <cstddef>
#include <span>

#include "core/aligned_vector.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/adaptation.hpp"

namespace torsio::detail {

/// Adapts weights W of a sum W x to its error e = reference - W x, from frozen weights W0:
///
///     NLMS   W <- (1 - gamma) W + gamma W0 + mu e x / (epsilon + |x|^2)
///     RLS    s = lambda + x' P x,   W <- W + P x e / s
///            P <- (P - P x x' P / s) min(1 / lambda, cap / tr(P - ...)),   P symmetric as it is stored
///
/// P starts as delta I. What is stored is W - W0. Source: specification 3.4. Cost for n weights:
/// NLMS 5 n multiply-adds; RLS one pass over n^2 / 2 doubles. Nothing is allocated after
/// construction.
class LinearUpdate {
 public:
  struct Sums {
    double correction = 0.0;  ///< (W - W0) x
    double square = 0.0;      ///< |x|^2
  };

  /// @throws Error if there are more weights than `kMaxRlsFeatures` + 1 for RLS.
  LinearUpdate(const AdaptationSettings& settings, std::size_t weights);

  void reset() noexcept TORSIO_REALTIME;

  /// x of the next update. @param features x without its last element, which is 1.
  Sums set(std::span<const float> features) noexcept TORSIO_REALTIME;
  /// The same for an x that was written to `regressor()`.
  Sums set() noexcept TORSIO_REALTIME;
  [[nodiscard]] std::span<double> regressor() noexcept { return std::span(x_).first(weights_); }

  /// @returns false if rounding has made P indefinite: it starts again, W is as it was.
  bool update(double error) noexcept TORSIO_REALTIME;

  /// W - W0
  [[nodiscard]] std::span<const double> deviation() const noexcept {
    return std::span(deviation_).first(weights_);
  }
  [[nodiscard]] std::span<double> deviation() noexcept {
    return std::span(deviation_).first(weights_);
  }
  /// |W - W0|^2 after the last `update` or `shrink`.
  [[nodiscard]] double square() const noexcept { return square_; }
  void shrink(double factor) noexcept TORSIO_REALTIME;

 private:
  void nlms(double error) noexcept;
  [[nodiscard]] bool rls(double error) noexcept;
  void reset_covariance() noexcept;

  AdaptationSettings settings_;
  std::size_t weights_;
  AlignedVector<double> deviation_;  ///< padded
  double square_ = 0.0;
  AlignedVector<double> x_;  ///< padded
  double x_square_ = 0.0;

  // RLS. The last rank-one update waits until the next pass over P, which then costs no more.
  AlignedVector<double> covariance_;  ///< layout: src/model/common/adaptation_kernels.hpp
  AlignedVector<double> pending_;     ///< P is pending_scale_ (covariance_ - pending_ pending_')
  AlignedVector<double> product_;     ///< P x
  double pending_scale_ = 1.0;
};

}  // namespace torsio::detail

namespace torsio {

/// More would need over 64 MiB for P.
inline constexpr std::size_t kMaxRlsFeatures = 4000;

}  // namespace torsio
