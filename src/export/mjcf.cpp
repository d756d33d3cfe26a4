#include "torsio/export/mjcf.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "estimate/branching_estimator.hpp"
#include "estimate/motion_channels.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/core/version.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

void check_mjcf_name(const std::string& name) {
  const auto is_part = [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  };
  if (name.empty() || name.size() > 48 || !std::ranges::all_of(name, is_part) ||
      std::isalpha(static_cast<unsigned char>(name.front())) == 0)
    throw UsageError({.place = "the name of the joint",
                      .expected = "an identifier of at most 48 letters, digits and _ that begins "
                                  "with a letter",
                      .found = '"' + name + '"'});
}

/// The text without what would end a comment of XML or is not allowed in one.
std::string xml_comment(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (static_cast<unsigned char>(text[i]) < ' ') text[i] = ' ';
    if (text[i] == '-' && (i + 1 == text.size() || text[i + 1] == '-')) text[i] = '_';
  }
  return text;
}

void check_model(const ModelFile& model, const Estimator& estimator) {
  const std::string place = "export to MuJoCo";
  const std::string& target = model.settings.target;
  if (const auto parts = split_channel_name(target); !parts || parts->unit->si_suffix != "Nm")
    throw Error({.place = place,
                 .expected = "a model whose target is a torque in Nm",
                 .found = fmt::format("the target '{}'", target)});
  for (const std::string& channel : estimator.raw_inputs()) {
    if (find_motion_channel(channel) != nullptr) continue;
    std::vector<std::string_view> known;
    for (const MotionChannel& each : kMotionChannels) known.push_back(each.name);
    throw Error(
        {.place = place,
         .expected = fmt::format("a model whose channels MuJoCo has: {}", fmt::join(known, ", ")),
         .found = fmt::format("the channel {}", channel),
         .advice = "Train a model without it (torsio fit --inputs)."});
  }
  if (estimator.state_size() == 0)
    throw Error({.place = place,
                 .expected = "a model whose state can be saved",
                 .found = std::string(estimator.model().family())});
}

/// A linear spring: torque = offset + stiffness * deflection.
struct LinearMjcfSpring {
  double offset_Nm = 0.0;
  double stiffness_Nm_rad = 0.0;
};

/// The value of the fallback at rest at this angle of the gear side, with the joint at 0.
double fallback_at(const ModelFile& model, const Estimator& estimator, double gear_rad,
                   double ratio) {
  FeaturePipeline pipeline(model.settings.features, model.settings.sample_rate_Hz);
  std::vector<double> raw;
  for (const std::string& channel : estimator.raw_inputs()) {
    const MotionChannel& motion = *find_motion_channel(channel);
    raw.push_back(motion.is_speed ? 0.0
                                  : motion.gear * gear_rad * (motion.is_of_motor ? ratio : 1.0));
  }
  std::span<const double> features = pipeline.step(raw);
  for (std::size_t i = 0; i < pipeline.settling_samples(); ++i) features = pipeline.step(raw);
  double value = model.settings.fallback.intercept;
  for (std::size_t i = 0; i < features.size(); ++i)
    value += model.settings.fallback.slope[i] * features[i];
  return value;
}

LinearMjcfSpring linear_spring_of(const ModelFile& model, const Estimator& estimator,
                                  double ratio) {
  constexpr double kTwist_rad = 1e-3;
  const double forward = fallback_at(model, estimator, kTwist_rad, ratio);
  const double back = fallback_at(model, estimator, -kTwist_rad, ratio);
  return {.offset_Nm = 0.5 * (forward + back),
          .stiffness_Nm_rad = 0.5 * (forward - back) / kTwist_rad};
}

/// The two inertias of a joint, about its axis [kg m^2].
struct MjcfInertias {
  double rotor = 0.0;   ///< referred to the gear's output
  double middle = 0.0;  ///< the body between gear and spring
  double joint = 0.0;
};

MjcfInertias inertias_of(const DataSheet& sheet) {
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  // With a spring before the last gear, the body between belongs to the joint.
  const bool is_at_joint = std::holds_alternative<GearSheet>(sheet.second);
  return {.rotor = joint.drive.inertia(),
          .middle = is_at_joint ? 0.0 : sheet.middle_inertia_kg_m2.value,
          .joint = joint.joint_inertia_kg_m2};
}

