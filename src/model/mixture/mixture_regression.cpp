#include "model/mixture/mixture_regression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

// The parameters of one component in the order of the packed rows, on the stack and, for a number of
// inputs that is known at compile time, in registers. @returns false if the given quantities have no
// positive definite covariance.
template <std::size_t kFixed>
bool conditional_parameters(double weight, const double* mean, const double* covariance,
                            std::size_t inputs, std::size_t output, double* parameters) noexcept {
  constexpr std::size_t kMost = kFixed > 0 ? kFixed : kMaxMixtureQuantities;
  const std::size_t n = kFixed > 0 ? kFixed : inputs;
  const std::size_t dimension = n + 1;
  const auto quantity = [output](std::size_t j) { return j < output ? j : j + 1; };
  std::array<std::array<double, kMost>, kMost> factor;  // Cholesky, then its inverse
  std::array<double, kMost> inverse;                    // reciprocals of its diagonal
  double log_scale = 0.0;  // ln of weight / root of the determinant is this + ln `scale`
  double scale = weight;
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = 0; c <= r; ++c) {
      double sum = covariance[quantity(r) * dimension + quantity(c)];
      for (std::size_t k = 0; k < c; ++k) sum -= factor[r][k] * factor[c][k];
      if (c < r) {
        factor[r][c] = sum * inverse[c];
      } else {
        if (!(sum > 0.0 && std::isfinite(sum))) return false;
        const double root = std::sqrt(sum);
        factor[r][r] = root;
        inverse[r] = 1.0 / root;
        scale *= inverse[r];
      }
    }
    // One logarithm, as long as the product cannot leave the range of a double.
    if (scale > 1e-100 && scale < 1e100) continue;
    log_scale += std::log(scale);
    scale = 1.0;
  }
  for (std::size_t c = 0; c < n; ++c) {
    factor[c][c] = inverse[c];
    for (std::size_t r = c + 1; r < n; ++r) {
      double sum = 0.0;
      for (std::size_t k = c; k < r; ++k) sum += factor[r][k] * factor[k][c];
      factor[r][c] = -sum * inverse[r];
    }
  }
  std::array<double, kMost> white;  // L^-1 S^ZY
  for (std::size_t r = 0; r < n; ++r) {
    white[r] = 0.0;
    for (std::size_t c = 0; c <= r; ++c)
      white[r] += factor[r][c] * covariance[quantity(c) * dimension + output];
  }
  double* next = parameters;
  for (std::size_t j = 0; j < n; ++j) *next++ = mean[quantity(j)];
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t c = 0; c <= r; ++c) *next++ = factor[r][c] * (0.5 * std::numbers::sqrt2);
  constexpr double kLogTwoPi = 1.8378770664093454836;
  *next++ = log_scale + std::log(scale) - 0.5 * static_cast<double>(n) * kLogTwoPi;
  *next++ = mean[output];
  for (std::size_t c = 0; c < n; ++c) {
    double slope = 0.0;
    for (std::size_t r = c; r < n; ++r) slope += factor[r][c] * white[r];
    *next++ = slope;
  }
  double variance = covariance[output * dimension + output];
  for (std::size_t r = 0; r < n; ++r) variance -= white[r] * white[r];
  // The Schur complement of a positive definite matrix is positive; with rounding it may not be.
  *next = std::max(variance, std::numeric_limits<double>::min());
  return true;
}

bool conditional_parameters_of(double weight, const double* mean, const double* covariance,
                               std::size_t inputs, std::size_t output,
                               double* parameters) noexcept {
  switch (inputs) {
    case 1: return conditional_parameters<1>(weight, mean, covariance, inputs, output, parameters);
    case 2: return conditional_parameters<2>(weight, mean, covariance, inputs, output, parameters);
    case 3: return conditional_parameters<3>(weight, mean, covariance, inputs, output, parameters);
    case 4: return conditional_parameters<4>(weight, mean, covariance, inputs, output, parameters);
    default: return conditional_parameters<0>(weight, mean, covariance, inputs, output, parameters);
  }
}

}  // namespace

