#include "torsio/fit/common/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "core/checks.hpp"
#include "core/did_you_mean.hpp"
#include "fit/common/option_fields.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::string_view kAuto = "auto";

template <class Number>
bool read(std::string_view text, Number& number) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  return code == std::errc() && end == text.data() + text.size();
}

std::string written(double number) {
  std::array<char, 32> text{};
  const auto [end, code] = std::to_chars(text.begin(), text.end(), number);
  return {text.data(), end};
}

bool takes_auto(const OptionInfo& option) {
  return option.takes_auto || option.default_value == kAuto;
}

std::string expected_of(const OptionInfo& option) {
  const std::string range = " from " + written(option.minimum) + " to " + written(option.maximum);
  const std::string or_auto = takes_auto(option) ? " or auto" : "";
  switch (option.kind) {
    case OptionInfo::Kind::number: return "a number" + range + or_auto;
    case OptionInfo::Kind::integer: return "a whole number" + range + or_auto;
    case OptionInfo::Kind::boolean: return "true or false";
    case OptionInfo::Kind::choice: return fmt::format("one of {}", fmt::join(option.choices, ", "));
    case OptionInfo::Kind::text: break;
  }
  return "text";
}

bool is_valid(const OptionInfo& option, std::string_view text) {
  if (option.kind == OptionInfo::Kind::text) return true;
  if (option.kind == OptionInfo::Kind::boolean) return text == "true" || text == "false";
  if (option.kind == OptionInfo::Kind::choice)
    return std::ranges::find(option.choices, text) != option.choices.end();
  if (text == kAuto && takes_auto(option)) return true;
  double number = 0.0;
  if (option.kind == OptionInfo::Kind::integer) {
    std::size_t whole = 0;
    if (!read(text, whole)) return false;
    number = static_cast<double>(whole);
  } else if (!read(text, number)) {
    return false;
  }
  return number >= option.minimum && number <= option.maximum;  // false for NaN
}

std::string names_of(std::span<const OptionInfo> options) {
  std::string list;
  for (const OptionInfo& option : options) {
    if (!list.empty()) list += ", ";
    list += option.name;
  }
  return list.empty() ? "no option at all" : "one of " + list;
}

[[noreturn]] void refuse_option(const OptionInfo& option, std::string_view expected,
                                std::string_view found) {
  refuse<UsageError>(fmt::format("option {}", option.name), expected, fmt::format("\"{}\"", found));
}

}  // namespace

std::string range_of(const OptionInfo& option) {
  if (option.kind == OptionInfo::Kind::choice)
    return fmt::format(" ({})", fmt::join(option.choices, ", "));
  if (!(option.minimum < option.maximum)) return {};
  return fmt::format(" ({:g} to {:g})", option.minimum, option.maximum);
}

Options::Options(std::span<const OptionInfo> known,
                 const std::map<std::string, std::string>& given) {
  for (const OptionInfo& option : known) values_.emplace(option.name, option.default_value);
  for (const auto& [option_name, value] : given) {
    const auto option = std::ranges::find(known, option_name, &OptionInfo::name);
    if (option == known.end()) {
      std::vector<std::string_view> names;
      for (const OptionInfo& each : known) names.push_back(each.name);
      throw UsageError({.problem = "unknown option \"" + option_name + '"',
                        .expected = names_of(known),
                        .advice = did_you_mean(option_name, names)});
    }
    if (!is_valid(*option, value)) refuse_option(*option, expected_of(*option), value);
    values_.find(option_name)->second = value;
  }
}

const std::string& Options::text(std::string_view name) const {
  const auto value = values_.find(name);
  if (value == values_.end())
    throw Error({.problem = "no option is called \"" + std::string(name) + '"'});
  return value->second;
}

double Options::number(std::string_view name) const {
  double number = kNotMeasured;
  const std::string& value = text(name);
  if (value != kAuto) read(value, number);
  return number;
}

std::size_t Options::integer(std::string_view name) const {
  std::size_t number = 0;
  read(text(name), number);
  return number;
}

bool Options::boolean(std::string_view name) const { return text(name) == "true"; }

namespace detail {

std::string option_text(bool value) { return value ? "true" : "false"; }
std::string option_text(double value) {
  return std::isnan(value) ? std::string(kAuto) : written(value);
}
std::string option_text(std::size_t value) { return fmt::format("{}", value); }
std::string option_text(const std::string& value) { return value; }
std::string option_text(const std::optional<std::size_t>& value) {
  return value ? option_text(*value) : std::string(kAuto);
}
std::string option_text(const std::vector<std::size_t>& value) {
  return fmt::format("{}", fmt::join(value, "-"));
}
std::string option_text(const std::optional<NineNumbers>& value) {
  return value ? fmt::format("{}", fmt::join(*value, "/")) : std::string();
}

void read_option(std::string_view text, const OptionInfo& /*stated*/, bool& value) {
  value = text == "true";
}
void read_option(std::string_view text, const OptionInfo& /*stated*/, double& value) {
  value = kNotMeasured;
  if (text != kAuto) read(text, value);
}
void read_option(std::string_view text, const OptionInfo& /*stated*/, std::size_t& value) {
  read(text, value);
}
void read_option(std::string_view text, const OptionInfo& /*stated*/, std::string& value) {
  value = text;
}
void read_option(std::string_view text, const OptionInfo& /*stated*/,
                 std::optional<std::size_t>& value) {
  value.reset();
  if (text != kAuto) read(text, value.emplace());
}

void read_option(std::string_view text, const OptionInfo& stated, std::vector<std::size_t>& value) {
  value.clear();
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    const auto [next, failure] = std::from_chars(at, end, value.emplace_back());
    const bool goes_on = next != end && (*next == '-' || *next == ',') && next + 1 != end;
    if (failure != std::errc{} || (next != end && !goes_on))
      refuse_option(stated, "numbers of units with - between them: 50-20-10", text);
    at = goes_on ? next + 1 : next;
  }
}

void read_option(std::string_view text, const OptionInfo& stated,
                 std::optional<NineNumbers>& value) {
  value.reset();
  if (text.empty()) return;
  NineNumbers& numbers = value.emplace();
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t j = 0; j < numbers.size(); ++j) {
    const auto [next, code] = std::from_chars(at, end, numbers[j]);
    const bool is_last = j + 1 == numbers.size();
    if (code != std::errc() || (is_last ? next != end : next == end || *next != '/'))
      refuse_option(stated, "nine numbers joined by /", text);
    at = next + (is_last ? 0 : 1);
  }
}

std::size_t chosen(std::string_view text, const OptionInfo& stated) {
  const auto at = std::ranges::find(stated.choices, text);
  if (at == stated.choices.end()) refuse_option(stated, expected_of(stated), text);
  return static_cast<std::size_t>(at - stated.choices.begin());
}

}  // namespace detail

}  // namespace torsio
