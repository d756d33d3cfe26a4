#include <fmt/format.h>

#include "store/database.hpp"

#if TORSIO_HAS_POSTGRESQL
#include <dlfcn.h>
#include <libpq-fe.h>

#include <array>
#include <charconv>
#include <map>

namespace torsio {
namespace {

// Numbers of types from PostgreSQL's catalogue (pg_type.dat), which do not change.
constexpr Oid kBool = 16;
constexpr Oid kBytea = 17;
constexpr Oid kInt8 = 20;
constexpr Oid kInt2 = 21;
constexpr Oid kInt4 = 23;
constexpr Oid kText = 25;
constexpr Oid kFloat4 = 700;
constexpr Oid kFloat8 = 701;

constexpr const char* kUrlExample = "one such as postgresql://user@host:5432/torsio";

/// The functions of libpq that are used here.
struct Libpq {
  decltype(&::PQclear) clear = nullptr;
  decltype(&::PQconnectdbParams) connect = nullptr;
  decltype(&::PQconnectionNeedsPassword) needs_password = nullptr;
  decltype(&::PQerrorMessage) error_message = nullptr;
  decltype(&::PQexec) exec = nullptr;
  decltype(&::PQexecParams) exec_params = nullptr;
  decltype(&::PQfinish) finish = nullptr;
  decltype(&::PQfreemem) free_memory = nullptr;
  decltype(&::PQftype) field_type = nullptr;
  decltype(&::PQgetisnull) is_null = nullptr;
  decltype(&::PQgetlength) length = nullptr;
  decltype(&::PQgetvalue) value = nullptr;
  decltype(&::PQnfields) fields = nullptr;
  decltype(&::PQntuples) rows = nullptr;
  decltype(&::PQpingParams) ping = nullptr;
  decltype(&::PQresultErrorField) result_error_field = nullptr;
  decltype(&::PQresultErrorMessage) result_error_message = nullptr;
  decltype(&::PQresultStatus) result_status = nullptr;
  decltype(&::PQsetNoticeProcessor) set_notice_processor = nullptr;
  decltype(&::PQstatus) status = nullptr;
  decltype(&::PQunescapeBytea) unescape_bytea = nullptr;
};

/// libpq is loaded when the first server is opened: it needs Kerberos, LDAP and TLS, which no other
/// part of torsio does. @throws Error if it is not installed.
const Libpq& libpq() {
  static const Libpq loaded = [] {
    void* const library = dlopen(TORSIO_LIBPQ_SONAME, RTLD_NOW | RTLD_LOCAL);
    Libpq functions;
    bool is_complete = library != nullptr;
    const auto load = [&](const char* name, auto& function) {
      if (!is_complete) return;
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
      is_complete = function != nullptr;
    };
    load("PQclear", functions.clear);
    load("PQconnectdbParams", functions.connect);
    load("PQconnectionNeedsPassword", functions.needs_password);
    load("PQerrorMessage", functions.error_message);
    load("PQexec", functions.exec);
    load("PQexecParams", functions.exec_params);
    load("PQfinish", functions.finish);
    load("PQfreemem", functions.free_memory);
    load("PQftype", functions.field_type);
    load("PQgetisnull", functions.is_null);
    load("PQgetlength", functions.length);
    load("PQgetvalue", functions.value);
    load("PQnfields", functions.fields);
    load("PQntuples", functions.rows);
    load("PQpingParams", functions.ping);
    load("PQresultErrorField", functions.result_error_field);
    load("PQresultErrorMessage", functions.result_error_message);
    load("PQresultStatus", functions.result_status);
    load("PQsetNoticeProcessor", functions.set_notice_processor);
    load("PQstatus", functions.status);
    load("PQunescapeBytea", functions.unescape_bytea);
    if (!is_complete)
      throw Error(
          {.place = "--store",
           .problem = "the client library of PostgreSQL cannot be loaded (" TORSIO_LIBPQ_SONAME ")",
           .advice = "Install it (Debian: libpq5), or use --store with the path of a SQLite "
                     "file."});
    return functions;
  }();
  return loaded;
}

struct FinishConnection {
  void operator()(PGconn* connection) const noexcept { libpq().finish(connection); }
};
struct ClearResult {
  void operator()(PGresult* result) const noexcept { libpq().clear(result); }
};
using PostgresqlResult = std::unique_ptr<PGresult, ClearResult>;

/// A message of libpq or of the server in one line.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const char printed = c == '\n' || c == '\t' ? ' ' : c;
    if (printed != ' ' || !line.ends_with(' ')) line += printed;
  }
  while (line.ends_with(' ')) line.pop_back();
  return line;
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

class PostgresqlDatabase final : public Database {
 public:
  explicit PostgresqlDatabase(const StoreAddress& address)
      : name_(address.name()), url_(address.target) {
    connect();
  }

