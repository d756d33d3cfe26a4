#include "fit/narx/frols.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/aligned_vector.hpp"
#include "core/report_progress.hpp"
#include "fit/narx/frols_kernel.hpp"
#include "model/gaussian_process/kernel_kernels.hpp"
#include "model/narx/multivariate_polynomial.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using frols_kernel::Candidate;
using frols_kernel::kBlock;

// Share of a candidate's square that must be new. Squares are computed as differences, accurate to
// about 1e-15.
constexpr double kDependent = 1e-12;
constexpr double kNothing = 1e-15;  // share of y.y
constexpr double kBetter = 1e-9;    // relative gain of an exchange

/// Every monomial up to a degree, each after its parent.
struct CandidateList {
  std::vector<Candidate> list;
  std::size_t parents = 0;

  [[nodiscard]] Monomial monomial(std::size_t j) const {
    Monomial factors;
    for (; j != 0; j = list[j].parent) factors.push_back(list[j].column - 1);
    std::ranges::reverse(factors);
    return factors;
  }
};

CandidateList candidates_of(std::size_t inputs, std::size_t degree) {
  CandidateList candidates{.list = {{.parent = 0, .column = 0}}, .parents = 0};
  for (std::size_t of_degree = 1; of_degree <= degree; ++of_degree) {
    const std::size_t first = candidates.parents;
    candidates.parents = candidates.list.size();
    for (std::size_t parent = first; parent < candidates.parents; ++parent)
      for (std::size_t column = std::max<std::size_t>(1, candidates.list[parent].column);
           column <= inputs; ++column)
        candidates.list.push_back({.parent = static_cast<std::uint32_t>(parent),
                                   .column = static_cast<std::uint32_t>(column)});
  }
  return candidates;
}

int exponent_of_largest(std::span<const double> values) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
}

double dot(const detail::AlignedVector<double>& a, const detail::AlignedVector<double>& b) {
  return kernel_kernels::dot(a.data(), b.data(), a.size());
}

/// The samples, column by column, filled up with zeros to whole blocks.
class Columns {
 public:
  explicit Columns(const Matrix& regressors)
      : size_((regressors.rows + kBlock - 1) / kBlock * kBlock),
        values_((regressors.columns + 1) * size_, 0.0),
        scales_(regressors.columns, 0.0) {
    std::fill_n(values_.begin(), regressors.rows, 1.0);
    for (std::size_t n = 0; n < regressors.rows; ++n)
      for (std::size_t i = 0; i < regressors.columns; ++i)
        scales_[i] = std::max(scales_[i], std::abs(regressors(n, i)));
    std::ranges::replace(scales_, 0.0, 1.0);
    // By blocks, so that the rows of one stay in the cache while its columns are written.
    for (std::size_t first = 0; first < regressors.rows; first += kBlock)
      for (std::size_t i = 0; i < regressors.columns; ++i)
        for (std::size_t n = first; n < std::min(first + kBlock, regressors.rows); ++n)
          values_[(i + 1) * size_ + n] = regressors(n, i) / scales_[i];
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] const double* values() const noexcept { return values_.data(); }
  [[nodiscard]] const std::vector<double>& scales() const noexcept { return scales_; }

  [[nodiscard]] detail::AlignedVector<double> product(const Monomial& monomial) const {
    detail::AlignedVector<double> result(values_.begin(), values_.begin() + ending());
    for (const std::size_t i : monomial) {
      const double* factor = values_.data() + (i + 1) * size_;
      for (std::size_t n = 0; n < size_; ++n) result[n] *= factor[n];
    }
    return result;
  }

 private:
  [[nodiscard]] std::ptrdiff_t ending() const { return static_cast<std::ptrdiff_t>(size_); }

  std::size_t size_;
  detail::AlignedVector<double> values_;  ///< ones first
  std::vector<double> scales_;
};

/// Inner products of an orthonormal basis with all candidates and with y: sufficient for a choice.
struct Products {
  std::vector<std::vector<double>> with_candidates;  ///< one list per direction
  std::vector<double> with_target;
  std::vector<std::size_t> chosen;  ///< terms from which the directions were made
};

/// A rotation in the plane of a direction and the next one.
struct Rotation {
  std::size_t direction;
  double cosine;
  double sine;

