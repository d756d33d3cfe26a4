#include "torsio/report/estimates.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kManyFaults = 0.1;

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}

std::string in_words(Fault fault) {
  std::string words(name(fault));
  std::ranges::replace(words, '_', ' ');
  return fault == Fault::none ? "no fault" : words;
}

/// Never "0.00" for a fault that occurred, nor "100.00" where another one did.
std::string percent(std::size_t samples, std::size_t of) {
  if (samples == 0) return "0";
  if (samples == of) return "100";
  const double share = 100.0 * static_cast<double>(samples) / static_cast<double>(of);
  return share < 0.01 ? "<0.01" : fmt::format("{:.2f}", std::min(share, 99.99));
}

std::size_t samples_with(Fault fault, const EstimateSummary& summary) {
  const auto found = std::ranges::find(summary.faults, fault, &EstimateSummary::OfFault::fault);
  return found == summary.faults.end() ? 0 : found->samples;
}

}  // namespace

std::string estimates_text(const std::vector<EstimateSummary>& summaries,
                           const EstimatorSettings& settings) {
  std::set<Fault> faults{Fault::none};
  for (const EstimateSummary& summary : summaries)
    for (const auto& each : summary.faults) faults.insert(each.fault);
  TextTable table;
  table.header({"recording", "samples"});
  for (const Fault fault : faults) table.header({in_words(fault) + " %"});
  table.header({"lowest", "highest", "largest error bar"});
  std::string remarks;
  for (const EstimateSummary& summary : summaries) {
    std::vector<std::string> row{summary.recording, fmt::format("{}", summary.samples)};
    for (const Fault fault : faults)
      row.push_back(percent(samples_with(fault, summary), summary.samples));
    row.insert(row.end(),
               {number(summary.lowest), number(summary.highest), number(summary.largest_std_dev)});
    table.row(std::move(row));
    if (summary.usable_share() < 1.0 - kManyFaults)
      remarks += fmt::format(
          "WARNING: {:.0f} % of the samples of {} have a fault: their values "
          "are not the model's\n",
          100.0 * (1.0 - summary.usable_share()), summary.recording);
  }
  const std::string unit = unit_label(settings.target);
  return fmt::format(
      "{} in {}, inputs {}\nlowest, highest and largest error bar: of the samples without a "
      "fault\n{}{}",
      settings.target, unit.empty() ? "no unit" : unit, fmt::join(settings.features.inputs, ", "),
      table.text(), remarks);
}

std::string estimates_json(const std::vector<EstimateSummary>& summaries,
                           const EstimatorSettings& settings) {
  Json document{{"target", settings.target},
                {"unit", unit_label(settings.target)},
                {"inputs", settings.features.inputs},
                {"results", Json::array()}};
  for (const EstimateSummary& summary : summaries) {
    Json faults = Json::object();
    for (const auto& each : summary.faults) faults[std::string(name(each.fault))] = each.samples;
    document["results"].push_back({{"recording", summary.recording},
                                   {"sample_rate_Hz", summary.sample_rate_Hz},
                                   {"samples", summary.samples},
                                   {"faults", faults},
                                   {"lowest", json_number(summary.lowest)},
                                   {"highest", json_number(summary.highest)},
                                   {"largest_std_dev", json_number(summary.largest_std_dev)}});
  }
  return json_text(document);
}

}  // namespace torsio