/// Steps of MuJoCo in a tick of the model, so that the fastest oscillation of the two bodies on the spring is resolved:
/// its frequency times the step is at most `kLargestAngle`. Semi-implicit integration is unstable from 2.
double steps_of(const MjcfInertias& inertias, double stiffness_Nm_rad, double rate_Hz) {
  constexpr double kLargestAngle = 0.3;
  const double inverse = 1.0 / (inertias.rotor + inertias.middle) + 1.0 / inertias.joint;
  return std::max(1.0,
                  std::ceil(std::sqrt(stiffness_Nm_rad * inverse) / (rate_Hz * kLargestAngle)));
}

/// The parts of the text, in their order. {n} is the prefix of the names.
constexpr const char* kMjcfHeader = R"(<!-- Written by torsio {version} from {origin}.
     Model: {family}, {rate:g} Hz.
     Actuator: {actuator}, {title}; its numbers are
     those of a data sheet: replace them with yours.
     Units: rad, rad/s, Nm, kg m^2, A, s. The deflection is the gear angle minus the joint angle.

{spring_comment}

     Not expressed: {left_out}.
     The joint is without weight and its link has no length: move the bodies into your model. MuJoCo solves dry friction
     (frictionloss) as a soft constraint, so that a joint at rest creeps. -->
<mujoco model="{n}">
  <compiler angle="radian"/>
  <option timestep="{timestep}" integrator="Euler"/>
{size})";

constexpr const char* kMjcfBodies = R"(  <worldbody>
    <body name="{n}_gear">
      <!-- The output of the gear, before the spring. armature: the rotor, {rotor_inertia} kg m^2, times the square of the ratio {ratio}. -->
      <joint name="{n}_gear" type="hinge" axis="0 0 1" armature="{armature}" damping="{gear_damping}" frictionloss="{gear_friction}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{gear_inertia} {gear_inertia} {gear_inertia}"/>
    </body>
    <body name="{n}_link">
      <!-- After the spring: flange and link. -->
      <joint name="{n}_joint" type="hinge" axis="0 0 1" damping="{joint_damping}" frictionloss="{joint_friction}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{joint_inertia} {joint_inertia} {joint_inertia}"/>
      <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="{n}_deflection">
      <joint joint="{n}_gear" coef="1"/>
      <joint joint="{n}_joint" coef="-1"/>
    </fixed>
  </tendon>
  <actuator>
    <!-- Control: the motor current [A]; gear: Nm at the gear's output per A. -->
    <motor name="{n}_motor" joint="{n}_gear" gear="{torque_per_current}" ctrllimited="true" ctrlrange="-{peak_current} {peak_current}"/>
    <!-- Force: the torque of the spring on the joint [Nm]. -->
    <general name="{n}_spring" tendon="{n}_deflection" gear="-1" gaintype="fixed" gainprm="0" {bias}/>
  </actuator>
  <sensor>
    <jointpos name="{n}_gear_angle_rad" joint="{n}_gear"/>
    <jointpos name="{n}_joint_angle_rad" joint="{n}_joint"/>
    <jointvel name="{n}_gear_speed_rad_s" joint="{n}_gear"/>
    <jointvel name="{n}_joint_speed_rad_s" joint="{n}_joint"/>
    <tendonpos name="{n}_spring_deflection_rad" tendon="{n}_deflection"/>
    <actuatorfrc name="{n}_torque_Nm" actuator="{n}_spring"/>
  </sensor>
</mujoco>
)";

constexpr const char* kMjcfModelSpring =
    R"(     Spring: the model itself, by torsio::MujocoSprings (docs/robot/simulators.md). Without that, its torque is 0:
       torsio::MujocoSprings springs(*model, {{{{.actuator = "{n}_spring", {estimator}}}}});
     {steps})";

constexpr const char* kMjcfLinearSpring =
    R"(     Spring: the linear fallback of the model, {offset} Nm + {stiffness} Nm/rad
     times the deflection, for every MuJoCo. Curve, hysteresis, creep, error bar and faults of the model are left out.)";

std::string left_out(const DataSheet& sheet) {
  return fmt::format(
      "the supply, which limits the speed of the joint to {:.3g} rad/s; the current loop, {:g} s; "
      "ripple of the\n     "
      "motor's torque; elasticity and hysteresis of the gear; friction that depends on the load or "
      "falls with the speed;\n"
      "     resolution, noise and latency of sensors; temperature",
      speed_limit_of(sheet), sheet.motor.current_time_constant_s.value);
}

}  // namespace

