#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "data/yaml_reader.hpp"
#include "evaluate/model_entry.hpp"
#include "fleet/calibration.hpp"
#include "search/specimen_study.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::string beside(const std::string& list, const std::string& path) {
  const std::filesystem::path own(path);
  return own.is_absolute()
             ? path
             : (std::filesystem::path(list).parent_path() / own).lexically_normal().string();
}

std::vector<std::string> files_of(const YamlValue& joint, std::string_view key,
                                  const std::string& list) {
  const auto yaml = joint.find(key);
  if (!yaml) return {};
  std::vector<std::string> files =
      yaml->is_scalar() ? std::vector<std::string>{yaml->text()} : yaml->texts();
  for (std::string& file : files) file = beside(list, file);
  return files;
}

FleetJoint joint_from(const YamlValue& yaml, const std::string& list) {
  yaml.allow_only({"serial", "type", "train", "test"});
  FleetJoint joint{.serial = yaml.at("serial").text(),
                   .train = files_of(yaml, "train", list),
                   .test = files_of(yaml, "test", list)};
  if (const auto type = yaml.find("type")) joint.type = type->text();
  if (joint.serial.empty()) yaml.at("serial").refuse("a serial number");
  if (joint.train.empty()) yaml.at("train").refuse("at least one recording");
  return joint;
}

}  // namespace

CalibrationRequest read_fleet_list(const std::string& path) {
  const YamlValue yaml = YamlValue::read(path);
  yaml.allow_only({"mapping", "target", "sample_rate_Hz", "inputs", "base", "joints"});
  CalibrationRequest request;
  if (const auto mapping = yaml.find("mapping")) {
    request.mapping = mapping->text();
    // A mapping that comes with torsio has a name, not a path.
    if (const std::string file = beside(path, request.mapping); std::filesystem::exists(file))
      request.mapping = file;
  }
  if (const auto target = yaml.find("target")) request.target = target->text();
  if (const auto rate = yaml.find("sample_rate_Hz")) request.rate_Hz = rate->positive_number("Hz");
  if (const auto inputs = yaml.find("inputs")) request.inputs = inputs->texts();
  if (const auto base = yaml.find("base")) request.base = beside(path, base->text());
  const YamlValue joints = yaml.at("joints");
  std::set<std::string> serials;
  std::map<std::string, std::string> joint_of;  // a recording
  for (const YamlValue& each : joints.items()) {
    request.joints.push_back(joint_from(each, path));
    if (!serials.insert(request.joints.back().serial).second)
      each.at("serial").refuse("another serial number: the list has each joint once");
    const FleetJoint& joint = request.joints.back();
    for (const std::vector<std::string>* files : {&joint.train, &joint.test})
      for (const std::string& file : *files)
        if (const auto [known, is_new] = joint_of.emplace(file, joint.serial); !is_new)
          throw Error({.place = each.place(),
                       .problem = "a recording is listed twice",
                       .expected = "recordings of this joint alone, each once",
                       .found = fmt::format("{}, listed for {}", file, known->second)});
  }
  if (request.joints.empty()) joints.refuse("at least one joint");
  return request;
}

namespace {

void check_faults(const FleetChoice& choice, const CalibrationRequest& request) {
  if (choice.faults == 0) return;
  if (!request.simulated)
    throw UsageError({.place = "--faults",
                      .problem = "only simulated joints can be given a fault",
                      .advice = "Use --specimens in place of a list."});
  if (const std::uint64_t count = request.simulated->last + 1 - request.simulated->first;
      choice.faults > count)
    throw UsageError({.place = "--faults",
                      .expected = fmt::format("at most {}, one for each specimen", count),
                      .found = fmt::format("{}", choice.faults)});
}

}  // namespace

CalibrationRequest calibration_request(const FleetChoice& choice) {
  if (choice.list.empty() == choice.specimens.empty())
    throw UsageError({.place = "fleet calibrate",
                      .expected = "either a list of joints or specimens",
                      .found = choice.list.empty() ? "neither" : "both",
                      .advice = "torsio fleet calibrate robot.yaml"});
  CalibrationRequest request;
  if (!choice.list.empty()) {
    request = read_fleet_list(choice.list);
  } else {
    const SpecimenRequest range = specimen_range(choice.specimens);
    request.simulated = {.actuator = range.actuator,
                         .first = range.first,
                         .last = range.last,
                         .faults = choice.faults};
  }
  check_faults(choice, request);
  if (!choice.base.empty()) request.base = choice.base;
  if (!choice.model.empty()) request.model = choice.model;
  // Refused here and not once for each joint, when the study has its name already.
  check_model_entry(request.model);
  request.seed = choice.seed;
  request.only_compares = choice.only_compares;
  return request;
}

}  // namespace torsio
