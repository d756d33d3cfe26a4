#include "torsio/report/cross_validation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "report/result_parts.hpp"
#include "torsio/report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

Json summary_json(const FoldSummary& summary) {
  Json json{{"family", summary.family},
            {"variant", text_or_null(summary.variant)},
            {"input_set", text_or_null(summary.input_set)},
            {"split", name(Role::validation)},
            {"mode", "free_run"},
            {"folds", summary.folds},
            {"failed_folds", summary.failed_folds}};
  const auto add = [&](const std::string& metric, const FoldStatistic& statistic) {
    json[metric + "_mean"] = json_number(statistic.mean);
    json[metric + "_std"] = json_number(statistic.std_dev);
  };
  add("rmse", summary.rmse);
  add("mad", summary.mad);
  add("max_abs", summary.max_abs);
  add("fit_percent", summary.fit_percent);
  json["worst_fold"] = text_or_null(summary.worst_fold);
  json["guarded_share"] = json_number(summary.guarded_share);
  json["step_ns_p50"] = json_number(summary.step_ns_p50);
  json["fit_seconds"] = json_number(summary.fit_seconds);
  json["parameter_count"] = summary.parameter_count;
  json["status"] = summary.failed_folds == 0 ? "ok" : "failed";
  json["reason"] = text_or_null(summary.reason);
  if (summary.leak) json["leak"] = true;
  return json;
}

void add_folds_and_summary(Json& document, const CrossValidation& validation) {
  document["folds"] = Json::array();
  for (const Fold& fold : validation.plan.folds)
    document["folds"].push_back({{"name", fold.name},
                                 {"recordings", fold.recordings},
                                 {"held_out_samples", fold.held_out_samples}});
  document["summary"] = Json::array();
  for (const FoldSummary& summary : validation.ranking)
    document["summary"].push_back(summary_json(summary));
}

std::string mean_and_spread(const FoldStatistic& statistic) {
  return std::isfinite(statistic.std_dev)
             ? fmt::format("{} +- {}", error_text(statistic.mean), error_text(statistic.std_dev))
             : error_text(statistic.mean);
}

std::string held_out_list(const FoldPlan& plan) {
  std::string text;
  for (const Fold& fold : plan.folds)
    text += fmt::format("  {}: {} samples of {}\n", fold.name, fold.held_out_samples,
                        fmt::join(fold.recordings, ", "));
  return text;
}

}  // namespace

std::string cross_validation_json(const CrossValidation& validation) {
  Json document = results_document(validation.results);
  add_folds_and_summary(document, validation);
  return json_text(document);
}

std::string search_json(const Results& results, const CrossValidation& search) {
  Json document = results_document(results);
  document["search"] = {{"label", search.results.label}};
  add_folds_and_summary(document["search"], search);
  return json_text(document);
}

std::string cross_validation_table(const CrossValidation& validation) {
  const bool has_sets = validation.results.input_sets.size() > 1;
  TextTable table;
  table.header({"model"});
  if (has_sets) table.header({"inputs"});
  table.header({"RMSE", "MAD", "max|e|", "fit %", "guard %", "worst fold", "step ns", "fit s",
                "parameters"});
  std::string failures;
  for (const FoldSummary& summary : validation.ranking) {
    std::string label = model_label(summary.family, summary.variant);
    if (summary.failed_folds > 0) {
      failures +=
          fmt::format("  {}{}: failed in {} of {} folds; {}\n", label,
                      summary.input_set.empty() ? "" : " (" + summary.input_set + ")",
                      summary.failed_folds, summary.folds + summary.failed_folds, summary.reason);
      continue;
    }
    if (summary.leak) label += " (leak!)";
    std::vector<std::string> cells{std::move(label)};
    if (has_sets) cells.push_back(summary.input_set);
    for (const FoldStatistic& statistic : {summary.rmse, summary.mad, summary.max_abs})
      cells.push_back(mean_and_spread(statistic));
    cells.push_back(fixed_text(summary.fit_percent.mean, 1));
    cells.push_back(fmt::format("{:.1f}", 100.0 * summary.guarded_share));
    cells.push_back(summary.worst_fold);
    cells.push_back(fmt::format("{:.0f}", summary.step_ns_p50));
    cells.push_back(seconds_text(summary.fit_seconds));
    cells.push_back(fmt::format("{}", summary.parameter_count));
    table.row(std::move(cells));
  }
  std::string text = table.text();
  if (!failures.empty()) text += "not in the ranking:\n" + failures;
  return text + "held out by\n" + held_out_list(validation.plan);
}

}  // namespace torsio
