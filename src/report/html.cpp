#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "markup_text.hpp"
#include "torsio/core/version.hpp"
#include "torsio/report/results.hpp"

namespace torsio {
namespace {

constexpr const char* kStyle =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "pre{font:13px/1.45 ui-monospace,monospace;overflow-x:auto;padding:1rem;background:#f4f4f2}"
    "dt{font-weight:600}dd{margin:0 0 .5rem 0}";

std::string definition(const std::string& term, const std::string& text) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", markup_text(term), markup_text(text));
}

}  // namespace

std::string results_html(const Results& results) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>torsio: {0}</title>"
      "<style>{1}</style></head><body>\n<h1>{0}</h1>\n<dl>\n",
      markup_text(results.target), kStyle);
  if (!results.label.empty()) page += definition("split", results.label);
  if (results.input_sets.empty())
    page += definition("inputs", fmt::format("{}", fmt::join(results.inputs, ", ")));
  for (const auto& [set_name, inputs] : results.input_sets)
    page += definition("inputs " + set_name, fmt::format("{}", fmt::join(inputs, ", ")));
  if (results.non_causal_zero)
    page += definition("zero", "non-causal: taken from the middle of each whole record");
  page += "</dl>\n";
  for (const Role role : {Role::validation, Role::test}) {
    const bool has_rows =
        std::ranges::any_of(results.rows, [&](const ResultRow& row) { return row.split == role; });
    if (!has_rows) continue;
    page += fmt::format("<h2>{} records, errors in {}, free run</h2>\n", name(role),
                        markup_text(results.unit));
    for (const Ranking& ranking : results.rankings)
      if (const std::string note = ranking_note(ranking); ranking.split == role && !note.empty())
        page += fmt::format("<p><strong>{}</strong></p>\n", markup_text(note));
    page += fmt::format("<pre>{}</pre>\n", markup_text(ranked_table(results, role)));
  }
  return page + fmt::format("<p>torsio {}</p>\n</body></html>\n", kVersion);
}

}  // namespace torsio
