#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/vfs.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <system_error>
#include <thread>

#include "store/database.hpp"

namespace torsio {
namespace {

constexpr int kBusyTimeout_s = 60;

struct CloseSqlite {
  void operator()(sqlite3* database) const noexcept { sqlite3_close_v2(database); }
};
struct FinalizeSqlite {
  void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
};

/// Names of file systems that several machines share, on which the log of changes that SQLite maps
/// into memory is not coherent (sqlite.org/wal.html), by the number that statfs(2) gives.
const char* network_file_system(const std::filesystem::path& folder) {
  struct Known {
    unsigned long number;
    const char* name;
  };
  constexpr auto kKnown = std::to_array<Known>({{0x6969, "NFS"},
                                                {0xff534d42, "CIFS"},
                                                {0xfe534d42, "SMB"},
                                                {0x517b, "SMB"},
                                                {0x65735546, "FUSE"},
                                                {0x01021997, "9P"},
                                                {0x00c36400, "Ceph"},
                                                {0x0bd00bd0, "Lustre"},
                                                {0x47504653, "GPFS"},
                                                {0x19830326, "BeeGFS"},
                                                {0x5346414f, "AFS"}});
  struct statfs found {};
  if (statfs(folder.c_str(), &found) != 0) return nullptr;
  const auto number = static_cast<unsigned long>(found.f_type) & 0xffffffffUL;
  const auto* const known = std::ranges::find(kKnown, number, &Known::number);
  return known == kKnown.end() ? nullptr : known->name;
}

class SqliteDatabase final : public Database {
 public:
  explicit SqliteDatabase(const StoreAddress& address) : name_(address.name()) {
    if (address.kind == StoreAddress::Kind::memory) {
      open(":memory:");
      run("PRAGMA foreign_keys=ON");
      return;
    }
    refuse_network(address.target);
    open(address.target.c_str());
    refuse_foreign();
    keep_log();
    // A crash of the program loses nothing; after a power cut the last trials may be done again.
    run("PRAGMA synchronous=NORMAL");
    run("PRAGMA foreign_keys=ON");
  }
  ~SqliteDatabase() override { statements_.clear(); }

  std::vector<DatabaseRow> execute(std::string_view sql,
                                   const std::vector<DatabaseValue>& values) override {
    sqlite3_stmt* const statement = prepared(sql);
    struct Reset {
      sqlite3_stmt* statement;
      ~Reset() { sqlite3_reset(statement); }
    } const reset{statement};
    bind(statement, values);
    std::vector<DatabaseRow> rows;
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(statement)) == SQLITE_ROW) {
      DatabaseRow row;
      const int columns = sqlite3_column_count(statement);
      row.reserve(static_cast<std::size_t>(columns));
      for (int column = 0; column < columns; ++column) row.push_back(value_at(statement, column));
      rows.push_back(std::move(row));
    }
    if (code != SQLITE_DONE) fail();
    return rows;
  }

  void run_script(const std::string& sql) override {
    if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
  }

  // A transaction that begins as a reader and then writes fails at once if another wrote meanwhile.
  void begin(std::int64_t /*lock*/) override { run("BEGIN IMMEDIATE", {}); }

  void roll_back() noexcept override {
    if (sqlite3_get_autocommit(database_.get()) == 0)
      sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }

  void reconnect() override {}

  bool has_table(std::string_view table) override {
    return !run("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = $1",
                {std::string(table)})
                .empty();
  }
  std::string_view now() const noexcept override {
    return "((julianday('now') - 2440587.5) * 86400.0)";
  }
  std::string_view skip_locked() const noexcept override { return ""; }
  std::string_view counted_key() const noexcept override {
    return "INTEGER PRIMARY KEY AUTOINCREMENT";
  }
  std::string_view bytes_type() const noexcept override { return "BLOB"; }
  std::string keep_rows(std::string_view table, std::string_view key,
                        std::string_view columns) const override {
    const std::string refusal =
        fmt::format("SELECT RAISE(ABORT, 'rows of {} are kept as they are');", table);
    std::string triggers = fmt::format(
        "CREATE TRIGGER {0}_change BEFORE UPDATE{1}{2} ON {0} BEGIN {3} END;\n"
        "CREATE TRIGGER {0}_removal BEFORE DELETE ON {0} BEGIN {3} END;\n",
        table, columns.empty() ? "" : " OF ", columns, refusal);
    // INSERT OR REPLACE removes a row without calling a trigger on DELETE.
    if (!key.empty())
      triggers += fmt::format(
          "CREATE TRIGGER {0}_replacement BEFORE INSERT ON {0} WHEN EXISTS(SELECT 1 FROM {0} WHERE "
          "{1} = NEW.{1}) BEGIN {2} END;\n",
          table, key, refusal);
    return triggers;
  }

 private:
  void refuse_network(const std::string& path) const {
    std::filesystem::path folder = std::filesystem::path(path).parent_path();
    if (folder.empty()) folder = ".";
    std::error_code ignored;
    if (!std::filesystem::is_directory(folder, ignored))
      throw Error({.place = name_,
                   .problem = "there is no folder for this store",
                   .advice = fmt::format("Create {} first.", folder.string())});
    const char* const network = network_file_system(folder);
    if (network == nullptr) return;
    throw Error({.place = name_,
                 .problem = fmt::format("a SQLite store cannot be on a file system that machines "
                                        "share ({}): it would lose results",
                                        network),
                 .advice = "Use --store with a file on a local disk, or a PostgreSQL server: "
                           "--store postgresql://user@host/torsio."});
  }

