#include "arm/urdf_elements.hpp"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <exception>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "arm/vector3.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestText = std::size_t{4} << 20U;
constexpr std::size_t kDeepest = 64;
constexpr std::size_t kMaxParts = 1000;
constexpr std::size_t kLongestShown = 40;

/// A text of the file, short and without control characters.
std::string shown(std::string_view text) {
  std::string of(text.substr(0, kLongestShown));
  std::ranges::replace_if(
      of, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text.size() > kLongestShown ? of + "..." : of;
}

/// Attributes of an element, as expat passes them.
class Attributes {
 public:
  Attributes(const char* const* values, std::string place)
      : values_(values), place_(std::move(place)) {}

  [[nodiscard]] std::optional<std::string_view> find(std::string_view name) const {
    for (const char* const* at = values_; *at != nullptr; at += 2)
      if (name == *at) return at[1];
    return std::nullopt;
  }
  [[nodiscard]] std::string_view at(std::string_view name) const {
    if (const auto value = find(name)) return *value;
    throw Error(
        {.place = place_, .expected = fmt::format("an attribute '{}'", name), .found = "none"});
  }
  [[nodiscard]] double number(std::string_view name) const {
    std::array<double, 1> value;
    read(at(name), value, name, "a number");
    return value[0];
  }
  [[nodiscard]] Vector3 triple(std::string_view name, const Vector3& missing) const {
    const auto text = find(name);
    if (!text) return missing;
    Vector3 of;
    read(*text, of, name, "three numbers");
    return of;
  }
  [[nodiscard]] const std::string& place() const { return place_; }

 private:
  void read(std::string_view text, std::span<double> into, std::string_view name,
            std::string_view expected) const {
    const auto refuse = [&] {
      throw Error(
          {.place = fmt::format("{}: {}", place_, name),
           .expected = std::string(expected),
           .found = fmt::format("'{}'", shown(text)),
           .advice = text.find(',') == std::string_view::npos
                         ? ""
                         : "Numbers have a point before the decimals, and spaces between them."});
    };
    std::string_view rest = text;
    for (double& value : into) {
      const std::size_t begin = rest.find_first_not_of(" \t\r\n");
      if (begin == std::string_view::npos) refuse();
      rest.remove_prefix(begin);
      if (rest.front() == '+') rest.remove_prefix(1);
      const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
      if (error != std::errc() || !std::isfinite(value)) refuse();
      rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
      if (!rest.empty() && std::string_view(" \t\r\n").find(rest.front()) == std::string_view::npos)
        refuse();
    }
    if (rest.find_first_not_of(" \t\r\n") != std::string_view::npos) refuse();
  }

  const char* const* values_;
  std::string place_;
};

/// Rz(yaw) Ry(pitch) Rx(roll)
Matrix3 rotation_of(const Vector3& rpy) {
  const double cr = std::cos(rpy[0]);
  const double sr = std::sin(rpy[0]);
  const double cp = std::cos(rpy[1]);
  const double sp = std::sin(rpy[1]);
  const double cy = std::cos(rpy[2]);
  const double sy = std::sin(rpy[2]);
  return {cy * cp,
          cy * sp * sr - sy * cr,
          cy * sp * cr + sy * sr,
          sy * cp,
          sy * sp * sr + cy * cr,
          sy * sp * cr - cy * sr,
          -sp,
          cp * sr,
          cp * cr};
}

ArmFrame frame_of(const Attributes& attributes) {
  return {attributes.triple("xyz", {}), rotation_of(attributes.triple("rpy", {}))};
}

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::ranges::find(names, name) != names.end();
}

/// Receives the elements in the order of the text.
class Reader {
 public:
  explicit Reader(std::string_view file) : file_(file) {}

