#include "report/fit_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

Json report_json(const FitReport& report) {
  Json correlations = Json::array();
  for (const ResidualCorrelation& each : report.correlations)
    correlations.push_back({{"with", each.with},
                            {"strongest", json_number(each.strongest)},
                            {"lag_s", json_number(each.lag_s)},
                            {"bound_99", json_number(each.bound)},
                            {"share_outside", json_number(each.share_outside)}});
  Json parameters = Json::array();
  for (const FittedParameter& each : report.table)
    parameters.push_back({{"name", each.name},
                          {"unit", text_or_null(each.unit)},
                          {"value", json_number(each.value)},
                          {"std_error", json_number(each.std_error)}});
  return {{"split", report.split},
          {"samples", report.samples},
          {"residual_memory_s", json_number(report.memory_s)},
          {"effective_samples", json_number(report.effective_samples)},
          {"correlations", std::move(correlations)},
          {"parameters", std::move(parameters)}};
}

/// The way out where the residuals follow an input that is filtered: what the filter removes is missing.
std::string advice_on_filters(const std::vector<std::string>& with) {
  for (const std::string& each : with) {
    const std::size_t comma = each.rfind(", ");
    if (!each.starts_with("lowpass(") || comma == std::string::npos) continue;
    const std::string cutoff = each.substr(comma + 2, each.size() - comma - 3);
    return fmt::format(
        ", as could inputs that are filtered less: {} leaves out what is faster than {} (--inputs "
        "with a higher cut-off)",
        each, cutoff);
  }
  return {};
}

/// The result of the correlations in one sentence. With fewer than `kEnough` effective samples a
/// correlation with an input has to exceed 0.47 to be significant (99 %), so that small ones prove
/// nothing and the residuals are not called white.
std::string verdict(const FitReport& report) {
  constexpr double kEnough = 30.0;
  constexpr double kMatters = 0.1;  // long recordings make any correlation significant
  constexpr double kChance = 0.05;  // share of the lags; one in a hundred is outside by chance
  // Correlated residuals are correlated with some inputs by chance.
  const double of_input =
      std::max(kMatters, 2.576 / std::sqrt(std::max(report.effective_samples, 1.0)));
  std::vector<std::string> with;
  for (const ResidualCorrelation& each : report.correlations) {
    const bool is_past = &each == report.correlations.data();
    if (std::abs(each.strongest) > (is_past ? kMatters : of_input) && each.share_outside > kChance)
      with.push_back(is_past ? "their past" : each.with);
  }
  const bool is_enough = report.effective_samples >= kEnough;
  if (with.empty() && is_enough)
    return "the residuals are white and uncorrelated with the inputs\n";
  std::string text;
  if (!with.empty())
    text = fmt::format(
        "the residuals are correlated with {}: another model could reduce them{}{} "
        "(docs/use/fit_report.md)\n",
        fmt::join(with, ", "), advice_on_filters(with),
        report.table.empty() ? "" : "; the standard errors below account for it");
  if (!is_enough)
    text += fmt::format(
        "effective sample size {:.0f}: too small to exclude input correlations of up to {:.2f}; "
        "record longer or more varied motions\n",
        report.effective_samples, std::min(of_input, 1.0));
  return text;
}

}  // namespace

std::string fit_report_text(const FitReport& report) {
  std::string text;
  if (!report.correlations.empty()) {
    text += fmt::format("\nresiduals on {}: {} samples, effective sample size {:.0f}", report.split,
                        report.samples, report.effective_samples);
    if (std::isfinite(report.memory_s))
      text += fmt::format(" (correlation time {:.3g} s)", report.memory_s);
    text += "\n";
    TextTable table;
    table.header({"correlation with", "strongest", "at lag s", "99 % bound", "lags outside %"});
    for (const ResidualCorrelation& each : report.correlations)
      table.row({each.with, fmt::format("{:+.3f}", each.strongest),
                 fmt::format("{:.3g}", each.lag_s), fmt::format("{:.3f}", each.bound),
                 fmt::format("{:.0f}", 100.0 * each.share_outside)});
    text += table.text() + verdict(report);
  }
  if (report.table.empty()) return text;
  TextTable table;
  table.header({"parameter", "value", "+- std error", "unit"});
  for (const FittedParameter& each : report.table)
    table.row({each.name, fmt::format("{:.5g}", each.value),
               std::isfinite(each.std_error) ? fmt::format("{:.2g}", each.std_error) : "-",
               each.unit});
  return text + "\n" + table.text();
}

std::string fit_json(const Results& results, const FitReport& report,
                     const std::vector<std::string>& notes) {
  Json document = results_document(results);
  document["fit_report"] = report_json(report);
  document["notes"] = notes;
  return json_text(document);
}

}  // namespace torsio
