#include "model/mixture/mixture_regression.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "model/mixture/mixture_kernels.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using mixture_kernels::exact_rows;
using mixture_kernels::kExactLanes;
using mixture_kernels::kScanLanes;
using mixture_kernels::rounded_rows;
using mixture_kernels::scan_rows;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Components outside this share of the weight are not evaluated: e^-23 = 1e-10.
constexpr double kNegligible = 23.0;

// Blocks that are evaluated in double however few the mixture has.
constexpr std::size_t kAlwaysExact = 32;

constexpr double kRounding = static_cast<double>(std::numeric_limits<float>::epsilon());

// What rounding to float takes from a number.
float lost_to_float(double value) {
  const double lost = value - static_cast<double>(static_cast<float>(value));
  return static_cast<float>(lost);
}

std::size_t blocks_of(std::size_t count, std::size_t lanes) { return (count + lanes - 1) / lanes; }

// Splits [first, last) at the median of the widest input until one block remains, so that
// components in one block are neighbours and few blocks hold those that matter to a query.
void sort_into_blocks(const GaussianMixture& mixture, std::span<const std::size_t> given,
                      std::span<std::size_t> order) {
  if (order.size() <= kExactLanes) return;
  std::size_t widest = given.front();
  double width = -1.0;
  for (const std::size_t quantity : given) {
    const auto [low, high] =
        std::minmax_element(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
          return mixture.means(a, quantity) < mixture.means(b, quantity);
        });
    const double extent = mixture.means(*high, quantity) - mixture.means(*low, quantity);
    if (extent > width) {
      width = extent;
      widest = quantity;
    }
  }
  const std::size_t half = blocks_of(order.size() / 2, kExactLanes) * kExactLanes;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](std::size_t a, std::size_t b) {
                     const double left = mixture.means(a, widest);
                     const double right = mixture.means(b, widest);
                     return left < right || (left == right && a < b);
                   });
  sort_into_blocks(mixture, given, order.first(half));
  sort_into_blocks(mixture, given, order.subspan(half));
}

// The parameters of one component in the order of the packed rows.
std::vector<double> conditional_parameters(const GaussianMixture& mixture, std::size_t component,
                                           std::span<const std::size_t> given, std::size_t output) {
  const std::size_t dimension = mixture.dimension();
  const auto n = static_cast<Eigen::Index>(given.size());
  const auto covariance = mixture.covariances.row(component);
  Eigen::MatrixXd inner(n, n);
  Eigen::VectorXd cross(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::size_t row = given[static_cast<std::size_t>(r)] * dimension;
    cross(r) = covariance[row + output];
    for (Eigen::Index c = 0; c < n; ++c)
      inner(r, c) = covariance[row + given[static_cast<std::size_t>(c)]];
  }
  const Eigen::LLT<Eigen::MatrixXd> cholesky(inner);
  if (cholesky.info() != Eigen::Success)
    throw Error({.place = fmt::format("mixture: component {}", component),
                 .problem = "bad covariance",
                 .expected = "one whose given quantities have a positive definite part",
                 .found = fmt::format("none when quantity {} is the output", output)});
  const Eigen::MatrixXd whitening =
      cholesky.matrixL().solve(Eigen::MatrixXd::Identity(n, n)) / std::numbers::sqrt2;
  const Eigen::VectorXd slope = cholesky.solve(cross);
  const double log_determinant_half = cholesky.matrixLLT().diagonal().array().log().sum();

  std::vector<double> parameters;
  parameters.reserve(exact_rows(given.size()));
  for (const std::size_t quantity : given) parameters.push_back(mixture.means(component, quantity));
  for (Eigen::Index r = 0; r < n; ++r)
    for (Eigen::Index c = 0; c <= r; ++c) parameters.push_back(whitening(r, c));
  parameters.push_back(std::log(mixture.weights[component]) - log_determinant_half -
                       0.5 * static_cast<double>(n) * std::log(2.0 * std::numbers::pi));
  parameters.push_back(mixture.means(component, output));
  parameters.insert(parameters.end(), slope.begin(), slope.end());
  // The Schur complement of a positive definite matrix is positive; with rounding it may not be.
  const double variance = covariance[output * dimension + output] - slope.dot(cross);
  parameters.push_back(std::max(variance, std::numeric_limits<double>::min()));
  return parameters;
}

}  // namespace

