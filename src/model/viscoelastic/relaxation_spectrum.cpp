#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "model/viscoelastic/spring_dashpot_network.hpp"

namespace torsio {
namespace {

/// F(s) / s = a + sum_i g_i / (s + p_i), one pole at 0 if F relaxes to something.
struct Poles {
  double at_infinity = 0.0;
  std::vector<double> strength;  ///< g_i > 0
  std::vector<double> rate;      ///< p_i >= 0, rising
};

Poles poles_of(const RelaxationSpectrum& of) {
  Poles poles{.at_infinity = of.damping, .strength = {}, .rate = {}};
  if (of.stiffness > 0.0) {
    poles.strength.push_back(of.stiffness);
    poles.rate.push_back(0.0);
  }
  for (const RelaxationBranch& branch : of.branches) {
    poles.strength.push_back(branch.stiffness);
    poles.rate.push_back(branch.rate_1_s);
  }
  return poles;
}

/// F / s at s = -(rate of pole `origin` + offset); no cancellation, however near the pole.
double value_at(const Poles& poles, std::size_t origin, double offset) {
  double sum = poles.at_infinity;
  for (std::size_t i = 0; i < poles.rate.size(); ++i)
    sum += poles.strength[i] / ((poles.rate[i] - poles.rate[origin]) - offset);
  return sum;
}

/// The branch of s / F whose rate is the zero at that offset from a pole.
RelaxationBranch branch_at(const Poles& poles, std::size_t origin, double offset) {
  double slope = 0.0;
  for (std::size_t i = 0; i < poles.rate.size(); ++i) {
    const double gap = (poles.rate[i] - poles.rate[origin]) - offset;
    slope += poles.strength[i] / gap / gap;
  }
  const double rate_1_s = poles.rate[origin] + offset;
  return {.stiffness = 1.0 / (slope * rate_1_s), .rate_1_s = rate_1_s};
}

/// The zero at `origin` + `sign` * (low to high), where F / s rises with s falling; halved on a
/// logarithmic scale, since it may lie anywhere between.
double offset_of_zero(const Poles& poles, std::size_t origin, double sign, double low,
                      double high) {
  while (true) {
    const double middle = low * std::sqrt(high / low);
    if (!(middle > low && middle < high)) return sign * middle;
    const bool is_above = value_at(poles, origin, sign * middle) > 0.0;
    (is_above == (sign > 0.0) ? high : low) = middle;
  }
}

double sum_of(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = begin; i < end; ++i) sum += values[i];
  return sum;
}

/// The zero between pole j and the next.
RelaxationBranch branch_between(const Poles& poles, std::size_t j) {
  const double half = 0.5 * (poles.rate[j + 1] - poles.rate[j]);
  const std::size_t count = poles.rate.size();
  if (value_at(poles, j, half) > 0.0) {
    // g_j / offset = a + what the poles above give, each at least half the gap away
    const double most = poles.at_infinity + sum_of(poles.strength, j + 1, count) / half;
    return branch_at(poles, j, offset_of_zero(poles, j, 1.0, poles.strength[j] / most, half));
  }
  const double most = sum_of(poles.strength, 0, j + 1) / half;
  return branch_at(poles, j + 1,
                   offset_of_zero(poles, j + 1, -1.0, poles.strength[j + 1] / most, half));
}

/// s / F(s). The same again leads back.
RelaxationSpectrum dual(const RelaxationSpectrum& of) {
  const Poles poles = poles_of(of);
  const std::size_t count = poles.rate.size();
  const double all = sum_of(poles.strength, 0, count);
  RelaxationSpectrum result;
  if (of.damping == 0.0) result.damping = 1.0 / all;
  if (of.stiffness == 0.0) {
    double at_rest = of.damping;
    for (std::size_t i = 0; i < count; ++i) at_rest += poles.strength[i] / poles.rate[i];
    result.stiffness = 1.0 / at_rest;
  }
  for (std::size_t j = 0; j + 1 < count; ++j) result.branches.push_back(branch_between(poles, j));
  if (of.damping > 0.0 && count > 0) {
    const double low = poles.strength[count - 1] / of.damping;
    const double high = all / of.damping;
    const double offset = count == 1 ? low : offset_of_zero(poles, count - 1, 1.0, low, high);
    result.branches.push_back(branch_at(poles, count - 1, offset));
  }
  return result;
}

/// Operators add; branches of one rate are one.
RelaxationSpectrum sum_of(const std::vector<RelaxationSpectrum>& parts) {
  RelaxationSpectrum sum;
  std::vector<RelaxationBranch> all;
  for (const RelaxationSpectrum& part : parts) {
    sum.damping += part.damping;
    sum.stiffness += part.stiffness;
    all.insert(all.end(), part.branches.begin(), part.branches.end());
  }
  std::ranges::sort(all, {}, &RelaxationBranch::rate_1_s);
  constexpr double kSame = 8.0 * std::numeric_limits<double>::epsilon();
  for (const RelaxationBranch& branch : all) {
    const bool is_same =
        !sum.branches.empty() && branch.rate_1_s <= sum.branches.back().rate_1_s * (1.0 + kSame);
    if (is_same)
      sum.branches.back().stiffness += branch.stiffness;
    else
      sum.branches.push_back(branch);
  }
  return sum;
}

bool is_finite(const RelaxationSpectrum& spectrum) {
  return std::isfinite(spectrum.damping) && std::isfinite(spectrum.stiffness) &&
         std::ranges::all_of(spectrum.branches, [](const RelaxationBranch& branch) {
           return std::isfinite(branch.stiffness) && std::isfinite(branch.rate_1_s);
         });
}

std::string place_of(std::size_t node) { return fmt::format("network: node {}", node); }

void check_leaf(const SpringDashpotNetwork& network, std::size_t index) {
  const NetworkNode& node = network.nodes[index];
  if (!(node.value >= kSmallestElement && node.value <= kLargestElement))
    refuse(place_of(index),
           fmt::format("{} from {:g} to {:g}", node.name(), kSmallestElement, kLargestElement),
           node.value);
  for (std::size_t i = 0; i < index; ++i)
    if (network.nodes[i].is_leaf() && network.nodes[i].name() == node.name())
      refuse(place_of(index), "a name that is used only once", node.name());
}

}  // namespace

