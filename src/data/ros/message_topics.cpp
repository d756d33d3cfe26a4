#include "data/ros/message_topics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "data/byte_source.hpp"
#include "data/names.hpp"
#include "data/ros/json_numbers.hpp"
#include "data/ros/ros_decoder.hpp"
#include "data/ros/ros_schema.hpp"
#include "data/ros/unpack_chunk.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Whether a column of that name can be of the topic.
bool is_of(std::string_view column, std::string_view topic) {
  return column.size() > topic.size() && column.starts_with(topic) && column[topic.size()] == '/';
}

std::optional<RosEncoding> encoding_of(const MessageChannel& channel) {
  if (channel.encoding == "cdr" && channel.schema.encoding == "ros2msg") return RosEncoding::cdr;
  if (channel.encoding == "ros1" && channel.schema.encoding == "ros1msg") return RosEncoding::ros1;
  return std::nullopt;
}

/// The columns of a topic that torsio wrote, by the names in the comments of its definition.
std::map<std::string, std::string> own_names(const MessageChannel& channel) {
  std::map<std::string, std::string> names;
  std::istringstream lines(channel.schema.definition);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t field = line.find(' ') + 1;
    const std::size_t comment = line.find("  # ");
    if (field == 0 || comment == std::string::npos || comment < field) continue;
    names[channel.topic + "/" + line.substr(field, comment - field)] =
        escaped(line.substr(comment + 4));
  }
  return names;
}

/// A topic and how its messages are read.
struct Topic {
  std::string schema;
  std::string encoding;
  std::optional<RosDecoder> decoder = {};  ///< none: JSON
  TopicTable table = {};
  std::string problem = {};                           ///< why it is not read
  std::map<std::string, std::string> own_names = {};  ///< names of the columns, if torsio wrote it
};

class Topics {
 public:
  explicit Topics(const TopicOptions& options) : options_(options) {}

  /// The messages of one more file.
  void add(const NamedMessages& file) {
    name_ = file.name;
    budget_ = &file.messages->budget();
    messages_ = 0;
    LogMessage message;
    while (file.messages->next(message)) add(message);
    is_unfinished_ = is_unfinished_ || file.messages->is_unfinished();
  }
  [[nodiscard]] bool is_unfinished() const noexcept { return is_unfinished_; }
  [[nodiscard]] std::map<std::string, Topic>& all() noexcept { return topics_; }

 private:
  void add(const LogMessage& message) {
    ++messages_;
    const MessageChannel& channel = *message.channel;
    auto found = topics_.find(channel.topic);
    if (found == topics_.end()) found = topics_.emplace(channel.topic, made(channel)).first;
    Topic& topic = found->second;
    if (topic.problem.empty())
      decode(topic, channel, message);
    else
      topic.table.end_row(0, message.log_time_ns, messages_, *budget_);
  }

  [[nodiscard]] std::string place() const {
    return fmt::format("{}: message {}", name_, messages_);
  }

  [[nodiscard]] bool is_wanted(const std::string& topic) const {
    return options_.wanted.empty() || std::ranges::any_of(options_.wanted, [&](const auto& name) {
             return is_of(name, topic);
           });
  }

  [[nodiscard]] Topic made(const MessageChannel& channel) const {
    Topic topic{.schema = channel.schema.name, .encoding = channel.encoding};
    if (!is_wanted(channel.topic) && channel.schema.name != kOwnSchema) {
      topic.problem = "not wanted";
    } else if (const auto encoding = encoding_of(channel)) {
      RosSchema schema = parse_ros_schema(channel.schema.name, channel.schema.definition,
                                          fmt::format("{}: {}", name_, channel.topic));
      std::size_t fields = schema.types.size();
      for (const RosType& type : schema.types) fields += type.fields.size();
      budget_->keep(2 * sizeof(RosField) * fields);
      budget_->work(fields);
      topic.decoder.emplace(channel.topic, std::move(schema), *encoding);
      if (channel.schema.name == kOwnSchema) topic.own_names = own_names(channel);
    } else if (channel.encoding != "json") {
      topic.problem = fmt::format("messages in {}, described in {}, are not supported",
                                  channel.encoding, channel.schema.encoding);
      if (!options_.wanted.empty())
        throw Error({.place = fmt::format("{}: {}", name_, channel.topic),
                     .problem = topic.problem,
                     .expected = "cdr with ros2msg (ROS 2), ros1 with ros1msg, or json"});
    }
    return topic;
  }

