#include "torsio/safety/redundancy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "error_correlation.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// An error bar of more than so many times the smallest one has no weight.
constexpr double kLargestRatio = 1e6;

void check_sources(const std::vector<TorqueSource>& sources) {
  if (sources.empty() || sources.size() > Redundancy::kMaxSources)
    throw Error({.place = "redundancy",
                 .expected = fmt::format("1 to {} sources", Redundancy::kMaxSources),
                 .found = fmt::format("{}", sources.size())});
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      if (sources[i].name.empty() || (i != j && sources[i].name == sources[j].name))
        throw Error({.place = "redundancy",
                     .expected = "sources with names of their own",
                     .found = fmt::format("'{}'", sources[i].name)});
}

bool is_valid(const Estimate& source) noexcept {
  return source.fault == Fault::none && std::isfinite(source.value) && source.std_dev > 0.0 &&
         std::isfinite(source.std_dev);
}

}  // namespace

Redundancy::Redundancy(const RedundancySettings& settings) : settings_(settings) {
  check_sources(settings.sources);
  correlation_ =
      detail::error_correlation(settings.correlation, settings.sources.size(), "redundancy");
  for (std::size_t i = 0; i < settings.sources.size(); ++i) {
    for (const std::string& part : settings.sources[i].depends_on) {
      const auto bit = static_cast<std::size_t>(std::ranges::find(parts_, part) - parts_.begin());
      if (bit == kMaxParts)
        throw Error({.place = "redundancy",
                     .expected = fmt::format("sources that depend on at most {} parts", kMaxParts),
                     .found = "more"});
      if (bit == parts_.size()) parts_.push_back(part);
      parts_of_[i] |= PartSet{1} << bit;
    }
  }
}

std::vector<std::string> Redundancy::names(PartSet parts) const {
  std::vector<std::string> result;
  for (std::size_t bit = 0; bit < parts_.size(); ++bit)
    if ((parts >> bit & 1U) != 0) result.push_back(parts_[bit]);
  return result;
}

PartSet Redundancy::suspects(std::span<const std::array<std::uint8_t, 2>> pairs) const noexcept {
  if (pairs.empty()) return 0;
  PartSet common = ~PartSet{0};
  for (const auto& [first, second] : pairs) common &= parts_of_[first] | parts_of_[second];
  return common;
}

// The active-set method of Lawson and Hanson for min w'Sw with w >= 0 and sum 1: at the solution every
// source with a weight has the same gradient S w = var, and no other one has a smaller one.
void Redundancy::find_weights(std::span<const std::size_t> index, const Row& std_dev_Nm,
                              Row& weights) const noexcept {
  const std::size_t count = index.size();
  double smallest = std_dev_Nm[index[0]];
  std::size_t best = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (!(std_dev_Nm[index[i]] < smallest)) continue;
    smallest = std_dev_Nm[index[i]];
    best = i;
  }
  detail::SquareMatrix covariance{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const double left = std::min(std_dev_Nm[index[i]] / smallest, kLargestRatio);
      const double right = std::min(std_dev_Nm[index[j]] / smallest, kLargestRatio);
      covariance[i][j] = covariance[j][i] = left * correlation_[index[i]][index[j]] * right;
    }

  Row w{};
  w[best] = 1.0;
  std::array<std::size_t, kMaxSources> chosen{best};
  std::size_t chosen_count = 1;
  for (std::size_t round = 0; round < 3 * count; ++round) {
    double variance = 0.0;
    Row gradient{};
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) gradient[i] += covariance[i][j] * w[j];
      variance += w[i] * gradient[i];
    }
    std::size_t entering = count;
    double least = variance * (1.0 - 1e-12);
    for (std::size_t i = 0; i < count; ++i) {
      if (w[i] > 0.0 || !(gradient[i] < least)) continue;
      least = gradient[i];
      entering = i;
    }
    if (entering == count) break;
    chosen[chosen_count++] = entering;
    while (chosen_count > 0) {
      const Row x = detail::smallest_variance(covariance, std::span(chosen).first(chosen_count));
      // As far towards x as no weight becomes negative.
      double share = 1.0;
      for (std::size_t k = 0; k < chosen_count; ++k)
        if (!(x[k] > 0.0)) share = std::min(share, w[chosen[k]] / (w[chosen[k]] - x[k]));
      std::size_t kept = 0;
      for (std::size_t k = 0; k < chosen_count; ++k) {
        const std::size_t i = chosen[k];
        w[i] += share * (x[k] - w[i]);
        if (!(x[k] > 0.0) && !(w[i] > 1e-12)) w[i] = 0.0;
        if (w[i] > 0.0) chosen[kept++] = i;
      }
      const bool is_complete = share == 1.0 || kept == chosen_count;
      chosen_count = kept;
      if (is_complete) break;
    }
  }
  for (std::size_t i = 0; i < count; ++i) weights[index[i]] = w[i];
}

FusedTorque Redundancy::step(std::span<const Estimate> sources) noexcept {
  FusedTorque fused{.value_Nm = last_Nm_, .fault = Fault::input_not_finite};
  if (sources.size() != settings_.sources.size()) {
    fused.fault = Fault::input_count_wrong;
    return fused;
  }
  std::array<std::size_t, kMaxSources> index{};
  std::size_t count = 0;
  Row std_dev_Nm{};
  PartSet shared = ~PartSet{0};
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!is_valid(sources[i])) continue;
    index[count++] = i;
    std_dev_Nm[i] = sources[i].std_dev;
    fused.used |= SourceSet{1} << i;
    shared &= parts_of_[i];
  }
  if (count == 0) return fused;
  Row weights{};
  find_weights(std::span(index).first(count), std_dev_Nm, weights);
  double value_Nm = 0.0;
  double variance = 0.0;
  for (std::size_t a = 0; a < count; ++a) {
    const std::size_t i = index[a];
    value_Nm += weights[i] * sources[i].value;
    for (std::size_t b = 0; b < count; ++b) {
      const std::size_t j = index[b];
      variance += weights[i] * weights[j] * std_dev_Nm[i] * std_dev_Nm[j] * correlation_[i][j];
    }
  }
  fused.not_redundant = shared;
  if (!std::isfinite(value_Nm)) return fused;
  last_Nm_ = fused.value_Nm = value_Nm;
  fused.std_dev_Nm = std::sqrt(std::max(variance, 0.0));
  fused.fault = Fault::none;
  return fused;
}

}  // namespace torsio