  void begin(std::string_view element, const char* const* values, unsigned long line) {
    path_.emplace_back(element);
    if (path_.size() > kDeepest)
      refuse(line, fmt::format("elements in each other at most {} deep", kDeepest), "more");
    if (path_.size() == 1) return begin_robot(values, line);
    if (passed_ > 0 || is_passed(element)) {
      ++passed_;
      return;
    }
    const Attributes attributes(values, fmt::format("{}: line {}: <{}>", file_, line, element));
    if (path_.size() == 2) return begin_part(attributes, line);
    if (path_.size() > 4) return;
    if (path_[1] == "link")
      in_link(attributes, line);
    else if (path_[1] == "joint")
      in_joint(attributes);
  }
  void end() {
    if (passed_ > 0) --passed_;
    path_.pop_back();
  }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] UrdfElements take() && { return std::move(elements_); }

 private:
  [[noreturn]] void refuse(unsigned long line, std::string expected, std::string found,
                           std::string advice = {}) const {
    throw Error({.place = fmt::format("{}: line {}", file_, line),
                 .expected = std::move(expected),
                 .found = std::move(found),
                 .advice = std::move(advice)});
  }
  /// What a URDF file holds beside links and joints.
  [[nodiscard]] bool is_passed(std::string_view element) const {
    if (path_.size() == 2) return element != "link" && element != "joint";
    return is_one_of(element, {"visual", "collision", "material", "dynamics", "calibration",
                               "safety_controller", "gazebo", "sensor", "transmission"});
  }
  void begin_robot(const char* const* values, unsigned long line) {
    if (path_[0] != "robot")
      refuse(
          line, "an element <robot>", fmt::format("<{}>", shown(path_[0])),
          path_[0] == "sdf" || path_[0] == "mujoco"
              ? "This is another format; convert it to URDF."
              : "A URDF file describes one <robot>. Files with xacro macros have to be expanded: "
                "xacro robot.urdf.xacro > robot.urdf");
    const Attributes attributes(values, fmt::format("{}: line {}: <robot>", file_, line));
    elements_.robot = attributes.find("name").value_or("arm");
  }
  void begin_part(const Attributes& attributes, unsigned long line) {
    if (elements_.links.size() + elements_.joints.size() >= kMaxParts)
      refuse(line, fmt::format("at most {} links and joints", kMaxParts), "more");
    const std::string name(attributes.find("name").value_or(""));
    if (name.empty())
      throw Error({.place = attributes.place(), .expected = "a name", .found = "none"});
    auto& names = path_[1] == "link" ? link_lines_ : joint_lines_;
    if (const auto [first, is_new] = names.emplace(name, line); !is_new)
      throw Error({.place = attributes.place(),
                   .expected = fmt::format("a name that no other {} has", path_[1]),
                   .found = fmt::format("'{}', as in line {}", shown(name), first->second)});
    if (path_[1] == "link") {
      elements_.links.push_back({.name = name, .line = line});
    } else {
      elements_.joints.push_back({.name = name, .line = line});
      begin_joint(attributes, elements_.joints.back());
    }
  }
  static void begin_joint(const Attributes& attributes, UrdfJoint& joint) {
    const std::string_view type = attributes.at("type");
    joint.is_revolute = type == "revolute";
    if (joint.is_revolute || type == "fixed") return;
    throw Error(
        {.place = attributes.place(),
         .problem = fmt::format("joint '{}' is neither revolute nor fixed", shown(joint.name)),
         .expected = R"(type="revolute" or type="fixed")",
         .found = fmt::format("'{}'", shown(type)),
         .advice =
             type == "continuous"
                 ? R"(Make it revolute with the limits of its motion, as lower="-6.28" upper="6.28".)"
                 : "An arm here has joints that turn; make this one fixed if it does "
                   "not move."});
  }
  void in_link(const Attributes& attributes, unsigned long line) {
    UrdfLink& link = elements_.links.back();
    if (path_[2] != "inertial") return;
    if (path_.size() == 3) {
      if (link.has_inertial) refuse(line, "one <inertial> in a link", "two");
      link.has_inertial = true;
      link.inertial_line = line;
    } else if (path_[3] == "origin") {
      link.inertial = frame_of(attributes);
    } else if (path_[3] == "mass") {
      link.mass_kg = attributes.number("value");
    } else if (path_[3] == "inertia") {
      constexpr std::array kNames{"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
      for (std::size_t i = 0; i < kNames.size(); ++i)
        link.inertia_kg_m2[i] = attributes.number(kNames[i]);
    }
  }
  void in_joint(const Attributes& attributes) {
    if (path_.size() != 3) return;
    UrdfJoint& joint = elements_.joints.back();
    const std::string& element = path_[2];
    if (element == "origin") {
      joint.origin = frame_of(attributes);
    } else if (element == "parent") {
      joint.parent = attributes.at("link");
    } else if (element == "child") {
      joint.child = attributes.at("link");
    } else if (element == "axis") {
      const Vector3 axis = attributes.triple("xyz", {1.0, 0.0, 0.0});
      const double length = std::sqrt(dot(axis, axis));
      if (!(length > 1e-6) || !std::isfinite(length))
        throw Error({.place = attributes.place(),
                     .expected = "an axis of a length above 0",
                     .found = fmt::format("{} {} {}", axis[0], axis[1], axis[2])});
      joint.axis = (1.0 / length) * axis;
    } else if (element == "limit") {
      if (!joint.is_revolute) return;
      joint.has_limit = true;
      joint.lower_rad = attributes.number("lower");
      joint.upper_rad = attributes.number("upper");
      joint.effort_Nm = attributes.number("effort");
      joint.velocity_rad_s = attributes.number("velocity");
    } else if (element == "mimic") {
      throw Error({.place = attributes.place(),
                   .problem = fmt::format("joint '{}' follows another joint", shown(joint.name)),
                   .expected = "a joint with a motor of its own",
                   .advice = "Make it fixed, or give it its own actuator."});
    }
  }

  std::string file_;
  std::vector<std::string> path_;
  std::size_t passed_ = 0;  ///< depth inside an element that is passed over
  UrdfElements elements_;
  std::map<std::string, unsigned long> link_lines_;
  std::map<std::string, unsigned long> joint_lines_;
};

