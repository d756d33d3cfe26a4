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
#include <variant>
#include <vector>

#include "report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

namespace {

std::string number(double value) { return std::isnan(value) ? "-" : fmt::format("{:.4g}", value); }

/// A column of a table of rows.
template <class Row>
struct Column {
  std::string title;
  std::function<std::string(const Row& row)> cell;
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

template <class Row>
bool shows(const std::vector<Row>& rows, RowQuantity quantity) {
  return std::ranges::any_of(rows,
                             [&](const Row& row) { return published(row, quantity) != nullptr; });
}

/// The figures of others, last in the table, with the digits that were printed.
template <class Row>
void add_published(const std::vector<Row>& rows, std::vector<Column<Row>>& columns) {
  for (const PublishedName& name : kPublishedNames) {
    if (!shows(rows, name.quantity)) continue;
    columns.push_back({name.title,
                       [quantity = name.quantity](const Row& row) {
                         const PaperFigure* const figure = published(row, quantity);
                         return std::string(figure == nullptr ? "" : figure->text);
                       },
                       true});
  }
}

std::string spread(std::size_t runs, double std_dev) {
  return runs > 1 ? fmt::format("{:.2g}", std_dev) : std::string();
}

std::string diverged_runs(std::size_t diverged, std::size_t runs) {
  return diverged == 0 ? std::string() : fmt::format("diverged in {} of {}", diverged, runs);
}

/// Columns for a study of torque loops: the measures that the papers use.
std::vector<Column<LoopRow>> columns_of(const LoopTable& table, const std::string& unit) {
  using Row = LoopRow;
  const auto fixed = [](double Row::*value) {
    return [value](const Row& row) { return fmt::format("{:.3f}", row.*value); };
  };
  std::vector<Column<Row>> columns{
      {fmt::format("MAD {}", unit), fixed(&Row::mad)},
      {"+-", [](const Row& row) { return spread(row.runs, row.mad_std); }},
      {"STD |e|", fixed(&Row::std_abs)},
      {"RMSE", [](const Row& row) { return fmt::format("{:.3f}", row.rmse); }},
      {"/ linear", fixed(&Row::mad_to_linear)},
      {"runs", [](const Row& row) { return fmt::format("{}", row.runs); }, true},
      {"cycles", [](const Row& row) { return fmt::format("{}", row.limit_cycles); }, true},
      {"stopped", [](const Row& row) { return fmt::format("{}", row.stopped); }, true}};
  add_published(table.rows, columns);
  return columns;
}

double best_rmse(const ComparisonTable& table, const std::string& condition) {
  double best = std::numeric_limits<double>::infinity();
  for (const ComparisonRow& row : table.rows)
    if (row.condition == condition && row.is_ranked()) best = std::min(best, row.rmse);
  return best;
}

std::string share(double within) {
  return std::isfinite(within) ? fmt::format("{:.1f}", 100.0 * within) : "-";
}

std::string width(double std_dev) { return std::isfinite(std_dev) ? number(std_dev) : "-"; }

/// Why a row is not ranked, in a few words.
std::string unranked(const ComparisonRow& row) {
  if (row.diverged > 0) return diverged_runs(row.diverged, row.runs);
  if (row.failure.empty()) return {};
  return "failed: " + row.failure.substr(0, row.failure.find('\n'));
}

/// Columns for a study that compares families: the distance of each from the best.
std::vector<Column<ComparisonRow>> columns_of(const ComparisonTable& table,
                                              const std::string& unit) {
  using Row = ComparisonRow;
  return {{fmt::format("RMSE {}", unit), [](const Row& row) { return number(row.rmse); }},
          {"/ best",
           [&table](const Row& row) {
             return row.is_ranked()
                        ? fmt::format("{:.2f}", row.rmse / best_rmse(table, row.condition))
                        : std::string("-");
           }},
          {"% of max", [](const Row& row) { return fmt::format("{:.1f}", row.percent); }},
          {"mean sd", [](const Row& row) { return width(row.mean_std_dev); }},
          {"no sd %", [](const Row& row) { return share(row.without_std_dev); }},
          {"in 1 sd %", [](const Row& row) { return share(row.within_std_dev); }},
          {"in 2 sd %", [](const Row& row) { return share(row.within_2_std_dev); }},
          {"step ns", [](const Row& row) { return fmt::format("{:.0f}", row.step_ns); }},
          {"", unranked, true}};
}

/// Errors in percent of the sensor's full scale.
void add_full_scale(const ErrorTable& table, std::vector<Column<ErrorRow>>& columns) {
  using Row = ErrorRow;
  const double full_scale = *table.full_scale;
  columns.push_back({"% of FS", [full_scale](const Row& row) {
                       return fmt::format("{:.2f}", 100.0 * row.rmse / full_scale);
                     }});
  columns.push_back({"max|e|", [](const Row& row) { return number(row.max_abs); }});
  columns.push_back({"% of FS", [full_scale](const Row& row) {
                       return fmt::format("{:.1f}", 100.0 * row.max_abs / full_scale);
                     }});
  if (std::ranges::any_of(table.rows, [](const Row& row) { return std::isfinite(row.one_step); }))
    columns.push_back({"1 step", [](const Row& row) {
                         return std::isfinite(row.one_step) ? number(row.one_step) : std::string();
                       }});
}

std::vector<Column<ErrorRow>> columns_of(const ErrorTable& table, const std::string& unit) {
  using Row = ErrorRow;
  std::vector<Column<Row>> columns{
      {fmt::format("RMSE {}", unit), [](const Row& row) { return number(row.rmse); }},
      {"+-", [](const Row& row) { return spread(row.runs, row.rmse_std); }},
      {"% of max", [](const Row& row) { return fmt::format("{:.1f}", row.percent); }},
      {"max", [](const Row& row) { return number(row.largest); }}};
  if (table.full_scale) add_full_scale(table, columns);
  if (std::ranges::any_of(table.rows, [](const Row& row) { return row.guarded_percent > 0.0; }))
    columns.push_back(
        {"guard %", [](const Row& row) { return fmt::format("{:.1f}", row.guarded_percent); }});
  columns.push_back({"runs", [](const Row& row) { return fmt::format("{}", row.runs); }});
  if (table.shows_fit_time)
    columns.push_back(
        {"fit s", [](const Row& row) { return fmt::format("{:.3g}", row.fit_seconds); }});
  if (shows(table.rows, RowQuantity::fit_percent))
    columns.push_back(
        {"fit %", [](const Row& row) { return fmt::format("{:.2f}", row.fit_percent); }});
  add_published(table.rows, columns);
  if (std::ranges::any_of(table.rows, [](const Row& row) { return row.diverged > 0; }))
    columns.push_back({"", [](const Row& row) { return diverged_runs(row.diverged, row.runs); }});
  return columns;
}

template <class Table>
std::string table_text(const Table& of, const std::string& unit) {
  const auto columns = columns_of(of, unit);
  TextTable table;
  table.header({"condition", "model"});
  for (const auto& column : columns) table.header({column.title});
  std::string last;
  for (const auto& row : of.rows) {
    std::vector<std::string> cells{row.condition == last ? "" : row.condition, row.model};
    for (const auto& column : columns)
      cells.push_back(row.runs > 0 || column.is_published ? column.cell(row) : "");
    table.row(std::move(cells));
    last = row.condition;
  }
  return table.text();
}

const ComparisonRow* row_of(const ComparisonTable& table, const std::string& condition) {
  for (const ComparisonRow& row : table.rows)
    if (row.condition == condition && row.model == table.subject && row.runs > 0) return &row;
  return nullptr;
}

/// How far the subject is from the best under each condition.
std::string verdict_text(const ComparisonTable& of, const std::string& unit) {
  TextTable table;
  table.header({"condition", "best", fmt::format("RMSE {}", unit), of.subject, "/ best",
                "within 5 %", "mean sd", "no sd %", "in 1 sd %", "in 2 sd %", "step ns"});
  std::size_t near = 0;
  const std::vector<StudyVerdict> all = verdicts(of);
  for (const StudyVerdict& verdict : all) {
    if (verdict.is_near_best()) ++near;
    const ComparisonRow* const row = row_of(of, verdict.condition);
    table.row({verdict.condition, verdict.best, number(verdict.best_rmse),
               verdict.rmse ? number(*verdict.rmse) : "not ranked",
               verdict.rmse ? fmt::format("{:.3f}", *verdict.rmse / verdict.best_rmse) : "-",
               verdict.is_near_best() ? "yes" : "no",
               row != nullptr ? width(row->mean_std_dev) : "-",
               row != nullptr ? share(row->without_std_dev) : "-",
               row != nullptr ? share(row->within_std_dev) : "-",
               row != nullptr ? share(row->within_2_std_dev) : "-",
               row != nullptr ? fmt::format("{:.0f}", row->step_ns) : "-"});
  }
  return fmt::format("{}{} is lowest or within 5 % of the lowest in {} of {}\n", table.text(),
                     of.subject, near, all.size());
}

constexpr const char* kPercentOfMax =
    "% of max: RMSE over the largest |target| of the test recording; ";

std::string text_of(const LoopTable& table, const std::string& unit) {
  return '\n' + table_text(table, unit) +
         "/ linear: MAD over that of the linear model of the sweeps; +-: standard deviation of a "
         "run; cycles: runs with a limit cycle; stopped: runs that diverged\n";
}

std::string text_of(const ComparisonTable& table, const std::string& unit) {
  return fmt::format(
      "\n{}\n{}/ best: RMSE over the lowest of the condition; {}mean sd: mean error bar; no sd %: "
      "samples without one; in 1 sd %, in 2 sd %: samples whose error is at most one error bar, "
      "two "
      "error bars (calibrated: 68 and 95)\n",
      verdict_text(table, unit), table_text(table, unit), kPercentOfMax);
}

std::string text_of(const ErrorTable& table, const std::string& unit) {
  std::string text = fmt::format("\n{}{}+-: standard deviation of a run\n", table_text(table, unit),
                                 kPercentOfMax);
  if (table.full_scale)
    text += fmt::format(
        "% of FS: of RMSE or of max|e|, the largest error of all runs, over {:g} {}; 1 step: RMSE "
        "one step ahead, with measured past torques: not usable as a sensor\n",
        *table.full_scale, unit);
  return text;
}

std::string text_of(const QuantityTable& of, const std::string& /*unit*/) {
  TextTable table;
  table.header({"condition", "quantity", "value", "unit", "paper", ""});
  std::string last;
  for (const QuantityRow& row : of.rows) {
    table.row({row.condition == last ? "" : row.condition, row.quantity, number(row.value),
               row.unit, std::string(row.published ? row.published->text : ""), row.remark});
    last = row.condition;
  }
  return '\n' + table.text();
}

using Json = nlohmann::ordered_json;

Json figure_json(const PaperFigure& figure) {
  return {{"value", figure.value},
          {"text", figure.text},
          {"unit", figure.unit},
          {"paper", figure.paper},
          {"item", figure.item}};
}

/// The published figures of a row by quantity, each with its source; empty if there are none.
Json published_json(const StudyRow& row) {
  Json all = Json::object();
  for (const PublishedName& name : kPublishedNames)
    if (const PaperFigure* const figure = published(row, name.quantity))
      all[name.key] = figure_json(*figure);
  return all;
}

/// The fields of every row; values that are NaN because there are no runs are written as null.
Json row_json(const StudyRow& row) {
  return {{"condition", row.condition}, {"model", row.model},
          {"runs", row.runs},           {"rmse", row.rmse},
          {"rmse_std", row.rmse_std},   {"published", published_json(row)}};
}

void write(Json& document, const ErrorTable& table) {
  document["full_scale"] = table.full_scale ? Json(*table.full_scale) : Json(nullptr);
  for (const ErrorRow& row : table.rows) {
    Json json = row_json(row);
    json.update(Json{{"percent_of_max_abs", row.percent},
                     {"max_abs_target", row.largest},
                     {"max_abs", row.max_abs},
                     {"blank", row.blank},
                     {"one_step_rmse", row.one_step},
                     {"guarded_percent", row.guarded_percent},
                     {"diverged", row.diverged},
                     {"fit_percent", row.fit_percent}});
    if (table.shows_fit_time && row.runs > 0) json["fit_seconds"] = row.fit_seconds;
    document["rows"].push_back(std::move(json));
  }
}

void write(Json& document, const ComparisonTable& table) {
  for (const ComparisonRow& row : table.rows) {
    Json json = row_json(row);
    json.update(Json{{"percent_of_max_abs", row.percent},
                     {"diverged", row.diverged},
                     {"ranked", row.is_ranked()},
                     {"step_ns", row.step_ns},
                     {"within_std_dev", row.within_std_dev},
                     {"within_2_std_dev", row.within_2_std_dev},
                     {"mean_std_dev", row.mean_std_dev},
                     {"without_std_dev", row.without_std_dev},
                     {"failure", row.failure.empty() ? Json(nullptr) : Json(row.failure)}});
    document["rows"].push_back(std::move(json));
  }
  document["subject"] = table.subject;
  for (const StudyVerdict& verdict : verdicts(table))
    document["verdicts"].push_back({{"condition", verdict.condition},
                                    {"best", verdict.best},
                                    {"best_rmse", verdict.best_rmse},
                                    {"rmse", verdict.rmse ? Json(*verdict.rmse) : Json(nullptr)},
                                    {"within_5_percent", verdict.is_near_best()}});
}

void write(Json& document, const LoopTable& table) {
  for (const LoopRow& row : table.rows) {
    Json json = row_json(row);
    json.update(Json{{"mad", row.mad},
                     {"mad_std", row.mad_std},
                     {"std_abs", row.std_abs},
                     {"mad_to_linear", row.mad_to_linear},
                     {"limit_cycles", row.limit_cycles},
                     {"stopped", row.stopped}});
    document["rows"].push_back(std::move(json));
  }
}

void write(Json& document, const QuantityTable& table) {
  for (const QuantityRow& row : table.rows)
    document["rows"].push_back(
        {{"condition", row.condition},
         {"quantity", row.quantity},
         {"value", row.value},
         {"unit", row.unit},
         {"published", row.published ? figure_json(*row.published) : Json(nullptr)},
         {"remark", row.remark}});
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
  text += std::visit([&](const auto& table) { return text_of(table, study.unit); }, study.table);
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
                {"notes", study.notes},
                {"rows", Json::array()}};
  for (const StudyPlant& plant : study.plants)
    document["plants"].push_back({{"name", plant.name}, {"data_sheet", plant.fingerprint}});
  std::visit([&](const auto& table) { write(document, table); }, study.table);
  return json_text(document);
}

}  // namespace torsio
