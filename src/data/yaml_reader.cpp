#include "data/yaml_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "data/byte_source.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestFile = std::size_t{1} << 20;

}  // namespace

YamlValue YamlValue::parse(std::string_view text, const std::string& file) {
  if (text.size() > kLongestFile)
    throw Error({.place = file,
                 .expected = fmt::format("a YAML file of at most {} bytes", kLongestFile),
                 .found = "a longer one"});
  try {
    return {YAML::Load(std::string(text)), file, {}};
  } catch (const YAML::Exception& problem) {
    throw Error({.place = fmt::format("{}: line {}, column {}", file, problem.mark.line + 1,
                                      problem.mark.column + 1),
                 .problem = "this is not YAML: " + problem.msg});
  }
}

YamlValue YamlValue::read(const std::string& path, const Progress& progress) {
  const auto source = open_bytes(path, progress);
  std::string text(kLongestFile + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const std::size_t got = source->read(text.data() + size, text.size() - size);
    if (got == 0) break;
    size += got;
  }
  return parse(std::string_view(text).substr(0, size), path);
}

std::string yaml_quoted(std::string_view text) {
  std::string all = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') all += '\\';
    all += c;
  }
  return all + '"';
}

YamlValue YamlValue::replaced(std::map<std::string, std::string> texts) const {
  return {node_, file_, path_,
          std::make_shared<const std::map<std::string, std::string>>(std::move(texts))};
}

std::string YamlValue::scalar() const {
  std::string text = node_.Scalar();
  if (!replacements_) return text;
  for (const auto& [name, replacement] : *replacements_) {
    const std::string placeholder = "{" + name + "}";
    for (std::size_t at = text.find(placeholder); at != std::string::npos;
         at = text.find(placeholder, at + replacement.size()))
      text.replace(at, placeholder.size(), replacement);
  }
  return text;
}

std::string YamlValue::place() const {
  const YAML::Mark mark = node_.Mark();
  std::string place = file_;
  if (!mark.is_null()) place += fmt::format(": line {}", mark.line + 1);
  if (!path_.empty()) place += fmt::format(" ({})", printable(path_));
  return place;
}

void YamlValue::refuse(const std::string& expected, const std::string& advice) const {
  std::string found = "nothing";
  if (node_.IsMap()) found = "a map";
  if (node_.IsSequence()) found = "a list";
  if (node_.IsScalar()) found = "'" + printable(node_.Scalar()) + "'";
  throw Error({.place = place(), .expected = expected, .found = found, .advice = advice});
}

std::vector<std::pair<std::string, YamlValue>> YamlValue::entries() const {
  if (!node_.IsMap()) refuse("keys with values, 'key: value'");
  std::vector<std::pair<std::string, YamlValue>> all;
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) refuse("keys that are plain text");
    std::string key = entry.first.Scalar();
    if (!seen.insert(key).second)
      throw Error({.place = YamlValue(entry.first, file_, path_).place(),
                   .problem = "the key '" + printable(key) + "' is given twice"});
    const std::string path = path_.empty() ? key : path_ + "." + key;
    all.emplace_back(std::move(key), YamlValue(entry.second, file_, path, replacements_));
  }
  return all;
}

void YamlValue::allow_only(std::initializer_list<std::string_view> keys) const {
  allow_only(std::vector<std::string>(keys.begin(), keys.end()));
}

void YamlValue::allow_only(std::span<const std::string> known) const {
  for (const auto& [key, value] : entries())
    if (std::ranges::find(known, key) == known.end())
      throw Error({.place = value.place(),
                   .problem = "unknown key '" + printable(key) + "'",
                   .expected = "one of " + joined(known),
                   .advice = did_you_mean(key, known)});
}

std::optional<YamlValue> YamlValue::find(std::string_view wanted) const {
  for (auto& [key, value] : entries())
    if (key == wanted) return value;
  return std::nullopt;
}

YamlValue YamlValue::at(std::string_view key) const {
  if (auto value = find(key)) return *value;
  throw Error({.place = place(), .problem = fmt::format("the key '{}' is missing", key)});
}

std::vector<YamlValue> YamlValue::items() const {
  if (node_.IsScalar()) return {*this};
  if (!node_.IsSequence()) refuse("a list");
  std::vector<YamlValue> all;
  for (const auto& item : node_)
    all.push_back(YamlValue(item, file_, fmt::format("{}[{}]", path_, all.size()), replacements_));
  return all;
}

std::vector<std::string> YamlValue::texts() const {
  std::vector<std::string> all;
  for (const YamlValue& item : items()) all.push_back(item.text());
  return all;
}

std::vector<std::string> YamlValue::texts_or_empty() const {
  std::vector<std::string> all;
  for (const YamlValue& item : items())
    all.push_back(item.is_scalar() && item.node_.Scalar().empty() ? std::string() : item.text());
  return all;
}

std::string YamlValue::text() const {
  if (!node_.IsScalar() || node_.Scalar().empty()) refuse("text");
  return scalar();
}

double YamlValue::number(std::string_view si_unit) const {
  if (!node_.IsScalar()) refuse("a number");
  return si_quantity(scalar(), si_unit, place());
}

double YamlValue::plain_number(double largest) const {
  const std::string written = text();
  double value = 0.0;
  const auto [end, error] = std::from_chars(written.data(), written.data() + written.size(), value);
  if (error != std::errc() || end != written.data() + written.size() ||
      !(std::abs(value) <= largest))
    refuse(fmt::format("a number of at most {:g} in size, without its unit", largest));
  return value;
}

double YamlValue::factor() const {
  if (!node_.IsScalar()) refuse("a number or a fraction such as 1/150");
  const std::string text = scalar();
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return number();
  const double numerator = si_quantity(text.substr(0, slash), "1", place());
  const double denominator = si_quantity(text.substr(slash + 1), "1", place());
  if (denominator == 0.0) refuse("a fraction whose denominator is not 0");
  return numerator / denominator;
}

double YamlValue::positive_number(std::string_view si_unit) const {
  const double value = number(si_unit);
  if (!(value > 0.0)) refuse("a positive number");
  return value;
}

std::size_t YamlValue::count() const {
  const double value = number();
  constexpr double kLargest = 1e9;
  if (!(value >= 0.0 && value <= kLargest) || value != std::trunc(value)) refuse("a whole number");
  return static_cast<std::size_t>(value);
}

bool YamlValue::boolean() const {
  bool value = false;
  if (!node_.IsScalar() || !YAML::convert<bool>::decode(node_, value)) refuse("true or false");
  return value;
}

}  // namespace torsio
