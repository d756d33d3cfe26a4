#include "numerics/nnls.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/row_major_map.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

using Index = Eigen::Index;

constexpr double kDependentColumn = 1e-10;

/// The problem with columns of length 1, and what the method keeps about it.
class ActiveSet {
 public:
  ActiveSet(const NormalEquations& equations, std::span<const std::uint8_t> is_free)
      : is_free_(is_free),
        lengths_(equations.columns()),
        solution_(Eigen::VectorXd::Zero(static_cast<Index>(equations.columns()))),
        factor_(static_cast<Index>(equations.columns()), static_cast<Index>(equations.columns())) {
    const auto count = static_cast<Index>(equations.columns());
    product_ = Eigen::Map<const RowMajor>(equations.product.values.data(), count, count);
    projection_ = Eigen::Map<const Eigen::VectorXd>(equations.projection.data(), count);
    for (Index j = 0; j < count; ++j)
      lengths_[static_cast<std::size_t>(j)] = std::sqrt(product_(j, j));
    for (Index j = 0; j < count; ++j) {
      const double length = lengths_[static_cast<std::size_t>(j)];
      const double scale = length > 0.0 ? 1.0 / length : 0.0;
      product_.row(j) *= scale;
      product_.col(j) *= scale;
      projection_[j] *= scale;
    }
    // Rounding of a gradient whose parts are as large as the projection.
    constexpr double kRounding = 1e-13;
    tolerance_ = kRounding * std::sqrt(equations.square);
  }

  NonNegativeFit solve() {
    NonNegativeFit fit;
    for (Index j = 0; j < solution_.size(); ++j) {
      if (is_free_[static_cast<std::size_t>(j)] == 0) continue;
      if (is_independent(j))
        passive_.push_back(j);
      else
        fit.dropped.push_back(static_cast<std::size_t>(j));
    }
    move_to(passive_solution());
    // In exact arithmetic the error falls with each turn, so that no set is met twice.
    const std::size_t most = 10 * lengths_.size() + 10;
    std::vector<Index> refused;
    for (std::size_t turn = 0; turn < most; ++turn) {
      const Index entering = steepest(refused);
      if (entering < 0) {
        fit.has_converged = true;
        break;
      }
      passive_.push_back(entering);
      descend();
      // A column may point downhill by rounding only and leave at once: not again from here.
      if (solution_[entering] > 0.0)
        refused.clear();
      else
        refused.push_back(entering);
    }
    for (std::size_t j = 0; j < lengths_.size(); ++j) {
      const double scaled = solution_[static_cast<Index>(j)];
      fit.coefficients.push_back(scaled == 0.0 ? 0.0 : scaled / lengths_[j]);
    }
    return fit;
  }

 private:
  [[nodiscard]] bool is_free(Index j) const { return is_free_[static_cast<std::size_t>(j)] != 0; }

  /// Computes the rows of the lower Cholesky factor L of the passive columns' product: only those of columns that
  /// have entered since the last call.
  void factor() {
    for (const auto count = static_cast<Index>(passive_.size()); factored_ < count; ++factored_) {
      const Index j = passive_[static_cast<std::size_t>(factored_)];
      const Eigen::VectorXd row = solved(product_.col(j));
      factor_.row(factored_).head(factored_) = row;
      factor_(factored_, factored_) = std::sqrt(product_(j, j) - row.squaredNorm());
    }
  }

  /// x of L x = the passive elements of `right`, for the columns that are factored.
  [[nodiscard]] Eigen::VectorXd solved(const Eigen::VectorXd& right) const {
    Eigen::VectorXd x(factored_);
    for (Index i = 0; i < factored_; ++i) {
      const double known = factor_.row(i).head(i).dot(x.head(i));
      x[i] = (right[passive_[static_cast<std::size_t>(i)]] - known) / factor_(i, i);
    }
    return x;
  }

  /// What of column j the passive ones leave unexplained, squared, above the limit?
  [[nodiscard]] bool is_independent(Index j) {
    if (!(product_(j, j) > 0.0)) return false;
    factor();
    return product_(j, j) - solved(product_.col(j)).squaredNorm() > kDependentColumn;
  }

  [[nodiscard]] Eigen::VectorXd passive_solution() {
    factor();
    Eigen::VectorXd x = solved(projection_);
    for (Index i = factored_; i-- > 0;) {
      x[i] /= factor_(i, i);
      x.head(i) -= x[i] * factor_.row(i).head(i).transpose();
    }
    return x;
  }

  void move_to(const Eigen::VectorXd& values) {
    solution_.setZero();
    for (std::size_t i = 0; i < passive_.size(); ++i)
      solution_[passive_[i]] = values[static_cast<Index>(i)];
  }

