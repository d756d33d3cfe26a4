#include "fleet/calibration_text.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "files/json_text.hpp"
#include "search/stored_path.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using FleetJson = nlohmann::ordered_json;

[[noreturn]] void refuse_text(const char* what) {
  throw Error({.place = "store",
               .problem = std::string(what) + " of this study cannot be read",
               .advice = "Use the torsio that began it."});
}

double number_from(const FleetJson& json) {
  return json.is_null() ? kNotMeasured : json.get<double>();
}

FleetJson files_json(const std::vector<std::string>& files, const FileHashes& sha256) {
  FleetJson json = FleetJson::array();
  for (const std::string& file : files)
    json.push_back({{"file", file}, {"sha256", sha256.at(file)}});
  return json;
}

std::vector<std::string> files_from(const FleetJson& json, FileHashes& sha256) {
  std::vector<std::string> files;
  files.reserve(json.size());
  for (const FleetJson& each : json) {
    files.push_back(each.at("file"));
    sha256[files.back()] = each.at("sha256");
  }
  return files;
}

FleetJson joint_json(const FleetJoint& joint, const FileHashes& sha256) {
  return {{"serial", joint.serial},
          {"type", joint.type},
          {"train", files_json(joint.train, sha256)},
          {"test", files_json(joint.test, sha256)}};
}

FleetJoint joint_from(const FleetJson& json, FileHashes& sha256) {
  return {.serial = json.at("serial"),
          .type = json.at("type"),
          .train = files_from(json.at("train"), sha256),
          .test = files_from(json.at("test"), sha256)};
}

FleetJson traits_json(const JointTraits& traits) {
  FleetJson json;
  for (const JointTrait trait : kAllJointTraits) {
    const JointTraits::Value& of = traits[trait];
    json[std::string(name(trait))] = {{"value", json_number(of.value)},
                                      {"std_error", json_number(of.std_error)},
                                      {"unit", of.unit}};
  }
  json["encoder"] = traits.encoder;
  json["encoder_periods"] = traits.encoder_periods;
  json["rmse"] = json_number(traits.rmse);
  return json;
}

JointTraits traits_from(const FleetJson& json) {
  JointTraits traits;
  for (const JointTrait trait : kAllJointTraits) {
    // Results of an earlier version are without the asymmetry.
    if (trait == JointTrait::asymmetry && !json.contains(name(trait))) continue;
    const FleetJson& of = json.at(std::string(name(trait)));
    traits[trait] = {.value = number_from(of.at("value")),
                     .std_error = number_from(of.at("std_error")),
                     .unit = of.at("unit")};
  }
  traits.encoder = json.at("encoder");
  traits.encoder_periods = json.at("encoder_periods");
  traits.rmse = number_from(json.at("rmse"));
  return traits;
}

}  // namespace

std::string task_text(const FleetJoint& joint, const FileHashes& sha256) {
  return joint_json(joint, sha256).dump();
}

FleetJoint task_from_text(std::string_view text, FileHashes& sha256) {
  try {
    return joint_from(FleetJson::parse(text), sha256);
  } catch (const FleetJson::exception&) {
    refuse_text("a joint");
  }
}

std::string calibration_text(const CalibrationRequest& request) {
  FleetJson json{{"mapping", stored_path(request.mapping)},
                 {"rate_Hz", request.rate_Hz},
                 {"target", request.target},
                 {"inputs", request.inputs},
                 {"model", request.model},
                 {"base", request.base},
                 {"base_sha256", request.base.empty() ? "" : request.sha256.at(request.base)},
                 {"seed", request.seed},
                 {"only_compares", request.only_compares}};
  if (request.simulated)
    json["simulated"] = {{"actuator", request.simulated->actuator},
                         {"first", request.simulated->first},
                         {"last", request.simulated->last},
                         {"faults", request.simulated->faults}};
  json["joints"] = FleetJson::array();
  for (const FleetJoint& joint : request.joints)
    json["joints"].push_back(joint_json(joint, request.sha256));
  return json.dump();
}

