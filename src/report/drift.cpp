#include "report/drift.hpp"

#include <fmt/format.h>

#include <cmath>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

std::string short_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}
std::string signed_number(double value) {
  return std::isfinite(value) ? fmt::format("{:+.3g}", value) : "-";
}

std::string verdict_of(const DriftQuantity& of) {
  return of.reason.empty() ? std::string(name(of.verdict))
                           : fmt::format("{}: {}", name(of.verdict), of.reason);
}

/// The interval, in per cent where there is a value to compare it with.
std::string interval(const DriftQuantity& of) {
  if (!std::isfinite(of.lowest)) return "-";
  const bool is_relative = std::isfinite(of.relative);
  const double scale = is_relative ? 100.0 / of.before : 1.0;
  return fmt::format("{:+.3g} to {:+.3g} {}", scale * of.lowest, scale * of.highest,
                     is_relative ? "%" : of.unit);
}

std::string healthy(const DriftQuantity& of) {
  return std::isfinite(of.before) && of.before != 0.0
             ? fmt::format("{:.3g} %", 100.0 * of.tolerance / of.before)
             : fmt::format("{:.3g} {}", of.tolerance, of.unit);
}

std::string joint_sentence(const Drift& drift) {
  std::string changed;
  for (const DriftQuantity& of : drift.quantities)
    if (of.is_of_joint && of.verdict == DriftVerdict::changed)
      changed += fmt::format("{}{}", changed.empty() ? "" : ", ", of.name);
  switch (drift.joint) {
    case DriftVerdict::changed:
      return fmt::format("The joint has changed since the calibration: {}.", changed);
    case DriftVerdict::not_changed: return "The joint has not changed since the calibration.";
    case DriftVerdict::undetermined: break;
  }
  return "These recordings do not determine whether the joint has changed.";
}

std::string advice_sentence(const Drift& drift) {
  if (!std::isfinite(drift.calibration_rmse))
    return "The model file states no error: whether a new calibration is worth it cannot be "
           "determined.";
  const std::string factor = fmt::format("{:.2g}", drift.zeroed_rmse / drift.calibration_rmse);
  const std::string ratio =
      fmt::format("With the zero set, the error is {} that of the calibration",
                  factor == "1" ? "about" : factor + " times");
  switch (drift.advice) {
    case DriftAdvice::none: return ratio + ": a new calibration is not worth it.";
    case DriftAdvice::set_zero:
      return ratio + ": set the zero of the torque again; a new calibration is not worth it.";
    case DriftAdvice::calibrate:
      return ratio + ", and the changes above explain it:\na new calibration is worth it.";
    case DriftAdvice::other_motion:
      return ratio +
             ", and none of the changes above explains it. Possible causes are another\n"
             "motion or temperature than in the calibration, a delay of the torque, and a zero "
             "that "
             "drifts: `torsio check`\nfinds the latter two; else calibrate with this motion, too.";
    case DriftAdvice::check_sensor:
      return "The gain of the torque sensor has changed: check it before a new calibration, which "
             "would "
             "contain its error.";
    case DriftAdvice::better_model:
      return ratio +
             "; what is undetermined needs a model with a smaller error, not longer "
             "recordings.";
    case DriftAdvice::record_more: break;
  }
  return ratio + "; record more for a certain answer.";
}

std::string share(std::size_t count, std::size_t of) { return fmt::format("{} of {}", count, of); }

}  // namespace

std::string drift_text(const Drift& drift, const std::string& target) {
  TextTable table;
  table.header(
      {"quantity", "model", "unit", "change", "%", "95 % interval", "tolerance", "verdict"});
  for (const DriftQuantity& of : drift.quantities)
    table.row({of.name, short_number(of.before), of.unit, signed_number(of.change),
               signed_number(100.0 * of.relative), interval(of), healthy(of), verdict_of(of)});
  const std::string unit = unit_label(target);
  std::string text = fmt::format(
      "{}\n\n{}tolerance: largest change of a joint that has not changed, its load cell remounted "
      "included\n\n",
      joint_sentence(drift), table.text());
  text += fmt::format(
      "RMSE of the model: {} {} according to its file, {} {} now, {} {} with the zero set, {} {} "
      "with "
      "all\nchanges above corrected. {}\n",
      short_number(drift.calibration_rmse), unit, short_number(drift.rmse), unit,
      short_number(drift.zeroed_rmse), unit, short_number(drift.corrected_rmse), unit,
      advice_sentence(drift));
  text += fmt::format("{} samples compared, {:.0f} of them independent", drift.samples,
                      drift.effective_samples);
  if (drift.outside_samples > 0)
    text += fmt::format("; {} left out, with a fault of the model", drift.outside_samples);
  return text + "\n";
}