MixtureRegression::MixtureRegression(const GaussianMixture& mixture, std::size_t output,
                                     std::size_t reserve)
    : output_(output) {
  check(mixture);
  if (mixture.dimension() < 2 || output >= mixture.dimension())
    throw Error({.place = "mixture regression",
                 .expected = "two quantities or more and an output among them",
                 .found = fmt::format("{} quantities, output {}", mixture.dimension(), output)});
  pack(mixture, reserve);
  // The first call of a kernel asks for the machine's instruction sets: here, not in the loop.
  static_cast<void>(query(input_centre_));
}

void MixtureRegression::pack(const GaussianMixture& mixture, std::size_t reserve) {
  std::vector<std::size_t> given;
  for (std::size_t j = 0; j < mixture.dimension(); ++j) {
    if (j == output_) continue;
    given.push_back(j);
    input_centre_.push_back(mixture.centre[j]);
    input_scale_.push_back(mixture.scale[j]);
  }
  inputs_ = given.size();
  components_ = mixture.size();
  output_centre_ = mixture.centre[output_];
  output_scale_ = mixture.scale[output_];

  std::vector<std::size_t> order(components_);
  std::iota(order.begin(), order.end(), std::size_t{0});
  sort_into_blocks(mixture, given, order);

  const std::size_t capacity = components_ + reserve;
  const std::size_t slots = blocks_of(capacity, kScanLanes) * kScanLanes;
  few_blocks_ =
      std::max(kAlwaysExact, blocks_of(components_, kScanLanes) * (kScanLanes / kExactLanes) / 4);
  scan_.assign(slots * scan_rows(inputs_), 0.0F);
  rounded_.assign(slots * rounded_rows(inputs_), 0.0F);
  exact_.assign(slots * exact_rows(inputs_), 0.0);
  for (std::size_t slot = components_; slot < slots; ++slot) clear(slot);
  component_at_ = order;
  for (std::size_t slot = components_; slot < slots; ++slot) component_at_.push_back(slot);
  slot_of_.resize(slots);
  for (std::size_t slot = 0; slot < slots; ++slot) slot_of_[component_at_[slot]] = slot;
  parameters_.resize(exact_rows(inputs_));
  bounds_.offset = -kInfinity;
  for (std::size_t i = 0; i < components_; ++i)
    if (!set(i, mixture.weights[i], mixture.means.row(i), mixture.covariances.row(i)))
      throw Error({.place = fmt::format("mixture: component {}", i),
                   .problem = "bad covariance",
                   .expected = "one whose given quantities have a positive definite part",
                   .found = fmt::format("none when quantity {} is the output", output_)});
  slot_of_.resize(capacity);
  first_bounds_ = bounds_;
  standardised_.resize(inputs_);
  scan_input_.resize(2 * inputs_);
  scan_log_weights_.resize(slots);
  log_weights_.resize(slots);
  candidates_.resize(slots / kExactLanes);
}

void MixtureRegression::clear(std::size_t slot) noexcept {
  const std::size_t row = scan_rows(inputs_) - 1;  // the offset
  const std::size_t lane = slot % kScanLanes;
  const std::size_t block = slot / kScanLanes;
  constexpr float kNone = -std::numeric_limits<float>::infinity();
  scan_[(block * scan_rows(inputs_) + row) * kScanLanes + lane] = kNone;
  rounded_[(block * rounded_rows(inputs_) + row) * kScanLanes + lane] = kNone;
  exact_[(slot / kExactLanes * exact_rows(inputs_) + row) * kExactLanes + slot % kExactLanes] =
      -kInfinity;
}

