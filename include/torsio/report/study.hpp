#pragma once

#include <string>

#include "torsio/studies/study.hpp"

namespace torsio {

/// The study with its protocol, seeds and plants, and a table of our figures beside the paper's.
[[nodiscard]] std::string study_text(const StudyInfo& info, const Study& study);

/// One JSON object with the same; ends with a line feed.
[[nodiscard]] std::string study_json(const StudyInfo& info, const Study& study);

}  // namespace torsio
