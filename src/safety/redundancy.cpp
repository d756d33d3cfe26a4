#include "torsio/safety/redundancy.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "error_correlation.hpp"
#include "own_names.hpp"
#include "torsio/core/error.hpp"
#include "valid_source.hpp"

namespace torsio {
namespace {

void check_sources(const std::vector<TorqueSource>& sources) {
  if (sources.empty() || sources.size() > Redundancy::kMaxSources)
    throw Error({.place = "redundancy",
                 .expected = fmt::format("1 to {} sources", Redundancy::kMaxSources),
                 .found = fmt::format("{}", sources.size())});
  const auto name_of = [](const TorqueSource& source) -> const std::string& { return source.name; };
  if (const std::string* name = detail::first_not_own(sources, name_of))
    throw Error({.place = "redundancy",
                 .expected = "sources with names of their own",
                 .found = fmt::format("'{}'", *name)});
}

void check_factors(const RedundancySettings& settings) {
  const std::vector<double>& factors = settings.error_bar_factors;
  if (factors.empty()) return;
  constexpr double kLargest = 1e6;
  const auto is_usable = [](double factor) { return factor >= 1.0 && factor <= kLargest; };
  if (factors.size() == settings.sources.size() && std::ranges::all_of(factors, is_usable)) return;
  throw Error(
      {.place = "redundancy: error_bar_factors",
       .expected = fmt::format("{} numbers from 1 to {:g}", settings.sources.size(), kLargest),
       .found = fmt::format("{}", fmt::join(factors, ", "))});
}

}  // namespace

Redundancy::Redundancy(const RedundancySettings& settings) : settings_(settings) {
  check_sources(settings.sources);
  check_factors(settings);
  factors_.fill(1.0);
  std::ranges::copy(settings.error_bar_factors, factors_.begin());
  correlation_ =
      detail::error_correlation(settings.correlation, settings.sources.size(), "redundancy");
  inverses_ = detail::inverses(correlation_, settings.sources.size());
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

// With p_i = s_min / s_i and u_i = w_i / p_i the weights minimise u'Ru under u >= 0 and p'u = 1,
// where no number is large: an error bar may have any size, and the inverses of R are computed
// beforehand. An active-set method (Lawson & Hanson 1974): at the solution Ru = var p for every
// source with a weight, and Ru >= var p for every other one. It begins with the solution without
// correlation.

double Redundancy::minimise_over(SourceSet& chosen, const Row& precision, Row& u) const noexcept {
  const std::size_t count = settings_.sources.size();
  while (true) {
    const double* inverse = &inverses_[chosen * count * count];
    Row least{};
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) least[i] += inverse[i * count + j] * precision[j];
      sum += precision[i] * least[i];
    }
    const double variance = 1.0 / sum;
    double share = 1.0;
    SourceSet limiting = 0;
    for (std::size_t i = 0; i < count; ++i) {
      least[i] *= variance;
      const double reach = least[i] < 0.0 ? u[i] / (u[i] - least[i]) : 1.0;
      if (!(reach < share)) continue;
      share = reach;
      limiting = SourceSet{1} << i;
    }
    if (limiting == 0) {
      u = least;
      return variance;
    }
    // As far as no weight becomes negative; the source whose weight ends at 0 is no longer chosen.
    chosen &= ~limiting;
    for (std::size_t i = 0; i < count; ++i)
      u[i] = (chosen >> i & 1U) != 0 ? u[i] + share * (least[i] - u[i]) : 0.0;
  }
}

SourceSet Redundancy::entering(SourceSet others, const Row& precision, const Row& u,
                               double variance) const noexcept {
  const std::size_t count = settings_.sources.size();
  SourceSet best = 0;
  double least = -1e-9 * std::sqrt(variance);
  for (std::size_t i = 0; i < count; ++i) {
    double slope = -variance * precision[i];
    for (std::size_t j = 0; j < count; ++j) slope += correlation_[i][j] * u[j];
    if ((others >> i & 1U) == 0 || !(slope < least)) continue;
    least = slope;
    best = SourceSet{1} << i;
  }
  return best;
}

