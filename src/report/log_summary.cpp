#include "report/log_summary.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

double duration_s(const TopicSummary& topic) { return seconds(topic.last_ns - topic.first_ns); }

double rate_Hz(const TopicSummary& topic) {
  return topic.messages > 1 && topic.last_ns > topic.first_ns
             ? static_cast<double>(topic.messages - 1) / duration_s(topic)
             : 0.0;
}

std::string number_text(double value) { return fmt::format("{:.6g}", value); }

/// How often the column has a new value: per second where the clock is known, else per row.
std::string fresh_text(const ColumnSummary& column, const LogSummary& summary) {
  if (column.fresh == 0) return "-";
  if (column.fresh == 1) return "constant";
  const auto values = static_cast<double>(column.fresh - 1);
  if (summary.duration_s > 0.0) return fmt::format("{:.4g} Hz", values / summary.duration_s);
  if (column.fresh == summary.rows) return "every row";
  return fmt::format("1 in {:.3g} rows", static_cast<double>(summary.rows - 1) / values);
}

std::string columns_text(const LogSummary& summary) {
  TextTable table;
  table.header({"column", "unit", "from", "lowest", "highest", "new values", "rate", "empty",
                "first values"});
  for (const ColumnSummary& column : summary.columns) {
    std::string first;
    for (const double value : column.first)
      first += (first.empty() ? "" : " ") + number_text(value);
    const bool is_empty = column.measured == 0;
    table.row({column.name, column.unit.empty() ? "?" : column.unit,
               std::string(name(column.unit_origin)), is_empty ? "" : number_text(column.lowest),
               is_empty ? "" : number_text(column.highest), fmt::format("{}", column.fresh),
               fresh_text(column, summary), fmt::format("{}", column.empty), first});
  }
  std::string text = table.text() + fmt::format("\n{} rows", summary.rows);
  text += summary.duration_s > 0.0
              ? fmt::format(", {:.4g} s by '{}'\n", summary.duration_s, summary.clock)
              : ", no column shows that it is the clock\n";
  for (const std::string& left_out : summary.not_read) text += "not read: " + left_out + "\n";
  for (const std::string& note : summary.notes) text += note + "\n";
  return text;
}

nlohmann::ordered_json columns_json(const LogSummary& summary) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  for (const ColumnSummary& column : summary.columns) {
    const bool is_empty = column.measured == 0;
    const auto number = [&](double value) {
      return is_empty ? nlohmann::ordered_json() : nlohmann::ordered_json(value);
    };
    columns.push_back({{"column", column.name},
                       {"unit", column.unit},
                       {"unit_from", name(column.unit_origin)},
                       {"lowest", number(column.lowest)},
                       {"highest", number(column.highest)},
                       {"measured", column.measured},
                       {"new_values", column.fresh},
                       {"empty", column.empty},
                       {"first", column.first}});
  }
  return columns;
}

}  // namespace

std::string log_summary_text(const LogSummary& summary) {
  if (!summary.columns.empty()) return columns_text(summary);
  TextTable table;
  table.header({"topic", "schema", "messages", "Hz", "duration s", "largest gap ms"});
  std::string fields;
  for (const TopicSummary& topic : summary.topics) {
    table.row({topic.topic, topic.schema.empty() ? topic.encoding : topic.schema,
               fmt::format("{}", topic.messages), fixed_text(rate_Hz(topic), 2),
               fixed_text(duration_s(topic), 3),
               fixed_text(1e3 * seconds(topic.largest_gap_ns), 2)});
    for (const std::string& field : topic.fields) fields += fmt::format("  {}\n", field);
    if (!topic.problem.empty()) fields += fmt::format("  {}: {}\n", topic.topic, topic.problem);
  }
  std::string text = summary.topics.empty() ? "no messages\n" : table.text();
  if (!fields.empty()) text += "\nfields, for from: of a mapping\n" + fields;
  for (const auto& [condition, value] : summary.conditions)
    text += fmt::format("condition {}: {:g}\n", condition, value);
  for (const auto& [label, value] : summary.labels)
    text += fmt::format("label {}: {}\n", label, value);
  if (summary.is_unfinished)
    text += "\nThe recorder did not close this file: it is read up to its last whole record.\n";
  return text;
}

std::string labels_text(const Recording& recording) {
  std::string text = recording.name() + ":";
  for (const auto& [label, value] : recording.labels)
    text += fmt::format("{} {} {}", text.ends_with(':') ? "" : ",", label, value);
  return text;
}

namespace {

nlohmann::ordered_json summary_json(const LogSummary& summary) {
  nlohmann::ordered_json topics = nlohmann::ordered_json::array();
  for (const TopicSummary& topic : summary.topics) {
    topics.push_back({{"topic", topic.topic},
                      {"schema", topic.schema},
                      {"encoding", topic.encoding},
                      {"messages", topic.messages},
                      {"rate_Hz", rate_Hz(topic)},
                      {"duration_s", duration_s(topic)},
                      {"largest_gap_s", seconds(topic.largest_gap_ns)},
                      {"fields", topic.fields},
                      {"problem", topic.problem}});
  }
  nlohmann::ordered_json document{{"topics", std::move(topics)},
                                  {"unfinished", summary.is_unfinished}};
  if (!summary.columns.empty())
    document.update({{"columns", columns_json(summary)},
                     {"rows", summary.rows},
                     {"clock", summary.clock},
                     {"duration_s", summary.duration_s},
                     {"not_read", summary.not_read},
                     {"notes", summary.notes}});
  for (const auto& [condition, value] : summary.conditions)
    document["conditions"][condition] = value;
  for (const auto& [label, value] : summary.labels) document["labels"][label] = value;
  return document;
}

}  // namespace

std::string log_summary_json(const LogSummary& summary) { return json_text(summary_json(summary)); }

std::string log_summaries_json(const std::vector<std::pair<std::string, LogSummary>>& summaries) {
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (const auto& [file, summary] : summaries) {
    nlohmann::ordered_json document{{"file", file}};
    document.update(summary_json(summary));
    files.push_back(std::move(document));
  }
  return json_text(nlohmann::ordered_json{{"files", std::move(files)}});
}

}  // namespace torsio
