#include "report/transfer.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;
using OfMethod = TransferEvaluation::OfMethod;

double guarded_share(const Score& score) {
  return score.metrics.samples == 0 ? 0.0
                                    : static_cast<double>(score.guarded_samples) /
                                          static_cast<double>(score.metrics.samples);
}

const TransferTrial* trial_of(const TransferEvaluation& evaluation, std::size_t method) {
  return method < evaluation.transfer.trials.size() ? &evaluation.transfer.trials[method] : nullptr;
}

std::string method_table(const TransferEvaluation& evaluation, const std::string& unit) {
  TextTable table;
  table.header({"method", "scale of inputs", "gain", "offset " + unit, "prior",
                "held-out RMSE " + unit, "RMSE " + unit, "STD " + unit, "guarded %", ""});
  for (std::size_t i = 0; i < evaluation.methods.size(); ++i) {
    const OfMethod& of = evaluation.methods[i];
    const TransferTrial* const trial = trial_of(evaluation, i);
    const auto of_trial = [&](double value) {
      return trial == nullptr ? std::string("-") : fmt::format("{:.4g}", value);
    };
    table.row({of.method, of_trial(trial == nullptr ? 0.0 : trial->map.input_scale),
               of_trial(trial == nullptr ? 0.0 : trial->map.gain),
               of_trial(trial == nullptr ? 0.0 : trial->map.offset),
               trial == nullptr || trial->prior == 0.0 ? "-" : fmt::format("{:g}", trial->prior),
               error_text(of.held_out_rmse), error_text(of.test.metrics.rmse),
               error_text(of.test.metrics.std_abs), fixed_text(100.0 * guarded_share(of.test), 1),
               i == evaluation.transfer.chosen ? "chosen" : ""});
  }
  return table.text();
}

std::string advice(const TransferEvaluation& evaluation, const std::string& unit) {
  const OfMethod* const own = evaluation.find("own");
  if (own == nullptr) return {};
  const double transferred = evaluation.chosen().test.metrics.rmse;
  const double alone = own->test.metrics.rmse;
  std::string text = fmt::format(
      "With {:g} s of new data the transferred model has an RMSE of {} {}, a model of these data "
      "alone {} {}{}: {}\n",
      evaluation.seconds, error_text(transferred), unit, error_text(alone), unit,
      guarded_share(own->test) > 0.0
          ? fmt::format(" ({:.0f} % of the samples are outside of its range)",
                        100.0 * guarded_share(own->test))
          : "",
      transferred < alone ? "the base helps." : "the base does not help; use `torsio fit`.");
  const OfMethod* const base = evaluation.find(name(TransferMethod::none));
  if (base != nullptr && base->test.metrics.rmse < transferred)
    text += fmt::format(
        "The base as it is has an RMSE of only {} {}: these new data are too few for {}.\n",
        error_text(base->test.metrics.rmse), unit, evaluation.chosen().method);
  return text;
}

std::string curve_table(const TransferCurve& curve, const std::string& unit) {
  TextTable table;
  table.header({"new data s", "base", "offset", "transferred", "own", "method"});
  for (const TransferCurve::Point& point : curve.points)
    table.row({fmt::format("{:g}", point.seconds), error_text(point.base_rmse),
               error_text(point.offset_rmse), error_text(point.chosen_rmse),
               error_text(point.own_rmse), point.method});
  const std::string end =
      curve.base_helps_until_s
          ? fmt::format("From {:g} s on a model of the new data alone is as good.\n",
                        *curve.base_helps_until_s)
          : "The base helps at all of these times.\n";
  return fmt::format("\nLearning curve, RMSE in {} on the same test data\n\n{}{}", unit,
                     table.text(), end);
}

}  // namespace

std::string transfer_text(const TransferEvaluation& evaluation, const TransferCurve& curve,
                          const std::string& target) {
  const std::string unit(unit_label(target));
  std::string text = method_table(evaluation, unit) + "\n" + advice(evaluation, unit);
  for (const std::string& note : evaluation.notes) text += "Note: " + note + "\n";
  if (!curve.points.empty()) text += curve_table(curve, unit);
  return text;
}

std::string transfer_json(const TransferEvaluation& evaluation, const TransferCurve& curve,
                          const std::string& target) {
  Json methods = Json::array();
  for (std::size_t i = 0; i < evaluation.methods.size(); ++i) {
    const OfMethod& of = evaluation.methods[i];
    Json row{{"method", of.method},
             {"held_out_rmse", json_number(of.held_out_rmse)},
             {"rmse", json_number(of.test.metrics.rmse)},
             {"std_abs", json_number(of.test.metrics.std_abs)},
             {"samples", of.test.metrics.samples},
             {"guarded_share", guarded_share(of.test)}};
    if (const TransferTrial* const trial = trial_of(evaluation, i))
      row.update({{"input_scale", trial->map.input_scale},
                  {"gain", trial->map.gain},
                  {"offset", trial->map.offset},
                  {"prior", trial->prior}});
    methods.push_back(std::move(row));
  }
  Json points = Json::array();
  for (const TransferCurve::Point& point : curve.points)
    points.push_back({{"seconds", point.seconds},
                      {"base_rmse", json_number(point.base_rmse)},
                      {"offset_rmse", json_number(point.offset_rmse)},
                      {"transferred_rmse", json_number(point.chosen_rmse)},
                      {"own_rmse", json_number(point.own_rmse)},
                      {"method", point.method}});
  Json all{{"target", target},
           {"unit", unit_label(target)},
           {"seconds", evaluation.seconds},
           {"chosen", evaluation.chosen().method},
           {"methods", std::move(methods)},
           {"curve", std::move(points)},
           {"base_helps_until_s", nullptr},
           {"notes", evaluation.notes}};
  if (curve.base_helps_until_s) all["base_helps_until_s"] = *curve.base_helps_until_s;
  return json_text(all);
}

}  // namespace torsio
