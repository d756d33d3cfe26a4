#include "numerics/levenberg_marquardt.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/row_major_map.hpp"

namespace torsio {
namespace {

using Eigen::Index;

constexpr double kParameterTolerance = 1e-10;  ///< |δ| relative to |θ|
constexpr double kGradientTolerance = 1e-10;
constexpr double kLeastFall = 1e-3;  ///< real fall relative to the model's, else a step is rejected
constexpr double kLargestRadius = 1e16;
constexpr double kSmallestRadius = 1e-32;
constexpr double kNotComputed =
    std::numeric_limits<double>::max();  ///< sum of squares where r is not
constexpr int kUselessSteps = 5;         ///< in a row, after which no better point is expected

class Search {
 public:
  Search(const BoxedSquares& problem, std::vector<double> start)
      : problem_(problem),
        count_(static_cast<Index>(start.size())),
        is_bounded_(!problem.lower.empty() || !problem.upper.empty()),
        residuals_(problem.residuals),
        jacobian_(problem.residuals * start.size()),
        found_{.theta = std::move(start)} {}

  BoxedMinimum run() {
    if (!linearise()) return std::move(found_);
    double growth = 2.0;  // by which the radius shrinks next
    int useless = 0;
    const auto reject = [&] {
      radius_ /= growth;
      growth *= 2.0;
    };
    for (found_.iterations = 1;; ++found_.iterations) {
      if (problem_.report) problem_.report(found_.iterations - 1, found_.sum_of_squares);
      if (found_.iterations > problem_.max_iterations) return std::move(found_);
      if (gradient_ <= kGradientTolerance || radius_ <= kSmallestRadius) return converged();
      const Eigen::VectorXd step = boxed_step();
      const Eigen::VectorXd change = triangle_ * step;
      const double expected = -change.dot(2.0 * rotated_ + change);
      if (!(expected > 0.0)) {
        if (++useless >= kUselessSteps) return std::move(found_);
        reject();
        continue;
      }
      useless = 0;
      std::vector<double> tried = moved(step);
      double sum = sum_of_squares(tried);
      if (is_negligible(tried)) return converged();
      if (is_bounded_) shorten(step, 2.0 * rotated_.dot(change), tried, sum);
      const double fall = found_.sum_of_squares - sum;
      // Not if the fall alone is small: the step may have crossed a bent valley.
      if (std::max(std::abs(fall), expected) <= problem_.tolerance * found_.sum_of_squares)
        return converged();
      if (!(fall > kLeastFall * expected)) {
        reject();
        continue;
      }
      found_.theta = tried;
      if (!linearise()) return std::move(found_);
      const double surprise = 2.0 * fall / expected - 1.0;
      radius_ = std::min(radius_ / std::max(1.0 / 3.0, 1.0 - surprise * surprise * surprise),
                         kLargestRadius);
      growth = 2.0;
    }
  }

 private:
  BoxedMinimum converged() {
    found_.has_converged = true;
    return std::move(found_);
  }

  [[nodiscard]] double lower(Index j) const {
    return problem_.lower.empty() ? -std::numeric_limits<double>::infinity()
                                  : problem_.lower[static_cast<std::size_t>(j)];
  }
  [[nodiscard]] double upper(Index j) const {
    return problem_.upper.empty() ? std::numeric_limits<double>::infinity()
                                  : problem_.upper[static_cast<std::size_t>(j)];
  }
  [[nodiscard]] double theta(Index j) const { return found_.theta[static_cast<std::size_t>(j)]; }

  [[nodiscard]] double sum_of_squares(const std::vector<double>& theta) {
    if (!problem_.evaluate(theta, residuals_, {})) return kNotComputed;
    return Eigen::Map<const Eigen::VectorXd>(residuals_.data(), std::ssize(residuals_))
        .squaredNorm();
  }

  /// The triangle of J, its columns scaled, and what else a step is computed from.
  bool linearise() {
    if (!problem_.evaluate(found_.theta, residuals_, jacobian_)) return false;
    const auto rows = static_cast<Index>(problem_.residuals);
    const Eigen::Map<const Eigen::VectorXd> r(residuals_.data(), rows);
    Eigen::MatrixXd jacobian = Eigen::Map<const RowMajor>(jacobian_.data(), rows, count_);
    found_.sum_of_squares = r.squaredNorm();
    // The scale of the first point throughout: the radius keeps its meaning.
    if (scale_.size() == 0)
      scale_ = (1.0 + jacobian.colwise().norm().transpose().array()).inverse();
    jacobian *= scale_.asDiagonal();
    Eigen::VectorXd gradient = jacobian.transpose() * r;
    const Index kept = std::min(rows, count_);
    const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(jacobian);
    triangle_ = jacobian.topRows(kept).template triangularView<Eigen::Upper>();
    rotated_ = (qr.householderQ().adjoint() * r).head(kept);
    gradient.array() /= scale_.array();
    gradient_ = 0.0;
    held_.assign(static_cast<std::size_t>(count_), false);
    for (Index j = 0; j < count_; ++j) {
      const double to = std::clamp(theta(j) - gradient[j], lower(j), upper(j));
      gradient_ = std::max(gradient_, std::abs(to - theta(j)));
      held_[static_cast<std::size_t>(j)] = (theta(j) <= lower(j) && gradient[j] > 0.0) ||
                                           (theta(j) >= upper(j) && gradient[j] < 0.0);
    }
    return true;
  }