  /// A recording of another program may be a SQLite file, too: nothing is written into it.
  void refuse_foreign() {
    if (run("SELECT 1 FROM sqlite_master LIMIT 1").empty() || has_table("schema_version")) return;
    throw Error({.place = name_,
                 .problem = "this SQLite file is of another program",
                 .advice = "Use --store FILE with another name."});
  }

  /// Changes to the journal of a log. While another program does so too, SQLite fails at once
  /// instead of waiting.
  void keep_log() {
    constexpr auto kPause = std::chrono::milliseconds(20);
    for (auto waited = std::chrono::milliseconds(0); waited < std::chrono::seconds(kBusyTimeout_s);
         waited += kPause) {
      if (sqlite3_exec(database_.get(), "PRAGMA journal_mode=WAL", nullptr, nullptr, nullptr) ==
          SQLITE_OK)
        return;
      if ((sqlite3_errcode(database_.get()) & 0xff) != SQLITE_BUSY) fail();
      std::this_thread::sleep_for(kPause);
    }
    fail();
  }

  void open(const char* path) {
    sqlite3* opened = nullptr;
    const int code =
        sqlite3_open_v2(path, &opened, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
    database_.reset(opened);
    if (code != SQLITE_OK) fail();
    // Before anything is read: the files beside it would be those of this user, and lock out its owner.
    if (sqlite3_db_readonly(opened, "main") == 1) fail(SQLITE_READONLY);
    sqlite3_busy_timeout(opened, 1000 * kBusyTimeout_s);
    sqlite3_extended_result_codes(opened, 1);
  }

  sqlite3_stmt* prepared(std::string_view sql) {
    const auto known = statements_.find(sql);
    if (known != statements_.end()) return known->second.get();
    sqlite3_stmt* made = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &made,
                           nullptr) != SQLITE_OK)
      fail();
    return statements_
        .emplace(std::string(sql), std::unique_ptr<sqlite3_stmt, FinalizeSqlite>(made))
        .first->second.get();
  }

  void bind(sqlite3_stmt* statement, const std::vector<DatabaseValue>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int at = sqlite3_bind_parameter_index(statement, fmt::format("${}", i + 1).c_str());
      const auto bound = [&](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, std::monostate>)
          return sqlite3_bind_null(statement, at);
        else if constexpr (std::is_same_v<T, std::int64_t>)
          return sqlite3_bind_int64(statement, at, value);
        else if constexpr (std::is_same_v<T, double>)
          return sqlite3_bind_double(statement, at, value);
        else if constexpr (std::is_same_v<T, std::string>)
          return sqlite3_bind_text(statement, at, value.data(), static_cast<int>(value.size()),
                                   SQLITE_TRANSIENT);
        else
          return sqlite3_bind_blob64(statement, at, value.bytes.data(), value.bytes.size(),
                                     SQLITE_TRANSIENT);
      };
      if (at == 0 || std::visit(bound, values[i]) != SQLITE_OK) fail();
    }
  }

  static DatabaseValue value_at(sqlite3_stmt* statement, int column) {
    const auto size = [&] {
      return static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
    };
    switch (sqlite3_column_type(statement, column)) {
      case SQLITE_INTEGER: return std::int64_t{sqlite3_column_int64(statement, column)};
      case SQLITE_FLOAT: return sqlite3_column_double(statement, column);
      case SQLITE_TEXT: {
        const auto* const text =
            reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
        return std::string(text, size());
      }
      case SQLITE_BLOB: {
        const auto* const bytes = static_cast<const char*>(sqlite3_column_blob(statement, column));
        return Blob{bytes == nullptr ? std::string() : std::string(bytes, size())};
      }
      default: return std::monostate{};
    }
  }

  [[noreturn]] void fail() const { fail(sqlite3_errcode(database_.get()) & 0xff); }
  [[noreturn]] void fail(int code) const {
    ErrorReport report{.place = name_, .problem = sqlite3_errmsg(database_.get())};
    switch (code) {
      case SQLITE_FULL:
        report.problem = "the disk is full: nothing of this step was written";
        report.advice = "Free some space and start the command again: it continues.";
        break;
      case SQLITE_READONLY:
        report.problem = "the store may not be written";
        report.advice = "Give the file and its folder write permission, or use --store FILE.";
        break;
      case SQLITE_CANTOPEN:
        report.problem = "the store cannot be opened or created";
        report.advice = "Check the path and the permissions, or use --store FILE.";
        break;
      case SQLITE_NOTADB:
      case SQLITE_CORRUPT:
        report.problem = "this file is not a store of torsio, or it is damaged";
        report.advice = "Use --store FILE with another name.";
        break;
      case SQLITE_BUSY:
        report.problem = fmt::format("another program has held the store for {} s", kBusyTimeout_s);
        report.advice = "End that program, and start the command again: it continues.";
        break;
      case SQLITE_IOERR:
        report.problem =
            fmt::format("reading or writing failed ({})", sqlite3_errmsg(database_.get()));
        report.advice =
            "Nothing of this step was written. Check the disk and its free space, and the quota "
            "and "
            "the limits of this user (ulimit -f); then start the command again: it continues.";
        break;
      default: break;
    }
    throw Error(std::move(report));
  }

  std::string name_;
  std::unique_ptr<sqlite3, CloseSqlite> database_;
  std::map<std::string, std::unique_ptr<sqlite3_stmt, FinalizeSqlite>, std::less<>> statements_;
};

}  // namespace

std::unique_ptr<Database> open_sqlite(const StoreAddress& address) {
  return std::make_unique<SqliteDatabase>(address);
}

}  // namespace torsio
