#include "data/mapping/uncertainty.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/quantity.hpp"
#include "core/trimmed.hpp"
#include "data/mapping/mapping_yaml.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLargestReading = 1e12;  // in the SI unit of the channel

constexpr std::array<std::string_view, 5> kEntries = {"class", "range", "gain", "mounting", "zero"};

/// What to write for a number without %, which may be percent (most classes are written so) or a share.
std::string advice_for(std::string_view number, std::string_view of, const std::string& place) {
  if (number.find_first_not_of("0123456789.") != std::string_view::npos) return "";
  return fmt::format("Write {}% for {} percent of the {}, or {:g}% for {} of it.", number, number,
                     of, 100.0 * si_quantity(number, "1", place), number);
}

/// "0.5%" as 0.5.
double percent(const YamlValue& value, std::string_view of) {
  const std::string text = value.text();
  const std::string_view all = trimmed(text);
  if (!all.ends_with('%'))
    value.refuse(fmt::format("a share of the {} in %, as 0.2%", of),
                 advice_for(all, of, value.place()));
  const double number = si_quantity(all.substr(0, all.size() - 1), "1", value.place());
  if (!(number >= 0.0 && number < 100.0))
    value.refuse(fmt::format("a share of the {}, from 0% to below 100%", of));
  return number;
}

double reading(const YamlValue& value, std::string_view si_unit) {
  const double number = quantity_with_unit(value.text(), si_unit, value.place());
  if (!(number <= kLargestReading))
    value.refuse(fmt::format("at most {:g} {}", kLargestReading, si_unit));
  return number;
}

UncertaintyRule rule_of(const std::string& name, const YamlValue& yaml) {
  if (std::ranges::find(kEntries, name) != kEntries.end())
    throw Error({.place = yaml.place(),
                 .problem = "the channel of the sensor is missing",
                 .found = name + ":",
                 .advice = "Name it before its entries:  uncertainty: {torque_Nm: {class: 0.2%, "
                           "range: 100Nm}}"});
  UncertaintyRule rule{.channel = si_channel_name(name, yaml.place())};
  const std::string unit(split_channel_name(rule.channel)->unit->si_suffix);
  yaml.allow_only(std::vector<std::string>(kEntries.begin(), kEntries.end()));
  const auto accuracy_class = yaml.find("class");
  const auto range = yaml.find("range");
  if (accuracy_class) rule.class_percent = percent(*accuracy_class, "range");
  if (range) rule.range = reading(*range, unit);
  if (range && !(rule.range > 0.0)) range->refuse("a range above 0");
  if (accuracy_class && !range)
    accuracy_class->refuse("the range of the sensor beside it",
                           fmt::format("A class is a share of the range:  class: {}, range: 100{}",
                                       accuracy_class->text(), unit));
  if (range && !accuracy_class) range->refuse("class: beside range:, as  class: 0.2%");
  if (const auto gain = yaml.find("gain")) rule.gain_percent = percent(*gain, "reading");
  if (const auto mounting = yaml.find("mounting"))
    rule.mounting_percent = percent(*mounting, "reading");
  if (const auto zero = yaml.find("zero")) rule.zero = reading(*zero, unit);
  if (!rule.combined().is_stated())
    yaml.refuse(
        fmt::format("a number above 0 for class: with range:, gain:, mounting: or zero:, as  "
                    "{{class: 0.2%, range: 100{0}, gain: 0.5%, zero: 0.1{0}}}",
                    unit));
  return rule;
}

}  // namespace

SensorUncertainty UncertaintyRule::combined() const noexcept {
  constexpr double kPercent = 0.01;
  return {.constant = std::hypot(kPercent * class_percent * range / std::numbers::sqrt3, zero),
          .relative = kPercent * std::hypot(gain_percent, mounting_percent)};
}

std::vector<UncertaintyRule> uncertainties_from(const YamlValue& yaml) {
  std::vector<UncertaintyRule> rules;
  for (const auto& [name, value] : yaml.entries()) {
    UncertaintyRule rule = rule_of(name, value);
    if (std::ranges::find(rules, rule.channel, &UncertaintyRule::channel) != rules.end())
      throw Error({.place = value.place(),
                   .problem = fmt::format("the uncertainty of {} is given twice", rule.channel)});
    rules.push_back(std::move(rule));
  }
  return rules;
}

std::vector<std::pair<std::string, std::string>> entries_of(const UncertaintyRule& rule) {
  const std::string unit(split_channel_name(rule.channel)->unit->si_suffix);
  std::vector<std::pair<std::string, std::string>> entries;
  const auto add = [&](const char* key, double value, const std::string& of) {
    if (value > 0.0) entries.emplace_back(key, fmt::format("{}{}", value, of));
  };
  add("class", rule.class_percent, "%");
  add("range", rule.range, unit);
  add("gain", rule.gain_percent, "%");
  add("mounting", rule.mounting_percent, "%");
  add("zero", rule.zero, unit);
  return entries;
}

}  // namespace torsio
