#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>

#include "core/aligned_vector.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// A bank of stop operators on one input: springs k_i whose far ends slip at the force f_i,
///
///     F_i <- clip(F_i + k_i dx, +-f_i)
///
/// the Maxwell-slip model of friction with memory. With k_i = 1 the F_i are plain stops s_i within
/// their thresholds r_i = f_i, in x's unit, and x - s_i is the play operator of that threshold.
/// Independent of rate; no element gives work away that it did not take. Four elements are moved at
/// a time. Source: specification 3.7 (Maxwell-slip, PI). Cost: 5 operations an element.
class SlipBank {
 public:
  SlipBank() = default;

  /// Starts without force.
  /// @param stiffness k_i, finite and >= 0
  /// @param limit f_i, as many, finite and >= 0
  /// @param place what the error messages name, usually the family
  /// @throws Error if that does not hold
  SlipBank(std::span<const double> stiffness, std::span<const double> limit,
           std::string_view place);

  /// Plain stops. @param threshold r_i
  SlipBank(std::span<const double> threshold, std::string_view place);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::span<const double> stiffness() const noexcept {
    return std::span(stiffness_).first(size_);
  }
  [[nodiscard]] std::span<const double> limit() const noexcept {
    return std::span(limit_).first(size_);
  }

  void reset() noexcept;

  /// F_i, one per element.
  [[nodiscard]] std::span<const double> forces() const noexcept {
    return std::span(force_).first(size_);
  }
  /// Forces beyond their limits are brought to them; what is not finite is passed over.
  /// @param forces `size()` numbers
  void set_forces(std::span<const double> forces) noexcept TORSIO_REALTIME;

  /// Moves the input by `increment`; without effect if that is not a number.
  /// @param limit_scale >= 0: the limits of this tick are this multiple of f_i
  void move(double increment, double limit_scale = 1.0) noexcept TORSIO_REALTIME {
    const double dx = finite(increment);
    for (std::size_t i = 0; i < force_.size(); ++i) force_[i] = moved(i, dx, limit_scale);
  }

  /// sum_i F_i
  [[nodiscard]] double sum() const noexcept TORSIO_REALTIME {
    return weighted(force_.size(), [this](std::size_t i) { return force_[i]; });
  }

  /// sum_i w_i F_i, the weights perhaps those of this tick. @param weights `size()` numbers
  [[nodiscard]] double sum(std::span<const double> weights) const noexcept TORSIO_REALTIME {
    return weighted(size_, [this, weights](std::size_t i) { return weights[i] * force_[i]; });
  }

  /// What `sum(weights)` would be if the input moved by `increment`, which it does not.
  [[nodiscard]] double sum_after(double increment, std::span<const double> weights,
                                 double limit_scale = 1.0) const noexcept TORSIO_REALTIME {
    const double dx = finite(increment);
    return weighted(size_, [this, weights, dx, limit_scale](std::size_t i) {
      return weights[i] * moved(i, dx, limit_scale);
    });
  }

  /// `move`, then `sum`.
  double step(double increment) noexcept TORSIO_REALTIME {
    move(increment);
    return sum();
  }
  double step(double increment, std::span<const double> weights) noexcept TORSIO_REALTIME {
    move(increment);
    return sum(weights);
  }

  /// The increment by which the elements move: 0 instead of NaN, the largest number instead of infinity, so
  /// that no product with a stiffness is NaN.
  [[nodiscard]] static double finite(double increment) noexcept {
    constexpr double kLargest = std::numeric_limits<double>::max();
    if (std::abs(increment) <= kLargest) return increment;
    return std::isnan(increment) ? 0.0 : std::copysign(kLargest, increment);
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(force_); }

 private:
  static constexpr std::size_t kLanes = 4;

  // One rounding order whatever the machine: four sums side by side.
  template <class Term>
  [[nodiscard]] static double weighted(std::size_t count, const Term& term) noexcept {
    std::array<double, kLanes> lane{};
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes)
      for (std::size_t j = 0; j < kLanes; ++j) lane[j] += term(i + j);
    for (std::size_t j = 0; i + j < count; ++j) lane[j] += term(i + j);
    return (lane[0] + lane[2]) + (lane[1] + lane[3]);
  }

  [[nodiscard]] double moved(std::size_t i, double dx, double limit_scale) const noexcept {
    const double limit = limit_[i] * limit_scale;
    const double force = force_[i] + stiffness_[i] * dx;
    const double above = force < -limit ? -limit : force;
    return above > limit ? limit : above;
  }

  std::size_t size_ = 0;
  // Filled up to a multiple of kLanes by elements that hold no force.
  detail::AlignedVector<double> stiffness_;
  detail::AlignedVector<double> limit_;
  detail::AlignedVector<double> force_;
};

}  // namespace torsio
