#include "fit/hammerstein_wiener/wiener_problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace torsio {
namespace {

using Eigen::Index;

/// R with R^T R = the products, row by row; of semidefinite ones, too.
Eigen::MatrixXd triangle_of(const Eigen::MatrixXd& products) {
  Eigen::VectorXd scale = products.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& s : scale)
    if (!(s > 0.0)) s = 1.0;
  const Eigen::MatrixXd scaled =
      scale.cwiseInverse().asDiagonal() * products * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose() * scale.asDiagonal();
}

}  // namespace

WienerChart natural_chart() {
  return [](std::span<const double> theta, std::span<double> packed, Matrix& slopes) {
    std::ranges::copy(theta, packed.begin());
    for (std::size_t k = 0; k < slopes.rows; ++k) slopes(k, k) = 1.0;
  };
}

WienerChart stable_chart(const WienerError& error) {
  return [&error, edge = error.slowest_pole()](std::span<const double> theta,
                                               std::span<double> packed, Matrix& slopes) {
    std::ranges::copy(theta, packed.begin());
    const auto slope = [&](std::size_t to, std::size_t by, double value) {
      if (slopes.rows > 0) slopes(to, by) = value;
    };
    for (std::size_t k = 0; k < theta.size(); ++k) slope(k, k, 1.0);
    for (std::size_t i = 0; i < error.sections(); ++i) {
      const auto [a1, a2] = error.poles_at(i);
      double two = 0.0;
      double two_slope = 0.0;
      if (a2 != WienerError::kNowhere) {
        two = std::tanh(theta[a2]);
        two_slope = 1.0 - two * two;
        packed[a2] = edge * edge * two;
        slope(a2, a2, edge * edge * two_slope);
      }
      if (a1 == WienerError::kNowhere) continue;
      const double share = std::tanh(theta[a1]);
      packed[a1] = edge * (1.0 + two) * share;
      slope(a1, a1, edge * (1.0 + two) * (1.0 - share * share));
      if (a2 != WienerError::kNowhere) slope(a1, a2, edge * share * two_slope);
    }
  };
}

std::vector<double> stable_start(const WienerError& error, std::span<const double> packed) {
  static constexpr double kMax = 1.0 - 1e-6;
  const auto inside = [](double x) { return std::clamp(x, -kMax, kMax); };
  const double edge = error.slowest_pole();
  std::vector<double> theta(packed.begin(), packed.end());
  for (std::size_t i = 0; i < error.sections(); ++i) {
    const auto [a1, a2] = error.poles_at(i);
    double two = 0.0;
    if (a2 != WienerError::kNowhere) {
      two = inside(packed[a2] / (edge * edge));
      theta[a2] = std::atanh(two);
    }
    if (a1 != WienerError::kNowhere)
      theta[a1] = std::atanh(inside(packed[a1] / (edge * (1.0 + two))));
  }
  return theta;
}

std::vector<double> stable_bound(const WienerError& error) {
  constexpr double kFarEnough = 7.0;  // tanh: 1e-6 from the edge
  std::vector<double> bound(error.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < error.sections(); ++i) {
    const auto [a1, a2] = error.poles_at(i);
    for (const std::size_t at : {a1, a2})
      if (at != WienerError::kNowhere) bound[at] = kFarEnough;
  }
  return bound;
}

ResidualProblem wiener_problem(const WienerError& error, std::size_t parameters,
                               const WienerChart& chart) {
  const auto evaluate = [&error, chart](std::span<const double> theta, std::span<double> residuals,
                                        std::span<double> jacobian) {
    std::vector<double> packed(error.size());
    Matrix slopes;
    if (!jacobian.empty()) slopes = Matrix(error.size(), theta.size());
    chart(theta, packed, slopes);
    const WienerNumbers numbers = error.unpack(packed);
    if (jacobian.empty()) {
      const double sum = error.sum_of_squares(numbers);
      std::ranges::fill(residuals, 0.0);
      residuals.front() = std::sqrt(sum);
      return std::isfinite(sum);
    }
    Matrix gram;
    if (!error.products(numbers, gram)) return false;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto rows = static_cast<Index>(gram.rows);
    const auto columns = static_cast<Index>(theta.size());
    RowMajor turn = RowMajor::Zero(rows, columns + 1);
    turn.topLeftCorner(rows - 1, columns) =
        Eigen::Map<const RowMajor>(slopes.values.data(), rows - 1, columns);
    turn(rows - 1, columns) = 1.0;
    const Eigen::MatrixXd products =
        turn.transpose() * Eigen::Map<const RowMajor>(gram.values.data(), rows, rows) * turn;
    const Eigen::MatrixXd triangle = triangle_of(products);
    for (Index i = 0; i <= columns; ++i) {
      residuals[static_cast<std::size_t>(i)] = triangle(i, columns);
      for (Index j = 0; j < columns; ++j)
        jacobian[static_cast<std::size_t>(i * columns + j)] = triangle(i, j);
    }
    return true;
  };
  return {.residuals = parameters + 1,
          .evaluate = evaluate,
          .has_jacobian = true,
          .samples = error.scored_samples()};
}

}  // namespace torsio
