#include "torsio/safety/redundancy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "error_correlation.hpp"
#include "torsio/core/error.hpp"
#include "valid_source.hpp"

namespace torsio {
namespace {

/// An error bar of more than so many times the smallest one has no weight.
constexpr double kLargestRatio = 1e100;

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

}  // namespace

Redundancy::Redundancy(const RedundancySettings& settings) : settings_(settings) {
  check_sources(settings.sources);
  correlation_ =
      detail::error_correlation(settings.correlation, settings.sources.size(), "redundancy");
  for (std::size_t i = 0; i < settings.sources.size(); ++i) {
    for (const std::string& part : settings.sources[i].depends_on) {
      if (part.empty())
        throw Error({.place = "redundancy",
                     .expected = "parts with names",
                     .found = fmt::format("a part of '{}' without one", settings.sources[i].name)});
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

namespace {

using Row = std::array<double, Redundancy::kMaxSources>;

/// The weights and the sources that may have one.
struct Weights {
  Row of{};
  std::array<std::size_t, Redundancy::kMaxSources> chosen{};
  std::size_t chosen_count = 0;
};

/// Moves the weights of the chosen sources to those of the smallest variance. A source whose weight
/// would become negative on the way loses it and is no longer chosen.
void minimise_over_chosen(const detail::SquareMatrix& covariance, Weights& weights) noexcept {
  std::size_t limiting = 0;
  do {
    const std::size_t count = weights.chosen_count;
    const Row least = detail::smallest_variance(covariance, std::span(weights.chosen).first(count));
    double share = 1.0;
    limiting = count;
    for (std::size_t k = 0; k < count; ++k) {
      const double weight = weights.of[weights.chosen[k]];
      const double reach = least[k] < 0.0 ? weight / (weight - least[k]) : 1.0;
      if (!(reach < share)) continue;
      share = reach;
      limiting = k;
    }
    for (std::size_t k = 0; k < count; ++k) {
      double& weight = weights.of[weights.chosen[k]];
      weight += share * (least[k] - weight);
    }
    if (limiting == count) return;
    weights.of[weights.chosen[limiting]] = 0.0;
    std::copy(weights.chosen.begin() + static_cast<std::ptrdiff_t>(limiting) + 1,
              weights.chosen.begin() + static_cast<std::ptrdiff_t>(count),
              weights.chosen.begin() + static_cast<std::ptrdiff_t>(limiting));
    --weights.chosen_count;
  } while (true);
}

/// @returns the source that is not chosen and whose weight would reduce the variance most; `count`: none
std::size_t entering(const detail::SquareMatrix& covariance, std::size_t count,
                     const Weights& weights) noexcept {
  std::array<bool, Redundancy::kMaxSources> is_chosen{};
  double variance = 0.0;
  Row gradient{};
  for (std::size_t k = 0; k < weights.chosen_count; ++k) is_chosen[weights.chosen[k]] = true;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) gradient[i] += covariance[i][j] * weights.of[j];
    variance += weights.of[i] * gradient[i];
  }
  std::size_t best = count;
  double least = variance * (1.0 - 1e-9);
  for (std::size_t i = 0; i < count; ++i) {
    if (is_chosen[i] || !(gradient[i] < least)) continue;
    least = gradient[i];
    best = i;
  }
  return best;
}

/// The weights of the smallest variance by an active-set method (Lawson & Hanson 1974, for w'Sw with
/// w >= 0 and sum 1): at the solution every source with a weight has the same gradient, and no other
/// source has a smaller one. It begins with the weights that are the solution without correlation.
Row smallest_weights(const detail::SquareMatrix& covariance, std::size_t count) noexcept {
  Weights weights{.chosen_count = count};
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    weights.chosen[i] = i;
    weights.of[i] = 1.0 / covariance[i][i];
    sum += weights.of[i];
  }
  for (std::size_t i = 0; i < count; ++i) weights.of[i] /= sum;
  // Bounded: rounding could otherwise let one source enter and leave again without end.
  for (std::size_t rounds = 3 * count; rounds > 0;) {
    minimise_over_chosen(covariance, weights);
    const std::size_t next = entering(covariance, count, weights);
    rounds = next < count ? rounds - 1 : 0;
    if (next < count) weights.chosen[weights.chosen_count++] = next;
  }
  return weights.of;
}

}  // namespace

FusedTorque Redundancy::step(std::span<const Estimate> sources) noexcept {
  FusedTorque fused{.value_Nm = last_Nm_, .fault = Fault::input_not_finite};
  if (sources.size() != settings_.sources.size()) {
    fused.fault = Fault::input_count_wrong;
    return fused;
  }
  PartSet shared = ~PartSet{0};
  double smallest_Nm = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!detail::is_valid(sources[i])) continue;
    fused.used |= SourceSet{1} << i;
    shared &= parts_of_[i];
    smallest_Nm = std::min(smallest_Nm, sources[i].std_dev);
  }
  if (fused.used == 0) return fused;
  // In units of the smallest error bar: no square overflows or becomes 0.
  std::array<std::size_t, kMaxSources> index{};
  Row ratio{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if ((fused.used >> i & 1U) == 0 || !(sources[i].std_dev / smallest_Nm <= kLargestRatio))
      continue;
    ratio[count] = sources[i].std_dev / smallest_Nm;
    index[count++] = i;
  }
  detail::SquareMatrix covariance{};
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b)
      covariance[a][b] = ratio[a] * correlation_[index[a]][index[b]] * ratio[b];
  const Row weights = smallest_weights(covariance, count);
  double value_Nm = 0.0;
  double variance = 0.0;
  double lowest_Nm = std::numeric_limits<double>::infinity();
  double highest_Nm = -lowest_Nm;
  for (std::size_t a = 0; a < count; ++a) {
    const double source_Nm = sources[index[a]].value;
    value_Nm += weights[a] * source_Nm;
    lowest_Nm = std::min(lowest_Nm, source_Nm);
    highest_Nm = std::max(highest_Nm, source_Nm);
    for (std::size_t b = 0; b < count; ++b) variance += weights[a] * weights[b] * covariance[a][b];
  }
  // Between the estimates in spite of rounding; in this order a number in every case.
  last_Nm_ = fused.value_Nm = std::min(std::max(lowest_Nm, value_Nm), highest_Nm);
  fused.std_dev_Nm = smallest_Nm * std::sqrt(variance);
  fused.not_redundant = shared;
  fused.fault = Fault::none;
  return fused;
}

}  // namespace torsio
