#include "model/hammerstein_wiener/transfer_function.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/all_finite.hpp"
#include "core/checks.hpp"
#include "core/matrix_functions.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

bool is_real(Complex root) { return std::abs(root.imag()) <= 1e-12 * (1.0 + std::abs(root)); }

/// Roots as pairs that make real quadratics x^2 + p x + q; a last single one makes x + p.
struct Quadratic {
  double p = 0.0;
  double q = 0.0;
  Complex at;  ///< one of its roots
};

std::vector<Quadratic> quadratics_of(const std::vector<Complex>& roots) {
  std::vector<Quadratic> made;
  std::vector<double> real;
  for (const Complex root : roots) {
    if (is_real(root))
      real.push_back(root.real());
    else if (root.imag() > 0.0)
      made.push_back({-2.0 * root.real(), std::norm(root), root});
  }
  std::ranges::sort(real);
  for (std::size_t i = 0; i < real.size(); i += 2) {
    if (i + 1 < real.size())
      made.push_back({-(real[i] + real[i + 1]), real[i] * real[i + 1], real[i + 1]});
    else
      made.push_back({-real[i], 0.0, real[i]});
  }
  return made;
}

/// Quadratic factors of a polynomial, sorted so that the farthest root from 0 is last.
std::vector<Quadratic> sorted_quadratics(std::span<const double> of_z) {
  std::vector<Quadratic> made = quadratics_of(polynomial_roots(of_z));
  std::ranges::stable_sort(made, {}, [](const Quadratic& each) { return std::abs(each.at); });
  return made;
}

std::vector<double> product(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> c(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
  return c;
}

std::vector<double> power(const std::vector<double>& base, std::size_t exponent) {
  std::vector<double> result{1.0};
  for (std::size_t k = 0; k < exponent; ++k) result = product(result, base);
  return result;
}

/// sum_k c_k up^(n-k) down^k
std::vector<double> substituted(const std::vector<double>& c, const std::vector<double>& up,
                                const std::vector<double>& down) {
  const std::size_t n = c.size() - 1;
  std::vector<double> sum(n + 1, 0.0);
  for (std::size_t k = 0; k <= n; ++k) {
    const std::vector<double> term = product(power(up, n - k), power(down, k));
    for (std::size_t i = 0; i <= n; ++i) sum[i] += c[k] * term[i];
  }
  return sum;
}

void divide(std::vector<double>& values, double by) {
  for (double& value : values) value /= by;
}

/// Roots in z of b0 + b1 z^-1 + b2 z^-2, or of the denominator. Those at 0 only delay.
void append_roots(std::vector<Complex>& roots, double first, double second, double third) {
  for (const Complex root : polynomial_roots(std::vector<double>{first, second, third}))
    if (root != Complex(0.0)) roots.push_back(root);
}

void check(const DiscreteTransfer& transfer) {
  constexpr auto kPlace = "transfer function";
  require(!transfer.denominator.empty() && transfer.denominator.front() == 1.0, kPlace,
          "a denominator that begins with 1",
          transfer.denominator.empty() ? "none" : as_text(transfer.denominator.front()));
  require(all_finite(transfer.numerator) && all_finite(transfer.denominator), kPlace,
          "finite numbers", "one that is not finite");
  require(std::ranges::any_of(transfer.numerator, [](double b) { return b != 0.0; }), kPlace,
          "a numerator", "none");
  const std::size_t most = std::max(transfer.numerator.size(), transfer.denominator.size());
  require(most <= 2 * kMaxSections, kPlace, "at most 100 coefficients", std::to_string(most));
}

}  // namespace

std::vector<Complex> polynomial_roots(std::span<const double> highest_first) {
  while (!highest_first.empty() && highest_first.front() == 0.0)
    highest_first = highest_first.subspan(1);
  std::vector<Complex> roots;
  while (!highest_first.empty() && highest_first.back() == 0.0) {
    roots.emplace_back(0.0);
    highest_first = highest_first.first(highest_first.size() - 1);
  }
  if (highest_first.size() < 2) return roots;
  const auto n = static_cast<Eigen::Index>(highest_first.size()) - 1;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.diagonal(-1).setOnes();
  for (Eigen::Index k = 0; k < n; ++k)
    companion(0, k) = -highest_first[static_cast<std::size_t>(k) + 1] / highest_first.front();
  const Eigen::VectorXcd values = eigenvalues(companion);
  roots.insert(roots.end(), values.begin(), values.end());
  return roots;
}

