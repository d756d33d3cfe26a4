#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string_view>

#include "arm/vector3.hpp"
#include "data/yaml_reader.hpp"
#include "sim/arm/arm_bench.hpp"
#include "sim/arm/path_motion.hpp"
#include "sim/arm/plate_contact.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {
namespace {

constexpr double kLongestStep_s = 3600.0;
constexpr double kLargestForce_N = 1e4;
constexpr double kLargestGain = 1e5;
constexpr std::size_t kMaxSteps = 1000;
constexpr double kSameAngle_rad = 0.02;  // a trajectory begins where the step before ended
constexpr double kSpeedRounding = 1.001;

constexpr std::array kTasks{ArmTask::move,  ArmTask::follow,    ArmTask::hold,
                            ArmTask::guide, ArmTask::impedance, ArmTask::cartesian};

std::vector<double> angles_of(const YamlValue& list, const ArmSetup& setup) {
  const std::vector<YamlValue> items = list.items();
  if (items.size() != setup.moves.size())
    list.refuse(fmt::format("{} angles, one per joint of the arm", setup.moves.size()));
  std::vector<double> angle_rad;
  for (std::size_t j = 0; j < items.size(); ++j) {
    const double angle = items[j].number("rad");
    const JointMoveLimits& limits = setup.moves[j];
    if (!(angle >= limits.lowest_rad && angle <= limits.highest_rad))
      items[j].refuse(
          fmt::format("an angle of joint '{}' within its limits, {:.4g} to {:.4g} rad "
                      "({:.4g} to {:.4g} deg)",
                      setup.arm.joints[j].name, limits.lowest_rad, limits.highest_rad,
                      deg_from_rad(limits.lowest_rad), deg_from_rad(limits.highest_rad)));
    angle_rad.push_back(angle);
  }
  return angle_rad;
}

std::vector<double> gains_of(const YamlValue& list, std::size_t count) {
  std::vector<double> gains;
  for (const YamlValue& item : list.items()) {
    const double gain = item.plain_number(kLargestGain);
    if (!(gain >= 0.0)) item.refuse("a number of 0 or more");
    gains.push_back(gain);
  }
  if (gains.size() != count)
    list.refuse(fmt::format("{} numbers, one per joint of the arm", count));
  return gains;
}

Vector3 vector_of(const YamlValue& list, std::string_view unit) {
  const std::vector<YamlValue> items = list.items();
  if (items.size() != 3) list.refuse("three numbers, along x, y and z of the base");
  Vector3 of;
  for (std::size_t i = 0; i < 3; ++i) {
    of[i] = items[i].number(unit);
    if (!(std::abs(of[i]) <= kLargestForce_N)) items[i].refuse("at most 10000 N or Nm");
  }
  return of;
}

double duration_of(const YamlValue& yaml) {
  const double duration_s = yaml.positive_number("s");
  if (duration_s > kLongestStep_s) yaml.refuse("a time of at most one hour");
  return duration_s;
}

ArmPush push_of(const YamlValue& yaml, const ArmSetup& setup) {
  yaml.allow_only({"force", "moment", "torque", "at", "for"});
  ArmPush push;
  if (const auto force = yaml.find("force")) push.force_N = vector_of(*force, "N");
  if (const auto moment = yaml.find("moment")) push.moment_Nm = vector_of(*moment, "Nm");
  if (const auto torque = yaml.find("torque")) {
    std::vector<std::string> names;
    for (const ArmJoint& joint : setup.arm.joints) names.push_back(joint.name);
    torque->allow_only(std::span<const std::string>(names));
    push.torque_Nm.assign(names.size(), 0.0);
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto value = torque->find(names[j]);
      if (!value) continue;
      push.torque_Nm[j] = value->number("Nm");
      if (!(std::abs(push.torque_Nm[j]) <= kLargestForce_N)) value->refuse("at most 10000 Nm");
    }
  }
  if (const auto at = yaml.find("at")) {
    push.start_s = at->number("s");
    if (!(push.start_s >= 0.0)) at->refuse("a time of 0 s or more since the step began");
  }
  push.duration_s = duration_of(yaml.at("for"));
  if (!yaml.find("force") && !yaml.find("moment") && !yaml.find("torque"))
    yaml.refuse("a force, a moment or a torque", "For example force: [0N, 20N, 0N].");
  return push;
}