  std::vector<DatabaseRow> execute(std::string_view sql,
                                   const std::vector<DatabaseValue>& values) override {
    std::vector<std::string> texts(values.size());
    std::vector<const char*> pointers(values.size(), nullptr);
    std::vector<int> lengths(values.size(), 0);
    std::vector<int> formats(values.size(), 0);
    std::vector<Oid> types(values.size(), 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::visit(
          [&](const auto& value) {
            using T = std::decay_t<decltype(value)>;
            if constexpr (std::is_same_v<T, std::monostate>) {
              return;
            } else if constexpr (std::is_same_v<T, Blob>) {
              pointers[i] = value.bytes.data();
              lengths[i] = static_cast<int>(value.bytes.size());
              formats[i] = 1;
              types[i] = kBytea;
            } else {
              if constexpr (std::is_same_v<T, std::string>) {
                texts[i] = value;
                types[i] = kText;
              } else {
                texts[i] = fmt::format("{}", value);  // the shortest text that reads as the number
                types[i] = std::is_same_v<T, double> ? kFloat8 : kInt8;
              }
              pointers[i] = texts[i].c_str();
            }
          },
          values[i]);
    }
    const PostgresqlResult result(libpq().exec_params(
        connection_.get(), std::string(sql).c_str(), static_cast<int>(values.size()), types.data(),
        pointers.data(), lengths.data(), formats.data(), 0));
    check(result.get());
    std::vector<DatabaseRow> rows(static_cast<std::size_t>(libpq().rows(result.get())));
    for (std::size_t r = 0; r < rows.size(); ++r)
      for (int c = 0; c < libpq().fields(result.get()); ++c)
        rows[r].push_back(value_at(result.get(), static_cast<int>(r), c));
    return rows;
  }

  void run_script(const std::string& sql) override {
    const PostgresqlResult result(libpq().exec(connection_.get(), sql.c_str()));
    check(result.get());
  }

  void begin(std::int64_t lock) override {
    run("BEGIN", {});
    if (lock != 0) run("SELECT pg_advisory_xact_lock($1)", {lock});
  }

  void roll_back() noexcept override {
    if (connection_) libpq().clear(libpq().exec(connection_.get(), "ROLLBACK"));
  }

  void reconnect() override {
    connection_.reset();
    connect();
  }

  bool has_table(std::string_view table) override {
    return !run("SELECT 1 FROM pg_tables WHERE schemaname = current_schema() AND tablename = $1",
                {std::string(table)})
                .empty();
  }
  std::string_view now() const noexcept override {
    return "extract(epoch FROM clock_timestamp())::float8";
  }
  std::string_view skip_locked() const noexcept override { return " FOR UPDATE SKIP LOCKED"; }
  std::string_view counted_key() const noexcept override { return "BIGSERIAL PRIMARY KEY"; }
  std::string_view bytes_type() const noexcept override { return "BYTEA"; }
  std::string keep_rows(std::string_view table, std::string_view /*key*/,
                        std::string_view columns) const override {
    return fmt::format(
        "CREATE FUNCTION keep_{0}() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN RAISE EXCEPTION "
        "'rows of {0} are kept as they are'; END $$;\n"
        "CREATE TRIGGER {0}_change BEFORE UPDATE{1}{2} OR DELETE OR TRUNCATE ON {0} "
        "FOR EACH STATEMENT EXECUTE FUNCTION keep_{0}();\n",
        table, columns.empty() ? "" : " OF ", columns);
  }