  void decode(Topic& topic, const MessageChannel& channel, const LogMessage& message) {
    std::int64_t stamp_ns = 0;
    if (topic.decoder) {
      std::string_view data = message.data;
      // No message in CDR begins like this: rosbag2 packed each message.
      if (channel.encoding == "cdr" && data.starts_with(kZstdMark)) {
        if (!unpack_message(data, *budget_, unpacked_))
          throw Error({.place = place(),
                       .problem = fmt::format("a message of {} that zstd packed is damaged",
                                              channel.topic)});
        data = unpacked_;
      }
      if (!topic.decoder->decode(data, topic.table, *budget_)) refuse(channel, message);
      stamp_ns = topic.decoder->stamp_ns();
    } else if (!set_json_numbers(message.data, channel.topic, topic.table, *budget_)) {
      refuse(channel, message);
    }
    topic.table.end_row(stamp_ns, message.log_time_ns, messages_, *budget_);
    values_ += topic.table.columns().size();
    if (values_ > options_.values)
      throw Error({.place = place(),
                   .problem = fmt::format("more than {} numbers", options_.values),
                   .advice = "Give a mapping: the messages of other topics are not read."});
  }

  [[noreturn]] void refuse(const MessageChannel& channel, const LogMessage& message) const {
    constexpr unsigned char kExtended = 6;  // from here on XCDR2, which aligns differently
    const auto kind = message.data.size() > 1 ? static_cast<unsigned char>(message.data[1]) : 0;
    const bool is_extended = channel.encoding == "cdr" && kind >= kExtended;
    throw Error(
        {.place = place(),
         .problem = fmt::format("a message of {} does not match its schema {}", channel.topic,
                                channel.schema.name),
         .expected = channel.encoding == "cdr" ? "little-endian CDR (XCDR1)" : channel.encoding,
         .found = is_extended ? "XCDR2" : fmt::format("{} bytes", message.data.size()),
         .advice = is_extended ? "Record with the default serialisation of ROS 2." : ""});
  }

  std::string name_;
  const TopicOptions& options_;
  ReadBudget* budget_ = nullptr;
  std::map<std::string, Topic> topics_;
  std::string unpacked_;
  std::size_t messages_ = 0;
  std::size_t values_ = 0;
  bool is_unfinished_ = false;
};

/// Unsigned, since a file of unknown origin may have any stamps.
std::int64_t elapsed_ns(std::int64_t from, std::int64_t to) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) -
                                   static_cast<std::uint64_t>(from));
}

/// The rows of a topic in the order of their stamps.
std::vector<std::size_t> order_of(const TopicTable& table) {
  std::vector<std::size_t> order(table.rows());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t row) { return table.stamps_ns()[row]; });
  return order;
}

/// For each row of the base the last row of the other topic that is not later; its number of rows
/// where there is none.
std::vector<std::size_t> rows_before(const TopicTable& base, const TopicTable& other) {
  const std::vector<std::size_t> order = order_of(other);
  std::vector<std::size_t> rows;
  rows.reserve(base.rows());
  for (const std::int64_t stamp : base.stamps_ns()) {
    const auto after = std::ranges::upper_bound(
        order, stamp, {}, [&](std::size_t row) { return other.stamps_ns()[row]; });
    rows.push_back(after == order.begin() ? other.rows() : *(after - 1));
  }
  return rows;
}