ArmPlate plate_of(const YamlValue& yaml) {
  yaml.allow_only({"at", "from_flange", "normal", "stiffness_N_m", "damping_Ns_m", "mass"});
  const auto at = yaml.find("at");
  const auto from_flange = yaml.find("from_flange");
  if (at.has_value() == from_flange.has_value())
    yaml.refuse("one of at (in the frame of the base) and from_flange (from where the flange is)");
  ArmPlate plate{.is_from_flange = from_flange.has_value(),
                 .at_m = vector_of(at ? *at : *from_flange, "m")};
  const YamlValue normal = yaml.at("normal");
  const std::vector<YamlValue> items = normal.items();
  if (items.size() != 3) normal.refuse("three numbers, along x, y and z of the base");
  for (std::size_t i = 0; i < 3; ++i) plate.normal[i] = items[i].plain_number(1e3);
  const double length = std::sqrt(dot(plate.normal, plate.normal));
  if (!(length > 0.0)) normal.refuse("a direction: not three zeros");
  plate.normal = (1.0 / length) * plate.normal;
  const YamlValue stiffness = yaml.at("stiffness_N_m");
  plate.stiffness_N_m = stiffness.plain_number(PlateContact::kLargestStiffness_N_m);
  if (!(plate.stiffness_N_m > 0.0)) stiffness.refuse("a stiffness above 0 and at most 1e6 N/m");
  if (const auto damping = yaml.find("damping_Ns_m")) {
    plate.damping_Ns_m = damping->plain_number(kLargestGain);
    if (!(plate.damping_Ns_m >= 0.0)) damping->refuse("a damping of 0 or more");
  }
  if (const auto mass = yaml.find("mass")) {
    plate.mass_kg = mass->number("kg");
    if (!(plate.mass_kg >= PlateContact::kSmallestMass_kg && plate.mass_kg <= kLargestForce_N))
      mass->refuse("a mass of 0.5 kg or more", "Leave the mass out for a clamped plate.");
  }
  return plate;
}

ContactReaction reaction_of(const YamlValue& yaml) {
  constexpr std::array kReactions{ContactReaction::none, ContactReaction::stop,
                                  ContactReaction::hold, ContactReaction::retract,
                                  ContactReaction::floating};
  const std::string word = yaml.text();
  const auto* const found = std::ranges::find_if(
      kReactions, [&](ContactReaction reaction) { return name(reaction) == word; });
  if (found == kReactions.end()) yaml.refuse("one of none, stop, hold, retract and float");
  return *found;
}

/// The line of a CSV file with a header in which a sample is.
std::string at_sample(const std::string& file, std::size_t sample) {
  return file.ends_with(".csv") ? fmt::format("{}: line {}", file, sample + 2)
                                : fmt::format("{}: sample {}", file, sample + 1);
}

void check_path(const std::vector<std::vector<double>>& path_rad, const ArmSetup& setup,
                const std::string& file) {
  for (std::size_t j = 0; j < path_rad.size(); ++j) {
    const JointMoveLimits& limits = setup.moves[j];
    const std::string& name = setup.arm.joints[j].name;
    const std::vector<double>& q = path_rad[j];
    for (std::size_t n = 0; n < q.size(); ++n) {
      if (!(q[n] >= limits.lowest_rad && q[n] <= limits.highest_rad))
        throw Error({.place = at_sample(file, n),
                     .problem = fmt::format("the trajectory crosses a limit of joint '{}'", name),
                     .expected = fmt::format("an angle from {:.4g} to {:.4g} rad",
                                             limits.lowest_rad, limits.highest_rad),
                     .found = fmt::format("{:.4g} rad", q[n])});
      if (n == 0) continue;
      const double speed_rad_s = std::abs(q[n] - q[n - 1]) * kBenchRate_Hz;
      if (speed_rad_s > kSpeedRounding * limits.speed_rad_s)
        throw Error({.place = at_sample(file, n),
                     .problem = fmt::format("the trajectory is too fast for joint '{}'", name),
                     .expected = fmt::format("at most {:.4g} rad/s", limits.speed_rad_s),
                     .found = fmt::format("{:.4g} rad/s", speed_rad_s)});
    }
  }
}

/// The torques of the links, as without contacts.
void check_torques(const std::vector<std::vector<double>>& path_rad, const ArmSetup& setup,
                   const std::string& file) {
  const ArmDynamics dynamics(setup.arm);
  ArmDynamics::PerJoint angle_rad = {};
  ArmDynamics::PerJoint speed_rad_s = {};
  ArmDynamics::PerJoint acceleration_rad_s2 = {};
  ArmDynamics::PerJoint torque_Nm = {};
  for (std::size_t n = 0; n < path_rad.front().size(); ++n) {
    for (std::size_t j = 0; j < path_rad.size(); ++j) {
      angle_rad[j] = path_rad[j][n];
      speed_rad_s[j] = path_speed(path_rad[j], n);
      acceleration_rad_s2[j] = path_acceleration(path_rad[j], n);
    }
    dynamics.inverse(angle_rad, speed_rad_s, acceleration_rad_s2, torque_Nm);
    for (std::size_t j = 0; j < path_rad.size(); ++j)
      if (std::abs(torque_Nm[j]) > setup.arm.joints[j].effort_Nm)
        throw Error({.place = at_sample(file, n),
                     .problem = fmt::format("the trajectory needs more torque than joint '{}' has",
                                            setup.arm.joints[j].name),
                     .expected = fmt::format("at most {:.4g} Nm", setup.arm.joints[j].effort_Nm),
                     .found = fmt::format("{:.4g} Nm", std::abs(torque_Nm[j])),
                     .advice = "Make it slower or smoother."});
  }
}

