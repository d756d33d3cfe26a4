#include "signal/causal_polynomial.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {

CausalPolynomial::CausalPolynomial(std::size_t order, std::vector<double> places)
    : order_(order), places_(std::move(places)), values_(places_.size()) {
  if (order > kHighestOrder)
    throw Error({.place = "input_order",
                 .expected = "0 to " + std::to_string(kHighestOrder),
                 .found = std::to_string(order)});
  for (const double place : places_)
    if (!(place >= 0.0 && place <= 1.0))
      throw Error({.place = "places between two samples",
                   .expected = "0 to 1",
                   .found = std::to_string(place)});
  for (std::size_t samples = 1; samples <= order + 1; ++samples)
    weights_.push_back(weights_through(samples));
}

std::vector<double> CausalPolynomial::weights_through(std::size_t samples) const {
  std::vector<double> weights;
  for (const double place : places_) {
    const double x = place - 1.0;  // the newest sample is at 0, the one before it at -1
    for (std::size_t j = 0; j < samples; ++j) {
      double weight = 1.0;
      for (std::size_t i = 0; i < samples; ++i)
        if (i != j)
          weight *=
              (x + static_cast<double>(i)) / (static_cast<double>(i) - static_cast<double>(j));
      weights.push_back(weight);
    }
  }
  return weights;
}

std::span<const double> CausalPolynomial::step(double sample) noexcept {
  const double before = known_ == 0 ? sample : samples_[0];
  std::copy_backward(samples_.begin(), samples_.end() - 1, samples_.end());
  samples_[0] = sample;
  known_ = std::min(known_ + 1, order_ + 1);
  if (order_ == 0) {
    std::ranges::fill(values_, before);
    return values_;
  }
  const double* weight = weights_[known_ - 1].data();
  for (double& value : values_) {
    value = 0.0;
    for (std::size_t j = 0; j < known_; ++j) value += *weight++ * samples_[j];
  }
  return values_;
}

}  // namespace torsio
