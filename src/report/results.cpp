#include "torsio/report/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFreeRun = "free_run";

/// @param mode how a model with feedback gets its past outputs
Json row_json(const ResultRow& row, const Metrics& metrics, std::string_view mode,
              bool non_causal_zero) {
  Json json{{"family", row.family},
            {"variant", text_or_null(row.variant)},
            {"input_set", text_or_null(row.input_set)},
            {"split", name(row.split)},
            {"recording", row.recording ? Json(*row.recording) : Json(nullptr)},
            {"mode", mode},
            {"rmse", json_number(metrics.rmse)},
            {"mad", json_number(metrics.mad)},
            {"std_abs", json_number(metrics.std_abs)},
            {"max_abs", json_number(metrics.max_abs)},
            {"fit_percent", json_number(metrics.fit_percent)},
            {"samples", metrics.samples},
            {"initialised_samples", row.score.initialised_samples},
            {"guarded_samples", row.score.guarded_samples},
            {"step_ns_p50", json_number(row.score.step_ns_p50)},
            {"step_ns_p999", json_number(row.score.step_ns_p999)},
            {"fit_seconds", json_number(row.fit_seconds)},
            {"parameter_count", row.parameter_count},
            {"status", row.status},
            {"reason", text_or_null(row.reason)}};
  if (mode == kFreeRun) {
    json["within_std_dev"] = json_number(row.score.within_std_dev);
    json["within_2_std_dev"] = json_number(row.score.within_2_std_dev);
    json["mean_std_dev"] = json_number(row.score.mean_std_dev);
    json["without_std_dev"] = json_number(row.score.without_std_dev);
    const Metrics& common = row.score.common;
    json["common_samples"] = common.samples;
    json["common_rmse"] = json_number(common.rmse);
    json["common_mad"] = json_number(common.mad);
    json["common_max_abs"] = json_number(common.max_abs);
    json["common_fit_percent"] = json_number(common.fit_percent);
  }
  if (!row.fold.empty()) json["fold"] = row.fold;
  if (row.leak) json["leak"] = true;
  if (non_causal_zero) json["zero"] = "non_causal";
  return json;
}

bool is_same_model(const ResultRow& a, const ResultRow& b) {
  return a.family == b.family && a.variant == b.variant && a.input_set == b.input_set;
}

/// The recordings of a split, in order of appearance; none if there is only one, which the total
/// shows.
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

/// The errors that the table shows.
const Metrics& shown(const ResultRow& row) {
  return row.score.common.samples > 0 ? row.score.common : row.score.metrics;
}

/// The rows of a whole split: the ranked ones, best first, then the others in their order.
std::vector<const ResultRow*> in_order(const Results& results, Role split) {
  std::vector<const ResultRow*> rows;
  for (const ResultRow& row : results.rows)
    if (row.split == split && !row.recording) rows.push_back(&row);
  std::ranges::stable_sort(rows, {}, [](const ResultRow* row) {
    return row->score.common.samples > 0 ? row->score.common.rmse
                                         : std::numeric_limits<double>::infinity();
  });
  return rows;
}

/// Why a model is not in a possible ranking; empty if it is.
std::string reason_outside_ranking(const Results& results, const ResultRow& row) {
  if (row.status != "ok") return row.status + ": " + row.reason;
  const bool is_possible = std::ranges::any_of(results.rankings, [&](const Ranking& ranking) {
    return ranking.split == row.split && ranking.is_possible();
  });
  return is_possible && row.score.common.samples == 0 ? "guarded: " + row.reason : std::string();
}

double rmse_on(const Results& results, const ResultRow& model, const std::string& recording) {
  for (const ResultRow& row : results.rows)
    if (row.split == model.split && row.recording == recording && is_same_model(row, model))
      return shown(row).rmse;
  return kNotMeasured;
}

}  // namespace

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

std::string error_text(double value, double smallest) {
  constexpr double kTooSmallForThreePlaces = 0.005;
  if (smallest < kTooSmallForThreePlaces && value != 0.0) return fmt::format("{:.3g}", value);
  return fixed_text(value, 3);
}

std::string percent_text(double share) {
  return std::isfinite(share) ? fmt::format("{:.1f}", 100.0 * share) : "-";
}

std::string seconds_text(double seconds) {
  if (std::isnan(seconds)) return "-";
  return seconds < 0.01 ? "<0.01" : fmt::format("{:.2f}", seconds);
}

Json results_document(const Results& results) {
  Json document{{"target", results.target}, {"unit", results.unit}, {"inputs", results.inputs}};
  if (!results.input_sets.empty()) {
    Json sets = Json::object();
    for (const auto& [set_name, inputs] : results.input_sets) sets[set_name] = inputs;
    document["input_sets"] = std::move(sets);
  }
  if (!results.label.empty()) document["label"] = results.label;
  if (!results.rankings.empty()) document["rankings"] = Json::array();
  for (const Ranking& ranking : results.rankings)
    document["rankings"].push_back({{"split", name(ranking.split)},
                                    {"scored_samples", ranking.scored_samples},
                                    {"common_samples", ranking.common_samples},
                                    {"is_ranked", ranking.is_possible()},
                                    {"best_fit_percent", json_number(ranking.best_fit_percent)}});
  if (!results.warnings.empty()) document["warnings"] = results.warnings;
  document["results"] = Json::array();
  for (const ResultRow& row : results.rows) {
    const auto add = [&](const Metrics& metrics, std::string_view mode) {
      document["results"].push_back(row_json(row, metrics, mode, results.non_causal_zero));
    };
    add(row.score.metrics, kFreeRun);
    if (row.score.one_step.samples > 0) add(row.score.one_step, "one_step");
  }
  return document;
}