std::string mjcf_text(const ModelFile& model, const MjcfOptions& options,
                      const std::string& origin) {
  check_mjcf_name(options.name);
  const Estimator estimator = make_estimator(model);
  check_model(model, estimator);
  const DataSheet& sheet = options.actuator;
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  joint.check();
  const MjcfInertias inertias = inertias_of(sheet);
  const LinearMjcfSpring linear = linear_spring_of(model, estimator, joint.drive.ratio);
  if (options.is_linear && !(linear.stiffness_Nm_rad > 0.0))
    throw Error({.place = "export to MuJoCo, linear spring",
                 .expected = "a model whose linear fallback rises with the deflection",
                 .found = fmt::format("{:g} Nm/rad", linear.stiffness_Nm_rad),
                 .advice = "Export the model itself."});
  const double rate_Hz = model.settings.sample_rate_Hz;
  const double steps =
      steps_of(inertias, std::max(linear.stiffness_Nm_rad, joint.stiffness_Nm_rad), rate_Hz);
  const bool needs_ratio = std::ranges::any_of(
      estimator.raw_inputs(),
      [](const std::string& channel) { return find_motion_channel(channel)->is_of_motor; });
  const std::string spring_comment =
      options.is_linear
          ? fmt::format(kMjcfLinearSpring, fmt::arg("offset", linear.offset_Nm),
                        fmt::arg("stiffness", linear.stiffness_Nm_rad))
          : fmt::format(
                kMjcfModelSpring, fmt::arg("n", options.name),
                fmt::arg("estimator",
                         needs_ratio
                             ? fmt::format(".estimator = ..., .gear_ratio = {}", joint.drive.ratio)
                             : std::string(".estimator = ...")),
                fmt::arg("steps", steps > 1.0
                                      ? fmt::format("A tick of the model is {} steps.", steps)
                                      : std::string("A tick of the model is a step.")));
  const std::string size =
      options.is_linear
          ? std::string()
          : fmt::format("  <!-- The state of the spring. -->\n  <size nuserdata=\"{}\"/>\n",
                        BranchingEstimator::record_size(estimator.state_size()));
  const std::string bias = options.is_linear
                               ? fmt::format(R"(biastype="affine" biasprm="{} {} 0")",
                                             linear.offset_Nm, -linear.stiffness_Nm_rad)
                               : std::string(R"(biastype="user")");
  // MuJoCo requires an inertia of each body that moves.
  constexpr double kNoInertia = 1e-9;
  return fmt::format(fmt::runtime(std::string(kMjcfHeader) + kMjcfBodies),
                     fmt::arg("version", kVersion), fmt::arg("origin", xml_comment(origin)),
                     fmt::arg("family", xml_comment(std::string(model.parameters.family()))),
                     fmt::arg("rate", rate_Hz), fmt::arg("actuator", xml_comment(full_name(sheet))),
                     fmt::arg("title", xml_comment(sheet.title)),
                     fmt::arg("spring_comment", spring_comment),
                     fmt::arg("left_out", left_out(sheet)), fmt::arg("n", options.name),
                     fmt::arg("timestep", 1.0 / (rate_Hz * steps)), fmt::arg("size", size),
                     fmt::arg("rotor_inertia", joint.drive.rotor_inertia_kg_m2),
                     fmt::arg("ratio", joint.drive.ratio), fmt::arg("armature", inertias.rotor),
                     fmt::arg("gear_damping", joint.drive.viscous_Nms_rad),
                     fmt::arg("gear_friction", joint.drive.coulomb_Nm),
                     fmt::arg("gear_inertia", std::max(inertias.middle, kNoInertia)),
                     fmt::arg("joint_damping", joint.joint_viscous_Nms_rad),
                     fmt::arg("joint_friction", sheet.joint.bearing_friction_Nm.value),
                     fmt::arg("joint_inertia", inertias.joint),
                     fmt::arg("torque_per_current", joint.drive.torque_per_current()),
                     fmt::arg("peak_current", joint.drive.peak_current_A), fmt::arg("bias", bias));
}

}  // namespace torsio
