#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/store/store_address.hpp"

namespace torsio {

/// Bytes that are not text.
struct Blob {
  std::string bytes;
  bool operator==(const Blob&) const = default;
};
/// A value of a column or of a parameter; the first alternative is NULL.
using DatabaseValue = std::variant<std::monostate, std::int64_t, double, std::string, Blob>;
using DatabaseRow = std::vector<DatabaseValue>;

/// The connection to the server was lost in a transaction, which has then not happened or, if it was
/// about to be committed, may have: the caller repeats it.
class ConnectionLost : public Error {
 public:
  /// @param is_temporary the server is there, but starts, ends or has no connection left
  explicit ConnectionLost(ErrorReport report, bool is_temporary = false)
      : Error(std::move(report)), is_temporary_(is_temporary) {}
  [[nodiscard]] bool is_temporary() const noexcept { return is_temporary_; }

 private:
  bool is_temporary_ = false;
};

/// One connection to SQLite or PostgreSQL. The statements of torsio are written for both: parameters
/// are $1, $2, and what differs is in the functions below. For one thread at a time.
class Database {
 public:
  virtual ~Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// @returns the rows of one statement. @throws ConnectionLost, Error (disk full, read only, ...).
  std::vector<DatabaseRow> run(std::string_view sql,
                               const std::vector<DatabaseValue>& values = {}) {
    return execute(sql, values);
  }
  /// Several statements without parameters, separated by semicolons.
  virtual void run_script(const std::string& sql) = 0;

  /// Begins a transaction that may write. With a `lock` no other transaction with the same lock runs
  /// until this one ends; SQLite has one writer at a time in any case.
  virtual void begin(std::int64_t lock = 0) = 0;
  void commit() { run("COMMIT"); }
  virtual void roll_back() noexcept = 0;

  /// Connects again after `ConnectionLost`. @throws ConnectionLost, Error.
  virtual void reconnect() = 0;

  [[nodiscard]] virtual bool has_table(std::string_view name) = 0;
  /// The seconds since 1970 by the clock of the database, as an expression. Clocks of other machines
  /// are never compared with it.
  [[nodiscard]] virtual std::string_view now() const noexcept = 0;
  /// Ends a SELECT of one row that no other transaction may take.
  [[nodiscard]] virtual std::string_view skip_locked() const noexcept = 0;
  /// The types of a key that the database counts, and of bytes.
  [[nodiscard]] virtual std::string_view counted_key() const noexcept = 0;
  [[nodiscard]] virtual std::string_view bytes_type() const noexcept = 0;
  /// Statements after which no row of the table can be removed, and none of these columns changed.
  /// @param key column whose rows cannot be replaced either; empty: they may be, by the same
  /// @param columns separated by commas; empty: all
  [[nodiscard]] virtual std::string keep_rows(std::string_view table, std::string_view key,
                                              std::string_view columns = {}) const = 0;

 protected:
  Database() = default;
  virtual std::vector<DatabaseRow> execute(std::string_view sql,
                                           const std::vector<DatabaseValue>& values) = 0;
};

/// A transaction that is rolled back unless it is committed.
class Transaction {
 public:
  explicit Transaction(Database& database, std::int64_t lock = 0) : database_(database) {
    database_.begin(lock);
  }
  ~Transaction() {
    if (!is_committed_) database_.roll_back();
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void commit() {
    database_.commit();
    is_committed_ = true;
  }

 private:
  Database& database_;
  bool is_committed_ = false;
};

/// @throws Error if the file or the server cannot be opened, with the reason.
[[nodiscard]] std::unique_ptr<Database> open_database(const StoreAddress& address);

/// The two kinds.
[[nodiscard]] std::unique_ptr<Database> open_sqlite(const StoreAddress& address);
[[nodiscard]] std::unique_ptr<Database> open_postgresql(const StoreAddress& address);

}  // namespace torsio