  /// The step, divided by the scale. Parameters that would leave their bounds go onto them, and the
  /// others are found again, until none leaves.
  [[nodiscard]] Eigen::VectorXd boxed_step() const {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(count_);
    std::vector<bool> fixed = held_;
    for (;;) {
      std::vector<Index> free;
      for (Index j = 0; j < count_; ++j)
        if (!fixed[static_cast<std::size_t>(j)]) free.push_back(j);
      if (free.empty()) return step;
      const Eigen::VectorXd found = damped_step(free, rotated_ + triangle_ * step);
      bool is_inside = true;
      for (std::size_t i = 0; i < free.size(); ++i) {
        const Index j = free[i];
        const double to = theta(j) + found[static_cast<Index>(i)] * scale_[j];
        const double bounded = std::clamp(to, lower(j), upper(j));
        if (bounded == to) continue;
        step[j] = (bounded - theta(j)) / scale_[j];
        fixed[static_cast<std::size_t>(j)] = true;
        is_inside = false;
      }
      if (!is_inside) continue;
      for (std::size_t i = 0; i < free.size(); ++i) step[free[i]] = found[static_cast<Index>(i)];
      return step;
    }
  }

  /// argmin_y |c + R y|² + |D y|² / radius over some of the columns of R.
  [[nodiscard]] Eigen::VectorXd damped_step(const std::vector<Index>& columns,
                                            const Eigen::VectorXd& c) const {
    const auto count = std::ssize(columns);
    const Index rows = triangle_.rows();
    Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(rows + count, count);
    stacked.topRows(rows) = triangle_(Eigen::all, columns);
    for (Index j = 0; j < count; ++j)
      stacked(rows + j, j) =
          std::sqrt(std::clamp(stacked.col(j).squaredNorm(), 1e-6, 1e32) / radius_);
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(rows + count);
    wanted.head(rows) = -c;
    return Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>>(stacked).solve(wanted);
  }

  /// Bounded problems are often bent: a part of the step that lowers the sum (Armijo, by parabolas)
  /// saves the Jacobians of many reductions of the radius, and passes small kinks of the sum.
  /// @param slope of the sum along the step @param tried and its `sum`, at the whole step at first
  void shorten(const Eigen::VectorXd& step, double slope, std::vector<double>& tried, double& sum) {
    constexpr double kSufficient = 1e-4;
    constexpr int kParts = 20;
    double part = 1.0;
    for (int i = 0; i < kParts && !(sum <= found_.sum_of_squares + kSufficient * part * slope);
         ++i) {
      const double bend = sum - found_.sum_of_squares - part * slope;
      const double lowest = -0.5 * slope * part * part / bend;
      part = sum < kNotComputed ? std::clamp(lowest, 0.1 * part, 0.6 * part) : 0.5 * part;
      tried = moved(part * step);
      sum = sum_of_squares(tried);
    }
  }

  [[nodiscard]] std::vector<double> moved(const Eigen::VectorXd& step) const {
    std::vector<double> to = found_.theta;
    for (Index j = 0; j < count_; ++j)
      to[static_cast<std::size_t>(j)] =
          std::clamp(theta(j) + step[j] * scale_[j], lower(j), upper(j));
    return to;
  }

  [[nodiscard]] bool is_negligible(const std::vector<double>& tried) const {
    const Eigen::Map<const Eigen::VectorXd> from(found_.theta.data(), count_);
    const Eigen::Map<const Eigen::VectorXd> to(tried.data(), count_);
    return (to - from).norm() <= kParameterTolerance * (from.norm() + kParameterTolerance);
  }

  const BoxedSquares& problem_;
  Index count_;
  bool is_bounded_;
  std::vector<double> residuals_;
  std::vector<double> jacobian_;
  Eigen::VectorXd scale_;
  Eigen::MatrixXd triangle_;  ///< R of J times the scale = Q R
  Eigen::VectorXd rotated_;   ///< the first rows of Qᵀ r
  double gradient_ = 0.0;  ///< largest change of a parameter along the gradient, within the bounds
  std::vector<bool> held_;
  double radius_ = 1e4;
  BoxedMinimum found_;
};

}  // namespace

BoxedMinimum levenberg_marquardt(const BoxedSquares& problem, std::vector<double> start) {
  return Search(problem, std::move(start)).run();
}

}  // namespace torsio
