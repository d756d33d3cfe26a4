#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/did_you_mean.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr const char* kPlace = "--want";

std::string unit_of(const std::string& name) {
  const auto parts = split_channel_name(name);
  return parts ? std::string(parts->unit->si_suffix) : "1";
}

/// The SI name of the conditions of all recordings.
std::vector<std::string> condition_names(const Dataset& dataset) {
  std::vector<std::string> names;
  for (const DatasetRecord& record : dataset.records)
    for (const std::string& name : record.recording.conditions())
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  return names;
}

}  // namespace

WantedRange parse_wanted(const std::string& text, const Dataset& dataset, const FeatureSpec& spec) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw UsageError({.place = kPlace,
                      .expected = "QUANTITY=LOWEST:HIGHEST, as input=-3deg:3deg",
                      .found = text});
  std::string name = text.substr(0, equals);
  const std::string range = text.substr(equals + 1);
  const std::string input_unit = unit_of(spec.inputs.front());
  std::string unit;
  std::string written;  // the unit of a bare number
  if (name == "input") {
    unit = input_unit;
  } else if (name == "frequency") {
    unit = "Hz";
  } else if (name == "speed") {
    unit = input_unit == "1" ? "1_s" : input_unit + "_s";
    if (find_unit(unit) == nullptr) unit = "1";
  } else {
    const std::vector<std::string> conditions = condition_names(dataset);
    const auto parts = split_channel_name(name);
    const std::string si = parts ? parts->si() : name;
    if (std::ranges::find(conditions, si) == conditions.end()) {
      std::vector<std::string> known{"input", "frequency", "speed"};
      known.insert(known.end(), conditions.begin(), conditions.end());
      throw UsageError({.place = kPlace,
                        .expected = fmt::format("one of {}", fmt::join(known, ", ")),
                        .found = name,
                        .advice = did_you_mean(name, known)});
    }
    unit = parts->unit->si_suffix;
    written = parts->unit->suffix;
    name = si;
  }
  // A bare number has the unit that the name is written with.
  const auto number = [&](std::string part) {
    if (!written.empty() && part.find_first_not_of("0123456789.+-eE ") == std::string::npos)
      part += written;
    return si_quantity(part, unit, kPlace);
  };
  const std::size_t colon = range.find(':');
  if (colon == std::string::npos && name != "speed")
    throw UsageError({.place = std::string(kPlace) + " " + name,
                      .expected = "a range LOWEST:HIGHEST",
                      .found = range});
  WantedRange wanted{
      .quantity = name,
      .lowest = colon == std::string::npos ? 0.0 : number(range.substr(0, colon)),
      .highest = number(colon == std::string::npos ? range : range.substr(colon + 1))};
  const bool needs_positive = name == "frequency";
  if (!(wanted.lowest < wanted.highest) || !std::isfinite(wanted.lowest) ||
      !std::isfinite(wanted.highest) || (needs_positive && !(wanted.lowest > 0.0)))
    throw UsageError({.place = std::string(kPlace) + " " + name,
                      .expected = needs_positive ? "0 < LOWEST < HIGHEST" : "LOWEST < HIGHEST",
                      .found = range});
  return wanted;
}

}  // namespace torsio
