#include "arm/urdf_elements.hpp"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>

#include "arm/urdf_attributes.hpp"
#include "arm/vector3.hpp"
#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestText = std::size_t{4} << 20U;
constexpr std::size_t kDeepest = 64;
constexpr std::size_t kMaxLinks = 1000;
constexpr std::string_view kXacro =
    "Expand the macros of this file first: xacro robot.urdf.xacro > robot.urdf";

using Names = std::span<const std::string_view>;
template <std::size_t N>
using NameTable = std::array<std::string_view, N>;

constexpr NameTable<2> kParts = {"link", "joint"};
constexpr NameTable<1> kOfLink = {"inertial"};
constexpr NameTable<3> kOfInertial = {"origin", "mass", "inertia"};
constexpr NameTable<6> kOfJoint = {"origin", "parent", "child", "axis", "limit", "mimic"};
/// What a file also contains, and is not needed here. Anything else that resembles no name above
/// is an extension of some program.
constexpr NameTable<12> kSkipped = {
    "visual",       "collision", "material", "dynamics", "calibration",  "safety_controller",
    "transmission", "gazebo",    "mujoco",   "sensor",   "ros2_control", "contact"};
constexpr NameTable<6> kMoments = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};

bool contains(Names names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// Receives the elements in the order of the text.
class Reader {
 public:
  explicit Reader(std::string_view file) : file_(file) {}

  void begin(const UrdfAttributes& attributes, std::string_view element) {
    path_.emplace_back(element);
    if (path_.size() > kDeepest)
      throw Error({.place = attributes.place(),
                   .expected = fmt::format("elements in each other at most {} deep", kDeepest),
                   .found = "more"});
    if (skipped_ > 0) {
      ++skipped_;
      return;
    }
    if (path_.size() == 1) return begin_robot(attributes);
    if (!is_read(attributes, element)) {
      skipped_ = 1;
      return;
    }
    if (path_.size() == 2)
      begin_part(attributes);
    else if (path_[1] == "link")
      in_link(attributes, element);
    else
      in_joint(attributes, element);
  }
  void end() {
    if (skipped_ > 0) --skipped_;
    path_.pop_back();
  }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] UrdfElements take() && { return std::move(elements_); }

 private:
  /// The elements that are read inside the one that is open.
  [[nodiscard]] Names known_here() const {
    if (path_.size() == 2) return kParts;
    if (path_.size() == 3 && path_[1] == "link") return kOfLink;
    if (path_.size() == 3) return kOfJoint;
    if (path_.size() == 4 && path_[2] == "inertial") return kOfInertial;
    return {};
  }
  [[nodiscard]] bool is_read(const UrdfAttributes& attributes, std::string_view element) const {
    const Names known = known_here();
    if (contains(known, element)) return true;
    if (element.starts_with("xacro:"))
      throw Error({.place = attributes.place(),
                   .expected = "a URDF file",
                   .found = "a macro of xacro",
                   .advice = std::string(kXacro)});
    if (contains(kSkipped, element) || element.find(':') != std::string_view::npos) return false;
    // A misspelt <origin> would be one that is silently 0.
    if (const std::string advice = did_you_mean(element, known); !advice.empty())
      throw Error({.place = attributes.place(),
                   .expected = "an element of URDF",
                   .found = fmt::format("<{}>", shown(element)),
                   .advice = advice});
    return false;
  }

  void begin_robot(const UrdfAttributes& attributes) {
    if (path_[0] != "robot")
      throw Error({.place = attributes.place(),
                   .expected = "an element <robot>",
                   .found = fmt::format("<{}>", shown(path_[0])),
                   .advice = path_[0] == "sdf" || path_[0] == "mujoco"
                                 ? "This is another format; convert it to URDF."
                                 : "A URDF file describes one <robot>."});
    elements_.robot = attributes.find("name").value_or("arm");
    elements_.line = attributes.line();
  }
  void begin_part(const UrdfAttributes& attributes) {
    const bool is_link = path_[1] == "link";
    if ((is_link ? elements_.links.size() : elements_.joints.size()) >= kMaxLinks)
      throw Error({.place = attributes.place(),
                   .expected = fmt::format("at most {} links", kMaxLinks),
                   .found = "more"});
    std::string name(attributes.find("name").value_or(""));
    if (name.empty())
      throw Error({.place = attributes.place(),
                   .expected = "a name",
                   .found = "none",
                   .advice = fmt::format("Give each {} a name of its own.", path_[1])});
    auto& lines = is_link ? link_lines_ : joint_lines_;
    if (const auto [first, is_new] = lines.emplace(name, attributes.line()); !is_new)
      throw Error({.place = attributes.place(),
                   .expected = fmt::format("a name that no other {} has", path_[1]),
                   .found = fmt::format("'{}', as in line {}", shown(name), first->second),
                   .advice = fmt::format("Give each {} a name of its own.", path_[1])});
    parts_.clear();
    if (is_link) {
      elements_.links.push_back({.name = std::move(name), .line = attributes.line()});
    } else {
      elements_.joints.push_back({.name = std::move(name), .line = attributes.line()});
      begin_joint(attributes, elements_.joints.back());
    }
  }
  static void begin_joint(const UrdfAttributes& attributes, UrdfJoint& joint) {
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
                 : "An arm here has joints that turn; make this one fixed if it does not move."});
  }

  /// A second element of one name would silently replace the first one.
  void require_first(const UrdfAttributes& attributes, std::string_view element) {
    if (!parts_.emplace(element).second)
      throw Error({.place = attributes.place(),
                   .expected = fmt::format("one <{}>", element),
                   .found = "a second one",
                   .advice = "Remove one of them."});
  }
  void in_link(const UrdfAttributes& attributes, std::string_view element) {
    require_first(attributes, element);
    UrdfLink& link = elements_.links.back();
    if (element == "inertial") {
      link.inertial_line = attributes.line();
    } else if (element == "origin") {
      link.inertial = attributes.frame();
    } else if (element == "mass") {
      link.mass_kg = attributes.number("value");
    } else {
      attributes.allow_only(kMoments);
      for (std::size_t i = 0; i < kMoments.size(); ++i)
        link.inertia_kg_m2[i] = attributes.number(kMoments[i]);
    }
  }
  void in_joint(const UrdfAttributes& attributes, std::string_view element) {
    require_first(attributes, element);
    UrdfJoint& joint = elements_.joints.back();
    if (element == "origin") {
      joint.origin = attributes.frame();
    } else if (element == "parent") {
      joint.parent = attributes.at("link");
    } else if (element == "child") {
      joint.child = attributes.at("link");
    } else if (element == "axis") {
      joint.axis = axis_of(attributes);
    } else if (element == "limit") {
      if (joint.is_revolute) read_limit(attributes, joint);
    } else {
      throw Error({.place = attributes.place(),
                   .problem = fmt::format("joint '{}' follows another joint", shown(joint.name)),
                   .expected = "a joint with a motor of its own",
                   .found = "<mimic>",
                   .advice = "Make it fixed, or give it an actuator of its own."});
    }
  }
  static Vector3 axis_of(const UrdfAttributes& attributes) {
    constexpr NameTable<1> kNames = {"xyz"};
    attributes.allow_only(kNames);
    const Vector3 axis = attributes.triple("xyz", {1.0, 0.0, 0.0});
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    if (!(length > 1e-6) || !std::isfinite(length))
      throw Error({.place = attributes.place(),
                   .expected = "an axis of a length above 0",
                   .found = fmt::format("'{} {} {}'", axis[0], axis[1], axis[2]),
                   .advice = R"(It is the direction about which the joint turns: xyz="0 0 1".)"});
    return (1.0 / length) * axis;
  }
  static void read_limit(const UrdfAttributes& attributes, UrdfJoint& joint) {
    // The last three are of newer files; nothing here uses them.
    constexpr NameTable<7> kNames = {"lower",        "upper",        "effort", "velocity",
                                     "acceleration", "deceleration", "jerk"};
    attributes.allow_only(kNames);
    joint.limit_line = attributes.line();
    joint.lower_rad = attributes.number("lower");
    joint.upper_rad = attributes.number("upper");
    joint.effort_Nm = attributes.number("effort");
    joint.velocity_rad_s = attributes.number("velocity");
  }

  std::string file_;
  std::vector<std::string> path_;  ///< the elements that are open
  std::size_t skipped_ = 0;        ///< how deep inside an element that is not read
  UrdfElements elements_;
  std::unordered_map<std::string, std::size_t> link_lines_;
  std::unordered_map<std::string, std::size_t> joint_lines_;
  std::set<std::string, std::less<>> parts_;  ///< what the open link or joint has so far
};

