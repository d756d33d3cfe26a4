#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "torsio/store/registry.hpp"

/// All that the registry has about one device.
struct DeviceRecord {
  torsio::RegisteredDevice device;
  std::vector<torsio::RegisteredModel> models;
  /// The current model and those that it was made from.
  std::vector<torsio::RegisteredModel> lineage;
  /// Models of the registry, of any device, from whose files models of this one were transferred.
  std::vector<torsio::RegisteredModel> bases;
  std::vector<torsio::RegisteredRecording> recordings;
  std::vector<torsio::Promotion> promotions;
  std::vector<torsio::DriftEntry> drift;
};

// Times are in UTC: those of the database, wherever its readers are.

[[nodiscard]] std::string devices_text(std::span<const torsio::DeviceSummary> devices);
[[nodiscard]] std::string models_text(std::span<const torsio::RegisteredModel> models,
                                      bool with_device);
[[nodiscard]] std::string recordings_text(std::span<const torsio::RegisteredRecording> recordings);
[[nodiscard]] std::string device_text(const DeviceRecord& record);

[[nodiscard]] nlohmann::ordered_json store_json(const torsio::RegisteredDevice& device);
[[nodiscard]] nlohmann::ordered_json store_json(const torsio::RegisteredModel& model);
[[nodiscard]] nlohmann::ordered_json store_json(const torsio::RegisteredRecording& recording);
[[nodiscard]] nlohmann::ordered_json store_json(const torsio::DeviceSummary& summary);
[[nodiscard]] nlohmann::ordered_json store_json(const DeviceRecord& record);
