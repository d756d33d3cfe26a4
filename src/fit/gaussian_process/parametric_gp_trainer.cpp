#include "fit/gaussian_process/parametric_gp_trainer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/gaussian_process/covariance.hpp"
#include "model/gaussian_process/parametric_gp.hpp"

namespace torsio {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Jitter kJitter{.first = 1e-8};

Matrix with_one_more(const Matrix& points) {
  Matrix more(points.rows + 1, points.columns);
  std::ranges::copy(points.values, more.values.begin());
  if (points.rows > 0) std::ranges::copy(points.row(0), more.row(points.rows).begin());
  return more;
}

}  // namespace

ParametricGpTrainer::ParametricGpTrainer(Kernel kernel, Matrix points, double noise_variance)
    : kernel_(std::move(kernel)),
      points_(std::move(points)),
      noise_variance_(noise_variance),
      packed_(with_one_more(points_)),
      x_(points_.columns, 0.0),
      sums_(kernel_.parameter_count()),
      factor_(points_.rows),
      row_(packed_.padded_size(), 0.0) {
  const auto size = static_cast<Index>(points_.rows);
  for (MatrixXd* matrix : {&k_, &inverse_, &s_, &weights_, &product_}) matrix->setZero(size, size);
  for (VectorXd* vector : {&m_, &q_, &a_, &g_, &b_, &alpha_}) vector->setZero(size);
  if (!factorise()) refuse_covariance(ParametricGp::kFamily);
  s_ = k_;
}

bool ParametricGpTrainer::factorise() {
  const double jitter = factorise_covariance(kernel_, points_, packed_, 0.0, kJitter, factor_);
  if (jitter < 0.0) return false;
  jitter_ = jitter;
  const auto size = static_cast<Index>(points_.rows);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor, Eigen::Unaligned, Eigen::OuterStride<>> lower(
      factor_.row(0), size, size, Eigen::OuterStride<>(static_cast<Index>(factor_.stride())));
  product_ = lower.triangularView<Eigen::Lower>();
  k_.noalias() = product_ * product_.transpose();
  invert(factor_);
  inverse_ = lower.selfadjointView<Eigen::Lower>();
  alpha_.noalias() = inverse_ * m_;
  return true;
}

bool ParametricGpTrainer::set_parameters(std::span<const double> parameters) {
  const std::vector<double> before = kernel_.log_parameters();
  const auto numbers = parameters.first(kernel_.parameter_count());
  // Beyond, products of several variances leave the range of a double.
  constexpr double kLargest = 60.0;
  const bool is_in_range =
      std::ranges::all_of(parameters, [](double number) { return std::abs(number) <= kLargest; });
  if (!is_in_range) return false;
  kernel_.set_log_parameters(numbers);
  if (!factorise()) {
    kernel_.set_log_parameters(before);
    (void)factorise();
    return false;
  }
  noise_variance_ = std::exp(parameters.back());
  return true;
}

std::vector<double> ParametricGpTrainer::parameters() const {
  std::vector<double> numbers = kernel_.log_parameters();
  numbers.push_back(std::log(noise_variance_));
  return numbers;
}

ParametricGpTrainer::Prediction ParametricGpTrainer::predict(std::span<const double> x) {
  std::ranges::copy(x, x_.begin());
  packed_.set(points_.rows, x_);
  kernel_.row(x_.data(), packed_, packed_.size(), row_.data());
  q_ = Eigen::Map<const VectorXd>(row_.data(), q_.size());
  a_.noalias() = inverse_ * q_;
  g_.noalias() = s_ * a_;
  b_.noalias() = inverse_ * g_;
  prediction_ = {.mean = q_.dot(alpha_), .variance = row_[points_.rows] - q_.dot(a_) + a_.dot(g_)};
  return prediction_;
}

void ParametricGpTrainer::add_data_gradient(double target, double share) {
  const double by_variance = share / (2.0 * noise_variance_);
  const double by_mean = -2.0 * by_variance * (target - prediction_.mean);
  Eigen::Map<VectorXd> of_q(row_.data(), q_.size());
  of_q = by_mean * alpha_ + 2.0 * by_variance * (b_ - a_);
  row_[points_.rows] = by_variance;
  std::fill(row_.begin() + static_cast<std::ptrdiff_t>(points_.rows) + 1, row_.end(), 0.0);
  kernel_.add_gradient(x_.data(), packed_, packed_.size(), row_.data(), sums_);
  // -by_mean (a alpha^T + alpha a^T) / 2 + by_variance (a a^T - a b^T - b a^T)
  of_q = by_variance * (0.5 * a_ - b_) - 0.5 * by_mean * alpha_;
  weights_.noalias() += a_ * of_q.transpose();
  weights_.noalias() += of_q * a_.transpose();
}

void ParametricGpTrainer::add_noise_gradient(double target, double share) {
  const double error = target - prediction_.mean;
  noise_gradient_ +=
      share * (0.5 - (error * error + prediction_.variance) / (2.0 * noise_variance_));
}

void ParametricGpTrainer::add_divergence_gradient(double share) {
  product_.noalias() = inverse_ * s_;
  weights_ -= (0.5 * share) * product_.lazyProduct(inverse_);
  weights_.noalias() -= (0.5 * share * alpha_) * alpha_.transpose();
  weights_ += (0.5 * share) * inverse_;
}

void ParametricGpTrainer::add_nlml_gradient() {
  weights_.noalias() -= (0.5 * alpha_) * alpha_.transpose();
  weights_ += 0.5 * inverse_;
}

void ParametricGpTrainer::take_gradient(std::span<double> gradient) {
  // The jitter is a share of the mean diagonal.
  const double of_diagonal = jitter_ * weights_.trace() / static_cast<double>(points_.rows);
  std::ranges::fill(row_, 0.0);
  for (std::size_t i = 0; i < points_.rows; ++i) {
    const auto column = weights_.col(static_cast<Index>(i));
    for (std::size_t j = 0; j < i; ++j) row_[j] = 2.0 * column(static_cast<Index>(j));
    row_[i] = column(static_cast<Index>(i)) + of_diagonal;
    kernel_.add_gradient(points_.row(i).data(), packed_, i + 1, row_.data(), sums_);
  }
  for (std::size_t p = 0; p < kernel_.parameter_count(); ++p) gradient[p] = sums_[p];
  gradient.back() = noise_gradient_;
  weights_.setZero();
  sums_.clear();
  noise_gradient_ = 0.0;
}

void ParametricGpTrainer::take_in(double target) {
  const double total = prediction_.variance + noise_variance_;
  const double share = (target - prediction_.mean) / total;
  m_ += share * g_;
  alpha_ += share * b_;
  s_.noalias() -= (g_ / total) * g_.transpose();
}

void ParametricGpTrainer::take_in_as_printed(double target) {
  const double share = (target - prediction_.mean) / prediction_.variance;
  m_ += share * q_;
  alpha_ += share * a_;
  s_.noalias() -= (q_ / prediction_.variance) * q_.transpose();
}

void ParametricGpTrainer::widen() { s_ = 0.5 * (s_ + k_); }

}  // namespace torsio
