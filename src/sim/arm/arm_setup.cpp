#include "torsio/sim/arm/arm_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string_view>

#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "files/whole_file.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/arm/urdf.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/files/monitor_file.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

namespace torsio {
namespace {

/// The arm that comes with torsio.
constexpr std::string_view kArm6Yaml =
#include "arm6_yaml.inc"
    ;
constexpr std::string_view kArm6Urdf =
#include "arm6_urdf.inc"
    ;

constexpr std::uint64_t kPoseSeed = 1;
constexpr int kPoses = 2000;
constexpr double kSlowestSpeedUp_s = 60.0;
constexpr double kLargest = 1e6;
constexpr std::size_t kMaxUrdfBytes = std::size_t{16} << 20U;  // read_urdf has a limit of its own

/// Shares of the torque at rated current: what the spring may carry, and what no sensor measures.
constexpr double kMeasuredShare = kLargestStaticShare;
constexpr double kUnmeasuredShare = 0.05;
/// Fast, so that dry friction makes little difference to the speed at a limit.
constexpr double kOverride_rad_s = 100.0;
/// An external torque above this share of the rating is not a hand.
constexpr double kOverloadShare = 1.0;
/// Holds a guided arm against the error of the estimated torques: 6 Nm in a joint of 300 Nm.
constexpr double kGuidingShare = 0.02;

using ReadText = std::function<std::string(const std::string&)>;

std::vector<double> numbers(const YamlValue& list, std::size_t count, std::string_view unit) {
  std::vector<double> values;
  for (const YamlValue& item : list.items())
    values.push_back(unit.empty() ? item.plain_number(kLargest) : item.number(unit));
  if (values.size() != count) list.refuse(fmt::format("a list of {} numbers", count));
  return values;
}

BodyInertia payload_of(const YamlValue& yaml) {
  yaml.allow_only({"mass", "center_of_mass", "inertia_kg_m2"});
  BodyInertia payload;
  payload.mass_kg = yaml.at("mass").number("kg");
  if (!(payload.mass_kg >= 0.0)) yaml.at("mass").refuse("a mass of 0 kg or more");
  if (const auto com = yaml.find("center_of_mass"))
    std::ranges::copy(numbers(*com, 3, "m"), payload.com_m.begin());
  if (const auto inertia = yaml.find("inertia_kg_m2")) {
    const std::size_t count = inertia->items().size() == 6 ? 6 : 3;
    std::ranges::copy(numbers(*inertia, count, ""), payload.inertia_kg_m2.begin());
  }
  if (!is_possible_payload(payload))
    yaml.refuse("an inertia xx, yy, zz (and xy, xz, yz) that a body can have");
  return payload;
}

DataSheet sheet_of(const YamlValue& yaml, const std::string& name, const Progress& progress) {
  try {
    return find_data_sheet(name, progress);
  } catch (const UsageError& error) {
    ErrorReport report = error.report();
    report.place = yaml.place();
    throw Error(std::move(report));
  }
}

ArmJointSetup joint_of(const YamlValue& yaml, const std::filesystem::path& folder,
                       const Progress& progress) {
  yaml.allow_only({"actuator", "model", "monitor"});
  const YamlValue actuator = yaml.at("actuator");
  const auto beside = [&](const std::string& file) {
    return file.empty() ? file : (folder / file).string();
  };
  std::string name = actuator.text();
  if (is_sheet_file(name)) name = beside(name);
  ArmJointSetup joint{.sheet = sheet_of(actuator, name, progress)};
  if (joint.sheet.family != ActuatorFamily::series_elastic)
    actuator.refuse("a series-elastic actuator: dfki-28, dfki-50, dfki-120 or dfki-300");
  if (const auto model = yaml.find("model")) joint.model = beside(model->text());
  if (const auto monitor = yaml.find("monitor")) joint.monitor = beside(monitor->text());
  return joint;
}

void take_joints(ArmSetup& setup, const YamlValue& yaml, const std::filesystem::path& folder,
                 const Progress& progress) {
  std::vector<std::string> names;
  for (const ArmJoint& joint : setup.arm.joints) names.push_back(joint.name);
  yaml.allow_only(std::span<const std::string>(names));
  for (const std::string& name : names) {
    const auto joint = yaml.find(name);
    if (!joint)
      yaml.refuse(
          fmt::format("an actuator for joint '{}' of the arm", name),
          fmt::format("Add '{}: {{actuator: dfki-28}}', or make the joint fixed in the URDF.",
                      name));
    setup.joints.push_back(joint_of(*joint, folder, progress));
  }
}

/// A joint is as fast and as strong as both its URDF file and its actuator permit.
void limit_to_actuators(ArmSetup& setup) {
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    const RatingSheet& rating = setup.joints[j].sheet.rating;
    ArmJoint& joint = setup.arm.joints[j];
    joint.speed_rad_s = std::min(joint.speed_rad_s, rating.speed_rad_s.value);
    joint.effort_Nm = std::min(joint.effort_Nm, rating.torque_Nm.value);
  }
}

ArmSetup parse(const YamlValue& yaml, const std::filesystem::path& folder, const ReadText& read,
               const Progress& progress) {
  yaml.allow_only({"urdf", "base_tilt", "payload", "speed_up", "joints"});
  const YamlValue urdf = yaml.at("urdf");
  const std::string file = (folder / urdf.text()).string();
  ArmSetup setup{.arm = read_urdf(read(file), file)};
  if (const auto tilt = yaml.find("base_tilt"))
    setup.arm.gravity_m_s2 = tilted_gravity(tilt->number("rad"));
  if (const auto payload = yaml.find("payload")) setup.arm.payload = payload_of(*payload);
  double speed_up_s = 0.5;
  if (const auto given = yaml.find("speed_up")) {
    speed_up_s = given->positive_number("s");
    if (speed_up_s > kSlowestSpeedUp_s) given->refuse("a time of at most 60 s");
  }
  take_joints(setup, yaml.at("joints"), folder, progress);
  limit_to_actuators(setup);
  setup.files.push_back(file);
  for (const ArmJointSetup& joint : setup.joints) {
    for (const std::string& of : {joint.model, joint.monitor})
      if (!of.empty()) setup.files.push_back(of);
  }
  setup.moves = move_limits(setup.arm, speed_up_s);
  require_carriable(setup, yaml.find("payload").value_or(yaml).place());
  return setup;
}

std::string text_of_file(const std::string& path, const std::string& advice) {
  try {
    const std::vector<std::byte> bytes = read_whole_file(path, kMaxUrdfBytes);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.problem =
        report.problem.empty() ? "cannot be read" : "cannot be read: " + report.problem;
    report.advice = advice;
    throw Error(std::move(report));
  }
}

JointControllerCore::Settings control_of(const ArmJoint& joint, const DataSheet& sheet,
                                         double joint_inertia_kg_m2) {
  SeriesElasticJoint elastic = series_elastic_joint(sheet);
  elastic.joint_inertia_kg_m2 = joint_inertia_kg_m2;
  const Drive& drive = elastic.drive;
  const double rated_Nm = drive.rated_current_A * drive.torque_per_current();
  const double wound_rad = joint.effort_Nm / elastic.stiffness_Nm_rad;
  return {.torque = {.deflection = {.joint = elastic}, .largest_torque_Nm = joint.effort_Nm},
          .limits = {.lowest_rad = joint.lowest_rad - wound_rad,
                     .highest_rad = joint.highest_rad + wound_rad,
                     .speed_rad_s = speed_limit_of(sheet),
                     .max_unmeasured_load_Nm = kUnmeasuredShare * rated_Nm,
                     .max_measured_load_Nm = kMeasuredShare * rated_Nm},
          .override_rad_s = kOverride_rad_s,
          .gains = JointCascade::gains_for(drive, kOverride_rad_s)};
}

/// @throws Error with the joint's name
void use_model(ArmController::Joint& joint, const std::string& file, const std::string& name) {
  try {
    const ModelFile model = load_model(file);
    joint.estimator.emplace(make_estimator(model, kBenchRate_Hz));
    joint.inverse = AnyInverse::of(model.settings, model.parameters);
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place = fmt::format("model of joint '{}': {}", name, report.place);
    throw Error(std::move(report));
  }
}

/// The largest torque of gravity on a joint near this pose, one angle after the other: in each of them it is
/// a + b cos q + c sin q, of which three values determine all.
double climbed_torque(const ArmDynamics& dynamics, const ArmModel& arm, std::size_t joint,
                      ArmDynamics::PerJoint angle_rad, double largest_Nm) {
  constexpr int kSweeps = 20;
  ArmDynamics::PerJoint torque_Nm = {};
  const auto at = [&](std::size_t axis, double q) {
    angle_rad[axis] = q;
    dynamics.gravity_torque(angle_rad, torque_Nm);
    return torque_Nm[joint];
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t axis = 0; axis < dynamics.size(); ++axis) {
      double best_rad = angle_rad[axis];
      const double ahead = at(axis, 0.0);
      const double beside = at(axis, 0.5 * std::numbers::pi);
      const double opposite = at(axis, std::numbers::pi);
      const double mean = 0.5 * (ahead + opposite);
      const double turned = std::atan2(beside - mean, ahead - mean);
      const ArmJoint& limits = arm.joints[axis];
      for (const double q : {turned, turned + std::numbers::pi, turned - std::numbers::pi,
                             limits.lowest_rad, limits.highest_rad}) {
        if (!(q >= limits.lowest_rad && q <= limits.highest_rad)) continue;
        const double reached_Nm = std::abs(at(axis, q));
        if (reached_Nm <= largest_Nm) continue;
        largest_Nm = reached_Nm;
        best_rad = q;
      }
      angle_rad[axis] = best_rad;
    }
  }
  return largest_Nm;
}

}  // namespace

