#pragma once

#include <string>

#include "sim/campaign/drift_campaign.hpp"
#include "torsio/evaluate/drift.hpp"

namespace torsio {

/// What has changed, a row for each quantity, the errors of the model, and whether a new calibration is
/// worth it.
/// @param target the model's, whose unit the errors have
[[nodiscard]] std::string drift_text(const Drift& drift, const std::string& target);
[[nodiscard]] std::string drift_json(const Drift& drift, const std::string& target);

[[nodiscard]] std::string drift_campaign_text(const DriftCampaignResult& result);
[[nodiscard]] std::string drift_campaign_json(const DriftCampaignResult& result);

}  // namespace torsio
