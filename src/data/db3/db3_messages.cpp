#include "data/db3/db3_messages.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <utility>

#include "core/report_progress.hpp"
#include "data/names.hpp"
#include "data/ros/common_definitions.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr int kMaxBytes = 256 << 20;  ///< largest message
constexpr int kInstructionsPerReport = 100'000;

std::string text_at(sqlite3_stmt* statement, int column) {
  const unsigned char* text = sqlite3_column_text(statement, column);
  if (text == nullptr) return {};
  return {reinterpret_cast<const char*>(text),
          static_cast<std::size_t>(sqlite3_column_bytes(statement, column))};
}

/// Called by the database while it works. @returns other than 0 to stop it
int asks_to_stop(void* progress) noexcept {
  try {
    report_progress(*static_cast<const Progress*>(progress), 0.0, "reading");
    return 0;
  } catch (...) {
    return 1;
  }
}

}  // namespace

void Db3Messages::CloseDatabase::operator()(sqlite3* database) const noexcept {
  sqlite3_close(database);
}
void Db3Messages::Finalize::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

Db3Messages::Db3Messages(const std::string& path, Progress progress)
    : path_(path), progress_(std::move(progress)) {
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) refuse("it cannot be opened");
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kMaxBytes);
  // A file of unknown origin must not call functions.
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_progress_handler(opened, kInstructionsPerReport, asks_to_stop, &progress_);
  if (!has_table("topics") || !has_table("messages"))
    refuse("it has no tables 'topics' and 'messages'");
  read_topics();
  messages_ = query("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
}

Db3Messages::~Db3Messages() = default;

void Db3Messages::refuse(const std::string& problem) const {
  throw Error({.place = path_,
               .problem = problem,
               .expected = "a database of rosbag2",
               .found = database_ ? sqlite3_errmsg(database_.get()) : ""});
}

Db3Messages::Statement Db3Messages::query(const char* sql) {
  sqlite3_stmt* made = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &made, nullptr) != SQLITE_OK)
    refuse("its tables are not those of rosbag2");
  return Statement(made);
}

bool Db3Messages::step(const Statement& statement) {
  const int code = sqlite3_step(statement.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_INTERRUPT) throw Cancelled();
  if (code != SQLITE_DONE) refuse("it cannot be read");
  return false;
}

bool Db3Messages::has_table(const char* name) {
  const Statement found = query("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?1");
  sqlite3_bind_text(found.get(), 1, name, -1, SQLITE_STATIC);
  return step(found);
}

std::map<std::string, MessageSchema, std::less<>> Db3Messages::definitions() {
  std::map<std::string, MessageSchema, std::less<>> schemas;
  if (!has_table("message_definitions")) return schemas;
  const Statement found =
      query("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
  while (step(found)) {
    const std::string name = text_at(found.get(), 0);
    schemas[name] = {escaped(name), escaped(text_at(found.get(), 1)), text_at(found.get(), 2)};
  }
  return schemas;
}

void Db3Messages::read_topics() {
  constexpr std::size_t kMaxTopics = 4096;
  const auto schemas = definitions();
  const Statement found = query("SELECT id, name, type, serialization_format FROM topics");
  while (step(found)) {
    if (topics_.size() >= kMaxTopics) refuse(fmt::format("more than {} topics", kMaxTopics));
    const std::string type = text_at(found.get(), 2);
    MessageChannel topic{.topic = escaped(text_at(found.get(), 1)),
                         .encoding = escaped(text_at(found.get(), 3)),
                         .schema = {.name = escaped(type), .encoding = {}, .definition = {}}};
    const auto schema = schemas.find(type);
    if (schema != schemas.end() && !schema->second.definition.empty())
      topic.schema = schema->second;
    else if (const std::string_view common = common_definition(type); !common.empty())
      topic.schema = {escaped(type), "ros2msg", std::string(common)};
    topics_.emplace(sqlite3_column_int64(found.get(), 0), std::move(topic));
  }
}

bool Db3Messages::next(LogMessage& message) {
  if (!step(messages_)) return false;
  const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
  if (topic == topics_.end()) refuse("a message of a topic that is not in its list");
  const void* const data = sqlite3_column_blob(messages_.get(), 2);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2));
  message = {.channel = &topic->second,
             .log_time_ns = sqlite3_column_int64(messages_.get(), 1),
             .data = data == nullptr ? std::string_view{}
                                     : std::string_view(static_cast<const char*>(data), size)};
  return true;
}

}  // namespace torsio
