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

}  // namespace

std::string log_summary_text(const LogSummary& summary) {
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

std::string log_summary_json(const LogSummary& summary) {
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
  for (const auto& [condition, value] : summary.conditions)
    document["conditions"][condition] = value;
  for (const auto& [label, value] : summary.labels) document["labels"][label] = value;
  return json_text(document);
}

}  // namespace torsio
