#include "joint_load/urdf_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string_view>

#include "core/did_you_mean.hpp"
#include "data/names.hpp"
#include "files/whole_file.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/arm/urdf.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxUrdfFileBytes = std::size_t{4} << 20;
constexpr std::string_view kFlange = "flange";

std::string urdf_text(const std::string& path, const std::string& sheet_file) {
  try {
    const std::vector<std::byte> bytes = read_whole_file(path, kMaxUrdfFileBytes);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.advice = "The path in load.urdf is relative to the folder of " + sheet_file + ".";
    throw Error(std::move(report));
  }
}

[[noreturn]] void refuse_name(const std::string& place, const std::string& what,
                              const std::string& name, const std::vector<std::string>& names) {
  throw Error({.place = place,
               .expected = fmt::format("{} among {}", what, joined(names)),
               .found = "'" + name + "'",
               .advice = did_you_mean(name, names)});
}

std::size_t joint_of(const ArmModel& arm, const std::string& name, const std::string& place) {
  std::vector<std::string> names;
  for (const ArmJoint& joint : arm.joints) names.push_back(joint.name);
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) refuse_name(place, "a joint that turns,", name, names);
  return static_cast<std::size_t>(at - names.begin());
}

/// Body and place of the payload.
void place_payload(const UrdfFacts& facts, const std::string& sheet_file, UrdfLoad& load) {
  load.payload_body = load.arm.joints.size() - 1;
  if (facts.payload_link.empty()) return;
  const Vector3 at_m = {facts.payload_at_m.at(0), facts.payload_at_m.at(1),
                        facts.payload_at_m.at(2)};
  if (facts.payload_link == kFlange) {
    load.payload_at_m = moved({.mass_kg = 1.0, .com_m = at_m}, load.arm.flange).com_m;
    return;
  }
  std::vector<std::string> links;
  for (const ArmJoint& joint : load.arm.joints) links.push_back(joint.link);
  const auto found = std::ranges::find(links, facts.payload_link);
  if (found == links.end()) {
    links.emplace_back(kFlange);
    refuse_name(sheet_file + ": load.payload.link", "a link that a joint moves,",
                facts.payload_link, links);
  }
  load.payload_body = static_cast<std::size_t>(found - links.begin());
  load.payload_at_m = at_m;
  if (load.payload_body < load.joint)
    throw Error({.place = sheet_file + ": load.payload.link",
                 .expected = "a link that the joint " + facts.joint + " moves",
                 .found = "'" + facts.payload_link + "', which is before it"});
}

}  // namespace

UrdfLoad urdf_load(const UrdfFacts& facts, const std::string& sheet_file) {
  const std::string path = (std::filesystem::path(sheet_file).parent_path() / facts.file).string();
  UrdfLoad load{.arm = read_urdf(urdf_text(path, sheet_file), path)};
  load.arm.gravity_m_s2 = {0.0, 0.0, -kLoadGravity_m_s2};
  load.joint = joint_of(load.arm, facts.joint, sheet_file + ": load.joint");
  load.pose_rad.assign(load.arm.joints.size(), 0.0);
  for (const auto& [joint, angle_rad] : facts.pose_rad) {
    if (joint == facts.joint)
      throw Error({.place = sheet_file + ": load.pose",
                   .problem = "the joint " + joint + " moves in the recordings",
                   .advice = "State the angles of the other joints alone."});
    load.pose_rad[joint_of(load.arm, joint, sheet_file + ": load.pose")] = angle_rad;
  }
  place_payload(facts, sheet_file, load);
  return load;
}

JointLoad load_of(const UrdfLoad& urdf, double payload_mass_kg) {
  ArmModel arm = urdf.arm;
  if (payload_mass_kg > 0.0) {
    BodyInertia& body = arm.joints[urdf.payload_body].body;
    body = together(body, {.mass_kg = payload_mass_kg, .com_m = urdf.payload_at_m});
  }
  const ArmDynamics dynamics(arm);
  const std::size_t n = dynamics.size();
  std::vector<double> angle_rad = urdf.pose_rad;
  ArmDynamics::PerJoint torque_Nm{};
  const auto gravity_at = [&](double at_rad) {
    angle_rad[urdf.joint] = at_rad;
    dynamics.gravity_torque(angle_rad, std::span(torque_Nm).first(n));
    return torque_Nm[urdf.joint];
  };
  const double cosine_Nm = gravity_at(0.0);
  const double sine_Nm = gravity_at(0.5 * std::numbers::pi);
  ArmDynamics::JointMatrix mass_kg_m2{};
  dynamics.mass_matrix(angle_rad, std::span(mass_kg_m2).first(n * n));
  return {.gravity_Nm = std::hypot(sine_Nm, cosine_Nm),
          .inertia_kg_m2 = mass_kg_m2[urdf.joint * n + urdf.joint],
          .zero_rad = std::atan2(cosine_Nm, sine_Nm)};
}

}  // namespace torsio