 private:
  /// Calls a function of libpq that has the parameters of a connection.
  template <class Function>
  std::invoke_result_t<Function, const char* const*, const char* const*, int> call_with_url(
      Function function, const char* timeout_s) const {
    constexpr auto kKeywords = std::to_array<const char*>(
        {"dbname", "application_name", "connect_timeout", "keepalives", "keepalives_idle",
         "keepalives_interval", "keepalives_count", "client_encoding", nullptr});
    const auto values = std::to_array<const char*>(
        {url_.c_str(), "torsio", timeout_s, "1", "20", "5", "3", "UTF8", nullptr});
    return function(kKeywords.data(), values.data(), 1);
  }

  void connect() {
    PGPing state = PQPING_OK;
    // Where the server takes connections a moment later, it had just ended its start.
    for (int attempt = 0; attempt < 2 && state == PQPING_OK; ++attempt) {
      connection_.reset(call_with_url(libpq().connect, "10"));
      if (libpq().status(connection_.get()) == CONNECTION_OK) {
        prepare_session();
        was_connected_ = true;
        return;
      }
      if (libpq().needs_password(connection_.get()) != 0) break;
      state = call_with_url(libpq().ping, "5");
    }
    refuse_connection(state);
  }

  void prepare_session() {
    libpq().set_notice_processor(
        connection_.get(), [](void*, const char*) {}, nullptr);
    // A transaction that lasts pins old rows for all other workers: none of torsio's takes seconds.
    run_script(
        "SET idle_in_transaction_session_timeout = '60s'; SET statement_timeout = '120s'; "
        "SET synchronous_commit = on");
  }

  /// @param state of the server; what it is about is not in the error of a connection, but for a text
  /// in the language of the server.
  [[noreturn]] void refuse_connection(PGPing state) const {
    const std::string reason = one_line(libpq().error_message(connection_.get()));
    if (state == PQPING_NO_ATTEMPT)  // the reason may have the whole URL with its password
      throw Error({.place = name_, .problem = "this URL cannot be read", .expected = kUrlExample});
    if (libpq().needs_password(connection_.get()) != 0 ||
        contains(reason, "authentication failed") || contains(reason, "pg_hba.conf") ||
        (contains(reason, "role") && contains(reason, "does not exist")))
      throw Error({.place = name_,
                   .problem = "the server refuses the user or the password (" + reason + ")",
                   .advice = "Write them in the URL, postgresql://user:password@host/name, or the "
                             "password in ~/.pgpass."});
    if (contains(reason, "database") && contains(reason, "does not exist"))
      throw Error({.place = name_,
                   .problem = "the server has no such database (" + reason + ")",
                   .advice = "Create it once with createdb, or correct the end of the URL."});
    if (state == PQPING_REJECT || contains(reason, "too many") ||
        contains(reason, "connection slots"))
      throw ConnectionLost(
          {.place = name_,
           .problem = "the server takes no connection at the moment (" + reason + ")"},
          true);
    if (!was_connected_) refuse_first(state, reason);
    throw unreachable(reason);
  }

