#include "studies/paper_items.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "report/json_text.hpp"
#include "studies/studies.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

constexpr auto kPaperItems = std::to_array<PaperItem>({
#include "paper_items.inc"
});
constexpr auto kPaperResults = std::to_array<PaperResult>({
#include "paper_results.inc"
});

constexpr std::string_view kSeparator = " ; ";

std::vector<std::string_view> parts_of(std::string_view run) {
  std::vector<std::string_view> parts;
  while (!run.empty()) {
    const std::size_t end = run.find(kSeparator);
    parts.push_back(run.substr(0, end));
    run = end == std::string_view::npos ? std::string_view{} : run.substr(end + kSeparator.size());
  }
  return parts;
}

const StudyInfo* study_of(std::string_view part) noexcept {
  const auto all = studies();
  const auto found = std::ranges::find(all, part, &StudyInfo::name);
  return found == all.end() ? nullptr : &*found;
}

std::string study_minutes(const PaperItem& item) {
  double minutes = 0.0;
  for (const std::string_view part : parts_of(item.run))
    if (const StudyInfo* const study = study_of(part)) minutes += study->minutes;
  return minutes > 0.0 ? duration_text(60.0 * minutes) : std::string();
}

/// What a reader can type, or the test that shows it.
std::string run_text(const PaperItem& item) {
  std::string text;
  for (const std::string_view part : parts_of(item.run)) {
    if (!text.empty()) text += ", ";
    if (part.starts_with("test: "))
      text += part;
    else if (study_of(part) != nullptr)
      text += fmt::format("`reproduce {}`", part);
    else
      text += fmt::format("`{}`", part);
  }
  return text;
}

std::string outcome_text(const PaperItem& item) {
  std::string text;
  for (const std::string_view part : {item.verdict, item.outcome}) {
    if (part.empty()) continue;
    if (!text.empty()) text += ": ";
    text += part;
  }
  if (item.reason.empty()) return text;
  if (!text.empty()) text += ". ";
  return text + fmt::format("Reason ({}): {}", item.evidence, item.reason);
}

std::size_t count(std::string_view PaperItem::*field, std::string_view value) {
  return static_cast<std::size_t>(std::ranges::count(kPaperItems, value, field));
}

std::string counts_text() {
  std::string text = fmt::format(
      "{} items: {} done, {} partly, {} planned, {} not possible, {} with nothing to run.",
      kPaperItems.size(), count(&PaperItem::status, "done"), count(&PaperItem::status, "partly"),
      count(&PaperItem::status, "planned"), count(&PaperItem::status, "not possible"),
      count(&PaperItem::status, "nothing to run"));
  text += fmt::format(
      " Of those with a verdict {} are reproduced, {} in their order only, {} are not; {} hold "
      "(equations "
      "and data sheets).",
      count(&PaperItem::verdict, "reproduced"), count(&PaperItem::verdict, "order only"),
      count(&PaperItem::verdict, "not reproduced"), count(&PaperItem::verdict, "holds"));
  return text;
}

/// The results of one table of docs/papers.md.
std::string results_page(std::string_view table) {
  std::string rows;
  for (const PaperResult& result : kPaperResults) {
    if (result.table != table) continue;
    rows +=
        fmt::format("| {} | {} | {} | {} | {} {} |\n", result.paper, result.item, result.condition,
                    result.quantity, result.value, result.unit == "-" ? "" : result.unit);
  }
  if (rows.empty()) return {};
  std::string heading = fmt::format("In the table of `torsio reproduce {}`", table);
  if (table == "planned") heading = "In no table yet";
  if (table == "text") heading = "Nothing can be run for them";
  return fmt::format(
      "\n### {}\n\n| paper | item | condition | quantity | printed |\n|---|---|---|---|---|\n{}",
      heading, rows);
}

}  // namespace

std::span<const PaperItem> paper_items() noexcept { return kPaperItems; }
std::span<const PaperResult> paper_results() noexcept { return kPaperResults; }

std::string duration_text(double seconds) {
  if (seconds < 90.0) return fmt::format("{:.0f} s", seconds);
  const double minutes = seconds / 60.0;
  return minutes < 90.0 ? fmt::format("{:.0f} min", minutes)
                        : fmt::format("{:.1f} h", minutes / 60.0);
}

std::string paper_items_text() {
  TextTable table;
  table.header({"paper", "item", "what", "status", "verdict", "run", "time"});
  for (const PaperItem& item : kPaperItems) {
    std::string run(item.run.substr(0, item.run.find(kSeparator)));
    if (run.size() < item.run.size()) run += ", ...";
    table.row({std::string(item.paper), std::string(item.item), std::string(item.title),
               std::string(item.status), std::string(item.verdict), run, study_minutes(item)});
  }
  return table.text() + counts_text() + "\n";
}

std::string paper_items_page() {
  std::string page =
      "# The papers, item by item\n\n"
      "Written by `torsio reproduce --list --page docs/papers.md` from `studies/paper_items.csv` "
      "and "
      "`studies/paper_results.csv`. The papers are those of [sources](development/sources.md). "
      "Every section, table, figure "
      "and equation has a line: its status, what runs it, and what came out. A benchmark on a "
      "simulated joint shows that a "
      "method works there, not on the paper's joint. Where a figure did not come out, the most "
      "likely reason is given: "
      "*shown* by the run that is named, or *supposed*.\n\n" +
      counts_text() + "\n";
  std::string_view paper;
  for (const PaperItem& item : kPaperItems) {
    if (item.paper != paper) {
      paper = item.paper;
      page += fmt::format(
          "\n## Paper {}\n\n| item | what | status | run | outcome |\n|---|---|---|---|---|\n",
          paper);
    }
    page += fmt::format("| {} | {} | {} | {} | {} |\n", item.item, item.title, item.status,
                        run_text(item), outcome_text(item));
  }
  page +=
      fmt::format("\n## The {} printed results\n\nEach is in one table.\n", kPaperResults.size());
  for (const StudyInfo& study : studies()) page += results_page(study.name);
  page += results_page("planned");
  page += results_page("text");
  return page;
}

std::string paper_items_json() {
  auto items = nlohmann::ordered_json::array();
  for (const PaperItem& item : kPaperItems)
    items.push_back({{"paper", item.paper},
                     {"item", item.item},
                     {"title", item.title},
                     {"status", item.status},
                     {"run", parts_of(item.run)},
                     {"verdict", item.verdict},
                     {"outcome", item.outcome},
                     {"reason", item.reason},
                     {"evidence", item.evidence}});
  auto results = nlohmann::ordered_json::array();
  for (const PaperResult& result : kPaperResults)
    results.push_back({{"paper", result.paper},
                       {"item", result.item},
                       {"condition", result.condition},
                       {"quantity", result.quantity},
                       {"value", result.value},
                       {"unit", result.unit},
                       {"table", result.table}});
  return json_text(
      nlohmann::ordered_json{{"items", std::move(items)}, {"results", std::move(results)}});
}

}  // namespace torsio