/// Gives the columns those names; the header, which has none, is left out.
void use_own_names(Topic& topic) {
  if (topic.own_names.empty()) return;
  std::vector<TopicTable::Column>& columns = topic.table.columns();
  std::erase_if(columns, [&](const TopicTable::Column& column) {
    return !topic.own_names.contains(column.name);
  });
  for (TopicTable::Column& column : columns) column.name = topic.own_names.at(column.name);
}

/// Which columns become channels: those that the options name, and without them those with a unit.
std::vector<bool> used_columns(const TopicTable& table, const TopicOptions& options) {
  std::vector<bool> used;
  for (const TopicTable::Column& column : table.columns())
    used.push_back(options.wanted.empty()
                       ? split_channel_name(column.name).has_value()
                       : std::ranges::find(options.wanted, column.name) != options.wanted.end());
  return used;
}

/// The messages of each topic that hold what is used, apart by publishers that fill different fields.
struct UsedTopics {
  std::vector<TopicTable> tables;
  std::vector<std::string> other_columns;  ///< further fields of these topics
  std::size_t base = 0;                    ///< the table with most rows
  bool is_own = false;                     ///< the base is a topic that torsio wrote
};

UsedTopics used_topics(Topics& topics, const TopicOptions& options, ReadBudget& budget) {
  UsedTopics result;
  std::size_t rows = 0;
  for (auto& [name, topic] : topics.all()) {
    topic.table.finish();
    use_own_names(topic);
    const bool is_own = !topic.own_names.empty();  // whose messages all have the same fields
    const std::vector<bool> used = used_columns(topic.table, options);
    const bool has_used = std::ranges::find(used, true) != used.end();
    const bool is_needed = options.wanted.empty() ? !topic.table.columns().empty() : has_used;
    if (topic.table.rows() == 0 || !is_needed) continue;
    std::set<std::string> others;
    for (const TopicTable::Column& column : topic.table.columns()) others.insert(column.name);
    std::vector<TopicTable> parts;
    if (is_own)
      parts.push_back(std::move(topic.table));
    else
      parts = topic.table.parts(used, budget);
    for (TopicTable& table : parts) {
      table.replace_missing_stamps();
      if (table.rows() > rows) {
        rows = table.rows();
        result.base = result.tables.size();
        result.is_own = is_own;
      }
      for (const TopicTable::Column& column : table.columns()) others.erase(column.name);
      result.tables.push_back(std::move(table));
    }
    result.other_columns.insert(result.other_columns.end(), others.begin(), others.end());
  }
  return result;
}

void add_clock(LogTable& table, const TopicTable& base, std::size_t first) {
  LogColumn clock{.name = "t_s", .number = 1, .values = {}};
  for (std::size_t row = first; row < base.rows(); ++row)
    clock.values.push_back(
        1e-9 * static_cast<double>(elapsed_ns(base.stamps_ns()[first], base.stamps_ns()[row])));
  table.columns.push_back(std::move(clock));
}

void add_base(LogTable& table, TopicTable& base, std::size_t first) {
  const auto skip = static_cast<std::ptrdiff_t>(first);
  for (std::size_t row = first; row < base.rows(); ++row)
    if (row == first || base.numbers()[row] != base.numbers()[row - 1] + 1)
      table.line_marks.emplace_back(row - first, base.numbers()[row]);
  for (TopicTable::Column& column : base.columns()) {
    column.values.erase(column.values.begin(), column.values.begin() + skip);
    table.columns.push_back({.name = std::move(column.name),
                             .number = table.columns.size() + 1,
                             .values = std::move(column.values)});
  }
}

void add_other(LogTable& table, const TopicTable& other, const std::vector<std::size_t>& rows,
               std::size_t first) {
  std::vector<std::uint8_t> fresh;
  for (std::size_t i = first; i < rows.size(); ++i)
    fresh.push_back(i == first || rows[i] != rows[i - 1] ? 1 : 0);
  const bool is_always_fresh = std::ranges::find(fresh, 0) == fresh.end();
  for (const TopicTable::Column& column : other.columns()) {
    LogColumn held{.name = column.name, .number = table.columns.size() + 1, .values = {}};
    // A row whose stamp is earlier than that of the row before may be before the first message.
    for (std::size_t i = first; i < rows.size(); ++i)
      held.values.push_back(rows[i] < other.rows() ? column.values[rows[i]] : kNotMeasured);
    if (!is_always_fresh) held.fresh = fresh;
    table.columns.push_back(std::move(held));
  }
}

