#include "fit/gaussian_process/marginal_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "model/gaussian_process/covariance.hpp"

namespace torsio {

MarginalLikelihood::MarginalLikelihood(Kernel kernel, Matrix points, std::vector<double> target)
    : kernel_(std::move(kernel)),
      points_(std::move(points)),
      packed_(points_),
      target_(std::move(target)),
      matrix_(points_.rows),
      gradient_(kernel_.parameter_count()),
      row_(packed_.padded_size()) {}

double MarginalLikelihood::bytes(std::size_t points) noexcept {
  // The matrix, and as much again while it is inverted.
  return 2.0 * 8.0 * static_cast<double>(points) * static_cast<double>(points);
}

double MarginalLikelihood::fix(std::span<const double> parameters) {
  kernel_.set_log_parameters(parameters.first(kernel_.parameter_count()));
  noise_variance_ = std::exp(parameters.back());
  jitter_ = factorise_covariance(kernel_, points_, packed_, noise_variance_, {}, matrix_);
  if (jitter_ < 0.0) return std::numeric_limits<double>::infinity();
  weights_ = target_;
  solve(matrix_, weights_);
  const double fit = std::inner_product(target_.begin(), target_.end(), weights_.begin(), 0.0);
  return 0.5 * (fit + log_determinant(matrix_) +
                static_cast<double>(target_.size()) * std::log(2.0 * std::numbers::pi));
}

double MarginalLikelihood::evaluate(std::span<const double> parameters,
                                    std::span<double> gradient) {
  const double value = fix(parameters);
  if (!std::isfinite(value)) return value;
  invert(matrix_);
  gradient_.clear();
  double trace = 0.0;
  for (std::size_t i = 0; i < target_.size(); ++i) {
    const double* inverse = matrix_.row(i);
    // Both triangles at once: off the diagonal every element counts twice.
    for (std::size_t j = 0; j < i; ++j) row_[j] = inverse[j] - weights_[i] * weights_[j];
    row_[i] = 0.5 * (inverse[i] - weights_[i] * weights_[i]);
    trace += row_[i];
    std::fill(row_.begin() + static_cast<std::ptrdiff_t>(i) + 1,
              row_.begin() + static_cast<std::ptrdiff_t>(std::min(row_.size(), i + 8)), 0.0);
    kernel_.add_gradient(points_.row(i).data(), packed_, i + 1, row_.data(), gradient_);
  }
  for (std::size_t p = 0; p < kernel_.parameter_count(); ++p) gradient[p] = gradient_[p];
  gradient.back() = trace * noise_variance_;
  return value;
}

LeaveOneOut MarginalLikelihood::leave_one_out() {
  invert(matrix_);
  LeaveOneOut scores;
  for (std::size_t i = 0; i < target_.size(); ++i) {
    const double variance = 1.0 / matrix_(i, i);
    const double error = weights_[i] * variance;
    scores.rmse += error * error;
    scores.log_density -=
        0.5 * (std::log(2.0 * std::numbers::pi * variance) + error * error / variance);
    if (std::abs(error) <= 1.96 * std::sqrt(variance)) scores.covered_95 += 1.0;
  }
  const auto count = static_cast<double>(target_.size());
  scores.rmse = std::sqrt(scores.rmse / count);
  scores.log_density /= count;
  scores.covered_95 /= count;
  return scores;
}

}  // namespace torsio
