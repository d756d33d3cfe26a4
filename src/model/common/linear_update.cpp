#include "model/common/linear_update.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/common/adaptation_kernels.hpp"
#include "torsio/core/error.hpp"

namespace torsio::detail {
namespace {

namespace kernels = adaptation_kernels;

std::size_t padded(std::size_t count) {
  const std::size_t lanes = kernels::lanes();
  return (count + lanes - 1) / lanes * lanes;
}

}  // namespace

LinearUpdate::LinearUpdate(const AdaptationSettings& settings, std::size_t weights)
    : settings_(settings), weights_(weights), deviation_(padded(weights), 0.0), x_(deviation_) {
  if (settings_.rule != AdaptationRule::rls) return;
  if (weights > kMaxRlsFeatures + 1)
    throw Error({.place = "adaptation: rls",
                 .expected = fmt::format("at most {} features of the last layer", kMaxRlsFeatures),
                 .found = fmt::format("{}", weights - 1),
                 .advice = "Use nlms: its cost grows with the features, not their square."});
  pending_ = product_ = deviation_;
  covariance_.resize(kernels::triangle_size(deviation_.size()));
  reset_covariance();
}

void LinearUpdate::reset() noexcept {
  std::ranges::fill(deviation_, 0.0);
  square_ = 0.0;
  if (settings_.rule == AdaptationRule::rls) reset_covariance();
}

LinearUpdate::Sums LinearUpdate::set(std::span<const float> features) noexcept {
  const auto [correction, square] =
      kernels::extend(features.data(), features.size(), deviation_.data(), x_.data());
  x_square_ = square;
  return {correction, square};
}

LinearUpdate::Sums LinearUpdate::set() noexcept {
  x_square_ = kernels::dot(x_.data(), x_.data(), x_.size());
  return {kernels::dot(deviation_.data(), x_.data(), x_.size()), x_square_};
}

bool LinearUpdate::update(double error) noexcept {
  if (settings_.rule == AdaptationRule::rls) return rls(error);
  nlms(error);
  return true;
}

void LinearUpdate::shrink(double factor) noexcept {
  square_ = kernels::blend(deviation_.data(), factor, 0.0, x_.data(), deviation_.size());
}

void LinearUpdate::nlms(double error) noexcept {
  const double gain = settings_.step_size * error / (settings_.regularisation + x_square_);
  square_ =
      kernels::blend(deviation_.data(), 1.0 - settings_.leak, gain, x_.data(), deviation_.size());
}

bool LinearUpdate::rls(double error) noexcept {
  const std::size_t size = deviation_.size();
  const double trace = kernels::update_and_multiply(covariance_.data(), size, pending_scale_,
                                                    pending_.data(), x_.data(), product_.data());
  const double spread = kernels::dot(x_.data(), product_.data(), size);
  const double normaliser = settings_.forgetting + spread;
  const double root = std::sqrt(normaliser);
  // What P is after this update, without having touched it.
  const double smaller = 1.0 / root;
  std::ranges::transform(product_, pending_.begin(), [&](double x) { return x * smaller; });
  const double left = trace - kernels::dot(pending_.data(), pending_.data(), size);
  if (!(spread >= 0.0) || !(left > 0.0) || !std::isfinite(normaliser)) {
    reset_covariance();
    return false;
  }
  const double cap =
      settings_.trace_cap * settings_.initial_covariance * static_cast<double>(weights_);
  pending_scale_ = std::min(1.0 / settings_.forgetting, cap / left);
  square_ = kernels::blend(deviation_.data(), 1.0, error / normaliser, product_.data(), size);
  return true;
}

void LinearUpdate::reset_covariance() noexcept {
  std::ranges::fill(covariance_, 0.0);
  for (std::size_t row = 0; row < weights_; ++row)
    covariance_[kernels::diagonal_index(row)] = settings_.initial_covariance;
  std::ranges::fill(pending_, 0.0);
  pending_scale_ = 1.0;
}

}  // namespace torsio::detail
