#include "torsio/arm/urdf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "arm/urdf_attributes.hpp"
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
    const UrdfLink& base = root();
    require_connected(base);
    walk(base);
    if (arm_.joints.empty())
      refuse(elements_.line, {.expected = "at least one revolute joint",
                              .found = "none",
                              .advice = "All joints of this robot are fixed."});
    for (const ArmJoint& joint : arm_.joints) check_joint(joint);
    require_possible(arm_);
    return std::move(arm_);
  }

 private:
  /// A moving link, or one that is fixed to it, at its place in the frame of that.
  struct Fixed {
    const UrdfLink* link;
    ArmFrame frame;
    std::size_t depth;
    bool is_end;  ///< no other link is fixed to it
  };
  struct Next {
    const UrdfJoint* joint = nullptr;
    ArmFrame origin = {};
  };

  [[noreturn]] void refuse(std::size_t line, ErrorReport report) const {
    report.place = fmt::format("{}: line {}", file_, line);
    throw Error(std::move(report));
  }

  void connect(const UrdfJoint& joint) {
    const auto existing = [&](const std::string& link, const char* role) {
      if (link.empty())
        refuse(joint.line,
               {.expected = fmt::format("<{} link=...> in joint '{}'", role, shown(joint.name)),
                .found = "none",
                .advice = "A joint connects two links: its parent and its child."});
      if (!links_.contains(link))
        refuse(joint.line, {.problem = fmt::format("the {} of joint '{}' does not exist", role,
                                                   shown(joint.name)),
                            .expected = "the name of a <link>",
                            .found = fmt::format("'{}'", shown(link)),
                            .advice = "Add the link, or correct its name."});
    };
    existing(joint.parent, "parent");
    existing(joint.child, "child");
    if (const auto [first, is_new] = to_parent_.emplace(joint.child, &joint); !is_new)
      refuse(joint.line,
             {.problem = fmt::format("link '{}' has two parents: a loop, which is not an arm",
                                     shown(joint.child)),
              .expected = "one joint whose child it is",
              .found = fmt::format("'{}' in line {} and '{}'", shown(first->second->name),
                                   first->second->line, shown(joint.name)),
              .advice = "Remove one of these joints."});
    children_[joint.parent].push_back(&joint);
  }

  [[nodiscard]] const UrdfLink& root() const {
    const UrdfLink* root = nullptr;
    for (const UrdfLink& link : elements_.links) {
      if (to_parent_.contains(link.name)) continue;
      if (root != nullptr)
        refuse(link.line,
               {.expected = "one link without a parent, the base",
                .found = fmt::format("'{}' and '{}'", shown(root->name), shown(link.name)),
                .advice = "Connect the links by joints."});
      root = &link;
    }
    if (root != nullptr) return *root;
    if (elements_.links.empty())
      refuse(elements_.line, {.expected = "a link without a parent, the base", .found = "no link"});
    const UrdfJoint& joint = joint_in_loop(elements_.links.front());
    refuse(joint.line,
           {.expected = "a link without a parent, the base",
            .found = fmt::format("a loop of joints, of which '{}' is one", shown(joint.name)),
            .advice = "Remove the joint whose child is the base of the arm."});
  }

  /// A loop is entered if one follows the parents of a link that is not connected to a base.
  [[nodiscard]] const UrdfJoint& joint_in_loop(const UrdfLink& start) const {
    const UrdfJoint* joint = to_parent_.at(start.name);
    for (std::size_t i = 0; i < elements_.joints.size(); ++i) joint = to_parent_.at(joint->parent);
    return *joint;
  }

  void require_connected(const UrdfLink& base) const {
    std::unordered_map<std::string_view, bool> is_connected = {{base.name, true}};
    std::vector<const UrdfLink*> open = {&base};
    while (!open.empty()) {
      const auto found = children_.find(open.back()->name);
      open.pop_back();
      if (found == children_.end()) continue;
      for (const UrdfJoint* joint : found->second) {
        is_connected[joint->child] = true;
        open.push_back(links_.at(joint->child));
      }
    }
    for (const UrdfLink& link : elements_.links) {
      if (is_connected.contains(link.name)) continue;
      const UrdfJoint& joint = joint_in_loop(link);
      refuse(joint.line,
             {.problem = fmt::format("joint '{}' belongs to a loop that is not connected to the "
                                     "base '{}'",
                                     shown(joint.name), shown(base.name)),
              .expected = "a serial arm",
              .advice = "Remove one joint of the loop, and connect its links to the base."});
    }
  }

  void walk(const UrdfLink& base) {
    const UrdfLink* moving = &base;
    std::optional<ArmJoint> last;  // whose link is being put together; none: the base
    while (true) {
      Next next;
      const std::vector<Fixed> fixed = fixed_to(*moving, next);
      if (last) {
        for (const Fixed& at : fixed) add(*last, at, at.link == moving);
        arm_.joints.push_back(*last);
      }
      if (next.joint == nullptr) {
        arm_.flange = flange_of(fixed).frame;
        return;
      }
      last = begin(*next.joint, next.origin);
      moving = links_.at(next.joint->child);
    }
  }

  /// A link and all that is fixed to it, the nearer ones first.
  [[nodiscard]] std::vector<Fixed> fixed_to(const UrdfLink& moving, Next& next) const {
    std::vector<Fixed> fixed = {{&moving, {}, 0, true}};
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      const auto found = children_.find(fixed[i].link->name);
      if (found == children_.end()) continue;
      for (const UrdfJoint* joint : found->second) {
        const ArmFrame frame = product(fixed[i].frame, joint->origin);
        if (!joint->is_revolute) {
          fixed[i].is_end = false;
          fixed.push_back({links_.at(joint->child), frame, fixed[i].depth + 1, true});
          continue;
        }
        if (next.joint != nullptr)
          refuse(joint->line, {.problem = fmt::format(
                                   "the robot branches: '{}' in line {} and '{}' both move",
                                   shown(next.joint->name), next.joint->line, shown(joint->name)),
                               .expected = "a serial arm",
                               .advice = "Make the joints of all branches but one fixed."});
        next = {joint, frame};
      }
    }
    return fixed;
  }

  /// The end of the chain. Where it forks, as by a camera, names decide (those of REP 199 of ROS),
  /// then the length: the first of the longest branches.
  static const Fixed& flange_of(const std::vector<Fixed>& fixed) {
    if (std::ranges::count_if(fixed, &Fixed::is_end) > 1)
      for (const std::string_view name : {"flange", "tool0"})
        for (const Fixed& at : fixed)
          if (at.link->name == name) return at;
    return *std::ranges::max_element(fixed, {}, &Fixed::depth);
  }

  ArmJoint begin(const UrdfJoint& joint, const ArmFrame& origin) const {
    const std::string name = shown(joint.name);
    if (arm_.joints.size() >= kMaxArmJoints)
      refuse(joint.line, {.expected = fmt::format("at most {} revolute joints", kMaxArmJoints),
                          .found = fmt::format("'{}' as one more", name),
                          .advice = "Make joints that do not move fixed."});
    if (joint.limit_line == 0)
      refuse(
          joint.line,
          {.problem = fmt::format("joint '{}' has no <limit>", name),
           .expected = "<limit lower=... upper=... effort=... velocity=.../> in rad, Nm, rad/s"});
    if (!(joint.lower_rad < joint.upper_rad))
      refuse(joint.limit_line,
             {.problem = fmt::format("the limits of joint '{}' contain no angle", name),
              .expected = "lower below upper",
              .found = fmt::format("{} and {}", joint.lower_rad, joint.upper_rad)});
    if (!(joint.effort_Nm > 0.0) || !(joint.velocity_rad_s > 0.0))
      refuse(joint.limit_line,
             {.problem = fmt::format("joint '{}' cannot move", name),
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

  void add(ArmJoint& joint, const Fixed& at, bool is_moving) const {
    const UrdfLink& link = *at.link;
    if (link.inertial_line == 0) {
      if (is_moving)
        refuse(link.line,
               {.problem = fmt::format("link '{}' moves and has no <inertial>", shown(link.name)),
                .expected = "its mass, centre of mass and inertia"});
      return;
    }
    if (!(link.mass_kg > 0.0))
      refuse(link.inertial_line,
             {.problem = fmt::format("the mass of link '{}'", shown(link.name)),
              .expected = "a positive number of kg",
              .found = fmt::format("{}", link.mass_kg),
              .advice = is_moving ? "" : "Remove the <inertial> of a link that is only a frame."});
    const BodyInertia own = moved({link.mass_kg, {}, link.inertia_kg_m2}, link.inertial);
    // Each link on its own: a sum can hide an inertia that no body has. A fixed one may be a point.
    const bool is_point = link.inertia_kg_m2 == std::array<double, 6>{};
    if (is_moving || !is_point)
      check(link.inertial_line, link,
            {.name = joint.name,
             .body = own,
             .highest_rad = 1.0,
             .speed_rad_s = 1.0,
             .effort_Nm = 1.0});
    joint.body = together(joint.body, moved(own, at.frame));
  }

  void check_joint(const ArmJoint& joint) const {
    const UrdfLink& link = *links_.at(joint.link);
    check(link.inertial_line, link, joint);
  }

  /// As `require_possible`, with the line of a link.
  void check(std::size_t line, const UrdfLink& link, const ArmJoint& joint) const {
    try {
      require_possible({.name = arm_.name, .joints = {joint}});
    } catch (const Error& error) {
      ErrorReport report = error.report();
      report.place =
          fmt::format("{}: line {}: link '{}': {}", file_, line, shown(link.name), report.place);
      if (report.place.ends_with("inertia"))
        report.advice =
            "An inertia is about the centre of mass, in kg m2; one in g mm2 is 1e9 "
            "times as large.";
      throw Error(std::move(report));
    }
  }

  const UrdfElements& elements_;
  std::string file_;
  // The names are those of the elements.
  std::unordered_map<std::string_view, const UrdfLink*> links_;
  std::unordered_map<std::string_view, const UrdfJoint*> to_parent_;
  std::unordered_map<std::string_view, std::vector<const UrdfJoint*>> children_;
  ArmModel arm_;
};

}  // namespace

ArmModel read_urdf(std::string_view text, std::string_view file) {
  const UrdfElements elements = urdf_elements(text, file);
  return Chain(elements, file).build();
}

}  // namespace torsio