MixtureRegression::MixtureRegression(const GaussianMixture& mixture, std::size_t output) {
  check(mixture);
  if (mixture.dimension() < 2 || output >= mixture.dimension())
    throw Error({.place = "mixture regression",
                 .expected = "two quantities or more and an output among them",
                 .found = fmt::format("{} quantities, output {}", mixture.dimension(), output)});
  pack(mixture, output);
  // The first call of a kernel asks for the machine's instruction sets: here, not in the loop.
  static_cast<void>(query(input_centre_));
}

void MixtureRegression::pack(const GaussianMixture& mixture, std::size_t output) {
  std::vector<std::size_t> given;
  for (std::size_t j = 0; j < mixture.dimension(); ++j) {
    if (j == output) continue;
    given.push_back(j);
    input_centre_.push_back(mixture.centre[j]);
    input_scale_.push_back(mixture.scale[j]);
  }
  inputs_ = given.size();
  components_ = mixture.size();
  output_centre_ = mixture.centre[output];
  output_scale_ = mixture.scale[output];

  std::vector<std::size_t> order(components_);
  std::iota(order.begin(), order.end(), std::size_t{0});
  sort_into_blocks(mixture, given, order);

  const std::size_t slots = blocks_of(components_, kScanLanes) * kScanLanes;
  const std::size_t offset_row = scan_rows(inputs_) - 1;
  scan_.assign(slots * scan_rows(inputs_), 0.0F);
  rounded_.assign(slots * rounded_rows(inputs_), 0.0F);
  exact_.assign(slots * exact_rows(inputs_), 0.0);
  const auto store = [&](std::size_t slot, std::size_t row, double value) {
    const std::size_t lane = slot % kScanLanes;
    const std::size_t block = slot / kScanLanes;
    const std::size_t exact_block = slot / kExactLanes * exact_rows(inputs_);
    float* const rounded = rounded_.data() + block * rounded_rows(inputs_) * kScanLanes + lane;
    exact_[(exact_block + row) * kExactLanes + slot % kExactLanes] = value;
    rounded[row * kScanLanes] = static_cast<float>(value);
    if (row < inputs_) rounded[(exact_rows(inputs_) + row) * kScanLanes] = lost_to_float(value);
    if (row <= offset_row)
      scan_[(block * scan_rows(inputs_) + row) * kScanLanes + lane] = static_cast<float>(value);
  };
  largest_offset_ = -kInfinity;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    if (slot >= components_) {
      store(slot, offset_row, -kInfinity);
      continue;
    }
    const std::vector<double> parameters =
        conditional_parameters(mixture, order[slot], given, output);
    double whitening_square = 0.0;
    for (std::size_t row = 0; row < parameters.size(); ++row) {
      store(slot, row, parameters[row]);
      if (row < inputs_) largest_mean_ = std::max(largest_mean_, std::abs(parameters[row]));
      if (row >= inputs_ && row < offset_row) whitening_square += parameters[row] * parameters[row];
    }
    largest_whitening_ = std::max(largest_whitening_, std::sqrt(whitening_square));
    largest_offset_ = std::max(largest_offset_, parameters[offset_row]);
  }
  standardised_.resize(inputs_);
  scan_input_.resize(2 * inputs_);
  scan_log_weights_.resize(slots);
  log_weights_.resize(slots);
  candidates_.resize(slots / kExactLanes);
}

void MixtureRegression::standardise(Features inputs) noexcept {
  for (std::size_t j = 0; j < inputs_; ++j) {
    standardised_[j] = (inputs[j] - input_centre_[j]) / input_scale_[j];
    scan_input_[j] = static_cast<float>(standardised_[j]);
    scan_input_[inputs_ + j] = lost_to_float(standardised_[j]);
  }
}

Conditional MixtureRegression::physical(const Conditional& standardised) const noexcept {
  return {output_centre_ + output_scale_ * standardised.mean,
          output_scale_ * output_scale_ * standardised.variance, standardised.log_density};
}

// Below this log weight no component can matter. A float32 log weight of one that can, whose
// whitened vector w is no longer than `distance`, may be off by `error`: input, mean and whitening
// are rounded, and so is each operation on w.
double MixtureRegression::threshold(double largest) const noexcept {
  const auto count = static_cast<double>(inputs_);
  const double cut = kNegligible + std::log(static_cast<double>(components_));
  double reach = largest_mean_;
  for (const double z : standardised_) reach = std::max(reach, std::abs(z) + largest_mean_);
  const double distance = std::sqrt(std::max(0.0, largest_offset_ - largest + cut));
  const double shift = kRounding * reach * std::sqrt(count) * largest_whitening_;
  const double error =
      2.0 * distance * shift + shift * shift +
      kRounding * (std::abs(largest_offset_) + (2.0 * count + 4.0) * distance * distance);
  return largest - cut - 2.0 * error;
}