double Redundancy::minimise(SourceSet valid, const Row& precision, Row& u) const noexcept {
  double square = 0.0;
  for (const double p : precision) square += p * p;
  for (std::size_t i = 0; i < kMaxSources; ++i) u[i] = precision[i] / square;
  SourceSet chosen = valid;
  double variance = kNotMeasured;
  // Bounded: rounding could otherwise let one source enter and leave again without end.
  for (std::size_t rounds = 3 * kMaxSources; rounds > 0;) {
    variance = minimise_over(chosen, precision, u);
    const SourceSet next = chosen == valid ? 0 : entering(valid & ~chosen, precision, u, variance);
    chosen |= next;
    rounds = next == 0 ? 0 : rounds - 1;
  }
  return variance;
}

// var(t_i - tau) = S_ii - 2 (S w)_i + w' S w. Divided by the smallest error bar squared, so that no square
// overflows.
double Redundancy::disagreement_Nm(std::span<const Estimate> sources, const FusedTorque& fused,
                                   const Row& std_dev_Nm, double smallest_Nm,
                                   const Row& u) const noexcept {
  const double combined = fused.std_dev_Nm / smallest_Nm;
  double largest_Nm = 0.0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if ((fused.used >> i & 1U) == 0) continue;
    double common = 0.0;
    for (std::size_t j = 0; j < sources.size(); ++j) common += correlation_[i][j] * u[j];
    const double own = std_dev_Nm[i] / smallest_Nm;
    const double expected_Nm =
        smallest_Nm * std::sqrt(std::max(0.0, own * (own - 2.0 * common) + combined * combined));
    const double found_Nm = std::abs(sources[i].value - fused.value_Nm);
    if (found_Nm > expected_Nm)
      largest_Nm = std::max(largest_Nm,
                            std::sqrt(found_Nm - expected_Nm) * std::sqrt(found_Nm + expected_Nm));
  }
  return largest_Nm;
}

FusedTorque Redundancy::step(std::span<const Estimate> sources) noexcept {
  FusedTorque fused{.value_Nm = last_Nm_, .fault = Fault::input_not_finite};
  if (sources.size() != settings_.sources.size()) {
    fused.fault = Fault::input_count_wrong;
    return fused;
  }
  PartSet shared = ~PartSet{0};
  double smallest_Nm = std::numeric_limits<double>::infinity();
  Row std_dev_Nm{};
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!detail::is_valid(sources[i])) continue;
    fused.used |= SourceSet{1} << i;
    shared &= parts_of_[i];
    // The largest number in place of infinity: the product of two finite numbers.
    std_dev_Nm[i] = std::min(factors_[i] * sources[i].std_dev, std::numeric_limits<double>::max());
    smallest_Nm = std::min(smallest_Nm, std_dev_Nm[i]);
  }
  if (fused.used == 0) return fused;
  Row precision{};
  Row u{};
  double lowest_Nm = std::numeric_limits<double>::infinity();
  double highest_Nm = -lowest_Nm;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if ((fused.used >> i & 1U) == 0) continue;
    precision[i] = smallest_Nm / std_dev_Nm[i];
    lowest_Nm = std::min(lowest_Nm, sources[i].value);
    highest_Nm = std::max(highest_Nm, sources[i].value);
  }
  const double variance = minimise(fused.used, precision, u);
  double value_Nm = 0.0;
  for (std::size_t i = 0; i < sources.size(); ++i)
    if ((fused.used >> i & 1U) != 0) value_Nm += precision[i] * u[i] * sources[i].value;
  // Between the estimates in spite of rounding; in this order a number in every case.
  last_Nm_ = fused.value_Nm = std::min(std::max(lowest_Nm, value_Nm), highest_Nm);
  fused.std_dev_Nm = smallest_Nm * std::sqrt(variance);
  fused.std_dev_Nm =
      std::hypot(fused.std_dev_Nm, disagreement_Nm(sources, fused, std_dev_Nm, smallest_Nm, u));
  fused.not_redundant = shared;
  fused.fault = Fault::none;
  return fused;
}

}  // namespace torsio