  [[nodiscard]] Rotation back() const { return {direction, cosine, -sine}; }
  template <class Values>
  void apply(Values& a, Values& b) const {
    for (std::size_t n = 0; n < a.size(); ++n) {
      const double turned = cosine * a[n] + sine * b[n];
      b[n] = cosine * b[n] - sine * a[n];
      a[n] = turned;
    }
  }
};

/// Rotates the basis so that only the last direction needs the term at `place`, which is removed.
/// @returns the part of y that the last direction explained.
double take_out(Products& products, std::size_t place, std::vector<Rotation>& rotations) {
  auto& rows = products.with_candidates;
  auto& z = products.with_target;
  for (std::size_t t = place + 1; t < rows.size(); ++t) {
    const double a = rows[t - 1][products.chosen[t]];
    const double b = rows[t][products.chosen[t]];
    const double length = std::hypot(a, b);
    const Rotation rotation{.direction = t - 1, .cosine = a / length, .sine = b / length};
    rotation.apply(rows[t - 1], rows[t]);
    const double turned = rotation.cosine * z[t - 1] + rotation.sine * z[t];
    z[t] = rotation.cosine * z[t] - rotation.sine * z[t - 1];
    z[t - 1] = turned;
    rotations.push_back(rotation);
  }
  const double given = z.back();
  rows.pop_back();
  z.pop_back();
  products.chosen.erase(products.chosen.begin() + static_cast<std::ptrdiff_t>(place));
  return given;
}

struct Placed {
  std::size_t place;  ///< in the basis
  double reduction;   ///< reduction of y.y
};

/// The chosen terms, sorted by the share of the remaining variance that they explain.
std::vector<Placed> in_order(const Products& products) {
  const std::size_t count = products.chosen.size();
  std::vector<std::vector<double>> left(count, std::vector<double>(count));  // in the basis
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t s = 0; s < count; ++s)
      left[t][s] = products.with_candidates[s][products.chosen[t]];
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  std::vector<Placed> order;
  std::vector<std::uint8_t> is_placed(count, 0);
  while (order.size() < count) {
    Placed best{.place = count, .reduction = -1.0};
    for (std::size_t t = 0; t < count; ++t) {
      if (is_placed[t] != 0) continue;
      const double along = product(left[t], products.with_target);
      const double reduction = along * along / product(left[t], left[t]);
      if (reduction > (1.0 + kBetter) * best.reduction) best = {t, reduction};
    }
    is_placed[best.place] = 1;
    order.push_back(best);
    const std::vector<double>& axis = left[best.place];
    for (std::size_t t = 0; t < count; ++t) {
      if (is_placed[t] != 0) continue;
      const double share = product(axis, left[t]) / product(axis, axis);
      for (std::size_t s = 0; s < count; ++s) left[t][s] -= share * axis[s];
    }
  }
  return order;
}

class Search {
 public:
  Search(const Matrix& regressors, std::span<const double> target, std::size_t degree)
      : columns_(regressors),
        candidates_(candidates_of(regressors.columns, degree)),
        target_(columns_.size(), 0.0),
        scratch_(candidates_.parents * kBlock),
        squares_(candidates_.list.size(), 0.0),
        is_useless_(candidates_.list.size(), 0),
        target_exponent_(exponent_of_largest(target)) {
    std::ranges::copy(target, target_.begin());
    for (double& value : target_) value = std::ldexp(value, -target_exponent_);
    target_square_ = dot(target_, target_);
    target_products_ = products_with(target_, &squares_);
  }

  [[nodiscard]] double target_square() const noexcept { return target_square_; }
  [[nodiscard]] const std::vector<double>& scales() const noexcept { return columns_.scales(); }
  [[nodiscard]] std::size_t candidate_count() const noexcept { return candidates_.list.size(); }

  /// Adds the best candidate. @returns false if no candidate is useful.
  bool extend() {
    while (true) {
      const Choice best = best_candidate(products_);
      if (!(best.reduction > kNothing * target_square_)) return false;
      if (add(best.candidate)) return true;
    }
  }