std::string results_json(const Results& results) { return json_text(results_document(results)); }

namespace {

std::string note_on_samples(const Ranking& ranking) {
  constexpr double kCannotBeIgnored = 0.1;
  if (ranking.common_samples == ranking.scored_samples) return {};
  const double guarded = ranking.guarded_share();
  if (!ranking.is_possible())
    return fmt::format(
        "NO RANKING: in {:.1f} % of the samples a guard reported a fault of a model.\n"
        "Errors are on all samples, in the order of the call: they show fallbacks, or models "
        "beyond "
        "their data.\n"
        "Record training data of that range (torsio check shows it), or test inside it.\n",
        100.0 * guarded);
  if (guarded > kCannotBeIgnored)
    return fmt::format(
        "WARNING: in {:.1f} % of the samples a guard reported a fault of a model.\n"
        "Errors are on the other {:.1f} %; torsio check TRAINING.csv --test TEST.csv shows which "
        "inputs leave the range of the training data.\n",
        100.0 * guarded, 100.0 * (1.0 - guarded));
  return fmt::format(
      "errors on {} of the {} samples at which the sensor gave a new value; in the others a guard "
      "reported a fault of a model\n",
      ranking.common_samples, ranking.scored_samples);
}

}  // namespace

std::string ranking_note(const Ranking& ranking) {
  std::string note;
  if (ranking.best_fit_percent < 0.0)
    note = fmt::format(
        "WARNING: no model is better than the mean of the {} recordings (the best fit is {:.1f} "
        "%).\n"
        "The zero of the torque or of an angle differs from that of the training, or they are of "
        "another "
        "joint: torsio check compares the zeros.\n",
        name(ranking.split), ranking.best_fit_percent);
  return note + note_on_samples(ranking);
}

RankedRows ranked_rows(const Results& results, Role split) {
  const std::vector<std::string> recordings = recordings_of(results, split);
  const bool has_sets = results.input_sets.size() > 1;
  RankedRows ranked;
  TextTable& table = ranked.table;
  table.header({"model"});
  if (has_sets) table.header({"inputs"});
  table.header({"RMSE", "MAD", "max|e|", "fit %", "guard %", "in 1 sd %", "in 2 sd %"});
  const bool has_one_step = std::ranges::any_of(
      results.rows, [](const ResultRow& row) { return row.score.one_step.samples > 0; });
  if (has_one_step) table.header({"1 step"});
  for (const std::string& recording : recordings) table.header({"RMSE " + recording});
  table.header({"step ns", "p99.9", "fit s", "parameters"});

  std::vector<const ResultRow*>& rows = ranked.rows;
  rows = in_order(results, split);
  std::erase_if(rows, [&](const ResultRow* row) {
    const std::string reason = reason_outside_ranking(results, *row);
    if (reason.empty()) return false;
    ranked.others.push_back({row, reason});
    return true;
  });
  double smallest = 1.0;
  for (const ResultRow* row : rows) smallest = std::min(smallest, shown(*row).rmse);
  for (const ResultRow* row : rows) {
    const Metrics& metrics = shown(*row);
    std::vector<std::string> cells{model_label(row->family, row->variant)};
    if (has_sets) cells.push_back(row->input_set);
    for (const double value : {metrics.rmse, metrics.mad, metrics.max_abs})
      cells.push_back(error_text(value, smallest));
    cells.push_back(fixed_text(metrics.fit_percent, 1));
    cells.push_back(percent_text(static_cast<double>(row->score.guarded_samples) /
                                 static_cast<double>(row->score.metrics.samples)));
    cells.push_back(percent_text(row->score.within_std_dev));
    cells.push_back(percent_text(row->score.within_2_std_dev));
    if (has_one_step)
      cells.push_back(
          row->score.one_step.samples > 0 ? error_text(row->score.one_step.rmse, smallest) : "");
    for (const std::string& recording : recordings)
      cells.push_back(error_text(rmse_on(results, *row, recording), smallest));
    cells.push_back(fmt::format("{:.0f}", row->score.step_ns_p50));
    cells.push_back(fmt::format("{:.0f}", row->score.step_ns_p999));
    cells.push_back(seconds_text(row->fit_seconds));
    cells.push_back(fmt::format("{}", row->parameter_count));
    if (row->leak) cells.front() += " (leak!)";
    table.row(std::move(cells));
  }
  return ranked;
}

std::string ranked_table(const Results& results, Role split) {
  const RankedRows ranked = ranked_rows(results, split);
  std::string text = ranked.table.text();
  if (!ranked.others.empty()) text += "not in the ranking:\n";
  for (const RankedRows::Other& other : ranked.others)
    text += fmt::format("  {}: {}\n", model_label(*other.row), other.reason);
  return text;
}

}  // namespace torsio