std::vector<std::vector<double>> path_of(const YamlValue& yaml, const std::string& file,
                                         const ArmSetup& setup, const Progress& progress) {
  LoadOptions options;
  options.rate_Hz = kBenchRate_Hz;
  options.progress = progress;
  const std::vector<Recording> recordings = load_recordings(file, options);
  if (recordings.size() != 1) yaml.refuse("a file with one recording");
  const Recording& recording = recordings.front();
  std::vector<std::vector<double>> path_rad;
  for (const ArmJoint& joint : setup.arm.joints) {
    const std::string name = joint.name + "_angle_rad";
    if (!recording.has(name))
      throw Error({.place = file,
                   .expected = fmt::format("a channel '{}' (or in deg) for each joint", name),
                   .found = "none of that name",
                   .advice = "Name the columns as the joints of the arm, or use a mapping."});
    path_rad.push_back(recording.channel(name).values);
  }
  check_path(path_rad, setup, file);
  check_torques(path_rad, setup, file);
  return path_rad;
}

ArmStep step_of(const YamlValue& yaml, const std::filesystem::path& folder, const ArmSetup& setup,
                const Progress& progress) {
  const std::size_t count = setup.moves.size();
  ArmStep step;
  const auto* const task = std::ranges::find_if(
      kTasks, [&](ArmTask of) { return yaml.is_map() && yaml.find(name(of)).has_value(); });
  if (task == kTasks.end())
    yaml.refuse("one of move, follow, hold, guide, impedance and cartesian",
                "For example '- hold: 1s', or '- move: [0deg, ...]'.");
  step.task = *task;
  const YamlValue what = yaml.at(name(step.task));
  if (step.task == ArmTask::impedance)
    yaml.allow_only({"impedance", "stiffness_Nm_rad", "damping_Nms_rad", "push", "plate"});
  else
    yaml.allow_only({name(step.task), "push", "plate"});
  switch (step.task) {
    case ArmTask::move: step.to_rad = angles_of(what, setup); break;
    case ArmTask::follow:
      step.path_rad = path_of(what, (folder / what.text()).string(), setup, progress);
      break;
    case ArmTask::impedance:
      step.stiffness_Nm_rad = gains_of(yaml.at("stiffness_Nm_rad"), count);
      step.damping_Nms_rad = gains_of(yaml.at("damping_Nms_rad"), count);
      [[fallthrough]];
    case ArmTask::hold:
    case ArmTask::guide:
    case ArmTask::cartesian: step.duration_s = duration_of(what); break;
  }
  if (const auto push = yaml.find("push")) {
    const std::vector<YamlValue> pushes = push->is_list() ? push->items() : std::vector{*push};
    for (const YamlValue& one : pushes) {
      step.pushes.push_back(push_of(one, setup));
      const double end_s = step.pushes.back().start_s + step.pushes.back().duration_s;
      if (step.duration_s > 0.0 && end_s > step.duration_s + kArmTick_s)
        one.refuse(fmt::format("a push that ends within the {:g} s of its step", step.duration_s),
                   "Make the step longer, or at and for smaller.");
    }
  }
  if (const auto plate = yaml.find("plate")) step.plate = plate_of(*plate);
  return step;
}

CartesianImpedance::Settings cartesian_of(const YamlValue& yaml) {
  yaml.allow_only({"stiffness_N_m", "stiffness_Nm_rad", "damping_ratio", "posture_Nm_rad"});
  CartesianImpedance::Settings settings;
  const auto gains = [](const YamlValue& list) { return gains_of(list, 3); };
  if (const auto translation = yaml.find("stiffness_N_m"))
    std::ranges::copy(gains(*translation), settings.stiffness.begin());
  if (const auto rotation = yaml.find("stiffness_Nm_rad"))
    std::ranges::copy(gains(*rotation), settings.stiffness.begin() + 3);
  if (const auto ratio = yaml.find("damping_ratio"))
    settings.damping_ratio = ratio->plain_number(10.0);
  if (const auto posture = yaml.find("posture_Nm_rad")) {
    settings.null_stiffness_Nm_rad = posture->plain_number(kLargestGain);
    settings.null_damping_Nms_rad = 0.1 * settings.null_stiffness_Nm_rad;
  }
  return settings;
}

}  // namespace