  /// Exchanges terms until no exchange is useful.
  void exchange() {
    // Every exchange explains more, so this ends without a limit; the limit is for effects of
    // rounding.
    const std::size_t count = products_.chosen.size();
    std::size_t left = 10 * count;
    std::size_t place = 0;
    for (std::size_t kept = 0; kept < count && left > 0;) {
      Products without = products_;
      std::vector<Rotation> rotations;
      const double given = take_out(without, place, rotations);
      const Choice best = best_candidate(without);
      const bool is_better =
          best.reduction > (1.0 + kBetter) * given * given + kNothing * target_square_;
      if (is_better && replace(std::move(without), rotations, best.candidate)) {
        kept = 0;  // the next has moved to this place, the new one is last
        --left;
      } else {
        ++kept;
        place = (place + 1) % count;
      }
    }
  }

  [[nodiscard]] ChosenTerms chosen() const {
    const std::vector<double> theta = coefficients();
    ChosenTerms result;
    for (const auto& [place, reduction] : in_order(products_)) {
      result.terms.push_back(candidates_.monomial(products_.chosen[place]));
      result.coefficients.push_back(theta[place]);
      result.error_reductions.push_back(reduction / target_square_);
    }
    return result;
  }

 private:
  struct Choice {
    std::size_t candidate = 0;
    double reduction = 0.0;  ///< reduction of y.y
  };

  std::vector<double> products_with(const detail::AlignedVector<double>& v,
                                    std::vector<double>* squares = nullptr) {
    std::vector<double> result(candidate_count(), 0.0);
    for (std::size_t first = 0; first < columns_.size(); first += kBlock)
      frols_kernel::add_products({.list = candidates_.list.data(),
                                  .count = candidate_count(),
                                  .parents = candidates_.parents},
                                 columns_.values() + first, columns_.size(), v.data() + first,
                                 scratch_.data(), result.data(),
                                 squares == nullptr ? nullptr : squares->data());
    return result;
  }

  [[nodiscard]] Choice best_candidate(const Products& products) const {
    std::vector<double> square = squares_;
    std::vector<double> with_target = target_products_;
    for (std::size_t s = 0; s < products.chosen.size(); ++s) {
      const std::vector<double>& row = products.with_candidates[s];
      for (std::size_t j = 0; j < row.size(); ++j) {
        square[j] -= row[j] * row[j];
        with_target[j] -= row[j] * products.with_target[s];
      }
    }
    Choice best;
    for (std::size_t j = 0; j < square.size(); ++j) {
      if (is_useless_[j] != 0 || !(square[j] > kDependent * squares_[j])) continue;
      const double reduction = with_target[j] * with_target[j] / square[j];
      // Among candidates that differ only by rounding the first is taken, whatever the processor.
      if (reduction > (1.0 + kBetter) * best.reduction) best = {j, reduction};
    }
    return best;
  }

  /// The directions' products with the chosen terms are a triangle.
  [[nodiscard]] std::vector<double> coefficients() const {
    std::vector<double> theta = products_.with_target;
    for (std::size_t s = theta.size(); s-- > 0;) {
      const std::vector<double>& row = products_.with_candidates[s];
      for (std::size_t t = s + 1; t < theta.size(); ++t)
        theta[s] -= row[products_.chosen[t]] * theta[t];
      theta[s] /= row[products_.chosen[s]];
    }
    for (double& coefficient : theta) coefficient = std::ldexp(coefficient, target_exponent_);
    return theta;
  }

  /// @returns false, and never proposes it again, if it is not as new as its products indicated.
  bool add(std::size_t candidate) {
    detail::AlignedVector<double> q = columns_.product(candidates_.monomial(candidate));
    for (int twice = 0; twice < 2; ++twice) {  // once is not exact for near-dependent ones
      for (const detail::AlignedVector<double>& direction : directions_) {
        const double along = dot(direction, q);
        for (std::size_t n = 0; n < q.size(); ++n) q[n] -= along * direction[n];
      }
    }
    const double square = dot(q, q);
    if (!(square > kDependent * squares_[candidate])) {
      is_useless_[candidate] = 1;
      return false;
    }
    for (double& value : q) value /= std::sqrt(square);
    products_.with_candidates.push_back(products_with(q));
    products_.with_target.push_back(dot(q, target_));
    products_.chosen.push_back(candidate);
    directions_.push_back(std::move(q));
    return true;
  }

