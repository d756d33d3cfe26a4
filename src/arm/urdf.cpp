#include "torsio/arm/urdf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "arm/urdf_elements.hpp"
#include "arm/vector3.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Puts the elements together, from the base outwards.
class Chain {
 public:
  Chain(const UrdfElements& elements, std::string_view file) : elements_(elements), file_(file) {
    for (const UrdfLink& link : elements.links) links_.emplace(link.name, &link);
    for (const UrdfJoint& joint : elements.joints) connect(joint);
  }

  ArmModel build() {
    arm_.name = elements_.robot;
    walk();
    if (arm_.joints.empty())
      throw Error({.place = file_,
                   .expected = "at least one revolute joint",
                   .found = "none",
                   .advice = "All joints of this robot are fixed."});
    for (std::size_t j = 0; j < arm_.joints.size(); ++j) check_body(j);
    require_possible(arm_);
    return std::move(arm_);
  }

 private:
  /// A link that is fixed to the last moving one, or is it, at its place in the frame of that.
  struct Fixed {
    const UrdfLink* link;
    ArmFrame frame;
  };

  [[noreturn]] void refuse(unsigned long line, ErrorReport report) const {
    report.place = fmt::format("{}: line {}", file_, line);
    throw Error(std::move(report));
  }

  void connect(const UrdfJoint& joint) {
    const auto existing = [&](const std::string& link, const char* role) {
      if (link.empty())
        refuse(joint.line,
               {.expected = fmt::format("<{} link=...> in joint '{}'", role, joint.name),
                .found = "none"});
      if (!links_.contains(link))
        refuse(joint.line,
               {.problem = fmt::format("the {} of joint '{}' does not exist", role, joint.name),
                .expected = "the name of a <link>",
                .found = fmt::format("'{}'", link)});
    };
    existing(joint.parent, "parent");
    existing(joint.child, "child");
    if (const auto [first, is_new] = to_parent_.emplace(joint.child, &joint); !is_new)
      refuse(joint.line,
             {.problem = fmt::format("link '{}' has two parents: a loop, which is not an arm",
                                     joint.child),
              .expected = "one joint whose child it is",
              .found = fmt::format("'{}' and '{}'", first->second->name, joint.name)});
    children_[joint.parent].push_back(&joint);
  }

  [[nodiscard]] const UrdfLink& root() const {
    const UrdfLink* root = nullptr;
    for (const UrdfLink& link : elements_.links) {
      if (to_parent_.contains(link.name)) continue;
      if (root != nullptr)
        refuse(link.line, {.expected = "one link without a parent, the base",
                           .found = fmt::format("'{}' and '{}'", root->name, link.name),
                           .advice = "Connect the links by joints."});
      root = &link;
    }
    if (root == nullptr)
      throw Error({.place = file_,
                   .expected = "a link without a parent, the base",
                   .found = elements_.links.empty() ? "no link" : "a loop of joints"});
    return *root;
  }

  void walk() {
    const UrdfLink* moving = &root();
    std::size_t seen = 1;
    std::optional<ArmJoint> last;  // whose link is being put together; none: the base
    for (bool is_last = false; !is_last;) {
      const UrdfJoint* next = nullptr;
      ArmFrame next_frame;
      std::vector<Fixed> open{{moving, {}}};
      ArmFrame tip;
      for (std::size_t i = 0; i < open.size(); ++i) {
        const Fixed at = open[i];
        if (last) add(*last, at, moving);
        const auto found = children_.find(at.link->name);
        if (found == children_.end()) continue;
        for (const UrdfJoint* joint : found->second) {
          ++seen;
          const ArmFrame frame = product(at.frame, joint->origin);
          if (!joint->is_revolute) {
            open.push_back({links_.at(joint->child), frame});
            tip = frame;
            continue;
          }
          if (next != nullptr)
            refuse(joint->line,
                   {.problem = fmt::format("the robot branches: '{}' and '{}' both move",
                                           next->name, joint->name),
                    .expected = "a serial arm",
                    .advice = "Make the joints of all branches but one fixed."});
          next = joint;
          next_frame = frame;
        }
      }
      if (last) arm_.joints.push_back(*last);
      is_last = next == nullptr;
      if (is_last) {
        arm_.flange = tip;
      } else {
        last = begin(*next, next_frame);
        moving = links_.at(next->child);
      }
    }
    if (seen != elements_.links.size())
      throw Error({.place = file_,
                   .problem = "some links form a loop that is not connected to the base",
                   .expected = "a serial arm"});
  }