/// expat calls C functions, through which no exception may pass: the first one is kept.
struct Parse {
  XML_Parser parser;
  Reader reader;
  std::exception_ptr mistake = {};

  template <class Work>
  void guarded(Work&& work) noexcept {
    if (mistake) return;
    try {
      work();
    } catch (...) {
      mistake = std::current_exception();
      XML_StopParser(parser, XML_FALSE);
    }
  }
};

void on_begin(void* user, const char* element, const char** values) {
  auto& parse = *static_cast<Parse*>(user);
  parse.guarded(
      [&] { parse.reader.begin(element, values, XML_GetCurrentLineNumber(parse.parser)); });
}
void on_end(void* user, const char* /*element*/) {
  auto& parse = *static_cast<Parse*>(user);
  parse.guarded([&] { parse.reader.end(); });
}
void on_doctype(void* user, const char* /*name*/, const char* /*system*/, const char* /*id*/,
                int /*has_subset*/) {
  auto& parse = *static_cast<Parse*>(user);
  parse.guarded([&] {
    throw Error({.place = fmt::format("{}: line {}", parse.reader.file(),
                                      XML_GetCurrentLineNumber(parse.parser)),
                 .expected = "a URDF file without <!DOCTYPE>",
                 .found = "a document type, whose entities could read other files"});
  });
}

}  // namespace

UrdfElements urdf_elements(std::string_view text, std::string_view file) {
  if (text.size() > kLongestText)
    throw Error(
        {.place = std::string(file),
         .expected = "a URDF file of at most 4 MiB",
         .found = fmt::format("{:.1f} MiB", static_cast<double>(text.size()) / (1U << 20U))});
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  Parse parse{.parser = parser.get(), .reader = Reader(file)};
  XML_SetUserData(parser.get(), &parse);
  XML_SetElementHandler(parser.get(), on_begin, on_end);
  XML_SetStartDoctypeDeclHandler(parser.get(), on_doctype);
  const XML_Status status =
      XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), XML_TRUE);
  if (parse.mistake) std::rethrow_exception(parse.mistake);
  if (status != XML_STATUS_OK)
    throw Error(
        {.place = fmt::format("{}: line {}", file, XML_GetCurrentLineNumber(parser.get())),
         .problem = fmt::format("not XML: {}", XML_ErrorString(XML_GetErrorCode(parser.get()))),
         .expected = "a URDF file",
         .advice = text.empty() ? "The file is empty." : ""});
  return std::move(parse.reader).take();
}

}  // namespace torsio
