#include "model/gaussian_process/parametric_gp.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "model/gaussian_process/kernel_kernels.hpp"
#include "model/gaussian_process/kernel_model.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using kernel_kernels::in_groups;

ParametricGp::Parameters checked(ParametricGp::Parameters parameters) {
  check_kernel_model(parameters, parameters.inducing_points, "inducing_points", "parametric_gp",
                     ParametricGp::kMaxPoints);
  const std::size_t size = parameters.inducing_points.rows;
  if (parameters.has_std_dev())
    check_shape(parameters.explained, size, size, "parametric_gp: explained");
  return parameters;
}

/// C, its rows filled up to whole groups with 0.
detail::AlignedVector<double> padded_rows(const Matrix& matrix) {
  const std::size_t stride = in_groups(matrix.columns);
  detail::AlignedVector<double> rows(matrix.rows * stride, 0.0);
  for (std::size_t i = 0; i < matrix.rows; ++i)
    std::ranges::copy(matrix.row(i), rows.begin() + static_cast<std::ptrdiff_t>(i * stride));
  return rows;
}

}  // namespace

ParametricGp::ParametricGp(Parameters parameters)
    : parameters_(checked(std::move(parameters))),
      kernel_(parameters_.kernel, parameters_.inducing_points.columns),
      points_(parameters_.inducing_points),
      weights_(padded(parameters_.weights)),
      explained_(padded_rows(parameters_.explained)),
      input_(input_count()),
      values_(points_.padded_size()) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    kernel_.row(parameters_.inducing_points.row(i).data(), points_, points_.size(), values_.data());
    if (!std::ranges::all_of(values_, [](double value) { return std::isfinite(value); }))
      throw Error({.place = "parametric_gp: kernel",
                   .expected = "a finite value between any two of the points",
                   .found = "none at point " + std::to_string(i),
                   .advice = "A rational_quadratic kernel with alpha below 0 ends at a distance of "
                             "sqrt(2 |alpha|) length scales."});
  }
}

Estimate ParametricGp::step(Features features) noexcept {
  standardise(parameters_.scaling, features, input_.data());
  kernel_.row(input_.data(), points_, points_.size(), values_.data());
  const double mean = kernel_kernels::dot(values_.data(), weights_.data(), values_.size());
  if (!parameters_.has_std_dev()) return kernel_estimate(parameters_, input_, mean);
  const double explained =
      kernel_kernels::quadratic_form(explained_.data(), values_.data(), points_.size());
  return kernel_estimate(parameters_, input_, mean, {kernel_.self(input_.data()), explained});
}

}  // namespace torsio
