#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// The figures of a page for its script (web/src/document.ts).
struct PageData {
  std::string figures_json;    ///< contains no `<`, so that it cannot end the script element
  std::string numbers_base64;  ///< all numbers as float, little endian
};
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// @param figures no `FieldFigure`; the k-th has the identifier "figure-k", from 1
[[nodiscard]] PageData page_data(const std::vector<const ReportFigure*>& figures);

}  // namespace torsio