void MixtureRegression::store(std::size_t slot, std::span<const double> parameters) noexcept {
  const std::size_t scanned = scan_rows(inputs_);
  const std::size_t lane = slot % kScanLanes;
  const std::size_t block = slot / kScanLanes;
  float* const scan = scan_.data() + block * scanned * kScanLanes + lane;
  float* const rounded = rounded_.data() + block * rounded_rows(inputs_) * kScanLanes + lane;
  float* const lost = rounded + exact_rows(inputs_) * kScanLanes;
  double* const exact =
      exact_.data() + slot / kExactLanes * exact_rows(inputs_) * kExactLanes + slot % kExactLanes;
  double whitening_square = 0.0;
  for (std::size_t row = 0; row < parameters.size(); ++row) {
    const double value = parameters[row];
    const auto narrow = static_cast<float>(value);
    exact[row * kExactLanes] = value;
    rounded[row * kScanLanes] = narrow;
    if (row < scanned) scan[row * kScanLanes] = narrow;
    if (row < inputs_) {
      lost[row * kScanLanes] = static_cast<float>(value - static_cast<double>(narrow));
      bounds_.mean = std::max(bounds_.mean, std::abs(value));
    } else if (row + 1 < scanned) {
      whitening_square += value * value;
    }
  }
  bounds_.whitening = std::max(bounds_.whitening, std::sqrt(whitening_square));
  bounds_.offset = std::max(bounds_.offset, parameters[scanned - 1]);
}

bool MixtureRegression::set(std::size_t component, double weight, std::span<const double> mean,
                            std::span<const double> covariance) noexcept {
  if (!(weight > 0.0) || !conditional_parameters_of(weight, mean.data(), covariance.data(), inputs_,
                                                    output_, parameters_.data()))
    return false;
  store(slot_of_[component], parameters_);
  return true;
}

void MixtureRegression::remove(std::size_t component) noexcept { clear(slot_of_[component]); }

void MixtureRegression::standardise(Features inputs) noexcept {
  for (std::size_t j = 0; j < inputs_; ++j) {
    standardised_[j] = (inputs[j] - input_centre_[j]) / input_scale_[j];
    scan_input_[j] = static_cast<float>(standardised_[j]);
    scan_input_[inputs_ + j] = lost_to_float(standardised_[j]);
  }
}

Conditional MixtureRegression::physical(const Conditional& standardised) const noexcept {
  return {output_centre_ + output_scale_ * standardised.mean,
          output_scale_ * output_scale_ * standardised.variance,
          standardised.log_density - log_total_};
}

// Below this log weight no component can matter. A float32 log weight of one that can, whose
// whitened vector w is no longer than `distance`, may be off by `error`: input, mean and whitening
// are rounded, and so is each operation on w.
double MixtureRegression::threshold(double largest) const noexcept {
  const auto count = static_cast<double>(inputs_);
  const double cut = kNegligible + std::log(static_cast<double>(slot_of_.size()));
  double reach = bounds_.mean;
  for (const double z : standardised_) reach = std::max(reach, std::abs(z) + bounds_.mean);
  const double distance = std::sqrt(std::max(0.0, bounds_.offset - largest + cut));
  const double shift = kRounding * reach * std::sqrt(count) * bounds_.whitening;
  const double error =
      2.0 * distance * shift + shift * shift +
      kRounding * (std::abs(bounds_.offset) + (2.0 * count + 4.0) * distance * distance);
  return largest - cut - 2.0 * error;
}

// Whether float32 log weights near the largest are good to 5e-5 once the differences to the means
// are: only the operations on w are rounded then.
bool MixtureRegression::float_is_enough(double largest) const noexcept {
  constexpr double kGood = 5e-5;
  constexpr double kHeavy = 5.0;  // lighter than e^-5, an error counts for less than a hundredth
  const double square = std::max(0.0, bounds_.offset - largest + kHeavy);
  const double operations = 2.0 * static_cast<double>(inputs_) + 4.0;
  return 0.5 * kRounding * (std::abs(largest) + std::abs(bounds_.offset) + operations * square) <
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
  last_largest_ = largest;
  last_blocks_ = count;
  last_lanes_ = kExactLanes;

  if (count <= few_blocks_ || !float_is_enough(top)) {
    bytes_read_ += count * exact_rows(inputs_) * kExactLanes * sizeof(double);
    const Conditional found =
        mixture_kernels::finish(exact_.data(), inputs_, standardised_.data(), candidates_.data(),
                                count, log_weights_.data());
    last_log_density_ = found.log_density;
    return physical(found);
  }
  std::size_t pairs = 0;  // the larger blocks that hold the candidates
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t pair = candidates_[k] / (kScanLanes / kExactLanes);
    if (pairs == 0 || candidates_[pairs - 1] != pair) candidates_[pairs++] = pair;
  }
  last_blocks_ = pairs;
  last_lanes_ = kScanLanes;
  bytes_read_ += pairs * rounded_rows(inputs_) * kScanLanes * sizeof(float);
  const Conditional found = mixture_kernels::finish_rounded(
      rounded_.data(), inputs_, scan_input_.data(), candidates_.data(), pairs, best, largest);
  last_log_density_ = found.log_density;
  return physical(found);
}

