#include "data/ros/ros_schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <utility>

#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxTypes = 256;
constexpr std::size_t kMaxFields = 1024;
constexpr std::size_t kDeepest = 16;
constexpr std::string_view kTime = "builtin_interfaces/Time";

constexpr std::array<std::pair<std::string_view, RosKind>, 14> kNames{
    {{"bool", RosKind::boolean},
     {"byte", RosKind::uint8},
     {"char", RosKind::uint8},
     {"int8", RosKind::int8},
     {"uint8", RosKind::uint8},
     {"int16", RosKind::int16},
     {"uint16", RosKind::uint16},
     {"int32", RosKind::int32},
     {"uint32", RosKind::uint32},
     {"int64", RosKind::int64},
     {"uint64", RosKind::uint64},
     {"float32", RosKind::float32},
     {"float64", RosKind::float64},
     {"string", RosKind::text}}};

std::optional<RosKind> kind_named(std::string_view name) {
  const auto* at = std::ranges::find(kNames, name, &std::pair<std::string_view, RosKind>::first);
  return at == kNames.end() ? std::nullopt : std::optional(at->second);
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// "geometry_msgs/msg/Pose" and "geometry_msgs/Pose" are the same.
std::string short_name(std::string_view name) {
  std::string text(name);
  if (const auto at = text.find("/msg/"); at != std::string::npos) text.erase(at, 4);
  return text;
}

class Parser {
 public:
  explicit Parser(std::string place) : place_(std::move(place)) {}

  RosSchema parse(std::string_view name, std::string_view text) {
    schema_.types.push_back({short_name(name), {}});
    nested_.emplace_back();
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      add_line(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    for (std::size_t i = 0; i < schema_.types.size(); ++i) resolve(i);
    check_depth(0, 0);
    return std::move(schema_);
  }

 private:
  [[noreturn]] void refuse(const std::string& problem, std::string_view found) const {
    throw Error({.place = place_,
                 .problem = problem,
                 .expected = "the definition of a ROS message",
                 .found = "'" + printable(found) + "'"});
  }

  void add_line(std::string_view line) {
    constexpr std::string_view kNext = "MSG:";
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty() || line.find_first_not_of('=') == std::string_view::npos) return;
    if (line.starts_with(kNext)) {
      if (schema_.types.size() >= kMaxTypes) refuse("too many types", line);
      schema_.types.push_back({short_name(trimmed(line.substr(kNext.size()))), {}});
      nested_.emplace_back();
      return;
    }
    const std::size_t space = line.find_first_of(" \t");
    if (space == std::string_view::npos) refuse("a field without name", line);
    const std::string_view rest = trimmed(line.substr(space));
    const std::size_t name_end = std::min(rest.find_first_of(" \t="), rest.size());
    const std::string_view after = trimmed(rest.substr(name_end));
    if (after.starts_with('=')) return;  // a constant
    const std::string_view name = rest.substr(0, name_end);
    const auto is_of_name = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
    if (name.empty() || !std::ranges::all_of(name, is_of_name)) refuse("a name of a field", line);
    add_field(line.substr(0, space), name);
  }

  void add_field(std::string_view type, std::string_view name) {
    RosField field{.name = std::string(name)};
    if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos) {
      const std::string_view size = type.substr(bracket + 1, type.size() - bracket - 2);
      if (type.back() != ']') refuse("an array without ]", type);
      field.count = RosField::Count::sequence;
      if (!size.empty() && !size.starts_with("<=")) {
        field.count = RosField::Count::fixed;
        const auto [end, code] =
            std::from_chars(size.data(), size.data() + size.size(), field.size);
        if (code != std::errc{} || end != size.data() + size.size())
          refuse("an array of unknown size", type);
      }
      type = type.substr(0, bracket);
    }
    type = type.substr(0, type.find("<="));                  // the limit of a text
    if (type == "time" || type == "duration") type = kTime;  // a word of ROS 1
    if (type == "wstring") refuse("wide texts are not supported", name);
    if (schema_.types.back().fields.size() >= kMaxFields) refuse("too many fields", name);
    const auto kind = kind_named(type);
    field.kind = kind.value_or(RosKind::nested);
    schema_.types.back().fields.push_back(std::move(field));
    nested_.back().emplace_back(kind ? std::string() : short_name(type));
  }

  /// Finds the types by name: with their package, or in that of the message that has the field.
  void resolve(std::size_t type) {
    const std::string own = schema_.types[type].name;
    const std::string package = own.substr(0, own.find('/') + 1);
    for (std::size_t i = 0; i < schema_.types[type].fields.size(); ++i) {
      const std::string& wanted = nested_[type][i];
      if (wanted.empty()) continue;
      const auto find = [&](const std::string& name) {
        return std::ranges::find(schema_.types, name, &RosType::name);
      };
      auto found = find(wanted);
      if (found == schema_.types.end()) found = find(package + wanted);
      if (found == schema_.types.end() && wanted == "Header") found = find("std_msgs/Header");
      if (found == schema_.types.end() && is_time(wanted)) found = added_time(wanted);
      if (found == schema_.types.end()) refuse("a type that the schema does not define", wanted);
      schema_.types[type].fields[i].type = static_cast<std::size_t>(found - schema_.types.begin());
    }
  }

  static bool is_time(std::string_view name) {
    return name == kTime || name == "builtin_interfaces/Duration";
  }
  /// The times of ROS need no definition.
  std::vector<RosType>::iterator added_time(const std::string& name) {
    schema_.types.push_back(
        {name,
         {{.name = "sec", .kind = RosKind::int32}, {.name = "nanosec", .kind = RosKind::uint32}}});
    nested_.push_back({"", ""});
    return schema_.types.end() - 1;
  }

  void check_depth(std::size_t type, std::size_t depth) {
    if (depth > kDeepest) refuse("types nested too deeply", schema_.types[type].name);
    if (++visits_ > kMaxVisits) refuse("too many fields", schema_.types[0].name);
    for (const RosField& field : schema_.types[type].fields)
      if (field.kind == RosKind::nested) check_depth(field.type, depth + 1);
  }

  static constexpr std::size_t kMaxVisits = 10000;
  std::string place_;
  RosSchema schema_;
  std::vector<std::vector<std::string>> nested_;  ///< names of the types of fields
  std::size_t visits_ = 0;
};

}  // namespace

std::size_t bytes_of(RosKind kind) noexcept {
  switch (kind) {
    case RosKind::boolean:
    case RosKind::int8:
    case RosKind::uint8: return 1;
    case RosKind::int16:
    case RosKind::uint16: return 2;
    case RosKind::int32:
    case RosKind::uint32:
    case RosKind::float32: return 4;
    case RosKind::int64:
    case RosKind::uint64:
    case RosKind::float64: return 8;
    case RosKind::text:
    case RosKind::nested: break;
  }
  return 0;
}

RosSchema parse_ros_schema(std::string_view name, std::string_view text, const std::string& place) {
  return Parser(place).parse(name, text);
}

}  // namespace torsio
