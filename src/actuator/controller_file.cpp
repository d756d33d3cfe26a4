#include "torsio/actuator/controller_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "data/yaml_reader.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Actuation = DeflectionController::Actuation;

constexpr std::string_view kFormat = "torsio.controller";
constexpr int kVersion = 1;
constexpr double kLargest = 1e12;  // so that no product of settings overflows

/// A number of the file. An optional one that is not there keeps the value of the default settings.
struct Field {
  const char* key;
  double* value;
  bool is_optional = false;
};

struct Section {
  const char* key;
  std::vector<Field> fields;
};

constexpr bool kOptional = true;

/// The numbers that both directions have in common, in their order.
std::vector<Section> sections_of(ControllerFile& file) {
  DeflectionController::Settings& deflection = file.settings.torque.deflection;
  Drive& drive = deflection.joint.drive;
  JointCascade::Limits& limits = file.settings.limits;
  std::vector<Section> sections{
      {"drive",
       {{"ratio", &drive.ratio},
        {"torque_constant_Nm_A", &drive.torque_constant_Nm_A},
        {"rotor_inertia_kg_m2", &drive.rotor_inertia_kg_m2},
        {"viscous_Nms_rad", &drive.viscous_Nms_rad},
        {"coulomb_Nm", &drive.coulomb_Nm},
        {"rated_current_A", &drive.rated_current_A},
        {"peak_current_A", &drive.peak_current_A},
        {"current_time_constant_s", &drive.current_time_constant_s},
        {"supply_V", &drive.supply_V},
        {"resistance_Ohm", &drive.resistance_Ohm}}},
      {"joint",
       {{"stiffness_Nm_rad", &deflection.joint.stiffness_Nm_rad},
        {"inertia_kg_m2", &deflection.joint.joint_inertia_kg_m2},
        {"viscous_Nms_rad", &deflection.joint.joint_viscous_Nms_rad}}},
      {"deflection",
       {{"bandwidth_rad_s", &deflection.bandwidth_rad_s},
        {"damping", &deflection.damping},
        {"integral_1_s", &deflection.integral_1_s},
        {"rate_cutoff_Hz", &deflection.rate_cutoff_Hz, kOptional},
        {"largest_deflection_rad", &deflection.largest_deflection_rad, kOptional},
        {"fault_decay_s", &deflection.fault_decay_s, kOptional}}},
      {"limits",
       {{"lowest_rad", &limits.lowest_rad, kOptional},
        {"highest_rad", &limits.highest_rad, kOptional},
        {"speed_rad_s", &limits.speed_rad_s},
        {"torque_Nm", &limits.torque_Nm, kOptional},
        {"max_unmeasured_load_Nm", &limits.max_unmeasured_load_Nm},
        {"max_measured_load_Nm", &limits.max_measured_load_Nm},
        {"current_rate_A_s", &limits.current_rate_A_s, kOptional},
        {"thermal_time_s", &limits.thermal_time_s, kOptional},
        {"override_rad_s", &file.settings.override_rad_s, kOptional},
        {"speed_cutoff_Hz", &file.settings.speed_cutoff_Hz, kOptional}}}};
  if (file.stop) {
    JointStop::Settings& stop = *file.stop;
    sections.push_back({"stop",
                        {{"speed_rad_s", &stop.speed_rad_s},
                         {"deceleration_rad_s2", &stop.deceleration_rad_s2},
                         {"longest_ramp_s", &stop.longest_ramp_s, kOptional},
                         {"standstill_rad_s", &stop.standstill_rad_s, kOptional},
                         {"standstill_s", &stop.standstill_s, kOptional},
                         {"hold_rad", &stop.hold_rad, kOptional},
                         {"brake_static_Nm", &stop.brake_static_Nm},
                         {"brake_sliding_Nm", &stop.brake_sliding_Nm},
                         {"brake_engage_s", &stop.brake_engage_s},
                         {"brake_release_s", &stop.brake_release_s},
                         {"load_Nm", &stop.load_Nm, kOptional},
                         {"takeover_s", &stop.takeover_s, kOptional}}});
  }
  return sections;
}

double number_of(const YamlValue& yaml) { return yaml.plain_number(kLargest); }

void read_section(const YamlValue& yaml, const Section& section,
                  std::initializer_list<std::string_view> others) {
  std::vector<std::string> known(others.begin(), others.end());
  for (const Field& field : section.fields) known.emplace_back(field.key);
  yaml.allow_only(known);
  for (const Field& field : section.fields) {
    if (const auto value = yaml.find(field.key))
      *field.value = number_of(*value);
    else if (!field.is_optional)
      static_cast<void>(yaml.at(field.key));
  }
}

Pid::Gains read_gains(const YamlValue& yaml) {
  yaml.allow_only({"proportional", "integral", "derivative"});
  return {.proportional = number_of(yaml.at("proportional")),
          .integral = number_of(yaml.at("integral")),
          .derivative = number_of(yaml.at("derivative"))};
}

void read_torque(const YamlValue& yaml, TorqueLoopCore::Settings& torque) {
  yaml.allow_only({"largest_torque_Nm", "friction_share", "friction_speed_rad_s",
                   "observer_cutoff_Hz", "feeds_rate_forward"});
  if (const auto value = yaml.find("largest_torque_Nm"))
    torque.largest_torque_Nm = number_of(*value);
  if (const auto value = yaml.find("friction_share")) {
    torque.friction.emplace();
    torque.friction->share = number_of(*value);
  }
  if (const auto value = yaml.find("friction_speed_rad_s")) {
    if (!torque.friction) value->refuse("friction_share beside it");
    torque.friction->speed_rad_s = number_of(*value);
  }
  if (const auto value = yaml.find("observer_cutoff_Hz"))
    torque.observer_cutoff_Hz = number_of(*value);
  if (const auto value = yaml.find("feeds_rate_forward"))
    torque.feeds_rate_forward = value->boolean();
}

