#include "torsio/report/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/drive_advice_json.hpp"
#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

Json motion_json(const TriangleMotion& motion) {
  return {{"amplitude", json_number(motion.amplitude)},
          {"centre", json_number(motion.centre)},
          {"frequency_Hz", json_number(motion.frequency_Hz)},
          {"speed", json_number(motion.speed())}};
}

Json advice_json(const Advice& advice) {
  Json proposals = Json::array();
  for (const Proposal& proposal : advice.proposals)
    proposals.push_back(
        {{"recording", proposal.recording},
         {"reason", proposal.reason},
         {"motion", proposal.motion ? motion_json(*proposal.motion) : Json(nullptr)},
         {"duration_s", json_number(proposal.duration_s)},
         {"condition", text_or_null(proposal.condition)},
         {"condition_value", json_number(proposal.condition_value)},
         {"expected_reduction", json_number(proposal.expected_reduction)},
         {"assumed_reduction", json_number(proposal.assumed_reduction)}});
  Json regions = Json::array();
  for (const Region& region : advice.regions)
    regions.push_back({{"motion", motion_json(region.motion)},
                       {"strokes", region.strokes},
                       {"duration_s", json_number(region.duration_s)},
                       {"sample_share", json_number(region.sample_share)},
                       {"error_share", json_number(region.error_share)},
                       {"held_out_rmse", json_number(region.held_out_rmse)},
                       {"is_wanted", region.is_wanted}});
  Json curve = Json::array();
  for (const LearningPoint& point : advice.learning_curve)
    curve.push_back({{"share", json_number(point.share)},
                     {"effective_samples", json_number(point.effective_samples)},
                     {"rmse", json_number(point.rmse)}});
  return {{"input", advice.input},
          {"target", advice.target},
          {"unit", unit_label(advice.target)},
          {"intended_use",
           {{"lowest", json_number(advice.lowest)},
            {"highest", json_number(advice.highest)},
            {"lowest_Hz", json_number(advice.lowest_Hz)},
            {"highest_Hz", json_number(advice.highest_Hz)},
            {"highest_speed", json_number(advice.highest_speed)},
            {"expected_rmse", json_number(advice.wanted_rmse)}}},
          {"proposals", std::move(proposals)},
          {"regions", std::move(regions)},
          {"learning_curve", std::move(curve)},
          {"same_again_reduction", json_number(advice.same_again_reduction)},
          {"target_noise", json_number(advice.target_noise)},
          {"between_recordings", json_number(advice.between_recordings)},
          {"limits", advice.limits},
          {"undetermined", advice.undetermined}};
}

std::string reduction_text(const Proposal& proposal) {
  return std::isfinite(proposal.expected_reduction)
             ? fmt::format("expected to lower the RMSE over the intended use by {:.0f} %",
                           100.0 * proposal.expected_reduction)
             : "by how much it lowers the error cannot be determined from these recordings";
}

/// A centre that is nearly 0 is shown as 0.
double shown_centre(const TriangleMotion& motion) {
  return std::abs(motion.centre) < 0.05 * motion.amplitude ? 0.0 : motion.centre;
}

std::string regions_text(const Advice& advice) {
  const std::string x_unit = unit_label(advice.input);
  TextTable table;
  table.header({"region", "strokes", "s", "samples %", "error %",
                fmt::format("held-out RMSE [{}]", unit_label(advice.target)), "in use"});
  for (const Region& region : advice.regions)
    table.row(
        {fmt::format("+-{:.2g} {} about {:.2g} at {:.2g} Hz", region.motion.amplitude, x_unit,
                     shown_centre(region.motion), region.motion.frequency_Hz),
         fmt::format("{}", region.strokes), fixed_text(region.duration_s, 0),
         fixed_text(100.0 * region.sample_share, 1), fixed_text(100.0 * region.error_share, 1),
         std::isfinite(region.held_out_rmse) ? fmt::format("{:.3g}", region.held_out_rmse) : "-",
         region.is_wanted ? "yes" : "no"});
  return table.text();
}

}  // namespace

Verdict worst(const std::vector<Finding>& findings) {
  Verdict verdict = Verdict::pass;
  for (const Finding& finding : findings) verdict = std::max(verdict, finding.verdict);
  return verdict;
}

std::string check_json(const std::vector<Finding>& findings, const Advice* advice,
                       const std::vector<DriveAdvice>& drive_advice) {
  Json document{{"verdict", name(worst(findings))}, {"findings", Json::array()}};
  for (const Finding& finding : findings)
    document["findings"].push_back({{"verdict", name(finding.verdict)},
                                    {"check", finding.check},
                                    {"recording", text_or_null(finding.recording)},
                                    {"message", finding.message},
                                    {"advice", finding.advice}});
  if (advice != nullptr) document["advice"] = advice_json(*advice);
  if (!drive_advice.empty()) document["drive_advice"] = drive_advice_json(drive_advice);
  return json_text(document);
}

std::string advice_text(const Advice& advice) {
  const std::string x_unit = unit_label(advice.input);
  const std::string y_unit = unit_label(advice.target);
  std::string text = "what to record next, the most useful first\n";
  text += fmt::format("intended use: {} from {:.3g} to {:.3g} {}", advice.input, advice.lowest,
                      advice.highest, x_unit);
  if (advice.highest_Hz > 0.0)
    text += fmt::format(", {:.2g} to {:.2g} Hz", advice.lowest_Hz, advice.highest_Hz);
  if (std::isfinite(advice.highest_speed) && advice.highest_speed > 0.0)
    text += fmt::format(", up to {:.2g} {}/s", advice.highest_speed, x_unit);
  text += " (--want gives another)\n";
  if (std::isfinite(advice.wanted_rmse))
    text += fmt::format(
        "expected RMSE with these recordings over the part of it that they "
        "determine: {:.3g} {}\n",
        advice.wanted_rmse, y_unit);
  if (advice.proposals.empty() && !advice.regions.empty())
    text += "no recording of a missing motion is expected to lower the error by 1 % or more\n";
  for (std::size_t i = 0; i < advice.proposals.size(); ++i) {
    const Proposal& proposal = advice.proposals[i];
    text += fmt::format("{}. {}\n   {}\n   {}\n", i + 1, proposal.recording,
                        reduction_text(proposal), proposal.reason);
  }
  if (!advice.regions.empty())
    text += "\nwhat was recorded, by its share of the squared error of the held-out folds\n" +
            regions_text(advice);
  if (!advice.learning_curve.empty()) {
    text += fmt::format("\nlearning curve (held-out RMSE [{}] and effective samples):", y_unit);
    for (const LearningPoint& point : advice.learning_curve)
      text += fmt::format(" {:.3g} with {:.0f} %, {:.0f};", point.rmse, 100.0 * point.share,
                          point.effective_samples);
    text.back() = '\n';
    text += fmt::format("the same motions once more: {:.0f} % less error expected\n",
                        100.0 * advice.same_again_reduction);
  }
  for (const std::string& limit : advice.limits) text += "limit: " + limit + "\n";
  if (!advice.undetermined.empty()) text += "cannot be determined from these recordings:\n";
  for (const std::string& each : advice.undetermined) text += "- " + each + "\n";
  return text;
}

}  // namespace torsio
