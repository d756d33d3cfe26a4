#include "data/db3/db3_messages.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "data/names.hpp"
#include "data/ros/common_definitions.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr int kMaxBytes = 256 << 20;  ///< largest message
constexpr int kInstructionsPerReport = 100'000;
/// Elements that so many instructions count as.
constexpr std::uint64_t kWorkPerReport = 50'000;

std::string text_at(sqlite3_stmt* statement, int column) {
  const unsigned char* text = sqlite3_column_text(statement, column);
  if (text == nullptr) return {};
  return {reinterpret_cast<const char*>(text),
          static_cast<std::size_t>(sqlite3_column_bytes(statement, column))};
}

}  // namespace

void Db3Messages::CloseDatabase::operator()(sqlite3* database) const noexcept {
  sqlite3_close(database);
}
void Db3Messages::Finalize::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

/// Called by the database while it works. @returns other than 0 to stop it
int Db3Messages::watch(void* self) noexcept {
  auto& own = *static_cast<Db3Messages*>(self);
  try {
    own.budget().work(kWorkPerReport);
    return 0;
  } catch (...) {
    own.stopped_ = std::current_exception();
    return 1;
  }
}

Db3Messages::Db3Messages(const std::string& path, Progress progress)
    : MessageSource(ReadBudget(path, std::move(progress))) {
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unknown);
  if (!unknown) budget().read_to(bytes);
  open(path.c_str());
  prepare();
}

Db3Messages::Db3Messages(ByteSource& packed, const std::string& name, Progress progress)
    : MessageSource(ReadBudget(name, std::move(progress))) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::string block;
  bool is_whole = true;
  while (is_whole) {
    is_whole = read_exactly(packed, block, kBlock);
    budget().read_to(packed.bytes_read());
    budget().keep(block.size());
    unpacked_ += block;
  }
  // The log of changes is another file, which a database in memory has not.
  constexpr std::size_t kVersions = 18;
  constexpr char kWithLog = 2;
  for (std::size_t at = kVersions; at < kVersions + 2 && at < unpacked_.size(); ++at)
    if (unpacked_[at] == kWithLog) unpacked_[at] = 1;
  open(":memory:");
  const auto size = static_cast<sqlite3_int64>(unpacked_.size());
  if (sqlite3_deserialize(database_.get(), "main",
                          reinterpret_cast<unsigned char*>(unpacked_.data()), size, size,
                          SQLITE_DESERIALIZE_READONLY) != SQLITE_OK)
    refuse("it cannot be opened");
  prepare();
}

void Db3Messages::open(const char* path) {
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(path, &opened, SQLITE_OPEN_READONLY, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) refuse("it cannot be opened");
}

void Db3Messages::prepare() {
  sqlite3* const opened = database_.get();
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kMaxBytes);
  // A file of unknown origin must not call functions.
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_progress_handler(opened, kInstructionsPerReport, watch, this);
  if (!has_table("topics") || !has_table("messages"))
    refuse("it has no tables 'topics' and 'messages'");
  for (const char* table : {"topics", "messages", "message_definitions"}) require_plain(table);
  read_topics();
  messages_ = query("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
}

Db3Messages::~Db3Messages() = default;

void Db3Messages::refuse(const std::string& problem) const {
  throw Error({.place = budget().name(),
               .problem = problem,
               .expected = "a database of rosbag2",
               .found = database_ && sqlite3_errcode(database_.get()) != SQLITE_ROW
                            ? sqlite3_errmsg(database_.get())
                            : ""});
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
  if (stopped_) std::rethrow_exception(std::exchange(stopped_, nullptr));
  if (code != SQLITE_DONE) refuse("it cannot be read");
  return false;
}

bool Db3Messages::has_table(const char* name) {
  const Statement found = query("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?1");
  sqlite3_bind_text(found.get(), 1, name, -1, SQLITE_STATIC);
  return step(found);
}

// Views, virtual tables and generated columns compute what they return, by whatever the file states.
void Db3Messages::require_plain(const char* table) {
  const Statement made = query("SELECT sql FROM sqlite_master WHERE name = ?1");
  sqlite3_bind_text(made.get(), 1, table, -1, SQLITE_STATIC);
  while (step(made))
    if (!text_at(made.get(), 0).starts_with("CREATE TABLE"))
      refuse(fmt::format("'{}' is not an ordinary table", table));
  const Statement columns = query("SELECT name FROM pragma_table_xinfo(?1) WHERE hidden <> 0");
  sqlite3_bind_text(columns.get(), 1, table, -1, SQLITE_STATIC);
  if (step(columns))
    refuse(fmt::format("the column '{}' of '{}' is computed", text_at(columns.get(), 0), table));
}

std::map<std::string, MessageSchema, std::less<>> Db3Messages::definitions() {
  std::map<std::string, MessageSchema, std::less<>> schemas;
  if (!has_table("message_definitions")) return schemas;
  const Statement found =
      query("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
  while (step(found)) {
    const std::string name = text_at(found.get(), 0);
    budget().keep(static_cast<std::uint64_t>(sqlite3_column_bytes(found.get(), 2)));
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
    budget().keep(schema != schemas.end() ? schema->second.definition.size() : 0);
    if (schema != schemas.end() && !schema->second.definition.empty())
      topic.schema = schema->second;
    else if (const std::string_view common = common_definition(type); !common.empty())
      topic.schema = {escaped(type), "ros2msg", std::string(common)};
    topics_.emplace(sqlite3_column_int64(found.get(), 0), std::move(topic));
  }
}

bool Db3Messages::next(LogMessage& message) {
  if (!step(messages_)) return false;
  budget().work(1);
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
