#include "ring_constraint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, 8> kNames{
    "outer_radius", "inner_radius", "wall", "length", "volume", "stress", "strain", "stiffness"};

double value_of(std::string_view name, const RubberRing& ring, const RubberSpringDemand& demand) {
  const double modulus_Pa = demand.correction * demand.shear_modulus_Pa;
  if (name == "outer_radius") return ring.outer_m;
  if (name == "inner_radius") return ring.inner_m;
  if (name == "wall") return ring.outer_m - ring.inner_m;
  if (name == "length") return ring.length_m;
  if (name == "volume")
    return std::numbers::pi * (ring.outer_m * ring.outer_m - ring.inner_m * ring.inner_m) *
           ring.length_m;
  if (name == "stress") return shear_stress(ring, demand.torque_Nm);
  if (name == "strain") return shear_stress(ring, demand.torque_Nm) / modulus_Pa;
  return stiffness(ring, modulus_Pa);
}

/// "larger - smaller" of the text.
std::string difference_in(const std::string& text) {
  const std::size_t at = text.find_first_of("<>");
  if (at == std::string::npos || at + 1 >= text.size() || text[at + 1] != '=' ||
      text.find_first_of("<>=", at + 2) != std::string::npos)
    throw UsageError({.place = "--constraint",
                      .expected =
                          "two expressions with <= or >= between them, as in 'length <= 0.6 "
                          "* outer_radius'",
                      .found = "'" + text + "'"});
  const std::string left = text.substr(0, at);
  const std::string right = text.substr(at + 2);
  return text[at] == '<' ? "(" + right + ") - (" + left + ")" : "(" + left + ") - (" + right + ")";
}

FeaturePipeline parsed(const std::string& text) {
  try {
    return FeaturePipeline({.inputs = {difference_in(text)}, .definitions = {}}, 1.0);
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    throw UsageError({.place = "--constraint '" + text + "'", .problem = error.what()});
  }
}

}  // namespace

RingConstraint::RingConstraint(const std::string& text) : text_(text), difference_(parsed(text)) {
  for (const std::string& name : difference_.raw_inputs()) {
    if (std::ranges::find(kNames, name) == kNames.end())
      throw UsageError({.place = "--constraint '" + text + "'",
                        .expected = "outer_radius, inner_radius, wall, length, volume, stress, "
                                    "strain or stiffness",
                        .found = name,
                        .advice = did_you_mean(name, kNames)});
  }
  if (difference_.settling_samples() > 0 || !difference_.is_settled())
    throw UsageError({.place = "--constraint '" + text + "'",
                      .expected = "an expression without rate, lag and filters"});
  values_.resize(difference_.raw_inputs().size());
}

double RingConstraint::slack(const RubberRing& ring, const RubberSpringDemand& demand) {
  for (std::size_t i = 0; i < values_.size(); ++i)
    values_[i] = value_of(difference_.raw_inputs()[i], ring, demand);
  const double found = difference_.step(values_)[0];
  return std::isnan(found) ? -std::numeric_limits<double>::infinity() : found;
}

}  // namespace torsio