LogTable joined_topics(Topics& topics, const TopicOptions& options, const std::string& name,
                       ReadBudget& budget) {
  UsedTopics used = used_topics(topics, options, budget);
  if (used.tables.empty()) {
    std::vector<std::string> names;
    for (const auto& [topic_name, topic] : topics.all()) names.push_back(topic_name);
    throw Error(
        {.place = name,
         .problem = "no numbers in the topics that are needed",
         .expected = options.wanted.empty() ? "messages of ROS or JSON" : joined(options.wanted),
         .found = names.empty() ? "no messages" : "the topics " + joined(names),
         .advice = "torsio check --list FILE prints topics and fields."});
  }
  TopicTable* const base = &used.tables[used.base];
  LogTable table;
  table.source.file = name;
  table.row_word = "message";
  table.has_units = used.is_own && used.tables.size() == 1;
  table.other_columns = std::move(used.other_columns);
  std::vector<std::pair<TopicTable*, std::vector<std::size_t>>> others;
  std::size_t first = 0;
  for (TopicTable& other_table : used.tables) {
    TopicTable* const other = &other_table;
    if (other == base) continue;
    others.emplace_back(other, rows_before(*base, *other));
    const auto& rows = others.back().second;
    const auto begun =
        std::ranges::find_if(rows, [&](std::size_t row) { return row < other->rows(); });
    first = std::max(first, static_cast<std::size_t>(begun - rows.begin()));
  }
  if (first >= base->rows())
    throw Error({.place = name,
                 .problem = "the topics were not recorded at the same time",
                 .advice = "torsio check --list FILE prints their times; use those of one topic."});
  if (!used.is_own) add_clock(table, *base, first);
  add_base(table, *base, first);
  for (const auto& [other, rows] : others) {
    budget.keep((sizeof(double) + 1) * rows.size() * other->columns().size());
    add_other(table, *other, rows, first);
  }
  return table;
}

std::int64_t largest_gap(const std::vector<std::int64_t>& stamps) {
  std::int64_t gap = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    gap = std::max(gap, elapsed_ns(stamps[i - 1], stamps[i]));
  return gap;
}

}  // namespace

LogTable table_of_messages(std::span<const NamedMessages> files, const std::string& name,
                           const TopicOptions& options) {
  Topics topics(options);
  for (const NamedMessages& file : files) topics.add(file);
  LogTable table = joined_topics(topics, options, name, files.back().messages->budget());
  table.is_unfinished = topics.is_unfinished();
  return table;
}

LogSummary summary_of_messages(std::span<const NamedMessages> files, const TopicOptions& options) {
  Topics topics(options);
  for (const NamedMessages& file : files) topics.add(file);
  LogSummary summary{.topics = {}, .is_unfinished = topics.is_unfinished()};
  for (auto& [name, topic] : topics.all()) {
    use_own_names(topic);
    topic.table.replace_missing_stamps();
    const auto& stamps = topic.table.stamps_ns();
    TopicSummary made{.topic = name,
                      .schema = topic.schema,
                      .encoding = topic.encoding,
                      .messages = stamps.size(),
                      .first_ns = stamps.empty() ? 0 : stamps.front(),
                      .last_ns = stamps.empty() ? 0 : *std::ranges::max_element(stamps),
                      .largest_gap_ns = largest_gap(stamps),
                      .fields = {},
                      .problem = topic.problem};
    for (const TopicTable::Column& column : topic.table.columns())
      made.fields.push_back(column.name);
    summary.topics.push_back(std::move(made));
  }
  return summary;
}

}  // namespace torsio