RelaxationSpectrum relaxation_spectrum(const SpringDashpotNetwork& network) {
  if (network.nodes.empty() || network.nodes.size() > kMaxNetworkNodes)
    throw Error({.place = "network",
                 .expected = fmt::format("1 to {} nodes", kMaxNetworkNodes),
                 .found = fmt::format("{}", network.nodes.size())});
  std::vector<RelaxationSpectrum> open;
  for (std::size_t i = 0; i < network.nodes.size(); ++i) {
    const NetworkNode& node = network.nodes[i];
    if (node.is_leaf()) {
      check_leaf(network, i);
      const bool is_spring = node.is(NetworkKind::spring);
      open.push_back({.damping = is_spring ? 0.0 : node.value,
                      .stiffness = is_spring ? node.value : 0.0,
                      .branches = {}});
      continue;
    }
    const bool is_series = node.is(NetworkKind::series);
    if (!is_series && !node.is(NetworkKind::parallel))
      refuse(place_of(i), "a spring, a dashpot, series or parallel",
             fmt::format("kind {}", node.kind));
    if (node.children < 2 || node.children > open.size())
      refuse(place_of(i), fmt::format("2 to {} networks to join", open.size()),
             fmt::format("{}", node.children));
    const auto first = open.end() - static_cast<std::ptrdiff_t>(node.children);
    std::vector<RelaxationSpectrum> parts(first, open.end());
    open.erase(first, open.end());
    if (is_series) std::ranges::transform(parts, parts.begin(), dual);
    RelaxationSpectrum joined = sum_of(parts);
    open.push_back(is_series ? dual(joined) : std::move(joined));
  }
  if (open.size() != 1)
    throw Error({.place = "network",
                 .expected = "one network",
                 .found = fmt::format("{} that nothing joins", open.size())});
  if (!is_finite(open.front()))
    throw Error({.place = "network", .problem = "its values lie too far apart for a double"});
  return std::move(open.front());
}

}  // namespace torsio
