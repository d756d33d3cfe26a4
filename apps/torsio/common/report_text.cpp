#include "common/report_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "torsio/report/text_table.hpp"

namespace {

/// Target, split and inputs.
std::string heading(const torsio::Results& results) {
  std::string text = fmt::format("target {}{}\n", results.target,
                                 results.label.empty() ? "" : ", " + results.label);
  if (results.input_sets.empty()) {
    text += fmt::format("inputs {}\n", fmt::join(results.inputs, ", "));
  } else {
    for (const auto& [set_name, inputs] : results.input_sets)
      text += fmt::format("inputs {}: {}\n", set_name, fmt::join(inputs, ", "));
  }
  if (results.non_causal_zero)
    text += "zero: non-causal (taken from the middle of each whole record)\n";
  return text;
}

std::string percent(double share) {
  return std::isfinite(share) ? torsio::fixed_text(100.0 * share, 1) : "-";
}

std::string order_and_note(const torsio::Ranking& ranking) {
  return (ranking.is_possible() ? "best first\n" : "not ranked\n") + torsio::ranking_note(ranking);
}

/// "4", or "2 of 4" if a guard excluded the others.
std::string folds_shown(const torsio::CrossValidation& validation) {
  const auto& rankings = validation.results.rankings;
  const auto ranked = std::ranges::count_if(rankings, &torsio::Ranking::is_possible);
  const bool is_all = ranked == std::ssize(rankings) || !validation.ranked().is_possible();
  return is_all ? fmt::format("{}", rankings.size())
                : fmt::format("{} of {}", ranked, rankings.size());
}

}  // namespace

std::string comparison_text(const torsio::Results& results) {
  std::string text = heading(results);
  for (const torsio::Role role : {torsio::Role::validation, torsio::Role::test}) {
    const bool has_rows = std::ranges::any_of(
        results.rows, [&](const torsio::ResultRow& row) { return row.split == role; });
    if (!has_rows) continue;
    const auto ranking = std::ranges::find(results.rankings, role, &torsio::Ranking::split);
    text +=
        fmt::format("\nheld-out ({}) errors in {}, free run, {}{}", torsio::name(role),
                    results.unit, order_and_note(*ranking), torsio::ranked_table(results, role));
  }
  return text;
}

std::string cross_validation_text(const torsio::CrossValidation& validation) {
  return heading(validation.results) +
         fmt::format(
             "\nheld-out errors in {}, free run, mean +- standard deviation over {} folds, {}{}",
             validation.results.unit, folds_shown(validation), order_and_note(validation.ranked()),
             torsio::cross_validation_table(validation));
}

std::string evaluation_text(const torsio::Results& results) {
  torsio::TextTable table;
  table.header({"split", "RMSE", "MAD", "max|e|", "fit %", "samples", "by a guard", "in 1 sd %",
                "in 2 sd %", "step ns", "p99.9"});
  // Four decimals, or three significant digits if the smallest error needs more decimals (metres).
  constexpr double kTooSmallForFourPlaces = 0.0005;
  const bool is_small = std::ranges::any_of(results.rows, [](const torsio::ResultRow& row) {
    return row.score.metrics.rmse < kTooSmallForFourPlaces;
  });
  const auto error = [&](double value) {
    return is_small ? fmt::format("{:.3g}", value) : torsio::fixed_text(value, 4);
  };
  for (const torsio::ResultRow& row : results.rows) {
    const torsio::Metrics& metrics = row.score.metrics;
    std::string split(torsio::name(row.split));
    if (row.recording) split = "  " + *row.recording;
    table.row({split, error(metrics.rmse), error(metrics.mad), error(metrics.max_abs),
               torsio::fixed_text(metrics.fit_percent, 1), fmt::format("{}", metrics.samples),
               fmt::format("{}", row.score.guarded_samples), percent(row.score.within_std_dev),
               percent(row.score.within_2_std_dev), fmt::format("{:.0f}", row.score.step_ns_p50),
               fmt::format("{:.0f}", row.score.step_ns_p999)});
  }
  std::string text = fmt::format("target {}, inputs {}\nerrors in {}, free run\n{}", results.target,
                                 fmt::join(results.inputs, ", "),
                                 results.unit.empty() ? "no unit" : results.unit, table.text());
  for (const std::string& warning : results.warnings) text += "WARNING: " + warning + "\n";
  return text;
}

std::string first_failure(const torsio::Results& results) {
  if (std::ranges::any_of(results.rows,
                          [](const torsio::ResultRow& row) { return row.status == "ok"; }))
    return "no model can be ranked: guards reported faults of the models in more than half of the "
           "samples";
  for (const torsio::ResultRow& row : results.rows)
    if (row.status != "ok") return "no model could be fitted; " + row.family + ": " + row.reason;
  return "no model could be scored";
}