  /// @returns false, with nothing changed, if the new one cannot be added.
  bool replace(Products without, const std::vector<Rotation>& rotations, std::size_t candidate) {
    Products before = std::exchange(products_, std::move(without));
    for (const Rotation& rotation : rotations)
      rotation.apply(directions_[rotation.direction], directions_[rotation.direction + 1]);
    detail::AlignedVector<double> last = std::move(directions_.back());
    directions_.pop_back();
    if (add(candidate)) return true;
    products_ = std::move(before);
    directions_.push_back(std::move(last));
    for (std::size_t r = rotations.size(); r-- > 0;)
      rotations[r].back().apply(directions_[rotations[r].direction],
                                directions_[rotations[r].direction + 1]);
    return false;
  }

  Columns columns_;
  CandidateList candidates_;
  detail::AlignedVector<double> target_;
  double target_square_ = 0.0;
  detail::AlignedVector<double> scratch_;
  std::vector<double> squares_;          ///< phi . phi
  std::vector<double> target_products_;  ///< phi . y
  std::vector<std::uint8_t> is_useless_;
  int target_exponent_ = 0;  ///< y is divided by two to this power: squares of 1e-160 would be 0
  std::vector<detail::AlignedVector<double>> directions_;  ///< q
  Products products_;
};

void check(const Matrix& regressors, const FrolsOptions& options) {
  constexpr std::size_t kHighest = MultivariatePolynomial::kHighestDegree;
  if (options.degree < 1 || options.degree > kHighest)
    throw UsageError({.place = "degree",
                      .expected = fmt::format("1 to {}", kHighest),
                      .found = std::to_string(options.degree)});
  if (options.terms < 1 || options.terms > kMaxTerms)
    throw UsageError({.place = "terms",
                      .expected = fmt::format("1 to {}", kMaxTerms),
                      .found = std::to_string(options.terms)});
  check_candidates(regressors.columns, options.degree);
  if (regressors.rows < options.terms)
    throw Error({.problem = "too few training samples",
                 .expected = fmt::format("at least {}, one for each term", options.terms),
                 .found = std::to_string(regressors.rows)});
}

}  // namespace

std::size_t monomial_count(std::size_t inputs, std::size_t degree) noexcept {
  constexpr std::size_t kMax = std::numeric_limits<std::size_t>::max();
  std::size_t count = 1;  // (inputs + d over d), exact for each d
  for (std::size_t d = 1; d <= degree; ++d) {
    if (count > kMax / (inputs + d)) return kMax;
    count = count * (inputs + d) / d;
  }
  return count;
}

void check_candidates(std::size_t inputs, std::size_t degree) {
  const std::size_t count = monomial_count(inputs, degree);
  if (count <= kMaxCandidates) return;
  std::size_t fits = degree;
  while (fits > 0 && monomial_count(inputs, fits) > kMaxCandidates) --fits;
  const std::string found = count == std::numeric_limits<std::size_t>::max()
                                ? "more than can be counted"
                                : std::to_string(count);
  throw UsageError(
      {.place = "option degree",
       .problem =
           fmt::format("{} regressors (inputs, their lags, past outputs) make too many terms "
                       "of degree {} and less",
                       inputs, degree),
       .expected = fmt::format("at most {} to choose from", kMaxCandidates),
       .found = found,
       .advice = fits > 0 ? fmt::format("Set degree={} ({} terms), or take fewer lags.", fits,
                                        monomial_count(inputs, fits))
                          : "Take fewer lags."});
}

Frols frols(const Matrix& regressors, std::span<const double> target, const FrolsOptions& options,
            const Progress& progress) {
  check(regressors, options);
  Search search(regressors, target, options.degree);
  if (!(search.target_square() > 0.0))
    throw Error({.place = "target", .expected = "one that is not 0 throughout", .found = "zeros"});
  Frols result{.scales = search.scales(), .candidates = search.candidate_count(), .sizes = {}};
  for (std::size_t size = 1; size <= options.terms; ++size) {
    report_progress(progress, static_cast<double>(size - 1) / static_cast<double>(options.terms),
                    "choosing terms");
    if (!search.extend()) break;
    if (options.exchange) search.exchange();
    result.sizes.push_back(search.chosen());
  }
  return result;
}

}  // namespace torsio
