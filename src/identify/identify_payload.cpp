#include "torsio/identify/identify_payload.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "arm/vector3.hpp"
#include "identify/arm_equations.hpp"
#include "identify/momentum_windows.hpp"

namespace torsio {
namespace {

// Priors where the motion determines nothing: far more than an arm of these sizes carries.
constexpr double kLargestMass_kg = 50.0;
constexpr double kLargestMoment_kg_m = 20.0;
constexpr double kLargestInertia_kg_m2 = 10.0;

constexpr double kMassShare = 0.1;
constexpr double kLeastMass_kg = 1.0;
constexpr double kComError_m = 0.03;
constexpr double kInertiaShare = 0.5;

constexpr double kOneOrientation = 0.999;  // length of the mean direction of gravity
constexpr double kAlong = 0.01;            // part of an axis along gravity
constexpr double kNoWeight_Nm = 1e-3;      // 1 kg on any joint
constexpr double kSlow_rad_s = 0.02;

BodyPrior wide_prior() {
  BodyPrior prior;
  BodyParameters std_dev;
  std_dev << kLargestMass_kg, BodyParameters::Constant(kLargestMoment_kg_m).segment<3>(1),
      BodyParameters::Constant(kLargestInertia_kg_m2).segment<6>(4);
  prior.covariance = std_dev.cwiseAbs2().asDiagonal();
  return prior;
}

/// Mass, centre and inertia about it with their standard errors.
struct PayloadValues {
  BodyInertia body;
  std::array<double, kBodyParameters> standard_errors = {};
};

PayloadValues values_of(const ArmFit& of) {
  const Eigen::Index first = of.body.back().value();
  PayloadValues values{.body = body_of(of.fit.parameters.segment<kBodyParameters>(first))};
  // A body whose mass may be 0 has no centre: its derivative would be infinite.
  BodyInertia around = values.body;
  if (std::abs(around.mass_kg) < 1e-6) around.mass_kg = 1e-6;
  const BodyJacobian to_body = parameters_by_body(around).inverse();
  for (Eigen::Index i = 0; i < kBodyParameters; ++i) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(of.fit.parameters.size());
    gradient.segment<kBodyParameters>(first) = to_body.row(i);
    values.standard_errors[static_cast<std::size_t>(i)] = of.fit.standard_error(gradient);
  }
  return values;
}

/// Why the mass has no effect, or the error is too large.
std::string reason_of_mass(const MomentumWindows& windows, double error_kg) {
  if (windows.heaviest_Nm < kNoWeight_Nm)
    return "gravity has no torque about any joint: their axes are parallel to it";
  return fmt::format("its standard error is {:.2g} kg", error_kg);
}

std::string reason_of_com(const MomentumWindows& windows, std::size_t axis, double error_m) {
  const Vector3& direction = windows.mean_gravity_direction;
  if (dot(direction, direction) > kOneOrientation && std::abs(direction[axis]) > kAlong)
    return "the flange keeps one orientation to gravity: a coordinate along it has no torque";
  return fmt::format("its standard error is {:.2g} mm", 1e3 * error_m);
}

std::string reason_of_inertia(const MomentumWindows& windows, double error_kg_m2) {
  if (windows.fastest_rad_s < kSlow_rad_s) return "the arm hardly moves";
  return fmt::format("too little acceleration: its standard error is {:.2g} kg m2", error_kg_m2);
}

}  // namespace

BodyInertia IdentifiedPayload::body() const {
  BodyInertia body;
  if (!mass_kg.is_determined || !(mass_kg.value > 0.0)) return body;
  body.mass_kg = mass_kg.value;
  for (std::size_t i = 0; i < 3; ++i)
    if (com_m[i].is_determined) body.com_m[i] = com_m[i].value;
  const BodyInertia point = body;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!inertia_kg_m2[i].is_determined) return point;
    body.inertia_kg_m2[i] = inertia_kg_m2[i].value;
  }
  return is_possible_payload(body) ? body : point;
}

IdentifiedPayload identify_payload(const ArmModel& arm, std::span<const ArmMotion> motions,
                                   const IdentificationOptions& options) {
  require_possible(options, arm);
  ArmModel unloaded = arm;
  unloaded.payload = {};
  const MomentumWindows windows =
      momentum_windows(unloaded, motions,
                       {.window_s = options.window_s,
                        .speed_window_s = options.speed_window_s,
                        .friction_speed_rad_s = options.friction_speed_rad_s});
  std::vector<BodyPrior> bodies;
  bodies.reserve(arm.joints.size() + 1);
  for (const ArmJoint& joint : arm.joints)
    bodies.push_back(body_prior(joint.body, options.link_share, options.link_com_m));
  bodies.push_back(wide_prior());
  ArmFit fit = fit_arm(unloaded, windows, bodies, options);
  const PayloadValues values = values_of(fit);

  IdentifiedPayload payload{.joints = std::move(fit.joints), .data = fit.data};
  const auto quantity = [&](std::size_t i, double value) {
    return IdentifiedQuantity{.value = value, .standard_error = values.standard_errors[i]};
  };
  payload.mass_kg = quantity(0, values.body.mass_kg);
  const double mass_kg = payload.mass_kg.value;
  payload.mass_kg.is_determined =
      payload.mass_kg.standard_error <= kMassShare * std::max(std::abs(mass_kg), kLeastMass_kg);
  if (!payload.mass_kg.is_determined)
    payload.mass_kg.reason = reason_of_mass(windows, payload.mass_kg.standard_error);
  const bool has_mass =
      payload.mass_kg.is_determined && mass_kg > 3.0 * payload.mass_kg.standard_error;
  const std::string without = payload.mass_kg.is_determined ? "the mass does not differ from 0"
                                                            : "the mass is not determined";
  for (std::size_t i = 0; i < 3; ++i) {
    IdentifiedQuantity& com = payload.com_m[i] = quantity(1 + i, values.body.com_m[i]);
    com.is_determined = has_mass && com.standard_error <= kComError_m;
    if (!com.is_determined)
      com.reason = has_mass ? reason_of_com(windows, i, com.standard_error) : without;
  }
  const auto& inertia = values.body.inertia_kg_m2;
  const double largest = *std::max_element(inertia.begin(), inertia.begin() + 3);
  for (std::size_t i = 0; i < 6; ++i) {
    IdentifiedQuantity& moment = payload.inertia_kg_m2[i] = quantity(4 + i, inertia[i]);
    moment.is_determined = has_mass && moment.standard_error <= kInertiaShare * largest;
    if (!moment.is_determined)
      moment.reason = has_mass ? reason_of_inertia(windows, moment.standard_error) : without;
  }
  return payload;
}

}  // namespace torsio
