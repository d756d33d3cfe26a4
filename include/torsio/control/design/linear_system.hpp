#pragma once

#include <complex>
#include <cstddef>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// A linear system in discrete time, to design loops with:
///
///     x[n+1] = A x[n] + B u[n],   y[n] = C x[n] + D u[n]
///
/// Configuration only: everything here allocates. Systems that are combined must have the same
/// sample rate; otherwise an Error is thrown.
class LinearSystem {
 public:
  struct Matrices {
    Matrix a, b, c, d;
  };

  /// @throws Error if the shapes do not fit, a number is not finite, or the rate is not positive.
  LinearSystem(Matrices matrices, double sample_rate_Hz);

  /// ẋ = A x + B u, y = C x + D u after a zero-order hold, sampled: exact.
  [[nodiscard]] static LinearSystem held(const Matrices& continuous, double sample_rate_Hz);
  [[nodiscard]] static LinearSystem gain(double gain, double sample_rate_Hz);
  /// y[n] = u[n−1]
  [[nodiscard]] static LinearSystem delay(double sample_rate_Hz);
  /// y[n] = T (u[0] + … + u[n−1]), as `Pid` integrates
  [[nodiscard]] static LinearSystem integrator(double sample_rate_Hz);
  /// y[n] = (u[n] − u[n−1]) / T, as `Differentiator`
  [[nodiscard]] static LinearSystem difference(double sample_rate_Hz);
  /// As `Lowpass`.
  [[nodiscard]] static LinearSystem lowpass(double cutoff_Hz, double sample_rate_Hz);

  [[nodiscard]] const Matrices& matrices() const noexcept { return matrices_; }
  [[nodiscard]] double sample_rate_Hz() const noexcept { return sample_rate_Hz_; }
  [[nodiscard]] std::size_t order() const noexcept { return matrices_.a.rows; }
  [[nodiscard]] std::size_t input_count() const noexcept { return matrices_.d.columns; }
  [[nodiscard]] std::size_t output_count() const noexcept { return matrices_.d.rows; }

  /// C (z − A)⁻¹ B + D at z = exp(j ω T), from one input to one output.
  [[nodiscard]] std::complex<double> response(double frequency_rad_s, std::size_t output = 0,
                                              std::size_t input = 0) const;

  /// The largest absolute eigenvalue of A; below 1 the system is asymptotically stable.
  [[nodiscard]] double spectral_radius() const;

  /// Negative feedback: this system's outputs are subtracted from its inputs.
  /// @throws Error if the numbers of inputs and outputs differ, or the feedback has no solution.
  [[nodiscard]] LinearSystem closed() const;

 private:
  Matrices matrices_;
  double sample_rate_Hz_;
};

/// First `before`, then `after`. @throws Error if the number of signals between them, or the rates,
/// differ.
[[nodiscard]] LinearSystem operator*(const LinearSystem& after, const LinearSystem& before);
/// Both on the same inputs, their outputs added. @throws Error if they do not fit.
[[nodiscard]] LinearSystem operator+(const LinearSystem& one, const LinearSystem& other);

/// Distance of a loop from instability.
struct Margins {
  bool is_stable = false;  ///< `is_stable_closed`
  double phase_rad = 0.0;  ///< the least, over all frequencies of gain 1; infinite if there is none
  double crossover_rad_s = 0.0;  ///< where that is
  double gain = 0.0;        ///< the least factor above 1 that makes it unstable; infinite if none
  double gain_rad_s = 0.0;  ///< where that is
  double least_gain = 0.0;  ///< the largest factor below 1 that makes it unstable; 0 if none
};

/// Margins of a loop with one input and one output that is closed with negative feedback.
/// @throws Error if it has more.
[[nodiscard]] Margins margins(const LinearSystem& loop);

}  // namespace torsio
