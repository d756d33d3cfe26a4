#include "fit/gaussian_process/sparse_posterior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/report_progress.hpp"
#include "model/gaussian_process/covariance.hpp"
#include "model/gaussian_process/parametric_gp.hpp"

namespace torsio {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Jitter kPosteriorJitter{.first = 1e-8};
constexpr std::size_t kChunk = 512;

/// L of K with its jitter. @returns the jitter, negative if K has none.
double lower_factor(const Kernel& kernel, const Matrix& points, MatrixXd& lower) {
  const PackedPoints packed(points);
  SquareMatrix factor(points.rows);
  const double jitter = factorise_covariance(kernel, points, packed, 0.0, kPosteriorJitter, factor);
  const auto size = static_cast<Index>(points.rows);
  lower.setZero(size, size);
  for (std::size_t i = 0; i < points.rows; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      lower(static_cast<Index>(i), static_cast<Index>(j)) = factor(i, j);
  return jitter;
}

/// Columns q_n of the samples [begin, begin + columns).
void fill_columns(const Kernel& kernel, const PackedPoints& packed, const Matrix& features,
                  std::size_t begin, Eigen::Ref<MatrixXd> columns) {
  detail::AlignedVector<double> row(packed.padded_size());
  for (Index n = 0; n < columns.cols(); ++n) {
    kernel.row(features.row(begin + static_cast<std::size_t>(n)).data(), packed, packed.size(),
               row.data());
    columns.col(n) = Eigen::Map<const VectorXd>(row.data(), columns.rows());
  }
}

MatrixXd identity(Index size) { return MatrixXd::Identity(size, size); }

}  // namespace

SparsePosterior sparse_posterior(const Kernel& kernel, const Matrix& points, double noise_variance,
                                 const Matrix& features, std::span<const double> target,
                                 SparseNoise noise, const Progress& progress) {
  MatrixXd lower;
  if (lower_factor(kernel, points, lower) < 0.0) refuse_covariance(ParametricGp::kFamily);
  const auto triangle = std::as_const(lower).triangularView<Eigen::Lower>();
  const PackedPoints packed(points);
  const auto size = static_cast<Index>(points.rows);
  // A = L B L^T
  MatrixXd b = identity(size);
  VectorXd projected = VectorXd::Zero(size);
  for (std::size_t begin = 0; begin < features.rows; begin += kChunk) {
    report_progress(progress, static_cast<double>(begin) / static_cast<double>(features.rows),
                    "taking in all samples");
    const std::size_t count = std::min(kChunk, features.rows - begin);
    MatrixXd white(size, static_cast<Index>(count));
    fill_columns(kernel, packed, features, begin, white);
    triangle.solveInPlace(white);
    for (std::size_t n = 0; n < count; ++n) {
      auto column = white.col(static_cast<Index>(n));
      double variance = noise_variance;
      if (noise == SparseNoise::fitc)
        variance +=
            std::max(0.0, kernel.self(features.row(begin + n).data()) - column.squaredNorm());
      column /= std::sqrt(variance);
      projected += column * (target[begin + n] / std::sqrt(variance));
    }
    b.selfadjointView<Eigen::Lower>().rankUpdate(white);
  }
  const Eigen::LLT<MatrixXd> factor(b);
  const VectorXd weights = triangle.transpose().solve(factor.solve(projected));
  // C = L^-T (I - B^-1) L^-1
  MatrixXd middle = identity(size) - factor.solve(identity(size));
  triangle.transpose().solveInPlace(middle);
  MatrixXd explained = triangle.transpose().solve(middle.transpose());

  SparsePosterior posterior{.weights = {weights.begin(), weights.end()},
                            .explained = Matrix(points.rows, points.rows)};
  for (std::size_t i = 0; i < points.rows; ++i)
    for (std::size_t j = 0; j < points.rows; ++j)
      posterior.explained(i, j) = 0.5 * (explained(static_cast<Index>(i), static_cast<Index>(j)) +
                                         explained(static_cast<Index>(j), static_cast<Index>(i)));
  return posterior;
}

CollapsedBound::CollapsedBound(Kernel kernel, Matrix points, const Matrix& features,
                               std::vector<double> target)
    : kernel_(std::move(kernel)),
      points_(std::move(points)),
      packed_(points_),
      features_(features),
      target_(std::move(target)) {}

double CollapsedBound::evaluate(std::span<const double> parameters, std::span<double> gradient) {
  kernel_.set_log_parameters(parameters.first(kernel_.parameter_count()));
  const double precision = std::exp(-parameters.back());
  MatrixXd lower;
  const double jitter = lower_factor(kernel_, points_, lower);
  if (jitter < 0.0) return std::numeric_limits<double>::infinity();
  const auto triangle = std::as_const(lower).triangularView<Eigen::Lower>();
  const auto size = static_cast<Index>(points_.rows);
  const auto count = static_cast<Index>(features_.rows);
  const Eigen::Map<const VectorXd> y(target_.data(), count);

  // Everything in coordinates in which K is the identity: P = L^-1 K_zx, B = I + P P^T / sigma^2.
  MatrixXd white(size, count);
  fill_columns(kernel_, packed_, features_, 0, white);
  triangle.solveInPlace(white);
  MatrixXd square(size, size);
  square.noalias() = white * white.transpose();
  const Eigen::LLT<MatrixXd> factor(identity(size) + precision * square);
  if (factor.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  const MatrixXd b_inverse = factor.solve(identity(size));
  const VectorXd c = precision * (b_inverse * (white * y));  // whitened mean of u
  const VectorXd left = y - white.transpose() * c;

  double prior = 0.0;
  for (std::size_t n = 0; n < features_.rows; ++n) prior += kernel_.self(features_.row(n).data());
  const double fit = y.dot(left);
  const double log_det = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  const double lost = prior - square.trace();
  const double value =
      0.5 * (static_cast<double>(count) * (std::log(2.0 * std::numbers::pi) + parameters.back()) +
             log_det + precision * (fit + lost));
  if (!std::isfinite(value)) return std::numeric_limits<double>::infinity();

  // By K_zx, and by K; both brought back from white coordinates.
  MatrixXd by_columns(size, count);
  by_columns.noalias() = precision * ((b_inverse - identity(size)) * white);
  by_columns.noalias() -= (precision * c) * left.transpose();
  triangle.transpose().solveInPlace(by_columns);
  MatrixXd by_k = 0.5 * (b_inverse - identity(size) + c * c.transpose() + precision * square);
  triangle.transpose().solveInPlace(by_k);
  by_k = triangle.transpose().solve(MatrixXd(by_k.transpose()));

  KernelGradient sums(kernel_.parameter_count());
  detail::AlignedVector<double> row(packed_.padded_size(), 0.0);
  for (std::size_t n = 0; n < features_.rows; ++n) {
    Eigen::Map<VectorXd>(row.data(), size) = by_columns.col(static_cast<Index>(n));
    kernel_.add_gradient(features_.row(n).data(), packed_, points_.rows, row.data(), sums);
  }
  const double of_diagonal = jitter * by_k.trace() / static_cast<double>(size);
  std::ranges::fill(row, 0.0);
  for (std::size_t i = 0; i < points_.rows; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      row[j] = by_k(static_cast<Index>(i), static_cast<Index>(j)) +
               by_k(static_cast<Index>(j), static_cast<Index>(i));
    row[i] = by_k(static_cast<Index>(i), static_cast<Index>(i)) + of_diagonal;
    kernel_.add_gradient(points_.row(i).data(), packed_, i + 1, row.data(), sums);
  }
  // k(x_n, x_n), each with weight precision / 2
  PackedPoints self(Matrix(1, features_.columns));
  detail::AlignedVector<double> weight(self.padded_size(), 0.0);
  weight[0] = 0.5 * precision;
  for (std::size_t n = 0; n < features_.rows; ++n) {
    self.set(0, features_.row(n));
    kernel_.add_gradient(features_.row(n).data(), self, 1, weight.data(), sums);
  }
  for (std::size_t p = 0; p < kernel_.parameter_count(); ++p) gradient[p] = sums[p];
  gradient.back() =
      0.5 * (static_cast<double>(count) -
             precision * (b_inverse.cwiseProduct(square).sum() + left.squaredNorm() + lost));
  return value;
}

}  // namespace torsio
