#include "identify/drive/sheet_json.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace torsio {
namespace {

using SheetJson = nlohmann::ordered_json;

/// A condition, or the number with its unit.
std::string stated(const LoadFact& fact, std::string_view unit) {
  return fact.condition.empty() ? fmt::format("{}{}", fact.value, unit) : fact.condition;
}

bool is_stated(const LoadFact& fact) { return !fact.condition.empty() || fact.value != 0.0; }

/// The same of a number without a unit.
SheetJson plain(const LoadFact& fact) {
  return fact.condition.empty() ? SheetJson(fact.value) : SheetJson(fact.condition);
}

/// A load file while it is made.
struct LoadFile {
  SheetJson load = SheetJson::object();
  SheetJson errors = SheetJson::object();

  void state(SheetJson& place, const char* key, const LoadFact& fact, std::string_view unit,
             const char* error_key) {
    place[key] = stated(fact, unit);
    if (fact.relative_error > 0.0)
      errors[error_key] = fmt::format("{}%", 100.0 * fact.relative_error);
    else if (fact.standard_error > 0.0)
      errors[error_key] = fmt::format("{}{}", fact.standard_error, unit);
  }
  void state_if(SheetJson& place, const char* key, const LoadFact& fact, std::string_view unit) {
    if (is_stated(fact) || fact.standard_error > 0.0) state(place, key, fact, unit, key);
  }
};

void add_pendulum(const PendulumFacts& facts, LoadFile& file) {
  SheetJson& pendulum = file.load["pendulum"] = SheetJson::object();
  file.state(pendulum, "mass", facts.mass_kg, "kg", "mass");
  file.state(pendulum, "length", facts.length_m, "m", "length");
  file.state_if(pendulum, "arm_mass", facts.arm_mass_kg, "kg");
  file.state_if(pendulum, "inclination", facts.inclination_rad, "rad");
}

void add_urdf(const UrdfFacts& facts, const std::string& sheet_file, LoadFile& file) {
  file.load["urdf"] =
      std::filesystem::absolute(std::filesystem::path(sheet_file).parent_path() / facts.file)
          .lexically_normal()
          .string();
  file.load["joint"] = facts.joint;
  if (!facts.payload_link.empty()) {
    SheetJson& payload = file.load["payload"] = {{"link", facts.payload_link}};
    file.state(payload, "mass", facts.payload_mass_kg, "kg", "payload_mass");
    payload["at"] = facts.payload_at_m;
  }
  for (const auto& [joint, angle_rad] : facts.pose_rad)
    file.load["pose"][joint] = fmt::format("{}rad", angle_rad);
}

}  // namespace

SheetJson load_sheet_json(const LoadSheet& load) {
  LoadFile file;
  if (const auto* const pendulum = std::get_if<PendulumFacts>(&load.facts))
    add_pendulum(*pendulum, file);
  else
    add_urdf(std::get<UrdfFacts>(load.facts), load.file, file);
  if (load.fits_joint_inertia)
    file.load["joint_inertia"] = "fit";
  else
    file.state_if(file.load, "joint_inertia", load.joint_inertia_kg_m2, "kg_m2");
  if (load.fits_zero)
    file.load["zero"] = "fit";
  else
    file.state_if(file.load, "zero", load.zero_rad, "rad");
  SheetJson document{{"load", std::move(file.load)}};
  if (!file.errors.empty()) document["load_uncertainty"] = std::move(file.errors);
  return document;
}

SheetJson drive_sheet_json(const DriveSheet& drive) {
  SheetJson document{{"law", name(drive.law)}};
  if (!drive.command.empty()) document["command"] = drive.command;
  if (drive.is_command_held) document["between_samples"] = "held";
  if (!drive.angle.empty()) document["angle"] = drive.angle;
  if (drive.gear_ratio) document["gear_ratio"] = *drive.gear_ratio;
  if (drive.law == DriveLaw::position) {
    document["gain"] = plain(drive.gain);
    if (drive.error_gain_1_rad)
      document["error_gain"] = *drive.error_gain_1_rad;
    else
      document["error_gain"] = "measured";
    document["max_duty"] = drive.max_duty_1;
  }
  if (drive.law == DriveLaw::position || drive.law == DriveLaw::voltage) {
    document["supply"] = stated(drive.supply_V, "V");
    document["off"] = drive.brakes_when_off ? "short" : "open_circuit";
  }
  if (drive.law == DriveLaw::pd) {
    document["kp"] = stated(drive.kp_Nm_rad, "Nm_rad");
    document["kd"] = stated(drive.kd_Nms_rad, "Nms_rad");
    document["torque_limit"] = stated(drive.torque_limit_Nm, "Nm");
    if (drive.speed_filter_Hz > 0.0)
      document["filter"] = fmt::format("{}Hz", drive.speed_filter_Hz);
  }
  return document;
}

}  // namespace torsio
