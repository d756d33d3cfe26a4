#include "torsio/report/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "torsio/report/text_table.hpp"

namespace torsio {

std::string study_text(const StudyInfo& info, const Study& study) {
  std::string text =
      fmt::format("{} ({}): {}\n{}\nseed {}, {} repeats{}\n", info.name, info.paper, info.title,
                  study.protocol, study.options.seed, study.options.repeats,
                  study.options.is_quick ? ", quick: not the paper's sizes" : "");
  for (const StudyPlant& plant : study.plants)
    text += fmt::format("plant {}, data sheet {}\n", plant.name, plant.fingerprint);
  const bool has_paper = std::ranges::any_of(
      study.rows, [](const StudyRow& row) { return row.paper_rmse.has_value(); });
  TextTable table;
  table.header(
      {"condition", "model", fmt::format("RMSE {}", study.unit), "+-", "% of max", "max", "runs"});
  if (has_paper) table.header({"paper"});
  std::string last;
  for (const StudyRow& row : study.rows) {
    const auto if_run = [&](std::string cell) { return row.runs > 0 ? cell : std::string(); };
    table.row({row.condition == last ? "" : row.condition, row.model,
               if_run(fmt::format("{:.4g}", row.rmse)),
               row.runs > 1 ? fmt::format("{:.2g}", row.rmse_std) : "",
               if_run(fmt::format("{:.1f}", row.percent)),
               if_run(fmt::format("{:.4g}", row.largest)), if_run(fmt::format("{}", row.runs)),
               row.paper_rmse ? fmt::format("{:.4g}", *row.paper_rmse) : ""});
    last = row.condition;
  }
  return fmt::format(
      "{}\n{}% of max: RMSE over the largest |target| of the judged recording; +-: "
      "standard deviation of a run\n",
      text, table.text());
}

std::string study_json(const StudyInfo& info, const Study& study) {
  using Json = nlohmann::ordered_json;
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
  for (const StudyRow& row : study.rows)
    document["rows"].push_back(
        {{"condition", row.condition},
         {"model", row.model},
         {"runs", row.runs},
         {"rmse", row.runs > 0 ? Json(row.rmse) : Json(nullptr)},
         {"rmse_std", row.rmse_std},
         {"percent_of_max_abs", row.percent},
         {"max_abs_target", row.largest},
         {"paper_rmse", row.paper_rmse ? Json(*row.paper_rmse) : Json(nullptr)}});
  return document.dump(2) + "\n";
}

}  // namespace torsio
