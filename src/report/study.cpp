#include "torsio/report/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const std::optional<double>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : std::string();
}

/// Each condition once.
class Conditions {
 public:
  std::string next(const StudyRow& row) {
    const bool is_same = row.condition == last_;
    last_ = row.condition;
    return is_same ? std::string() : last_;
  }

 private:
  std::string last_;
};

std::string error_table(const Study& study) {
  const bool has_paper = std::ranges::any_of(
      study.rows, [](const StudyRow& row) { return row.paper_rmse.has_value(); });
  TextTable table;
  table.header(
      {"condition", "model", fmt::format("RMSE {}", study.unit), "+-", "% of max", "max", "runs"});
  if (has_paper) table.header({"paper"});
  Conditions conditions;
  for (const StudyRow& row : study.rows)
    table.row({conditions.next(row), row.model, fmt::format("{:.4g}", row.rmse),
               row.runs > 1 ? fmt::format("{:.2g}", row.rmse_std) : "",
               fmt::format("{:.1f}", row.percent), fmt::format("{:.4g}", row.largest),
               fmt::format("{}", row.runs), text_of(row.paper_rmse, "{:.4g}")});
  return fmt::format(
      "\n{}% of max: RMSE over the largest |target| of the judged recording; +-: "
      "standard deviation of a run\n",
      table.text());
}

std::string tracking_table(const Study& study) {
  TextTable table;
  table.header({"condition", "model", fmt::format("MAD {}", study.unit), "+-", "STD |e|", "RMSE",
                "/ linear", "runs", "cycles", "stopped", "paper's ratio", "paper's RMSE"});
  Conditions conditions;
  for (const StudyRow& row : study.rows) {
    const StudyTracking& of = row.tracking.value();
    const auto mean = [&](double value, const char* format) {
      return row.runs > 0 ? fmt::format(fmt::runtime(format), value) : std::string("-");
    };
    table.row({conditions.next(row), row.model, mean(of.mad, "{:.3f}"),
               row.runs > 1 ? fmt::format("{:.2g}", of.mad_std) : "", mean(of.std_abs, "{:.3f}"),
               mean(row.rmse, "{:.3f}"), mean(of.mad_to_linear, "{:.3f}"),
               fmt::format("{}", row.runs), fmt::format("{}", of.limit_cycles),
               fmt::format("{}", of.stopped), text_of(of.paper_ratio, "{:.3f}"),
               text_of(row.paper_rmse, "{:.2f}")});
  }
  return fmt::format(
      "\n{}/ linear: MAD over that of the line of the sweeps; +-: standard deviation of a run; "
      "cycles: runs with a limit cycle; stopped: runs that diverged\n",
      table.text());
}

Json row_json(const StudyRow& row) {
  const auto optional = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  Json json{{"condition", row.condition},
            {"model", row.model},
            {"runs", row.runs},
            {"rmse", row.rmse},
            {"rmse_std", row.rmse_std},
            {"percent_of_max_abs", row.percent},
            {"max_abs_target", row.largest},
            {"paper_rmse", optional(row.paper_rmse)}};
  if (const auto& of = row.tracking)
    json["tracking"] = {{"mad", of->mad},
                        {"mad_std", of->mad_std},
                        {"std_abs", of->std_abs},
                        {"mad_to_linear", of->mad_to_linear},
                        {"limit_cycles", of->limit_cycles},
                        {"stopped", of->stopped},
                        {"paper_ratio", optional(of->paper_ratio)}};
  return json;
}

}  // namespace

std::string study_text(const StudyInfo& info, const Study& study) {
  std::string text =
      fmt::format("{} ({}): {}\n{}\nseed {}, {} repeats{}\n", info.name, info.paper, info.title,
                  study.protocol, study.options.seed, study.options.repeats,
                  study.options.is_quick ? ", quick: not the paper's sizes" : "");
  for (const StudyPlant& plant : study.plants)
    text += fmt::format("plant {}, data sheet {}\n", plant.name, plant.fingerprint);
  const bool is_tracking =
      std::ranges::any_of(study.rows, [](const StudyRow& row) { return row.tracking.has_value(); });
  return text + (is_tracking ? tracking_table(study) : error_table(study));
}

std::string study_json(const StudyInfo& info, const Study& study) {
  Json document{{"study", info.name},
                {"paper", info.paper},
                {"title", info.title},
                {"protocol", study.protocol},
                {"unit", study.unit},
                {"seed", study.options.seed},
                {"repeats", study.options.repeats},
                {"quick", study.options.is_quick},
                {"plants", Json::array()},
                {"rows", Json::array()}};
  for (const StudyPlant& plant : study.plants)
    document["plants"].push_back({{"name", plant.name}, {"data_sheet", plant.fingerprint}});
  for (const StudyRow& row : study.rows) document["rows"].push_back(row_json(row));
  return document.dump(2) + "\n";
}

}  // namespace torsio