// Whether float32 log weights near the largest are good to 5e-5 once the differences to the means
// are: only the operations on w are rounded then.
bool MixtureRegression::float_is_enough(double largest) const noexcept {
  constexpr double kGood = 5e-5;
  constexpr double kHeavy = 5.0;  // lighter than e^-5, an error counts for less than a hundredth
  const double square = std::max(0.0, largest_offset_ - largest + kHeavy);
  const double operations = 2.0 * static_cast<double>(inputs_) + 4.0;
  return 0.5 * kRounding * (std::abs(largest) + std::abs(largest_offset_) + operations * square) <
         kGood;
}

Conditional MixtureRegression::query(Features inputs) noexcept {
  standardise(inputs);
  const std::size_t scan_blocks = scan_log_weights_.size() / kScanLanes;
  const float largest = mixture_kernels::scan(scan_.data(), scan_blocks, inputs_,
                                              scan_input_.data(), scan_log_weights_.data());
  const auto top = static_cast<double>(largest);
  const auto [count, best] =
      mixture_kernels::select(scan_log_weights_.data(), candidates_.size(),
                              static_cast<float>(threshold(top)), largest, candidates_.data());
  bytes_read_ = scan_.size() * sizeof(float);

  const bool few = count <= std::max(kAlwaysExact, candidates_.size() / 4);
  if (few || !float_is_enough(top)) {
    bytes_read_ += count * exact_rows(inputs_) * kExactLanes * sizeof(double);
    return physical(mixture_kernels::finish(exact_.data(), inputs_, standardised_.data(),
                                            candidates_.data(), count, log_weights_.data()));
  }
  std::size_t pairs = 0;  // the larger blocks that hold the candidates
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t pair = candidates_[k] / (kScanLanes / kExactLanes);
    if (pairs == 0 || candidates_[pairs - 1] != pair) candidates_[pairs++] = pair;
  }
  bytes_read_ += pairs * rounded_rows(inputs_) * kScanLanes * sizeof(float);
  return physical(mixture_kernels::finish_rounded(rounded_.data(), inputs_, scan_input_.data(),
                                                  candidates_.data(), pairs, best, largest));
}

void MixtureRegression::query(const Matrix& inputs, std::span<Conditional> results) noexcept {
  for (std::size_t i = 0; i < inputs.rows; ++i) results[i] = query(inputs.row(i));
}

Conditional MixtureRegression::query_exact(Features inputs) const noexcept {
  const std::size_t rows = exact_rows(inputs_);
  const auto parameter = [&](std::size_t component, std::size_t row) {
    return exact_[(component / kExactLanes * rows + row) * kExactLanes + component % kExactLanes];
  };
  const auto centred = [&](std::size_t component, std::size_t j) {
    return (inputs[j] - input_centre_[j]) / input_scale_[j] - parameter(component, j);
  };
  const auto log_weight = [&](std::size_t component) {
    double square = 0.0;
    std::size_t row = inputs_;
    for (std::size_t r = 0; r < inputs_; ++r) {
      double white = 0.0;
      for (std::size_t c = 0; c <= r; ++c, ++row)
        white += parameter(component, row) * centred(component, c);
      square += white * white;
    }
    return parameter(component, row) - square;
  };
  const auto output_mean = [&](std::size_t component) {
    const std::size_t first = scan_rows(inputs_);
    double mean = parameter(component, first);
    for (std::size_t j = 0; j < inputs_; ++j)
      mean += parameter(component, first + 1 + j) * centred(component, j);
    return mean;
  };

  double largest = -kInfinity;
  for (std::size_t i = 0; i < components_; ++i) largest = std::max(largest, log_weight(i));
  double total = 0.0;
  double mean = 0.0;
  for (std::size_t i = 0; i < components_; ++i) {
    const double weight = std::exp(log_weight(i) - largest);
    total += weight;
    mean += weight * output_mean(i);
  }
  mean /= total;
  double variance = 0.0;
  for (std::size_t i = 0; i < components_; ++i) {
    const double deviation = output_mean(i) - mean;
    variance +=
        std::exp(log_weight(i) - largest) * (parameter(i, rows - 1) + deviation * deviation);
  }
  return physical({mean, variance / total, largest + std::log(total)});
}

}  // namespace torsio