/// expat calls C functions, through which no exception may pass: the first one is kept.
struct Parse {
  XML_Parser parser;
  Reader reader;
  std::exception_ptr mistake = {};

  [[nodiscard]] std::size_t line() const { return XML_GetCurrentLineNumber(parser); }
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
  parse.guarded([&] {
    parse.reader.begin({parse.reader.file(), parse.line(), element, values}, element);
  });
}
void on_end(void* user, const char* /*element*/) {
  auto& parse = *static_cast<Parse*>(user);
  parse.guarded([&] { parse.reader.end(); });
}
void on_doctype(void* user, const char* /*name*/, const char* /*system*/, const char* /*id*/,
                int /*has_subset*/) {
  auto& parse = *static_cast<Parse*>(user);
  parse.guarded([&] {
    throw Error({.place = fmt::format("{}: line {}", parse.reader.file(), parse.line()),
                 .expected = "a URDF file without <!DOCTYPE>",
                 .found = "a document type, whose entities could read other files",
                 .advice = "Remove <!DOCTYPE>, and write out the entities."});
  });
}

void check_size(std::string_view text, std::string_view file) {
  if (text.size() > kLongestText)
    throw Error({.place = std::string(file),
                 .expected = "a URDF file of at most 4 MiB",
                 .found = fmt::format("{:.1f} MiB", static_cast<double>(text.size()) / (1U << 20U)),
                 .advice = "Shapes belong into files of their own, to which <mesh> refers."});
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos)
    throw Error({.place = fmt::format("{}: line 1", file),
                 .problem = "not XML",
                 .expected = "a URDF file",
                 .found = "an empty text",
                 .advice = "Check the path, and that the file was copied completely."});
}

}  // namespace

UrdfElements urdf_elements(std::string_view text, std::string_view file) {
  check_size(text, file);
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
    throw Error({.place = fmt::format("{}: line {}, column {}", file, parse.line(),
                                      XML_GetCurrentColumnNumber(parser.get()) + 1),
                 .problem = "not XML",
                 .expected = "a URDF file",
                 .found = XML_ErrorString(XML_GetErrorCode(parser.get())),
                 .advice = "An XML editor or xmllint shows the mistake; a file that ends early was "
                           "not copied completely."});
  return std::move(parse.reader).take();
}

}  // namespace torsio
