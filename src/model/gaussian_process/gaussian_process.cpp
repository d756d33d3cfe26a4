#include "model/gaussian_process/gaussian_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "model/gaussian_process/covariance.hpp"
#include "model/gaussian_process/kernel_kernels.hpp"
#include "model/gaussian_process/kernel_model.hpp"

namespace torsio {
namespace {

using kernel_kernels::in_groups;

GaussianProcess::Parameters checked(GaussianProcess::Parameters parameters) {
  check_kernel_model(parameters, parameters.points, "points", "gaussian_process",
                     parameters.with_std_dev ? GaussianProcess::kMaxPointsWithStdDev
                                             : GaussianProcess::kMaxPoints);
  return parameters;
}

/// L as `whitened_square` reads it.
detail::AlignedVector<double> packed_factor(const SquareMatrix& factor) {
  std::size_t places = 0;
  for (std::size_t i = 0; i < factor.size(); ++i) places += in_groups(i + 1);
  detail::AlignedVector<double> packed(places, 0.0);
  double* to = packed.data();
  for (std::size_t i = 0; i < factor.size(); ++i) {
    std::copy_n(factor.row(i), i, to);
    to[i] = 1.0 / factor(i, i);
    to += in_groups(i + 1);
  }
  return packed;
}

}  // namespace

GaussianProcess::GaussianProcess(Parameters parameters)
    : parameters_(checked(std::move(parameters))),
      kernel_(parameters_.kernel, parameters_.points.columns),
      points_(parameters_.points),
      weights_(padded(parameters_.weights)),
      input_(input_count()),
      values_(points_.padded_size()) {
  if (!parameters_.with_std_dev) return;
  SquareMatrix factor(parameters_.points.rows);
  if (factorise_covariance(kernel_, parameters_.points, points_, parameters_.noise_variance, {},
                           factor) < 0.0)
    refuse_covariance(kFamily);
  factor_ = packed_factor(factor);
}

Estimate GaussianProcess::step(Features features) noexcept {
  standardise(parameters_.scaling, features, input_.data());
  kernel_.row(input_.data(), points_, points_.size(), values_.data());
  const double mean = kernel_kernels::dot(values_.data(), weights_.data(), values_.size());
  if (factor_.empty()) return kernel_estimate(parameters_, input_, mean);
  const double prior = kernel_.self(input_.data());
  const double explained =
      kernel_kernels::whitened_square(factor_.data(), values_.data(), points_.size());
  return kernel_estimate(parameters_, input_, mean, {prior, explained});
}

}  // namespace torsio
