#pragma once

#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "data/byte_source.hpp"
#include "data/ros/message_source.hpp"
#include "torsio/core/progress.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace torsio {

/// The first bytes of a database of SQLite.
inline constexpr std::string_view kDb3Mark{"SQLite format 3\0", 16};

/// The messages of a database of rosbag2 (`.db3`) in the order of their times. Databases of ROS 2
/// before Iron do not contain the definitions of their messages: then those of `common_definition`
/// are used. Source: rosbag2_storage_sqlite3.
class Db3Messages final : public MessageSource {
 public:
  /// @throws Error if the file is no such database. Cancelled if the progress asks to stop.
  Db3Messages(const std::string& path, Progress progress = {});
  /// The same of a packed file, which is unpacked into memory.
  Db3Messages(ByteSource& packed, const std::string& name, Progress progress = {});
  ~Db3Messages() override;
  Db3Messages(const Db3Messages&) = delete;
  Db3Messages& operator=(const Db3Messages&) = delete;

  bool next(LogMessage& message) override;

 private:
  struct CloseDatabase {
    void operator()(sqlite3* database) const noexcept;
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

  void open(const char* path);
  void prepare();
  [[nodiscard]] Statement query(const char* sql);
  /// The next row. @returns false after the last
  bool step(const Statement& statement);
  [[nodiscard]] bool has_table(const char* name);
  void require_plain(const char* table);
  [[nodiscard]] static int watch(void* self) noexcept;
  [[nodiscard]] std::map<std::string, MessageSchema, std::less<>> definitions();
  void read_topics();
  [[noreturn]] void refuse(const std::string& problem) const;

  std::string unpacked_;        ///< must outlive the database
  std::exception_ptr stopped_;  ///< why the database was asked to stop
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  std::map<std::int64_t, MessageChannel> topics_;
  Statement messages_;
};

}  // namespace torsio
