#include "studies/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "torsio/report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

namespace {

std::string number(double value) { return fmt::format("{:.4g}", value); }

/// A column of the table; columns that no row of the study fills are left out.
struct Column {
  std::string title;
  std::function<std::string(const Study& study, const StudyRow& row)> cell;
  bool is_published = false;  ///< also filled in rows of models that only others ran
};

/// What a published figure is called in a table and in JSON.
struct PublishedName {
  RowQuantity quantity;
  const char* title;
  const char* key;
};
constexpr std::array kPublishedNames{
    PublishedName{RowQuantity::rmse, "paper", "rmse"},
    PublishedName{RowQuantity::rmse_percent, "paper %", "rmse_percent"},
    PublishedName{RowQuantity::max_percent, "paper max %", "max_percent"},
    PublishedName{RowQuantity::percent_of_max, "paper % of max", "percent_of_max_abs"},
    PublishedName{RowQuantity::fit_percent, "paper fit %", "fit_percent"},
    PublishedName{RowQuantity::mad, "paper MAD", "mad"},
    PublishedName{RowQuantity::std_abs, "paper STD", "std_abs"},
    PublishedName{RowQuantity::mad_to_linear, "paper / linear", "mad_to_linear"},
    PublishedName{RowQuantity::mad_percent, "paper MAD %", "mad_percent"}};

const PaperFigure* published(const StudyRow& row, RowQuantity quantity) {
  for (const auto& [of, figure] : row.published)
    if (of == quantity) return &figure;
  return nullptr;
}

bool shows(const Study& study, RowQuantity quantity) {
  return std::ranges::any_of(
      study.rows, [&](const StudyRow& row) { return published(row, quantity) != nullptr; });
}

/// The figures of others, last in the table, with the digits that were printed.
void add_published(const Study& study, std::vector<Column>& columns) {
  for (const PublishedName& name : kPublishedNames) {
    if (!shows(study, name.quantity)) continue;
    columns.push_back({name.title,
                       [quantity = name.quantity](const Study&, const StudyRow& row) {
                         const PaperFigure* const figure = published(row, quantity);
                         return std::string(figure == nullptr ? "" : figure->text);
                       },
                       true});
  }
}

bool is_tracking(const Study& study) {
  return std::ranges::any_of(study.rows,
                             [](const StudyRow& row) { return row.tracking.has_value(); });
}

/// Of a study of torque loops: what the papers judge these by.
std::vector<Column> tracking_columns(const Study& study) {
  std::vector<Column> columns{
      {fmt::format("MAD {}", study.unit),
       [](const Study&, const StudyRow& row) { return fmt::format("{:.3f}", row.tracking->mad); }},
      {"+-",
       [](const Study&, const StudyRow& row) {
         return row.runs > 1 ? fmt::format("{:.2g}", row.tracking->mad_std) : std::string();
       }},
      {"STD |e|", [](const Study&,
                     const StudyRow& row) { return fmt::format("{:.3f}", row.tracking->std_abs); }},
      {"RMSE", [](const Study&, const StudyRow& row) { return fmt::format("{:.3f}", row.rmse); }},
      {"/ linear",
       [](const Study&, const StudyRow& row) {
         return fmt::format("{:.3f}", row.tracking->mad_to_linear);
       }},
      {"runs", [](const Study&, const StudyRow& row) { return fmt::format("{}", row.runs); }, true},
      {"cycles",
       [](const Study&, const StudyRow& row) {
         return fmt::format("{}", row.tracking->limit_cycles);
       },
       true},
      {"stopped",
       [](const Study&, const StudyRow& row) { return fmt::format("{}", row.tracking->stopped); },
       true}};
  add_published(study, columns);
  return columns;
}

double best_rmse(const Study& study, const std::string& condition) {
  double best = std::numeric_limits<double>::infinity();
  for (const StudyRow& row : study.rows)
    if (row.condition == condition && row.is_ranked()) best = std::min(best, row.rmse);
  return best;
}

std::string share(double within) {
  return std::isfinite(within) ? fmt::format("{:.1f}", 100.0 * within) : "-";
}

/// Why a row is not ranked, in a few words.
std::string unranked(const StudyRow& row) {
  if (row.diverged > 0) return fmt::format("diverged in {} of {}", row.diverged, row.runs);
  if (row.failure.empty()) return {};
  return "failed: " + row.failure.substr(0, row.failure.find('\n'));
}

/// Of a study that compares families: how far each is from the best.
std::vector<Column> comparison_columns(const Study& study) {
  return {
      {fmt::format("RMSE {}", study.unit),
       [](const Study&, const StudyRow& row) { return number(row.rmse); }},
      {"/ best",
       [](const Study& of, const StudyRow& row) {
         return row.is_ranked() ? fmt::format("{:.2f}", row.rmse / best_rmse(of, row.condition))
                                : std::string("-");
       }},
      {"% of max",
       [](const Study&, const StudyRow& row) { return fmt::format("{:.1f}", row.percent); }},
      {"in 1 sd %", [](const Study&, const StudyRow& row) { return share(row.within_std_dev); }},
      {"in 2 sd %", [](const Study&, const StudyRow& row) { return share(row.within_2_std_dev); }},
      {"step ns",
       [](const Study&, const StudyRow& row) { return fmt::format("{:.0f}", row.step_ns); }},
      {"", [](const Study&, const StudyRow& row) { return unranked(row); }, true}};
}

std::vector<Column> columns_of(const Study& study) {
  if (is_tracking(study)) return tracking_columns(study);
  if (!study.judged.empty()) return comparison_columns(study);
  const auto any = [&](const auto& has) { return std::ranges::any_of(study.rows, has); };
  std::vector<Column> columns{
      {fmt::format("RMSE {}", study.unit),
       [](const Study&, const StudyRow& row) { return number(row.rmse); }},
      {"+-",
       [](const Study&, const StudyRow& row) {
         return row.runs > 1 ? fmt::format("{:.2g}", row.rmse_std) : std::string();
       }},
      {"% of max",
       [](const Study&, const StudyRow& row) { return fmt::format("{:.1f}", row.percent); }},
      {"max", [](const Study&, const StudyRow& row) { return number(row.largest); }}};
  if (study.full_scale) {
    columns.push_back({"% of FS", [](const Study& of, const StudyRow& row) {
                         return fmt::format("{:.2f}", 100.0 * row.rmse / *of.full_scale);
                       }});
    columns.push_back(
        {"max|e|", [](const Study&, const StudyRow& row) { return number(row.max_abs); }});
    columns.push_back({"% of FS", [](const Study& of, const StudyRow& row) {
                         return fmt::format("{:.1f}", 100.0 * row.max_abs / *of.full_scale);
                       }});
    if (any([](const StudyRow& row) { return row.one_step.has_value(); }))
      columns.push_back({"1 step", [](const Study&, const StudyRow& row) {
                           return row.one_step ? number(*row.one_step) : std::string();
                         }});
    if (any([](const StudyRow& row) { return row.guarded_percent > 0.0; }))
      columns.push_back({"guard %", [](const Study&, const StudyRow& row) {
                           return fmt::format("{:.1f}", row.guarded_percent);
                         }});
  }
  columns.push_back(
      {"runs", [](const Study&, const StudyRow& row) { return fmt::format("{}", row.runs); }});
  if (study.tells_fit_time)
    columns.push_back({"fit s", [](const Study&, const StudyRow& row) {
                         return fmt::format("{:.3g}", row.fit_seconds);
                       }});
  if (shows(study, RowQuantity::fit_percent))
    columns.push_back({"fit %", [](const Study&, const StudyRow& row) {
                         return fmt::format("{:.2f}", row.fit_percent);
                       }});
  add_published(study, columns);
  if (any([](const StudyRow& row) { return row.diverged > 0; }))
    columns.push_back({"", [](const Study&, const StudyRow& row) {
                         return row.diverged == 0
                                    ? std::string()
                                    : fmt::format("diverged in {} of {}", row.diverged, row.runs);
                       }});
  return columns;
}

std::string table_of(const Study& study) {
  const std::vector<Column> columns = columns_of(study);
  TextTable table;
  table.header({"condition", "model"});
  for (const Column& column : columns) table.header({column.title});
  std::string last;
  for (const StudyRow& row : study.rows) {
    std::vector<std::string> cells{row.condition == last ? "" : row.condition, row.model};
    for (const Column& column : columns)
      cells.push_back(row.runs > 0 || column.is_published ? column.cell(study, row) : "");
    table.row(std::move(cells));
    last = row.condition;
  }
  return table.text();
}

const StudyRow* row_of(const Study& study, const std::string& condition) {
  for (const StudyRow& row : study.rows)
    if (row.condition == condition && row.model == study.judged && row.runs > 0) return &row;
  return nullptr;
}

/// Where the judged model stands under each condition.
std::string verdict_text(const Study& study) {
  TextTable table;
  table.header({"condition", "best", fmt::format("RMSE {}", study.unit), study.judged, "/ best",
                "within 5 %", "in 1 sd %", "in 2 sd %", "step ns"});
  std::size_t near = 0;
  const std::vector<StudyVerdict> all = verdicts(study);
  for (const StudyVerdict& verdict : all) {
    if (verdict.is_near_best()) ++near;
    const StudyRow* const row = row_of(study, verdict.condition);
    table.row({verdict.condition, verdict.best, number(verdict.best_rmse),
               verdict.rmse ? number(*verdict.rmse) : "not ranked",
               verdict.rmse ? fmt::format("{:.3f}", *verdict.rmse / verdict.best_rmse) : "-",
               verdict.is_near_best() ? "yes" : "no",
               row != nullptr ? share(row->within_std_dev) : "-",
               row != nullptr ? share(row->within_2_std_dev) : "-",
               row != nullptr ? fmt::format("{:.0f}", row->step_ns) : "-"});
  }
  return fmt::format("{}{} is lowest or within 5 % of the lowest in {} of {}\n", table.text(),
                     study.judged, near, all.size());
}

/// What the columns mean.
std::string legend(const Study& study) {
  if (is_tracking(study))
    return "/ linear: MAD over that of the linear model of the sweeps; +-: standard deviation of a "
           "run; "
           "cycles: runs with a limit cycle; stopped: runs that diverged\n";
  const char* const percent = "% of max: RMSE over the largest |target| of the test recording; ";
  if (study.judged.empty()) return fmt::format("{}+-: standard deviation of a run\n", percent);
  return fmt::format(
      "/ best: RMSE over the lowest of the condition; {}in 1 sd %, in 2 sd %: samples whose error "
      "is "
      "at most one, two error bars (honest: 68 and 95)\n",
      percent);
}

using Json = nlohmann::ordered_json;

/// The published figures of a row by quantity, each with its source; empty if there are none.
Json published_json(const StudyRow& row) {
  Json all = Json::object();
  for (const PublishedName& name : kPublishedNames)
    if (const PaperFigure* const figure = published(row, name.quantity))
      all[name.key] = {{"value", figure->value},
                       {"text", figure->text},
                       {"unit", figure->unit},
                       {"paper", figure->paper},
                       {"item", figure->item}};
  return all;
}

}  // namespace

