#include "torsio/report/attribution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

std::vector<InputAttribution> by_use(std::vector<InputAttribution> inputs) {
  std::ranges::stable_sort(inputs, std::ranges::greater{}, &InputAttribution::mean_abs_shapley);
  return inputs;
}

std::string share_text(double share) {
  return std::isfinite(share) ? fixed_text(100.0 * share, 1) : "-";
}

std::string increase_text(const InputAttribution& input) {
  return std::isfinite(input.rmse_increase_std)
             ? fmt::format("{} +- {}", error_text(input.rmse_increase),
                           error_text(input.rmse_increase_std))
             : error_text(input.rmse_increase);
}

/// The length of the windows, or that there are none.
std::string window_text(const Attribution& attribution, double sample_rate_Hz) {
  if (attribution.window_samples == 1 && attribution.window_is_long_enough)
    return "single samples (the model has no memory)";
  return fmt::format("windows of {} samples ({:.3g} s){}", attribution.window_samples,
                     static_cast<double>(attribution.window_samples) / sample_rate_Hz,
                     attribution.window_is_long_enough
                         ? ""
                         : ", shorter than the model's memory: its values are those from a reset");
}

/// Breaks a text between words.
std::string wrapped(std::string_view text, std::size_t width) {
  std::string lines;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::size_t length = end - begin;
    if (column > 0) {
      const bool fits = column + 1 + length <= width;
      lines += fits ? ' ' : '\n';
      column = fits ? column + 1 : 0;
    }
    lines += text.substr(begin, length);
    column += length;
    begin = end + 1;
  }
  return lines + "\n";
}

}  // namespace

std::string attribution_json(const Attribution& attribution, const AttributionSubject& subject) {
  Json document{{"model", subject.model},
                {"family", subject.family},
                {"target", subject.target},
                {"unit", unit_label(subject.target)},
                {"window_samples", attribution.window_samples},
                {"window_is_long_enough", attribution.window_is_long_enough},
                {"windows", attribution.explained.size()},
                {"background", attribution.background},
                {"expected_value", attribution.expected_value},
                {"additivity_error", attribution.additivity_error},
                {"mode", "free_run"},
                {"rmse", json_number(attribution.rmse)},
                {"samples", attribution.samples},
                {"block_samples", attribution.block_samples},
                {"results", Json::array()},
                {"explained", Json::array()},
                {"caveat", kAttributionCaveat}};
  for (const InputAttribution& input : by_use(attribution.inputs))
    document["results"].push_back({{"input", input.input},
                                   {"mean_abs_shapley", input.mean_abs_shapley},
                                   {"share", json_number(input.share)},
                                   {"rmse_increase", json_number(input.rmse_increase)},
                                   {"rmse_increase_std", json_number(input.rmse_increase_std)}});
  for (const ExplainedWindow& window : attribution.explained) {
    Json shapley = Json::object();
    for (std::size_t j = 0; j < window.shapley.size(); ++j)
      shapley[attribution.inputs[j].input] = window.shapley[j];
    document["explained"].push_back({{"recording", window.recording},
                                     {"sample", window.sample},
                                     {"value", window.value},
                                     {"shapley", std::move(shapley)}});
  }
  return json_text(document);
}

std::string attribution_text(const Attribution& attribution, const AttributionSubject& subject) {
  const std::string unit = unit_label(subject.target);
  TextTable table;
  table.header({"input", fmt::format("mean |phi| {}", unit), "share %",
                fmt::format("RMSE increase when shuffled {}", unit)});
  for (const InputAttribution& input : by_use(attribution.inputs))
    table.row({input.input, error_text(input.mean_abs_shapley), share_text(input.share),
               increase_text(input)});
  return fmt::format(
      "{} of {}, attribution to its inputs\n\n{}\n"
      "Shapley values: {} {}, absent inputs from {} others;\n"
      "their sum is the output minus its mean over these ({:.4g} {}), within {:.1g}.\n"
      "Shuffling: blocks of {} samples; unshuffled RMSE {} over {} samples, free run, no "
      "guards.\n\n"
      "{}",
      subject.family, subject.model, table.text(), attribution.explained.size(),
      window_text(attribution, subject.sample_rate_Hz), attribution.background,
      attribution.expected_value, unit, attribution.additivity_error, attribution.block_samples,
      error_text(attribution.rmse), attribution.samples,
      wrapped("Caveat: " + std::string(kAttributionCaveat), 100));
}

}  // namespace torsio