Sections sections_of(const DiscreteTransfer& transfer) {
  check(transfer);
  std::vector<double> numerator = transfer.numerator;
  std::size_t delay = 0;  // whole samples, in front of the numerator
  while (numerator[delay] == 0.0) ++delay;
  const double gain = numerator[delay];
  std::vector<double> of_z(numerator.begin() + static_cast<std::ptrdiff_t>(delay), numerator.end());
  const std::vector<Quadratic> zero_pairs = sorted_quadratics(of_z);
  const std::vector<Quadratic> pole_pairs = sorted_quadratics(transfer.denominator);
  // Zeros and poles that are both sorted by their distance from 0 are near each other.
  const std::size_t delays = (delay + 1) / 2;
  Sections sections(std::max<std::size_t>({zero_pairs.size(), pole_pairs.size(), 1}) + delays,
                    kSectionColumns);
  for (std::size_t i = 0; i < sections.rows; ++i) sections(i, 0) = 1.0;
  for (std::size_t i = 0; i < zero_pairs.size(); ++i) {
    sections(i, 1) = zero_pairs[zero_pairs.size() - 1 - i].p;
    sections(i, 2) = zero_pairs[zero_pairs.size() - 1 - i].q;
  }
  for (std::size_t i = 0; i < pole_pairs.size(); ++i) {
    sections(i, 3) = pole_pairs[pole_pairs.size() - 1 - i].p;
    sections(i, 4) = pole_pairs[pole_pairs.size() - 1 - i].q;
  }
  for (std::size_t i = 0; i < delays; ++i) {
    const std::size_t row = sections.rows - 1 - i;
    sections(row, 0) = 0.0;
    sections(row, i == 0 && delay % 2 == 1 ? 1 : 2) = 1.0;
  }
  for (std::size_t k = 0; k < 3; ++k) sections(0, k) *= gain;
  return sections;
}

DiscreteTransfer transfer_of(const Sections& sections) {
  DiscreteTransfer transfer{{1.0}, {1.0}};
  for (std::size_t i = 0; i < sections.rows; ++i) {
    transfer.numerator =
        product(transfer.numerator, {sections(i, 0), sections(i, 1), sections(i, 2)});
    transfer.denominator = product(transfer.denominator, {1.0, sections(i, 3), sections(i, 4)});
  }
  for (std::vector<double>* of : {&transfer.numerator, &transfer.denominator})
    while (of->size() > 1 && of->back() == 0.0) of->pop_back();
  return transfer;
}

std::vector<Complex> poles(const Sections& sections) {
  std::vector<Complex> found;
  for (std::size_t i = 0; i < sections.rows; ++i)
    append_roots(found, 1.0, sections(i, 3), sections(i, 4));
  return found;
}

std::vector<Complex> zeros(const Sections& sections) {
  std::vector<Complex> found;
  for (std::size_t i = 0; i < sections.rows; ++i)
    append_roots(found, sections(i, 0), sections(i, 1), sections(i, 2));
  return found;
}

std::vector<Mode> modes(const Sections& sections) {
  const std::vector<Complex> all = poles(sections);
  std::vector<Mode> modes;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k] == 0.0) continue;
    const Complex delay = 1.0 / all[k];
    Complex residue = 1.0;
    for (std::size_t i = 0; i < sections.rows; ++i)
      residue *= sections(i, 0) + delay * (sections(i, 1) + delay * sections(i, 2));
    for (std::size_t j = 0; j < all.size(); ++j)
      if (j != k) residue /= 1.0 - all[j] * delay;
    modes.push_back({all[k], std::abs(residue)});
  }
  return modes;
}

bool is_stable(const Sections& sections) noexcept {
  for (std::size_t i = 0; i < sections.rows; ++i) {
    const double a1 = sections(i, 3);
    const double a2 = sections(i, 4);
    if (!(std::abs(a2) < 1.0 && std::abs(a1) < 1.0 + a2)) return false;
  }
  return true;
}

double dc_gain(const Sections& sections) noexcept {
  double gain = 1.0;
  for (std::size_t i = 0; i < sections.rows; ++i)
    gain *= (sections(i, 0) + sections(i, 1) + sections(i, 2)) /
            (1.0 + sections(i, 3) + sections(i, 4));
  return gain;
}

std::size_t reflect_unstable_poles(Sections& sections) {
  constexpr double kEdge = 1.0 - 1e-9;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < sections.rows; ++i) {
    std::vector<Complex> of_section;
    append_roots(of_section, 1.0, sections(i, 3), sections(i, 4));
    const double before = 1.0 + sections(i, 3) + sections(i, 4);
    std::size_t here = 0;
    for (Complex& pole : of_section) {
      if (!(std::abs(pole) > kEdge)) continue;
      pole = 1.0 / std::conj(pole);
      if (std::abs(pole) > kEdge) pole *= kEdge / std::abs(pole);
      ++here;
    }
    if (here == 0) continue;
    moved += here;
    const std::vector<Quadratic> again = quadratics_of(of_section);
    sections(i, 3) = again.front().p;
    sections(i, 4) = again.front().q;
    const double after = 1.0 + sections(i, 3) + sections(i, 4);
    if (before != 0.0)
      for (std::size_t k = 0; k < 3; ++k) sections(i, k) *= after / before;
  }
  return moved;
}

