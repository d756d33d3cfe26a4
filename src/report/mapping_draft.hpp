#pragma once

#include <string>

#include "check/draft/mapping_draft.hpp"

namespace torsio {

/// A row for each column that may be a channel, with the reasons; how many others there are.
[[nodiscard]] std::string mapping_draft_text(const MappingDraft& draft);

/// `{"file", "columns": [{"column", "channel", "unit", "sign", "gear_ratio", "hold", "certainty", "written", "missing",
/// "reasons"}], "clock", "rate_Hz", "not_read", "remarks", "refusal", "mapping"}`.
[[nodiscard]] std::string mapping_draft_json(const MappingDraft& draft);

/// The first seconds of the angles and of the torque, as the draft reads them; empty where there is no clock.
[[nodiscard]] std::string mapping_draft_picture(const LogTable& table, const MappingDraft& draft);

}  // namespace torsio
