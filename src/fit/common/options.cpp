#include "torsio/fit/common/options.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "torsio/core/did_you_mean.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/not_measured.hpp"

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

std::string expected_of(const OptionInfo& option) {
  const std::string range = " from " + written(option.minimum) + " to " + written(option.maximum);
  const std::string or_auto = option.default_value == kAuto ? " or auto" : "";
  switch (option.kind) {
    case OptionInfo::Kind::number: return "a number" + range + or_auto;
    case OptionInfo::Kind::integer: return "a whole number" + range + or_auto;
    case OptionInfo::Kind::boolean: return "true or false";
    case OptionInfo::Kind::text: break;
  }
  return "text";
}

bool is_valid(const OptionInfo& option, std::string_view text) {
  if (option.kind == OptionInfo::Kind::text) return true;
  if (option.kind == OptionInfo::Kind::boolean) return text == "true" || text == "false";
  if (text == kAuto && option.default_value == kAuto) return true;
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

}  // namespace

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
    if (!is_valid(*option, value))
      throw UsageError({.place = "option " + option_name,
                        .expected = expected_of(*option),
                        .found = '"' + value + '"'});
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

}  // namespace torsio
