#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// Roots of c_0 x^n + c_1 x^(n-1) + ... + c_n, as eigenvalues of the companion matrix. Leading zeros
/// are passed over.
[[nodiscard]] std::vector<std::complex<double>> polynomial_roots(
    std::span<const double> highest_first);

/// A linear system in discrete time as a cascade of second-order sections:
///
///     G(z) = prod_i (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)
///
/// One row per section, columns b0 b1 b2 a1 a2. A cascade, since slow poles change only the last
/// digits of the coefficients of one long polynomial: n poles near z = 1 at a distance d require an
/// accuracy of d^n.
using Sections = Matrix;
inline constexpr std::size_t kSectionColumns = 5;
inline constexpr std::size_t kMaxSections = 50;

/// The same in the form of the papers.
struct DiscreteTransfer {
  std::vector<double> numerator = {};    ///< coefficients of z^0, z^-1, ...
  std::vector<double> denominator = {};  ///< likewise; the first is 1
};

/// A linear system in continuous time; coefficients of the highest power first, that of the
/// denominator 1.
struct ContinuousTransfer {
  std::vector<double> numerator = {};
  std::vector<double> denominator = {};
};

/// Factors a transfer function into sections, nearest zeros with the poles.
/// @throws Error if the denominator does not begin with 1, the numerator is zero or of another degree
/// in z than the pairing holds (kMaxSections), or a number is not finite.
[[nodiscard]] Sections sections_of(const DiscreteTransfer& transfer);
[[nodiscard]] DiscreteTransfer transfer_of(const Sections& sections);

[[nodiscard]] std::vector<std::complex<double>> poles(const Sections& sections);
[[nodiscard]] std::vector<std::complex<double>> zeros(const Sections& sections);
/// A term r / (1 - p z^-1) of the partial fractions of G.
struct Mode {
  std::complex<double> pole;
  double residue = 0.0;  ///< |r|; not finite where another pole has the same value
};
/// One for each pole that is not 0.
[[nodiscard]] std::vector<Mode> modes(const Sections& sections);
/// Whether all poles are inside the unit circle: |a2| < 1 and |a1| < 1 + a2 in each section, which is exact
/// where roots next to each other are known to half their digits only.
[[nodiscard]] bool is_stable(const Sections& sections) noexcept;
/// G(1).
[[nodiscard]] double dc_gain(const Sections& sections) noexcept;

/// Every pole outside |z| = 1 - 1e-9 goes to its mirror image 1 / conj(p) inside; gain at z = 1 is kept.
/// @returns how many were moved
std::size_t reflect_unstable_poles(Sections& sections);

/// Bilinear transform z = (1 + s T/2) / (1 - s T/2). Specification 3.5.
[[nodiscard]] ContinuousTransfer tustin(const DiscreteTransfer& transfer, double sample_period_s);
/// Its inverse: s = 2/T (z - 1) / (z + 1).
[[nodiscard]] DiscreteTransfer tustin(const ContinuousTransfer& transfer, double sample_period_s);

/// Exact where the input is linear between samples (first-order hold): by a matrix exponential.
[[nodiscard]] DiscreteTransfer first_order_hold(const ContinuousTransfer& transfer,
                                                double sample_period_s);

/// The reason against interpreting a discrete system as a continuous one: a pole that is real and
/// negative oscillates from sample to sample. No continuous system does that; Tustin maps it to a
/// pole beyond Nyquist. Empty if there is no such pole. Specification 2.
[[nodiscard]] std::string continuous_warning(const Sections& sections, double sample_period_s);

/// "(1.72 s^2 + 688 s + 151) / (s^2 + 975 s + 509)"
[[nodiscard]] std::string text_of(const ContinuousTransfer& transfer);

}  // namespace torsio