ArmProgram read_arm_program(const std::string& path, const ArmSetup& setup,
                            const Progress& progress) {
  const YamlValue yaml = YamlValue::read(path, progress);
  yaml.allow_only({"start", "program", "cartesian", "contact"});
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  ArmProgram program{.start_rad = angles_of(yaml.at("start"), setup)};
  if (const auto cartesian = yaml.find("cartesian")) program.cartesian = cartesian_of(*cartesian);
  if (const auto contact = yaml.find("contact")) program.reaction = reaction_of(*contact);
  const YamlValue steps = yaml.at("program");
  if (!steps.is_list() || steps.items().empty() || steps.items().size() > kMaxSteps)
    steps.refuse(fmt::format("a list of 1 to {} steps", kMaxSteps));
  for (const YamlValue& step : steps.items()) {
    program.steps.push_back(step_of(step, folder, setup, progress));
    if (program.steps.back().task == ArmTask::follow)
      program.files.push_back((folder / step.at("follow").text()).string());
  }
  try {
    require_possible(program, setup);
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place = fmt::format("{}: {}", path, report.place);
    throw Error(std::move(report));
  }
  return program;
}

void require_possible(const ArmProgram& program, const ArmSetup& setup) {
  const CartesianImpedance impedance(program.cartesian);
  const ArmDynamics dynamics(setup.arm);
  std::vector<double> at_rad = program.start_rad;
  bool is_known = true;  // where the step begins
  for (std::size_t s = 0; s < program.steps.size(); ++s) {
    const ArmStep& step = program.steps[s];
    const std::string place = fmt::format("step {} ({})", s + 1, name(step.task));
    if (step.task == ArmTask::move) {
      const ArmMove move(std::vector{at_rad, step.to_rad}, setup.moves, kBenchRate_Hz);
      at_rad = step.to_rad;
      is_known = true;
    } else if (step.task == ArmTask::follow) {
      for (std::size_t j = 0; j < at_rad.size(); ++j) {
        if (is_known && std::abs(step.path_rad[j].front() - at_rad[j]) > kSameAngle_rad)
          throw Error({.place = place,
                       .problem = fmt::format("the trajectory of joint '{}' does not begin where "
                                              "the step before ended",
                                              setup.arm.joints[j].name),
                       .expected = fmt::format("{:.4g} rad", at_rad[j]),
                       .found = fmt::format("{:.4g} rad", step.path_rad[j].front()),
                       .advice = "Move to its first angles before."});
        at_rad[j] = step.path_rad[j].back();
      }
      is_known = true;
    } else if (step.task == ArmTask::cartesian && is_known) {
      const ArmDynamics::PerJoint rest = {};
      const auto output =
          impedance.step(dynamics, at_rad, rest, {.flange = dynamics.flange(at_rad)});
      if (output.is_singular)
        throw Error(
            {.place = place,
             .problem = "the arm is in a singular configuration: its flange cannot move in "
                        "every direction of the impedance",
             .expected = fmt::format("a manipulability above {:g}", CartesianImpedance::kSingular),
             .found = fmt::format("{:.2g}", output.manipulability),
             .advice = "Bend the elbow and the wrist by a move before, or leave the rotations "
                       "free (stiffness_Nm_rad: [0, 0, 0])."});
    }
    if (step.task == ArmTask::guide || step.task == ArmTask::impedance ||
        step.task == ArmTask::cartesian)
      is_known = false;
  }
}

ArmProgram arm6_program() {
  const auto deg = [](std::vector<double> angles) {
    for (double& angle : angles) angle = rad_from_deg(angle);
    return angles;
  };
  return {.start_rad = deg({0, -60, 100, 0, 40, 0}),
          .steps = {
              {.task = ArmTask::move, .to_rad = deg({40, -20, 60, 30, 50, -30})},
              {.task = ArmTask::move, .to_rad = deg({-40, -80, 110, -40, 20, 60})},
              {.task = ArmTask::move, .to_rad = deg({0, -40, 90, 0, 50, 0})},
              {.task = ArmTask::hold,
               .duration_s = 1.5,
               .pushes = {{.start_s = 0.5, .duration_s = 0.5, .force_N = {0.0, 20.0, -20.0}}}},
              {.task = ArmTask::cartesian,
               .duration_s = 2.5,
               .pushes = {{.start_s = 0.5, .duration_s = 1.0, .force_N = {0.0, 0.0, 30.0}}}},
              {.task = ArmTask::guide,
               .duration_s = 2.0,
               .pushes = {{.start_s = 0.3, .duration_s = 0.4, .force_N = {0.0, 25.0, 0.0}},
                          {.start_s = 1.0, .duration_s = 0.4, .force_N = {0.0, -25.0, 0.0}}}},
              {.task = ArmTask::hold, .duration_s = 1.0},
          }};
}

}  // namespace torsio