  /// What waiting does not help against: the URL has never been right.
  void refuse_first(PGPing state, const std::string& reason) const {
    if (contains(reason, "could not translate host name"))
      throw Error({.place = name_,
                   .problem = "there is no host of this name (" + reason + ")",
                   .advice = "Correct the host in the URL."});
    if (contains(reason, "invalid response"))
      throw Error({.place = name_,
                   .problem = "there is another program at this address (" + reason + ")",
                   .advice = "Correct the host or the port in the URL."});
    if (contains(reason, "invalid"))
      throw Error({.place = name_,
                   .problem = "this URL cannot be read (" + reason + ")",
                   .expected = kUrlExample});
    if (state == PQPING_OK)
      throw Error({.place = name_,
                   .problem = "the server refuses the connection (" + reason + ")",
                   .advice = "Check user, password and database of the URL."});
  }

  [[nodiscard]] ConnectionLost unreachable(const std::string& reason) const {
    return ConnectionLost({.place = name_,
                           .problem = "the server does not answer (" + reason + ")",
                           .advice = "Check the host and the port of the URL and that the server "
                                     "runs."});
  }

  void check(const PGresult* result) const {
    const ExecStatusType status = libpq().result_status(result);
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) return;
    const char* const code = libpq().result_error_field(result, PG_DIAG_SQLSTATE);
    const std::string_view state = code == nullptr ? "" : code;
    const std::string reason = one_line(result == nullptr ? libpq().error_message(connection_.get())
                                                          : libpq().result_error_message(result));
    // 08: connection, 57P: the server ends or starts, 40: the transaction is to be repeated.
    if (state.empty() || state.starts_with("08") || state.starts_with("57P") ||
        state.starts_with("40") || libpq().status(connection_.get()) != CONNECTION_OK)
      throw ConnectionLost({.place = name_, .problem = "the connection was lost (" + reason + ")"},
                           true);
    ErrorReport report{.place = name_, .problem = reason};
    if (state.starts_with("53")) {
      report.problem = "the server has no space or memory left (" + reason + ")";
      report.advice = "Nothing of this step was written. Free some, and start the command again.";
    } else if (state == "25006") {
      report.problem = "the database may only be read";
      report.advice = "Give the URL of the primary server.";
    } else if (state == "42501") {
      report.problem = "this user may not write here (" + reason + ")";
      report.advice = "Let the owner GRANT the rights, or use another user in the URL.";
    }
    throw Error(std::move(report));
  }

  static DatabaseValue value_at(const PGresult* result, int row, int column) {
    if (libpq().is_null(result, row, column) != 0) return std::monostate{};
    const char* const text = libpq().value(result, row, column);
    const auto length = static_cast<std::size_t>(libpq().length(result, row, column));
    switch (libpq().field_type(result, column)) {
      case kBool: return std::int64_t{*text == 't' ? 1 : 0};
      case kInt2:
      case kInt4:
      case kInt8: {
        std::int64_t number = 0;
        std::from_chars(text, text + length, number);
        return number;
      }
      case kFloat4:
      case kFloat8: {
        double number = 0.0;
        std::from_chars(text, text + length, number);  // reads Infinity and NaN, too
        return number;
      }
      case kBytea: {
        std::size_t size = 0;
        unsigned char* const bytes =
            libpq().unescape_bytea(reinterpret_cast<const unsigned char*>(text), &size);
        Blob blob{std::string(reinterpret_cast<const char*>(bytes), size)};
        libpq().free_memory(bytes);
        return blob;
      }
      default: return std::string(text, length);
    }
  }

  std::string name_;
  std::string url_;
  bool was_connected_ = false;
  std::unique_ptr<PGconn, FinishConnection> connection_;
};

}  // namespace

std::unique_ptr<Database> open_postgresql(const StoreAddress& address) {
  return std::make_unique<PostgresqlDatabase>(address);
}

}  // namespace torsio

#else

namespace torsio {

std::unique_ptr<Database> open_postgresql(const StoreAddress& address) {
  throw Error({.place = address.name(),
               .problem = "this build of torsio has no PostgreSQL client",
               .advice = "Install libpq (Debian: libpq-dev) and build again, or use --store with "
                         "the path of a SQLite file."});
}

}  // namespace torsio

#endif