ArmSetup read_arm(const std::string& path, const Progress& progress) {
  return parse(
      YamlValue::read(path, progress), std::filesystem::path(path).parent_path(),
      [](const std::string& file) {
        return text_of_file(file, "The path in 'urdf' is relative to the file of the arm.");
      },
      progress);
}

ArmModel read_urdf_file(const std::string& path) { return read_urdf(text_of_file(path, ""), path); }

ArmSetup arm6_setup() {
  return parse(YamlValue::parse(kArm6Yaml, "arm6.yaml"), {},
               [](const std::string&) { return std::string(kArm6Urdf); }, {});
}

void require_carriable(const ArmSetup& setup, const std::string& place) {
  const std::vector<double> needed_Nm = largest_gravity_torques(setup.arm);
  for (std::size_t j = 0; j < needed_Nm.size(); ++j) {
    const double largest_Nm = setup.arm.joints[j].effort_Nm;
    if (needed_Nm[j] <= kLargestStaticShare * largest_Nm) continue;
    const bool is_payload = setup.arm.payload.mass_kg > 0.0;
    throw Error({.place = place,
                 .problem = fmt::format("the {} beyond the rating of joint '{}'",
                                        is_payload ? "payload is" : "weight of the links is",
                                        setup.arm.joints[j].name),
                 .expected = fmt::format("a weight of arm and payload that needs at most {:g} % of "
                                         "the largest {:.4g} Nm in any pose",
                                         100.0 * kLargestStaticShare, largest_Nm),
                 .found = fmt::format("{:.4g} Nm", needed_Nm[j]),
                 .advice = fmt::format("Reduce {}the limits of the joints in the URDF, or take a "
                                       "stronger actuator; the effort of the URDF limits it, too.",
                                       is_payload ? "the payload or " : "")});
  }
}

