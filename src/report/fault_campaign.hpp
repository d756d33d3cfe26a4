#pragma once

#include <string>

#include "sim/campaign/fault_campaign.hpp"

namespace torsio {

/// The tables of a campaign: classes, sizes, impacts, stops, fault-free hours, with their 95 % bounds.
[[nodiscard]] std::string fault_campaign_text(const CampaignResult& result);

/// The same as JSON: {"seed", "classes": [{"class", "group", "injected", "detected", "latency_ms_p50",
/// "latency_ms_p99", ...}], "sizes": [...], "fault_free": {"joint_hours", "false_alarms", "upper_95", ...},
/// "low_load": {...}, "groups": [...]}. What is not measured is null.
[[nodiscard]] std::string fault_campaign_json(const CampaignResult& result);

}  // namespace torsio