double MixtureRegression::log_weight(std::size_t slot) const noexcept {
  const double* const block =
      exact_.data() + slot / kExactLanes * exact_rows(inputs_) * kExactLanes + slot % kExactLanes;
  double square = 0.0;
  std::size_t row = inputs_;
  for (std::size_t r = 0; r < inputs_; ++r) {
    double white = 0.0;
    for (std::size_t c = 0; c <= r; ++c, ++row)
      white += block[row * kExactLanes] * (standardised_[c] - block[c * kExactLanes]);
    square += white * white;
  }
  return block[row * kExactLanes] - square;
}

std::size_t MixtureRegression::heaviest(double least, std::span<Share> found) const noexcept {
  // Error of a float32 log weight: what `threshold` allows for is far smaller where weights matter.
  constexpr double kMargin = 0.1;
  const double lightest = static_cast<double>(last_largest_) + std::log(least) - kMargin;
  auto limit = static_cast<float>(lightest);
  std::size_t count = 0;
  for (std::size_t k = 0; k < last_blocks_; ++k) {
    const std::size_t first = candidates_[k] * last_lanes_;
    for (std::size_t slot = first; slot < first + last_lanes_; ++slot) {
      const float weight = scan_log_weights_[slot];
      if (!(weight >= limit) || std::isinf(weight)) continue;
      const bool is_full = count == found.size();
      std::size_t at = is_full ? count - 1 : count++;
      for (; at > 0 && found[at - 1].log_weight < static_cast<double>(weight); --at)
        found[at] = found[at - 1];
      found[at] = {.component = slot, .log_weight = static_cast<double>(weight)};
      if (count == found.size())
        limit = std::max(limit, static_cast<float>(found[count - 1].log_weight));
    }
  }
  for (Share& each : found.first(count)) {
    each.log_weight = log_weight(each.component);
    each.share = std::exp(each.log_weight - last_log_density_);
    each.component = component_at_[each.component];
  }
  return count;
}

void MixtureRegression::query(const Matrix& inputs, std::span<Conditional> results) noexcept {
  for (std::size_t i = 0; i < inputs.rows; ++i) results[i] = query(inputs.row(i));
}

Conditional MixtureRegression::query_exact(Features inputs) const noexcept {
  const std::size_t rows = exact_rows(inputs_);
  const std::size_t capacity = slot_of_.size();
  const auto parameter = [&](std::size_t component, std::size_t row) {
    return exact_[(component / kExactLanes * rows + row) * kExactLanes + component % kExactLanes];
  };
  const auto centred = [&](std::size_t component, std::size_t j) {
    return (inputs[j] - input_centre_[j]) / input_scale_[j] - parameter(component, j);
  };
  const auto log_weight_of = [&](std::size_t component) {
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
  for (std::size_t i = 0; i < capacity; ++i) largest = std::max(largest, log_weight_of(i));
  double total = 0.0;
  double mean = 0.0;
  for (std::size_t i = 0; i < capacity; ++i) {
    const double weight = std::exp(log_weight_of(i) - largest);
    total += weight;
    mean += weight * output_mean(i);
  }
  mean /= total;
  double variance = 0.0;
  for (std::size_t i = 0; i < capacity; ++i) {
    const double deviation = output_mean(i) - mean;
    variance +=
        std::exp(log_weight_of(i) - largest) * (parameter(i, rows - 1) + deviation * deviation);
  }
  return physical({mean, variance / total, largest + std::log(total)});
}

}  // namespace torsio