ContinuousTransfer tustin(const DiscreteTransfer& transfer, double sample_period_s) {
  const std::size_t order = std::max(transfer.numerator.size(), transfer.denominator.size());
  std::vector<double> b = transfer.numerator;
  std::vector<double> a = transfer.denominator;
  b.resize(order, 0.0);
  a.resize(order, 0.0);
  const double half = 0.5 * sample_period_s;
  ContinuousTransfer result{substituted(b, {half, 1.0}, {-half, 1.0}),
                            substituted(a, {half, 1.0}, {-half, 1.0})};
  const double lead = result.denominator.front();
  divide(result.numerator, lead);
  divide(result.denominator, lead);
  return result;
}

DiscreteTransfer tustin(const ContinuousTransfer& transfer, double sample_period_s) {
  std::vector<double> b(transfer.denominator.size() - transfer.numerator.size(), 0.0);
  b.insert(b.end(), transfer.numerator.begin(), transfer.numerator.end());
  // In powers of z^-1: s^(n-k) -> (2/T)^(n-k) (1 - z^-1)^(n-k) (1 + z^-1)^k
  const double rate = 2.0 / sample_period_s;
  const std::vector<double> up{-rate, rate};  // highest power of z^-1 first
  const std::vector<double> down{1.0, 1.0};
  DiscreteTransfer result{substituted(b, up, down), substituted(transfer.denominator, up, down)};
  std::ranges::reverse(result.numerator);
  std::ranges::reverse(result.denominator);
  const double lead = result.denominator.front();
  divide(result.numerator, lead);
  divide(result.denominator, lead);
  result.denominator.front() = 1.0;
  return result;
}

DiscreteTransfer first_order_hold(const ContinuousTransfer& transfer, double sample_period_s) {
  const auto n = static_cast<Eigen::Index>(transfer.denominator.size()) - 1;
  std::vector<double> b(transfer.denominator.size() - transfer.numerator.size(), 0.0);
  b.insert(b.end(), transfer.numerator.begin(), transfer.numerator.end());
  // Controllable form x' = A x + e u, y = C x + D u, and the input and its rise as two more states.
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 2, n + 2);
  Eigen::RowVectorXd out(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k) + 1;
    system(0, k) = -transfer.denominator[at] * sample_period_s;
    out(k) = b[at] - transfer.denominator[at] * b.front();
    if (k > 0) system(k, k - 1) = sample_period_s;
  }
  if (n > 0) system(0, n) = sample_period_s;
  system(n, n + 1) = 1.0;
  const Eigen::MatrixXd step = matrix_exponential(system);
  const Eigen::MatrixXd a = step.topLeftCorner(n, n);
  const Eigen::VectorXd rise = step.block(0, n + 1, n, 1);
  const Eigen::VectorXd held = step.block(0, n, n, 1) - rise;
  // G = D + C (zI - A)^-1 (held + rise z) by Leverrier's recursion for the adjugate.
  DiscreteTransfer result;
  result.denominator.assign(static_cast<std::size_t>(n) + 1, 0.0);
  result.numerator.assign(static_cast<std::size_t>(n) + 1, 0.0);
  result.denominator.front() = 1.0;
  Eigen::MatrixXd adjugate = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    result.numerator[at] += out * adjugate * rise;
    result.numerator[at + 1] += out * adjugate * held;
    const Eigen::MatrixXd next = a * adjugate;
    result.denominator[at + 1] = -next.trace() / static_cast<double>(k + 1);
    adjugate = next;
    adjugate.diagonal().array() += result.denominator[at + 1];
  }
  for (std::size_t k = 0; k < result.numerator.size(); ++k)
    result.numerator[k] += b.front() * result.denominator[k];
  return result;
}

std::string continuous_warning(const Sections& sections, double sample_period_s) {
  std::optional<double> worst;
  for (const Complex pole : poles(sections))
    if (is_real(pole) && pole.real() < 0.0 && (!worst || pole.real() < *worst)) worst = pole.real();
  if (!worst) return {};
  const double image = 2.0 / sample_period_s * (*worst - 1.0) / (*worst + 1.0);
  return fmt::format(
      "the pole {:.4g} is real and negative: it turns over from sample to sample, which no "
      "continuous system does. Tustin makes {:.4g} rad/s of it, beyond Nyquist ({:.4g} rad/s): an "
      "artefact, not a time constant",
      *worst, image, std::numbers::pi / sample_period_s);
}

std::string text_of(const ContinuousTransfer& transfer) {
  const auto side = [](const std::vector<double>& of) {
    std::string text;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const std::size_t order = of.size() - 1 - k;
      if (of[k] == 0.0) continue;
      const std::string variable = order == 0 ? "" : order == 1 ? "s" : fmt::format("s^{}", order);
      const std::string number = fmt::format("{:.5g}", text.empty() ? of[k] : std::abs(of[k]));
      if (!text.empty()) text += of[k] < 0.0 ? " - " : " + ";
      if (variable.empty())
        text += number;
      else
        text += number == "1" ? variable : fmt::format("{} {}", number, variable);
    }
    return fmt::format("({})", text.empty() ? "0" : text);
  };
  return fmt::format("{} / {}", side(transfer.numerator), side(transfer.denominator));
}

}  // namespace torsio