ControllerFile controller_of(const YamlValue& yaml) {
  yaml.allow_only({"format", "version", "actuator", "sample_rate_Hz", "drive", "joint",
                   "deflection", "torque", "cascade", "limits", "stop"});
  if (yaml.at("format").text() != kFormat)
    yaml.at("format").refuse(std::string(kFormat), "torsio tune-loop -o FILE.yaml writes one.");
  if (yaml.at("version").count() != static_cast<std::size_t>(kVersion))
    yaml.at("version").refuse(fmt::format("{}", kVersion),
                              "Write the file again with torsio tune-loop of this version.");
  ControllerFile file{.actuator = yaml.at("actuator").text(),
                      .sample_rate_Hz = number_of(yaml.at("sample_rate_Hz"))};
  if (yaml.find("stop")) file.stop.emplace();
  DeflectionController::Settings& deflection = file.settings.torque.deflection;
  for (const Section& section : sections_of(file)) {
    const bool is_deflection = std::string_view(section.key) == "deflection";
    read_section(yaml.at(section.key), section,
                 is_deflection
                     ? std::initializer_list<std::string_view>{"actuation", "gains", "anti_windup"}
                     : std::initializer_list<std::string_view>{});
  }
  const YamlValue own = yaml.at("deflection");
  const std::string actuation = own.at("actuation").text();
  if (actuation != "current" && actuation != "velocity")
    own.at("actuation").refuse("current or velocity");
  deflection.actuation = actuation == "current" ? Actuation::current : Actuation::velocity;
  if (const auto gains = own.find("gains")) deflection.gains = read_gains(*gains);
  if (const auto scheme = own.find("anti_windup")) {
    if (scheme->text() != "conditional" && scheme->text() != "back_calculation")
      scheme->refuse("conditional or back_calculation");
    deflection.anti_windup = scheme->text() == "conditional" ? Pid::AntiWindup::conditional
                                                             : Pid::AntiWindup::back_calculation;
  }
  if (const auto torque = yaml.find("torque")) read_torque(*torque, file.settings.torque);
  if (const auto cascade = yaml.find("cascade")) {
    cascade->allow_only({"position_1_s", "velocity"});
    file.settings.gains =
        JointCascade::Gains{.position_1_s = number_of(cascade->at("position_1_s")),
                            .velocity = read_gains(cascade->at("velocity"))};
  }
  if (file.stop) file.stop->drive = deflection.joint.drive;
  // What they refuse.
  static_cast<void>(JointControllerCore(file.settings, file.sample_rate_Hz));
  if (file.stop) static_cast<void>(JointStop(*file.stop, file.sample_rate_Hz));
  return file;
}

std::string gains_yaml(const Pid::Gains& gains) {
  return fmt::format("{{proportional: {}, integral: {}, derivative: {}}}", gains.proportional,
                     gains.integral, gains.derivative);
}

}  // namespace

std::string controller_yaml(const ControllerFile& controller) {
  ControllerFile file = controller;
  const TorqueLoopCore::Settings& torque = file.settings.torque;
  const DeflectionController::Settings& deflection = torque.deflection;
  std::string text =
      fmt::format("format: {}\nversion: {}\nactuator: {}\nsample_rate_Hz: {}\n", kFormat, kVersion,
                  yaml_quoted(file.actuator), file.sample_rate_Hz);
  for (const Section& section : sections_of(file)) {
    text += fmt::format("{}:\n", section.key);
    for (const Field& field : section.fields)
      if (std::isfinite(*field.value)) text += fmt::format("  {}: {}\n", field.key, *field.value);
    if (std::string_view(section.key) != "deflection") continue;
    text +=
        fmt::format("  actuation: {}\n  anti_windup: {}\n",
                    deflection.actuation == Actuation::current ? "current" : "velocity",
                    deflection.anti_windup == Pid::AntiWindup::conditional ? "conditional"
                                                                           : "back_calculation");
    if (deflection.gains) text += fmt::format("  gains: {}\n", gains_yaml(*deflection.gains));
  }
  if (const auto& gains = file.settings.gains)
    text += fmt::format("cascade:\n  position_1_s: {}\n  velocity: {}\n", gains->position_1_s,
                        gains_yaml(gains->velocity));
  text += fmt::format("torque:\n  feeds_rate_forward: {}\n", torque.feeds_rate_forward);
  if (std::isfinite(torque.largest_torque_Nm))
    text += fmt::format("  largest_torque_Nm: {}\n", torque.largest_torque_Nm);
  if (torque.friction)
    text += fmt::format("  friction_share: {}\n  friction_speed_rad_s: {}\n",
                        torque.friction->share, torque.friction->speed_rad_s);
  if (torque.observer_cutoff_Hz)
    text += fmt::format("  observer_cutoff_Hz: {}\n", *torque.observer_cutoff_Hz);
  return text;
}

ControllerFile read_controller(const std::string& path, const Progress& progress) {
  return controller_of(YamlValue::read(path, progress));
}

ControllerFile parse_controller(std::string_view text, const std::string& file) {
  return controller_of(YamlValue::parse(text, file));
}

}  // namespace torsio
