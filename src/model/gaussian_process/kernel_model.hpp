#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/gaussian_process/kernel_kernels.hpp"
#include "model/network/network_checks.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// What families whose value is a weighted sum of kernels share.

/// Checks scaling, noise, the inputs of the kernels and their weights. @param points the field `points_name`: a row per
/// kernel. @throws Error at `place` with the field.
template <class Parameters>
void check_kernel_model(const Parameters& parameters, const Matrix& points,
                        const std::string& points_name, const std::string& place,
                        std::size_t max_points) {
  const std::size_t inputs = checked_input_count(parameters.scaling, place + ": scaling");
  const std::string points_place = place + ": " + points_name;
  if (points.rows == 0 || points.rows > max_points)
    throw Error({.place = points_place,
                 .expected = fmt::format("1 to {} points", max_points),
                 .found = fmt::format("{}", points.rows)});
  check_shape(points, points.rows, inputs, points_place);
  check_length(parameters.weights, points.rows, place + ": weights");
  check_positive(parameters.noise_variance, place + ": noise_variance");
}

/// Filled up to whole groups with 0.
inline detail::AlignedVector<double> padded(const std::vector<double>& values) {
  detail::AlignedVector<double> result(kernel_kernels::in_groups(values.size()), 0.0);
  std::ranges::copy(values, result.begin());
  return result;
}

/// The variance of the standardised target.
struct KernelVariance {
  double prior = 0.0;
  double explained = 0.0;
};

/// A mean of the standardised target in the target's unit; the target's centre and a fault where
/// the mean or an input is not a number: a vanishing kernel would hide that.
template <class Parameters>
Estimate kernel_estimate(const Parameters& parameters, std::span<const double> inputs,
                         double mean) noexcept {
  double sum = mean;
  for (const double input : inputs) sum += 0.0 * input;
  if (!std::isfinite(sum))
    return {.value = parameters.scaling.target_centre, .fault = Fault::model_not_finite};
  return {.value = destandardise(parameters.scaling, mean)};
}

template <class Parameters>
Estimate kernel_estimate(const Parameters& parameters, std::span<const double> inputs, double mean,
                         const KernelVariance& variance) noexcept {
  Estimate estimate = kernel_estimate(parameters, inputs, mean);
  const double left = variance.prior - variance.explained;
  if (estimate.fault != Fault::none || !std::isfinite(left)) return estimate;
  // Rounding may leave less than nothing.
  estimate.std_dev =
      parameters.scaling.target_scale * std::sqrt(std::max(left, 0.0) + parameters.noise_variance);
  estimate.novelty =
      variance.prior > 0.0 ? std::clamp(left / variance.prior, 0.0, 1.0) : kNotMeasured;
  return estimate;
}

}  // namespace torsio