std::string_view published_title(RowQuantity quantity) noexcept {
  const auto* const name = std::ranges::find(kPublishedNames, quantity, &PublishedName::quantity);
  return name == kPublishedNames.end() ? "" : name->title;
}

std::string study_text(const StudyInfo& info, const Study& study) {
  std::string text =
      fmt::format("{} ({}): {}\n{}\nseed {}, {} repeats{}\n", info.name, info.paper, info.title,
                  study.protocol, study.options.seed, study.options.repeats,
                  study.options.is_quick ? ", quick: not the paper's sizes" : "");
  for (const StudyPlant& plant : study.plants)
    text += fmt::format("plant {}, data sheet {}\n", plant.name, plant.fingerprint);
  if (!study.judged.empty()) text += '\n' + verdict_text(study);
  text += '\n' + table_of(study);
  text += legend(study);
  if (study.full_scale)
    text += fmt::format(
        "% of FS: of RMSE or of max|e|, the largest error of all runs, over {:g} {}; 1 step: RMSE "
        "one step ahead, with measured past torques: not usable as a sensor\n",
        *study.full_scale, study.unit);
  for (const std::string& note : study.notes) text += note + '\n';
  return text;
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
                {"full_scale", study.full_scale ? Json(*study.full_scale) : Json(nullptr)},
                {"notes", study.notes},
                {"rows", Json::array()}};
  for (const StudyPlant& plant : study.plants)
    document["plants"].push_back({{"name", plant.name}, {"data_sheet", plant.fingerprint}});
  for (const StudyRow& row : study.rows) {
    document["rows"].push_back(
        {{"condition", row.condition},
         {"model", row.model},
         {"runs", row.runs},
         {"rmse", row.rmse},  // what is NaN for want of runs is written as null
         {"rmse_std", row.rmse_std},
         {"percent_of_max_abs", row.percent},
         {"max_abs_target", row.largest},
         {"max_abs", row.max_abs},
         {"blank", row.blank},
         {"one_step_rmse", row.one_step ? Json(*row.one_step) : Json(nullptr)},
         {"guarded_percent", row.guarded_percent},
         {"diverged", row.diverged},
         {"fit_percent", row.fit_percent},
         {"published", published_json(row)}});
    if (study.tells_fit_time && row.runs > 0)
      document["rows"].back()["fit_seconds"] = row.fit_seconds;
    if (!study.judged.empty())
      document["rows"].back().update(
          Json{{"ranked", row.is_ranked()},
               {"step_ns", row.step_ns},
               {"within_std_dev", row.within_std_dev},
               {"within_2_std_dev", row.within_2_std_dev},
               {"failure", row.failure.empty() ? Json(nullptr) : Json(row.failure)}});
    if (const auto& of = row.tracking)
      document["rows"].back()["tracking"] = {{"mad", of->mad},
                                             {"mad_std", of->mad_std},
                                             {"std_abs", of->std_abs},
                                             {"mad_to_linear", of->mad_to_linear},
                                             {"limit_cycles", of->limit_cycles},
                                             {"stopped", of->stopped}};
  }
  if (!study.judged.empty()) {
    document["judged"] = study.judged;
    for (const StudyVerdict& verdict : verdicts(study))
      document["verdicts"].push_back({{"condition", verdict.condition},
                                      {"best", verdict.best},
                                      {"best_rmse", verdict.best_rmse},
                                      {"rmse", verdict.rmse ? Json(*verdict.rmse) : Json(nullptr)},
                                      {"within_5_percent", verdict.is_near_best()}});
  }
  return json_text(document);
}

}  // namespace torsio
