#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/campaign/fault_campaign.hpp"
#include "support/monitored_joint.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/estimate/monitored_torque.hpp"

namespace torsio::test {

/// Gear and spring of dfki-50 as straight lines, with limits by hand.
inline MonitoredTorque toy_monitor() {
  std::vector<Estimator> sources;
  sources.push_back(proportional_source("motor_angle_rad / 120 - gear_angle_rad", 16000.0));
  sources.push_back(proportional_source("gear_angle_rad - joint_angle_rad", 573.0));
  const auto encoder = [](std::string name) {
    return MonitoredSignal{
        .name = std::move(name), .longest_age_s = 1.5e-3, .turn = 6.283185307179586};
  };
  return {torque_sources(std::move(sources)),
          {.sources = {{"gear", {"motor_encoder", "gear_encoder"}},
                       {"spring", {"gear_encoder", "joint_encoder"}}},
           .correlation = {}},
          {.sources = {"gear", "spring"},
           .signals = {encoder("motor_angle_rad"), encoder("gear_angle_rad"),
                       encoder("joint_angle_rad")},
           .pairs = {{.floor_Nm = 9.0, .ceiling_Nm = 9.5}},
           .correlation = {}}};
}

inline CampaignGroup toy_group() {
  return {.name = "dfki-50",
          .sheet = data_sheet("dfki-50"),
          .monitor = toy_monitor,
          .monitor_hash = "toy"};
}

}  // namespace torsio::test