CalibrationRequest calibration_from_text(std::string_view text) {
  try {
    const FleetJson json = FleetJson::parse(text);
    CalibrationRequest request{.mapping = json.at("mapping"),
                               .rate_Hz = json.at("rate_Hz"),
                               .target = json.at("target"),
                               .inputs = json.at("inputs"),
                               .model = json.at("model"),
                               .base = json.at("base"),
                               .seed = json.at("seed"),
                               .only_compares = json.at("only_compares")};
    if (json.contains("simulated")) {
      const FleetJson& of = json.at("simulated");
      request.simulated = {.actuator = of.at("actuator"),
                           .first = of.at("first"),
                           .last = of.at("last"),
                           .faults = of.at("faults")};
    }
    for (const FleetJson& joint : json.at("joints"))
      request.joints.push_back(joint_from(joint, request.sha256));
    if (!request.base.empty()) request.sha256[request.base] = json.at("base_sha256");
    return request;
  } catch (const FleetJson::exception&) {
    refuse_text("what it calibrates");
  }
}

std::string calibration_differences(std::string_view before, std::string_view now) {
  constexpr auto kParts = std::to_array<std::pair<const char*, const char*>>(
      {{"joints", "the joints or their recordings"},
       {"simulated", "the specimens"},
       {"mapping", "mapping"},
       {"rate_Hz", "sample_rate_Hz"},
       {"target", "target"},
       {"inputs", "inputs"},
       {"model", "model"},
       {"base", "base"},
       {"seed", "seed"},
       {"only_compares", "only-compare"}});
  try {
    const FleetJson a = FleetJson::parse(before);
    const FleetJson b = FleetJson::parse(now);
    std::string text;
    for (const auto& [key, what] : kParts) {
      const FleetJson was = a.value(key, FleetJson());
      const FleetJson is = b.value(key, FleetJson());
      if (was == is) continue;
      text += fmt::format("{}{}", text.empty() ? "" : ", ", what);
      if (was.is_primitive() && is.is_primitive() && !was.is_null() && !is.is_null())
        text += fmt::format(" ({}, now {})", was.dump(), is.dump());
    }
    return text.empty() ? "its description" : text;
  } catch (const FleetJson::exception&) {
    refuse_text("what it calibrates");
  }
}

std::string joint_text(const CalibratedJoint& joint) {
  FleetJson methods = FleetJson::array();
  for (const CalibratedJoint::Method& of : joint.methods)
    methods.push_back({{"name", of.name},
                       {"held_out_rmse", json_number(of.held_out_rmse)},
                       {"test_rmse", json_number(of.test_rmse)}});
  return FleetJson{{"serial", joint.serial},
                   {"type", joint.type},
                   {"fault", joint.fault},
                   {"fault_trait", static_cast<int>(joint.fault_trait)},
                   {"failure", joint.failure},
                   {"warnings", joint.warnings},
                   {"traits", traits_json(joint.traits)},
                   {"methods", std::move(methods)},
                   {"chosen", joint.chosen},
                   {"base_sha256", joint.base_sha256},
                   {"test_rmse", json_number(joint.test_rmse)}}
      .dump();
}

CalibratedJoint joint_from_text(std::string_view text) {
  try {
    const FleetJson json = FleetJson::parse(text);
    CalibratedJoint joint{.serial = json.at("serial"),
                          .type = json.at("type"),
                          .fault = json.at("fault"),
                          .fault_trait = static_cast<JointTrait>(json.at("fault_trait").get<int>()),
                          .failure = json.at("failure"),
                          .warnings = json.at("warnings"),
                          .traits = traits_from(json.at("traits")),
                          .chosen = json.at("chosen"),
                          .test_rmse = number_from(json.at("test_rmse")),
                          // A store that was upgraded may have results without it.
                          .base_sha256 = json.value("base_sha256", std::string())};
    for (const FleetJson& of : json.at("methods"))
      joint.methods.push_back({.name = of.at("name"),
                               .held_out_rmse = number_from(of.at("held_out_rmse")),
                               .test_rmse = number_from(of.at("test_rmse"))});
    return joint;
  } catch (const FleetJson::exception&) {
    refuse_text("a result");
  }
}

}  // namespace torsio