std::vector<double> largest_gravity_torques(const ArmModel& arm) {
  const ArmDynamics dynamics(arm);
  const std::size_t count = arm.joints.size();
  std::vector<double> largest_Nm(count, 0.0);
  std::vector<ArmDynamics::PerJoint> worst_rad(count);
  Random random(kPoseSeed);
  ArmDynamics::PerJoint angle_rad = {};
  ArmDynamics::PerJoint torque_Nm = {};
  for (int pose = 0; pose < kPoses; ++pose) {
    for (std::size_t j = 0; j < count; ++j)
      angle_rad[j] = random.uniform(arm.joints[j].lowest_rad, arm.joints[j].highest_rad);
    dynamics.gravity_torque(angle_rad, torque_Nm);
    for (std::size_t j = 0; j < count; ++j) {
      if (std::abs(torque_Nm[j]) <= largest_Nm[j]) continue;
      largest_Nm[j] = std::abs(torque_Nm[j]);
      worst_rad[j] = angle_rad;
    }
  }
  for (std::size_t j = 0; j < count; ++j)
    largest_Nm[j] = climbed_torque(dynamics, arm, j, worst_rad[j], largest_Nm[j]);
  return largest_Nm;
}

ArmController::Settings arm_controller_settings(
    const ArmSetup& setup, const std::optional<CartesianImpedance::Settings>& cartesian) {
  ArmController::Settings settings{.arm = setup.arm, .cartesian = cartesian};
  const std::vector<double> weight_Nm = largest_gravity_torques(setup.arm);
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    const ArmJointSetup& from = setup.joints[j];
    const DataSheet& sheet = from.sheet;
    ArmController::Joint joint{
        .control = control_of(setup.arm.joints[j], sheet, sheet.joint.inertia_kg_m2.value),
        .stop = joint_stop_settings(sheet, weight_Nm[j]),
        .bearing_Nm = sheet.joint.bearing_friction_Nm.value,
        .viscous_Nms_rad = sheet.joint.viscous_Nms_rad.value,
        .guiding_friction_Nm = kGuidingShare * setup.arm.joints[j].effort_Nm,
        .largest_external_Nm = kOverloadShare * setup.arm.joints[j].effort_Nm};
    joint.inverse = LinearInverse(joint.control.torque.deflection.joint.stiffness_Nm_rad);
    if (!from.model.empty()) use_model(joint, from.model, setup.arm.joints[j].name);
    // A load cell is after the bearing: a model of its torque contains the friction of the bearing.
    if (!from.model.empty() || !from.monitor.empty())
      joint.bearing_Nm = joint.viscous_Nms_rad = 0.0;
    if (!from.monitor.empty())
      joint.monitored.emplace(load_monitor(from.monitor, {.rate_Hz = kBenchRate_Hz}));
    settings.joints.push_back(std::move(joint));
  }
  return settings;
}

}  // namespace torsio
