#pragma once

#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

[[nodiscard]] inline ReportTable report_table(const TextTable& table, std::string title = {}) {
  ReportTable report{.title = std::move(title), .headings = table.headings(), .rows = {}};
  for (const std::vector<std::string>& row : table.rows()) report.rows.push_back({row});
  return report;
}

/// The same with columns of sentences.
[[nodiscard]] inline ReportTable words_table(const TextTable& table, std::string title = {}) {
  ReportTable report = report_table(table, std::move(title));
  report.is_words = true;
  return report;
}

}  // namespace torsio
