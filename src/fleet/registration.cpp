#include "fleet/registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace torsio {
namespace {

/// Adds the files of a joint as they were when the study began. @returns their uses by its model
std::vector<RecordingUse> add_recordings(Registry& registry, const CalibrationRequest& request,
                                         const std::string& serial) {
  std::vector<RecordingUse> uses;
  const auto joint = std::ranges::find(request.joints, serial, &FleetJoint::serial);
  if (joint == request.joints.end()) return uses;  // simulated
  const auto add = [&](const std::vector<std::string>& files, Role role) {
    for (const std::string& file : files) {
      uses.push_back({.sha256 = request.sha256.at(file), .role = std::string(name(role))});
      registry.add_recording({.sha256 = uses.back().sha256, .device = serial, .file = file});
    }
  };
  add(joint->train, Role::train);
  add(joint->test, Role::test);
  return uses;
}

}  // namespace

RegisteredFleet register_fleet(Registry& registry, StudyStore& store, const FleetCalibration& fleet,
                               const CalibrationRequest& request, bool promotes,
                               const std::string& by) {
  RegisteredFleet result;
  for (std::size_t i = 0; i < fleet.joints.size(); ++i) {
    const CalibratedJoint& joint = fleet.joints[i];
    registry.add_device({.serial = joint.serial, .type = joint.type});
    if (joint.chosen.empty()) continue;  // no model was made
    const std::optional<RegisteredModel> before = registry.current(joint.serial);
    NewModel added{.device = joint.serial,
                   .bytes = store.samples(joint.trial),
                   .file = joint.serial + ".safetensors",
                   .by = by,
                   .note = fmt::format("fleet calibrate: {}", joint.chosen),
                   .recordings = add_recordings(registry, request, joint.serial),
                   .trial = joint.trial,
                   .base_sha256 = joint.base_sha256};
    if (before && before->trial != joint.trial) added.parent = before->id;
    const std::int64_t model = registry.add_model(added);
    ++result.models;
    if (!promotes) continue;
    if (std::ranges::find(fleet.outliers, i, &FleetOutlier::joint) != fleet.outliers.end()) {
      result.refused.push_back(joint.serial + ": it differs from the others of its type");
      continue;
    }
    if (!registry.promote(joint.serial, model, by, "fleet calibrate")) {
      ++result.current_before;
      continue;
    }
    ++result.promoted;
    if (!fleet.is_compared(i)) result.not_compared.push_back(joint.serial);
  }
  return result;
}

}  // namespace torsio
