#include "torsio/report/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json row_json(const ResultRow& row, bool non_causal_zero) {
  const Metrics& metrics = row.score.metrics;
  Json json{{"family", row.family},
            {"variant", text_or_null(row.variant)},
            {"input_set", text_or_null(row.input_set)},
            {"split", name(row.split)},
            {"recording", row.recording ? Json(*row.recording) : Json(nullptr)},
            {"mode", "free_run"},
            {"rmse", number(metrics.rmse)},
            {"mad", number(metrics.mad)},
            {"std_abs", number(metrics.std_abs)},
            {"max_abs", number(metrics.max_abs)},
            {"fit_percent", number(metrics.fit_percent)},
            {"samples", metrics.samples},
            {"initialised_samples", row.score.initialised_samples},
            {"guarded_samples", row.score.guarded_samples},
            {"step_ns_p50", number(row.score.step_ns_p50)},
            {"step_ns_p999", number(row.score.step_ns_p999)},
            {"fit_seconds", number(row.fit_seconds)},
            {"parameter_count", row.parameter_count},
            {"status", row.status},
            {"reason", text_or_null(row.reason)}};
  if (row.leak) json["leak"] = true;
  if (non_causal_zero) json["zero"] = "non_causal";
  return json;
}

std::string model_label(const ResultRow& row) {
  return row.variant.empty() ? row.family : row.family + "[" + row.variant + "]";
}

bool is_same_model(const ResultRow& a, const ResultRow& b) {
  return a.family == b.family && a.variant == b.variant && a.input_set == b.input_set;
}

/// The recordings of a split, in order of appearance; none if there is only one (the total says
/// it).
std::vector<std::string> recordings_of(const Results& results, Role split) {
  std::vector<std::string> names;
  for (const ResultRow& row : results.rows)
    if (row.split == split && row.recording &&
        std::ranges::find(names, *row.recording) == names.end())
      names.push_back(*row.recording);
  constexpr std::size_t kColumnsThatFit = 4;
  if (names.size() < 2 || names.size() > kColumnsThatFit) names.clear();
  return names;
}

/// The rows that stand for a whole split, best first, failed ones last.
std::vector<const ResultRow*> ranking(const Results& results, Role split) {
  std::vector<const ResultRow*> ranked;
  for (const ResultRow& row : results.rows)
    if (row.split == split && !row.recording) ranked.push_back(&row);
  std::ranges::stable_sort(ranked, [](const ResultRow* a, const ResultRow* b) {
    if ((a->status == "ok") != (b->status == "ok")) return a->status == "ok";
    return a->score.metrics.rmse < b->score.metrics.rmse;
  });
  return ranked;
}

double rmse_on(const Results& results, const ResultRow& model, const std::string& recording) {
  for (const ResultRow& row : results.rows)
    if (row.split == model.split && row.recording == recording && is_same_model(row, model))
      return row.score.metrics.rmse;
  return kNotMeasured;
}

std::string seconds_text(double seconds) {
  if (std::isnan(seconds)) return "-";
  return seconds < 0.01 ? "<0.01" : fmt::format("{:.2f}", seconds);
}

}  // namespace

std::string results_json(const Results& results) {
  Json document{{"target", results.target}, {"unit", results.unit}, {"inputs", results.inputs}};
  if (!results.input_sets.empty()) {
    Json sets = Json::object();
    for (const auto& [set_name, inputs] : results.input_sets) sets[set_name] = inputs;
    document["input_sets"] = std::move(sets);
  }
  if (!results.label.empty()) document["label"] = results.label;
  document["results"] = Json::array();
  for (const ResultRow& row : results.rows)
    document["results"].push_back(row_json(row, results.non_causal_zero));
  return document.dump(2) + "\n";
}

std::string ranked_table(const Results& results, Role split) {
  const std::vector<std::string> recordings = recordings_of(results, split);
  const bool has_sets = results.input_sets.size() > 1;
  TextTable table;
  table.header({"model"});
  if (has_sets) table.header({"inputs"});
  table.header({"RMSE", "MAD", "max|e|", "fit %"});
  for (const std::string& recording : recordings) table.header({"RMSE " + recording});
  table.header({"step ns", "p99.9", "fit s", "parameters"});

  std::string failures;
  for (const ResultRow* row : ranking(results, split)) {
    if (row->status != "ok") {
      failures += fmt::format("  {}{}: {}: {}\n", model_label(*row),
                              row->input_set.empty() ? "" : " (" + row->input_set + ")",
                              row->status, row->reason);
      continue;
    }
    const Metrics& metrics = row->score.metrics;
    std::vector<std::string> cells{model_label(*row)};
    if (has_sets) cells.push_back(row->input_set);
    for (const double value : {metrics.rmse, metrics.mad, metrics.max_abs})
      cells.push_back(fmt::format("{:.3f}", value));
    cells.push_back(fmt::format("{:.1f}", metrics.fit_percent));
    for (const std::string& recording : recordings)
      cells.push_back(fmt::format("{:.3f}", rmse_on(results, *row, recording)));
    cells.push_back(fmt::format("{:.0f}", row->score.step_ns_p50));
    cells.push_back(fmt::format("{:.0f}", row->score.step_ns_p999));
    cells.push_back(seconds_text(row->fit_seconds));
    cells.push_back(fmt::format("{}", row->parameter_count));
    if (row->leak) cells.front() += " (leak!)";
    table.row(std::move(cells));
  }
  std::string text = table.text();
  if (!failures.empty()) text += "not in the ranking:\n" + failures;
  return text;
}

}  // namespace torsio
