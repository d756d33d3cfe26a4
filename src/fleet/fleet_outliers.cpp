#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "fleet/calibration.hpp"
#include "fleet/calibration_text.hpp"

namespace torsio {
namespace {

OutlierOptions options_for(JointTrait trait) {
  // A joint with less play than the base has is sound.
  const bool is_upper = is_size(trait) || trait == JointTrait::backlash;
  OutlierOptions options{.sides = is_upper ? OutlierSides::upper : OutlierSides::both};
  // What a remounted load cell may show, docs/robot/drift.md.
  constexpr double kScaleTolerance = 0.012;
  constexpr double kFrictionTolerance = 0.04;
  if (trait == JointTrait::stiffness || trait == JointTrait::asymmetry)
    options.tolerance = kScaleTolerance;
  if (trait == JointTrait::friction) options.tolerance = kFrictionTolerance;
  return options;
}

/// How many times as far as the limit of its side a value lies from the median.
double excess(const OutlierTest& test, std::size_t member) {
  const double distance = test.scores[member].distance;
  const double limit = distance < 0.0 ? test.median - test.lowest : test.highest - test.median;
  return std::abs(distance) / limit;
}

void add_outliers(FleetCalibration& fleet, const FleetCalibration::OfType& type) {
  const std::vector<std::size_t>& members = type.members;
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::vector<std::pair<double, JointTrait>> found;
    for (const JointTrait trait : kAllJointTraits) {
      const OutlierTest& test = type.tests.at(static_cast<std::size_t>(trait));
      if (test.scores[m].is_outlier) found.emplace_back(excess(test, m), trait);
    }
    if (found.empty()) continue;
    // The largest excess names the kind; noise does so only where nothing else does.
    std::ranges::sort(found, [](const auto& a, const auto& b) {
      return std::pair(a.second == JointTrait::noise, -a.first) <
             std::pair(b.second == JointTrait::noise, -b.first);
    });
    const JointTrait kind = found.front().second;
    const OutlierTest& test = type.tests.at(static_cast<std::size_t>(kind));
    FleetOutlier outlier{.joint = members[m],
                         .trait = kind,
                         .value = fleet.joints[members[m]].traits[kind].value,
                         .median = natural(kind, test.median),
                         .expected = test.scores[m].expected};
    for (std::size_t k = 1; k < found.size(); ++k) outlier.others.push_back(found[k].second);
    fleet.outliers.push_back(std::move(outlier));
  }
}

}  // namespace

bool FleetCalibration::OfType::is_compared() const noexcept {
  return std::ranges::any_of(tests,
                             [](const OutlierTest& test) { return std::isfinite(test.highest); });
}

bool FleetCalibration::is_compared(std::size_t joint) const noexcept {
  return std::ranges::any_of(types, [&](const OfType& type) {
    return type.is_compared() && std::ranges::find(type.members, joint) != type.members.end();
  });
}

void find_fleet_outliers(FleetCalibration& fleet) {
  fleet.types.clear();
  fleet.outliers.clear();
  std::map<std::string, std::vector<std::size_t>> types;
  for (std::size_t i = 0; i < fleet.joints.size(); ++i)
    if (std::isfinite(fleet.joints[i].traits.rmse)) types[fleet.joints[i].type].push_back(i);
  for (const auto& [type, members] : types) {
    FleetCalibration::OfType of{.type = type, .members = members};
    for (const JointTrait trait : kAllJointTraits) {
      std::vector<double> values;
      values.reserve(members.size());
      for (const std::size_t i : members)
        values.push_back(compared(trait, fleet.joints[i].traits[trait].value));
      of.tests.at(static_cast<std::size_t>(trait)) = find_outliers(values, options_for(trait));
    }
    add_outliers(fleet, of);
    fleet.types.push_back(std::move(of));
  }
  std::ranges::stable_sort(fleet.outliers, {}, &FleetOutlier::expected);
}

FleetCalibration calibration_result(StudyStore& store, const StoredStudy& study) {
  FleetCalibration fleet;
  for (const TrialRecord& record : store.trials(study.id)) {
    if (record.result.result.empty()) {
      if (record.state != TrialState::failed) continue;  // it has not finished
      fleet.joints.push_back({.serial = record.trial.key, .failure = record.result.reason});
    } else {
      fleet.joints.push_back(joint_from_text(record.result.result));
    }
    fleet.joints.back().trial = record.id;
  }
  find_fleet_outliers(fleet);
  return fleet;
}

}  // namespace torsio