  ArmJoint begin(const UrdfJoint& joint, const ArmFrame& origin) const {
    if (arm_.joints.size() >= kMaxArmJoints)
      refuse(joint.line, {.expected = fmt::format("at most {} revolute joints", kMaxArmJoints),
                          .found = "more"});
    if (!joint.has_limit)
      refuse(
          joint.line,
          {.problem = fmt::format("joint '{}' has no <limit>", joint.name),
           .expected = "<limit lower=... upper=... effort=... velocity=.../> in rad, Nm, rad/s"});
    if (!(joint.lower_rad < joint.upper_rad))
      refuse(joint.line,
             {.problem = fmt::format("the limits of joint '{}' contain no angle", joint.name),
              .expected = "lower below upper",
              .found = fmt::format("{} and {}", joint.lower_rad, joint.upper_rad)});
    if (!(joint.effort_Nm > 0.0) || !(joint.velocity_rad_s > 0.0))
      refuse(joint.line,
             {.problem = fmt::format("joint '{}' cannot move", joint.name),
              .expected = "an effort and a velocity above 0",
              .found = fmt::format("{} Nm and {} rad/s", joint.effort_Nm, joint.velocity_rad_s)});
    return {.name = joint.name,
            .link = joint.child,
            .origin = origin,
            .axis = joint.axis,
            .lowest_rad = joint.lower_rad,
            .highest_rad = joint.upper_rad,
            .speed_rad_s = joint.velocity_rad_s,
            .effort_Nm = joint.effort_Nm};
  }

  void add(ArmJoint& joint, const Fixed& at, const UrdfLink* moving) const {
    const UrdfLink& link = *at.link;
    if (!link.has_inertial) {
      if (&link == moving)
        refuse(link.line,
               {.problem = fmt::format("link '{}' moves and has no <inertial>", link.name),
                .expected = "its mass, centre of mass and inertia"});
      return;
    }
    if (!(link.mass_kg > 0.0))
      refuse(link.inertial_line, {.problem = fmt::format("the mass of link '{}'", link.name),
                                  .expected = "a positive number of kg",
                                  .found = fmt::format("{}", link.mass_kg)});
    const BodyInertia own = moved({link.mass_kg, {}, link.inertia_kg_m2}, link.inertial);
    joint.body = together(joint.body, moved(own, at.frame));
  }

  /// As `require_possible`, with the line of the link.
  void check_body(std::size_t joint) const {
    ArmModel alone{.name = arm_.name, .joints = {arm_.joints[joint]}};
    try {
      require_possible(alone);
    } catch (const Error& error) {
      ErrorReport report = error.report();
      const UrdfLink& link = *links_.at(arm_.joints[joint].link);
      report.place = fmt::format("{}: line {}: link '{}': {}", file_, link.inertial_line, link.name,
                                 report.place);
      throw Error(std::move(report));
    }
  }

  const UrdfElements& elements_;
  std::string file_;
  std::map<std::string, const UrdfLink*> links_;
  std::map<std::string, const UrdfJoint*> to_parent_;
  std::map<std::string, std::vector<const UrdfJoint*>> children_;
  ArmModel arm_;
};

}  // namespace

ArmModel read_urdf(std::string_view text, std::string_view file) {
  const UrdfElements elements = urdf_elements(text, file);
  return Chain(elements, file).build();
}

}  // namespace torsio
