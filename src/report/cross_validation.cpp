#include "report/cross_validation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
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
  json["ranked_folds"] = summary.ranked_folds;
  add("common_rmse", summary.common_rmse);
  add("common_mad", summary.common_mad);
  add("common_max_abs", summary.common_max_abs);
  add("common_fit_percent", summary.common_fit_percent);
  json["worst_fold"] = text_or_null(summary.worst_fold);
  json["guarded_share"] = json_number(summary.guarded_share);
  json["within_std_dev"] = json_number(summary.within_std_dev);
  json["within_2_std_dev"] = json_number(summary.within_2_std_dev);
  json["step_ns_p50"] = json_number(summary.step_ns_p50);
  json["fit_seconds"] = json_number(summary.fit_seconds);
  json["parameter_count"] = summary.parameter_count;
  json["status"] = summary.status;
  json["reason"] = text_or_null(summary.reason);
  if (summary.leak) json["leak"] = true;
  return json;
}

void add_folds_and_summary(Json& document, const CrossValidation& validation) {
  document["folds"] = Json::array();
  for (std::size_t k = 0; k < validation.plan.folds.size(); ++k) {
    const Fold& fold = validation.plan.folds[k];
    const Ranking& ranking = validation.results.rankings[k];
    document["folds"].push_back({{"name", fold.name},
                                 {"recordings", fold.recordings},
                                 {"held_out_samples", fold.held_out_samples},
                                 {"scored_samples", ranking.scored_samples},
                                 {"common_samples", ranking.common_samples},
                                 {"is_ranked", ranking.is_possible()}});
  }
  document["summary"] = Json::array();
  for (const FoldSummary& summary : validation.ranking)
    document["summary"].push_back(summary_json(summary));
}

std::string mean_and_spread(const FoldStatistic& statistic) {
  return std::isfinite(statistic.std_dev)
             ? fmt::format("{} +- {}", error_text(statistic.mean), error_text(statistic.std_dev))
             : error_text(statistic.mean);
}

std::string held_out_list(const CrossValidation& validation) {
  std::string text;
  for (std::size_t k = 0; k < validation.plan.folds.size(); ++k) {
    const Fold& fold = validation.plan.folds[k];
    const Ranking& ranking = validation.results.rankings[k];
    text += fmt::format("  {}: {} samples of {}", fold.name, fold.held_out_samples,
                        fmt::join(fold.recordings, ", "));
    if (ranking.common_samples < ranking.scored_samples)
      text += fmt::format("; a guard reported a fault in {} % of them{}",
                          percent_text(ranking.guarded_share()),
                          ranking.is_possible() ? "" : ", not in the ranking");
    text += "\n";
  }
  return text;
}

/// Why a model is not in the ranking; empty if it is, or if no ranking is possible.
std::string reason_outside_ranking(const FoldSummary& summary, bool is_possible) {
  if (summary.failed_folds > 0)
    return fmt::format("{} in {} of {} folds; {}", summary.status, summary.failed_folds,
                       summary.folds + summary.failed_folds, summary.reason);
  if (summary.status == "pruned") return "pruned in " + summary.reason;
  if (!is_possible || summary.ranked_folds > 0) return {};
  return fmt::format("guarded: in more than half of a fold that is ranked ({} % of all samples)",
                     percent_text(summary.guarded_share));
}

}  // namespace

std::string cross_validation_json(const CrossValidation& validation) {
  Json document = results_document(validation.results);
  document.erase("rankings");  // `folds` has them
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
  table.header({"RMSE", "MAD", "max|e|", "fit %", "guard %", "in 1 sd %", "in 2 sd %", "worst fold",
                "step ns", "fit s", "parameters"});
  const bool is_possible = validation.ranked().is_possible();
  std::string others;
  for (const FoldSummary& summary : validation.ranking) {
    std::string label = model_label(summary.family, summary.variant);
    const std::string reason = reason_outside_ranking(summary, is_possible);
    if (!reason.empty()) {
      others +=
          fmt::format("  {}{}: {}\n", label,
                      summary.input_set.empty() ? "" : " (" + summary.input_set + ")", reason);
      continue;
    }
    if (summary.leak) label += " (leak!)";
    std::vector<std::string> cells{std::move(label)};
    if (has_sets) cells.push_back(summary.input_set);
    for (const FoldStatistic& statistic :
         is_possible ? std::array{summary.common_rmse, summary.common_mad, summary.common_max_abs}
                     : std::array{summary.rmse, summary.mad, summary.max_abs})
      cells.push_back(mean_and_spread(statistic));
    cells.push_back(
        fixed_text(is_possible ? summary.common_fit_percent.mean : summary.fit_percent.mean, 1));
    cells.push_back(percent_text(summary.guarded_share));
    cells.push_back(percent_text(summary.within_std_dev));
    cells.push_back(percent_text(summary.within_2_std_dev));
    cells.push_back(summary.worst_fold);
    cells.push_back(fmt::format("{:.0f}", summary.step_ns_p50));
    cells.push_back(seconds_text(summary.fit_seconds));
    cells.push_back(fmt::format("{}", summary.parameter_count));
    table.row(std::move(cells));
  }
  std::string text = table.text();
  if (!others.empty()) text += "not in the ranking:\n" + others;
  return text + "held out by\n" + held_out_list(validation);
}

}  // namespace torsio
