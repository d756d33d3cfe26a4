#include "report/adaptation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

Json metrics_json(const Metrics& metrics) {
  return {{"rmse", json_number(metrics.rmse)},
          {"mad", json_number(metrics.mad)},
          {"std_abs", json_number(metrics.std_abs)},
          {"max_abs", json_number(metrics.max_abs)},
          {"fit_percent", json_number(metrics.fit_percent)}};
}

Json scores_json(const std::vector<AdaptationScore>& scores) {
  Json list = Json::array();
  for (const AdaptationScore& score : scores)
    list.push_back({{"recording", text_or_null(score.recording)},
                    {"samples", score.adapted.samples},
                    {"frozen", metrics_json(score.frozen)},
                    {"adapted", metrics_json(score.adapted)}});
  return list;
}

std::string part_of(std::string_view family) {
  if (family == "dgmm") return "mixture";
  return family == "grey_box" ? "coefficients" : "last layer";
}

const std::string& method_of(const AdaptedModel& adapted) {
  return adapted.file.card.options.at("adaptation.method");
}

void add_rows(TextTable& table, const std::string& samples,
              const std::vector<AdaptationScore>& scores) {
  for (const AdaptationScore& score : scores) {
    // One recording is all of them.
    if (score.recording.empty() && scores.size() == 2) continue;
    const double change = 100.0 * (score.adapted.rmse / score.frozen.rmse - 1.0);
    table.row({samples, score.recording.empty() ? "all" : score.recording,
               error_text(score.frozen.rmse), error_text(score.adapted.rmse),
               std::isfinite(change)
                   ? fmt::format("{}{}", std::signbit(change) ? "" : "+", fixed_text(change, 1))
                   : "-",
               error_text(score.frozen.mad), error_text(score.adapted.mad),
               fmt::format("{}", score.adapted.samples)});
  }
}

std::string skipped_text(const AdaptationCounts& counts) {
  std::string reasons;
  for (std::size_t i = 0; i < kUpdateOutcomes; ++i) {
    const auto outcome = static_cast<UpdateOutcome>(i);
    if (outcome == UpdateOutcome::updated || outcome == UpdateOutcome::limited ||
        counts.of(outcome) == 0)
      continue;
    reasons +=
        fmt::format("{}{} {}", reasons.empty() ? "" : ", ", name(outcome), counts.of(outcome));
  }
  return reasons.empty() ? "none" : reasons;
}

}  // namespace

std::string adaptation_json(const AdaptedModel& adapted, const std::string& model) {
  const AdaptationCounts& counts = adapted.counts;
  const std::string& target = adapted.file.settings.target;
  Json outcomes = Json::object();
  for (std::size_t i = 0; i < kUpdateOutcomes; ++i)
    outcomes[std::string(name(static_cast<UpdateOutcome>(i)))] = counts.outcomes[i];
  return json_text(Json{{"model", model},
                        {"family", adapted.file.parameters.family()},
                        {"target", target},
                        {"unit", unit_label(target)},
                        {"method", method_of(adapted)},
                        {"updates", counts.updates()},
                        {"outcomes", std::move(outcomes)},
                        {"roll_backs", counts.roll_backs},
                        {"covariance_resets", counts.covariance_resets},
                        {"relative_change", adapted.relative_change},
                        {"as_it_ran", scores_json(adapted.as_it_ran)},
                        {"held_out", scores_json(adapted.held_out)}});
}

std::string adaptation_text(const AdaptedModel& adapted, const std::string& model) {
  const AdaptationCounts& counts = adapted.counts;
  TextTable table;
  table.header({"samples", "recording", "frozen RMSE", "adapted RMSE", "change %", "frozen MAD",
                "adapted MAD", "scored"});
  add_rows(table, "as it ran", adapted.as_it_ran);
  add_rows(table, "held out", adapted.held_out);
  return fmt::format(
      "{} of {} ({}) adapted by {}, errors in {}\n\n{}\n"
      "as it ran: the error before each update; held out: after the last one, on samples that "
      "were\nnot used for the adaptation\n\n"
      "updates {}, of them limited to the largest change {}; skipped: {}\n"
      "roll-backs to the frozen model {}{}; change of the parameters {:.2g} %\n",
      part_of(adapted.file.parameters.family()), model, adapted.file.parameters.family(),
      method_of(adapted), unit_label(adapted.file.settings.target), table.text(), counts.updates(),
      counts.of(UpdateOutcome::limited), skipped_text(counts), counts.roll_backs,
      counts.covariance_resets == 0
          ? ""
          : fmt::format(", resets of the covariance {}", counts.covariance_resets),
      100.0 * adapted.relative_change);
}

}  // namespace torsio