std::string drift_json(const Drift& drift, const std::string& target) {
  Json quantities = Json::array();
  for (const DriftQuantity& of : drift.quantities)
    quantities.push_back({{"name", of.name},
                          {"unit", text_or_null(of.unit)},
                          {"before", json_number(of.before)},
                          {"change", json_number(of.change)},
                          {"lowest", json_number(of.lowest)},
                          {"highest", json_number(of.highest)},
                          {"relative", json_number(of.relative)},
                          {"tolerance", json_number(of.tolerance)},
                          {"smallest", json_number(of.smallest)},
                          {"is_of_joint", of.is_of_joint},
                          {"verdict", name(of.verdict)},
                          {"reason", text_or_null(of.reason)}});
  return json_text(Json{{"target", target},
                        {"unit", unit_label(target)},
                        {"joint", name(drift.joint)},
                        {"advice", name(drift.advice)},
                        {"quantities", std::move(quantities)},
                        {"calibration_rmse", json_number(drift.calibration_rmse)},
                        {"rmse", json_number(drift.rmse)},
                        {"zeroed_rmse", json_number(drift.zeroed_rmse)},
                        {"corrected_rmse", json_number(drift.corrected_rmse)},
                        {"samples", drift.samples},
                        {"outside_samples", drift.outside_samples},
                        {"effective_samples", json_number(drift.effective_samples)}});
}

std::string drift_campaign_text(const DriftCampaignResult& result) {
  TextTable table;
  table.header({"actuator", "changed", "specimens", "found", "another one", "undetermined",
                "in the 95 % interval"});
  for (const DriftCampaignRow& of : result.rows)
    table.row({of.actuator, of.changed.empty() ? "nothing" : of.changed,
               fmt::format("{}", of.specimens),
               of.changed.empty() ? "-" : fmt::format("{}", of.found),
               fmt::format("{}", of.other_found), fmt::format("{}", of.undetermined),
               of.changed.empty() ? "-" : fmt::format("{}", of.covered)});
  std::size_t undetermined_changed = 0;
  std::size_t undetermined_healthy = 0;
  for (const DriftCampaignRow& of : result.rows)
    (of.changed.empty() ? undetermined_healthy : undetermined_changed) += of.undetermined;
  return fmt::format(
      "{}another one: a quantity is reported that has not changed. undetermined: neither a change "
      "nor "
      "none.\n\nchanged specimens found, with the right sign: {}; share that is missed: at most "
      "{:.3g} %\n"
      "false alarms: {} specimens without a change; share: at most {:.3g} %\n"
      "bounds: one-sided, 95 % (Clopper-Pearson)\n"
      "undetermined: {} with a change, {} without one\n",
      table.text(), share(result.found, result.changed), 100.0 * result.missed_upper_95,
      share(result.false_alarms, result.healthy), 100.0 * result.false_upper_95,
      share(undetermined_changed, result.changed), share(undetermined_healthy, result.healthy));
}

std::string drift_campaign_json(const DriftCampaignResult& result) {
  Json rows = Json::array();
  for (const DriftCampaignRow& of : result.rows)
    rows.push_back({{"actuator", of.actuator},
                    {"changed", text_or_null(of.changed)},
                    {"specimens", of.specimens},
                    {"found", of.found},
                    {"other_found", of.other_found},
                    {"undetermined", of.undetermined},
                    {"covered", of.covered}});
  Json specimens = Json::array();
  for (const DriftSpecimen& of : result.specimens)
    specimens.push_back({{"actuator", of.actuator},
                         {"changed", text_or_null(of.changed)},
                         {"amount", of.amount},
                         {"scale", json_number(of.scale)},
                         {"friction", json_number(of.friction)},
                         {"backlash_rad", json_number(of.backlash_rad)},
                         {"found", of.is_found},
                         {"other_found", of.is_other_found},
                         {"undetermined", of.is_undetermined}});
  return json_text(Json{{"seed", result.seed},
                        {"rows", std::move(rows)},
                        {"changed", result.changed},
                        {"found", result.found},
                        {"missed_upper_95", result.missed_upper_95},
                        {"healthy", result.healthy},
                        {"false_alarms", result.false_alarms},
                        {"false_upper_95", result.false_upper_95},
                        {"specimens", std::move(specimens)}});
}

}  // namespace torsio
