#pragma once

#include <string>
#include <string_view>

#include "studies/study.hpp"

namespace torsio {

/// The study with its protocol, seeds and plants, and a table of our figures beside the paper's.
[[nodiscard]] std::string study_text(const StudyInfo& info, const Study& study);

/// One JSON object with the same; ends with a line feed.
[[nodiscard]] std::string study_json(const StudyInfo& info, const Study& study);

/// The title of the column that shows a published figure of the quantity.
[[nodiscard]] std::string_view published_title(RowQuantity quantity) noexcept;

}  // namespace torsio
