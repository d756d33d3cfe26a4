#include "torsio/arm/arm_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

#include "arm/vector3.hpp"
#include "core/all_finite.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kLargestAngle_rad = 1e3;  // sines of larger ones lose digits
constexpr double kUnitTolerance = 1e-6;
constexpr double kLargestMass_kg = 1e6;  // far above any arm; torques of larger ones overflow

/// The principal moments, in rising order, by the closed form for the roots of a cubic (Smith 1961).
Vector3 principal(const Symmetric3& s) {
  const double mean = (s[0] + s[1] + s[2]) / 3.0;
  const double off = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  const Vector3 d = {s[0] - mean, s[1] - mean, s[2] - mean};
  const double p = std::sqrt((dot(d, d) + 2.0 * off) / 6.0);
  if (!(p > 0.0)) return {mean, mean, mean};
  const double determinant = d[0] * (d[1] * d[2] - s[5] * s[5]) -
                             s[3] * (s[3] * d[2] - s[5] * s[4]) +
                             s[4] * (s[3] * s[5] - d[1] * s[4]);
  const double angle = std::acos(std::clamp(determinant / (2.0 * p * p * p), -1.0, 1.0)) / 3.0;
  const double high = mean + 2.0 * p * std::cos(angle);
  const double low = mean + 2.0 * p * std::cos(angle + 2.0 * std::numbers::pi / 3.0);
  return {low, 3.0 * mean - high - low, high};
}

class JointCheck {
 public:
  JointCheck(const ArmModel& arm, std::size_t joint)
      : joint_(arm.joints[joint]),
        place_(fmt::format(
            "{}: joint {}", arm.name.empty() ? "arm" : arm.name,
            joint_.name.empty() ? std::to_string(joint + 1) : "'" + joint_.name + "'")) {}

  void run() const {
    require(!joint_.name.empty(), place_, "a name", "none");
    frame();
    inertia();
    limits();
  }

 private:
  void frame() const {
    require(all_finite(joint_.origin.position_m) && all_finite(joint_.origin.rotation) &&
                all_finite(joint_.axis),
            place_, "a finite origin and axis", "a value that is not finite");
    const double length = std::sqrt(dot(joint_.axis, joint_.axis));
    require(std::abs(length - 1.0) <= kUnitTolerance, {place_, "axis"}, "length 1", length);
    require(is_rotation(joint_.origin.rotation), {place_, "origin"}, "a rotation",
            "a matrix that is none");
  }
  static bool is_rotation(const Matrix3& r) {
    const Matrix3 unit = product(r, transposed(r));
    for (std::size_t i = 0; i < 9; ++i)
      if (!(std::abs(unit[i] - kIdentity3[i]) <= kUnitTolerance)) return false;
    return dot(cross(column(r, 0), column(r, 1)), column(r, 2)) > 0.0;
  }
  void inertia() const {
    const BodyInertia& body = joint_.body;
    require(body.mass_kg > 0.0 && body.mass_kg <= kLargestMass_kg, {place_, "mass"},
            "a positive number of kg, at most 1e6", body.mass_kg);
    require(all_finite(body.com_m) && all_finite(body.inertia_kg_m2), {place_, "inertia"},
            "finite values", "a value that is not finite");
    const Vector3 moments = principal(body.inertia_kg_m2);
    require(moments[0] > 0.0, {place_, "inertia"}, "positive principal moments", moments[0]);
    require(moments[0] + moments[1] >= moments[2] * (1.0 - kUnitTolerance), {place_, "inertia"},
            "principal moments of which no one is above the sum of the others",
            fmt::format("{:.4g}, {:.4g} and {:.4g} kg m2", moments[0], moments[1], moments[2]));
  }
  void limits() const {
    require(joint_.lowest_rad < joint_.highest_rad && joint_.lowest_rad >= -kLargestAngle_rad &&
                joint_.highest_rad <= kLargestAngle_rad,
            {place_, "limits"}, "a lower one below the upper one, within 1000 rad",
            fmt::format("{} and {} rad", joint_.lowest_rad, joint_.highest_rad));
    require(joint_.speed_rad_s > 0.0 && std::isfinite(joint_.speed_rad_s), {place_, "speed limit"},
            "a positive number of rad/s", joint_.speed_rad_s);
    require(joint_.effort_Nm > 0.0 && std::isfinite(joint_.effort_Nm), {place_, "effort limit"},
            "a positive number of Nm", joint_.effort_Nm);
  }

  const ArmJoint& joint_;
  std::string place_;
};

}  // namespace

BodyInertia together(const BodyInertia& a, const BodyInertia& b) noexcept {
  const double mass_kg = a.mass_kg + b.mass_kg;
  if (!(mass_kg > 0.0)) return {.inertia_kg_m2 = a.inertia_kg_m2 + b.inertia_kg_m2};
  const Vector3 com_m = (1.0 / mass_kg) * (a.mass_kg * a.com_m + b.mass_kg * b.com_m);
  const auto about_com = [&](const BodyInertia& body) {
    const Vector3 offset_m = body.com_m - com_m;
    return body.inertia_kg_m2 + 0.5 * body.mass_kg * inertia_of(offset_m, offset_m);
  };
  return {mass_kg, com_m, about_com(a) + about_com(b)};
}

BodyInertia moved(const BodyInertia& body, const ArmFrame& frame) noexcept {
  return {body.mass_kg, frame.position_m + rotated(frame.rotation, body.com_m),
          rotated(frame.rotation, body.inertia_kg_m2)};
}

Vector3 tilted_gravity(double tilt_rad) noexcept {
  return {kGravity_m_s2 * std::sin(tilt_rad), 0.0, -kGravity_m_s2 * std::cos(tilt_rad)};
}

bool is_possible_payload(const BodyInertia& payload) noexcept {
  return payload.mass_kg >= 0.0 && std::isfinite(payload.mass_kg) && all_finite(payload.com_m) &&
         all_finite(payload.inertia_kg_m2) && principal(payload.inertia_kg_m2)[0] >= -1e-12;
}

void require_possible(const ArmModel& arm) {
  const std::string place = arm.name.empty() ? "arm" : arm.name;
  require(!arm.joints.empty(), place, "at least one joint", "none");
  require(arm.joints.size() <= kMaxArmJoints, place,
          fmt::format("at most {} joints", kMaxArmJoints), fmt::format("{}", arm.joints.size()));
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    JointCheck(arm, j).run();
    for (std::size_t i = 0; i < j; ++i)
      require(arm.joints[i].name != arm.joints[j].name, place, "a name for each joint",
              fmt::format("'{}' twice", arm.joints[j].name));
  }
  require(all_finite(arm.flange.position_m) && all_finite(arm.flange.rotation) &&
              all_finite(arm.gravity_m_s2),
          place, "a finite flange and gravity", "a value that is not finite");
  require(is_possible_payload(arm.payload), {place, "payload"},
          "a mass of 0 kg or more, and an inertia that is not negative",
          fmt::format("{} kg", arm.payload.mass_kg));
}

}  // namespace torsio