  /// The column outside along which the error falls most, or -1. What the passive columns explain
  /// cannot enter.
  [[nodiscard]] Index steepest(const std::vector<Index>& refused) {
    Eigen::VectorXd fall = projection_ - product_ * solution_;
    const auto leave_out = [&](Index j) { fall[j] = 0.0; };
    for (Index j = 0; j < fall.size(); ++j)
      if (is_free(j)) leave_out(j);
    std::ranges::for_each(passive_, leave_out);
    std::ranges::for_each(refused, leave_out);
    while (fall.size() > 0) {
      Index best = 0;
      if (!(fall.maxCoeff(&best) > tolerance_)) return -1;
      if (is_independent(best)) return best;
      leave_out(best);
    }
    return -1;
  }

  /// Towards the passive columns' own solution, columns that meet 0 on the way leaving.
  void descend() {
    while (!passive_.empty()) {
      const Eigen::VectorXd wanted = passive_solution();
      double share = 1.0;
      Index leaving = -1;
      for (std::size_t i = 0; i < passive_.size(); ++i) {
        const Index j = passive_[i];
        const double there = wanted[static_cast<Index>(i)];
        if (is_free(j) || there > 0.0) continue;
        const double here = solution_[j];
        const double reach = here / (here - there);
        if (leaving < 0 || reach < share) {
          share = here > 0.0 ? reach : 0.0;
          leaving = j;
        }
      }
      if (leaving < 0) {
        move_to(wanted);
        return;
      }
      for (std::size_t i = 0; i < passive_.size(); ++i) {
        double& value = solution_[passive_[i]];
        value += share * (wanted[static_cast<Index>(i)] - value);
      }
      solution_[leaving] = 0.0;
      const auto leaves = [&](Index j) { return !is_free(j) && solution_[j] <= 0.0; };
      const auto first = std::ranges::find_if(passive_, leaves) - passive_.begin();
      factored_ = std::min(factored_, static_cast<Index>(first));
      std::erase_if(passive_, leaves);
    }
  }

  std::span<const std::uint8_t> is_free_;
  std::vector<double> lengths_;
  Eigen::MatrixXd product_;
  Eigen::VectorXd projection_;
  Eigen::VectorXd solution_;
  std::vector<Index> passive_;
  RowMajor factor_;     ///< L
  Index factored_ = 0;  ///< its rows that hold for `passive_`
  double tolerance_ = 0.0;
};

}  // namespace

void NormalEquations::add(std::span<const double> row, double target) noexcept {
  const std::size_t count = columns();
  for (std::size_t i = 0; i < count; ++i) {
    const auto line = product.row(i);
    for (std::size_t j = 0; j < count; ++j) line[j] += row[i] * row[j];
    projection[i] += row[i] * target;
  }
  square += target * target;
  ++rows;
}

double NormalEquations::error(std::span<const double> coefficients) const {
  double sum = square;
  for (std::size_t i = 0; i < columns(); ++i) {
    double along = -2.0 * projection[i];
    for (std::size_t j = 0; j < columns(); ++j) along += product(i, j) * coefficients[j];
    sum += coefficients[i] * along;
  }
  return std::max(sum, 0.0);
}

NormalEquations normal_equations(const Matrix& design, std::span<const double> target) {
  NormalEquations equations(design.columns);
  for (std::size_t n = 0; n < design.rows; ++n) equations.add(design.row(n), target[n]);
  return equations;
}

NonNegativeFit non_negative_least_squares(const NormalEquations& equations,
                                          std::span<const std::uint8_t> is_free) {
  return ActiveSet(equations, is_free).solve();
}

std::vector<double> standard_errors(const NormalEquations& equations,
                                    std::span<const double> coefficients) {
  std::vector<double> errors(coefficients.size(), kNotMeasured);
  std::vector<Index> used;
  for (std::size_t j = 0; j < coefficients.size(); ++j)
    if (coefficients[j] != 0.0) used.push_back(static_cast<Index>(j));
  if (used.empty() || equations.rows <= used.size()) return errors;
  const auto count = static_cast<Index>(equations.columns());
  const Eigen::MatrixXd product =
      Eigen::Map<const RowMajor>(equations.product.values.data(), count, count)(used, used);
  const Eigen::VectorXd scale = product.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * product * scale.asDiagonal();
  const Eigen::FullPivLU<Eigen::MatrixXd> factors(scaled);
  if (!factors.isInvertible()) return errors;
  const Eigen::VectorXd spread = factors.inverse().diagonal();
  const double variance =
      equations.error(coefficients) / static_cast<double>(equations.rows - used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto at = static_cast<Index>(i);
    errors[static_cast<std::size_t>(used[i])] =
        scale[at] * std::sqrt(variance * std::max(spread[at], 0.0));
  }
  return errors;
}

}  // namespace torsio
