#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace torsio::test {

/// A PostgreSQL server of its own, in a folder under /tmp, with the user fleet and the password
/// "secret". It refuses to run as root: then it runs as the user that Debian's package made.
class PostgresqlServer {
 public:
  /// The folder of initdb; empty: it is not installed.
  static std::string programs() {
    std::string newest;
    std::error_code absent;
    for (const auto& version : std::filesystem::directory_iterator("/usr/lib/postgresql", absent))
      if (std::filesystem::exists(version.path() / "bin/initdb"))
        newest = std::max(newest, (version.path() / "bin").string());
    return newest;
  }

  PostgresqlServer() : port_(free_port()) {
    std::string pattern = "/tmp/torsio-postgresql-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no folder under /tmp");
    folder_ = pattern;
    std::ofstream(folder_ + "/password") << "secret\n";
    if (geteuid() == 0) {
      const passwd* const user = getpwnam("postgres");
      if (user == nullptr) throw std::runtime_error("there is no user postgres");
      for (const std::string& path : {folder_, folder_ + "/password"})
        if (chown(path.c_str(), user->pw_uid, user->pw_gid) != 0)
          throw std::runtime_error("the folder of the server cannot be given to postgres");
      as_user_ = "setpriv --reuid=postgres --regid=postgres --clear-groups ";
    }
    command(
        fmt::format("{}/initdb -D {}/data -A scram-sha-256 -E UTF8 --no-locale -U fleet "
                    "--pwfile={}/password",
                    programs(), folder_, folder_));
    start();
  }
  ~PostgresqlServer() {
    try {
      stop("immediate");
    } catch (const std::exception&) {  // it was stopped
    }
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  PostgresqlServer(const PostgresqlServer&) = delete;
  PostgresqlServer& operator=(const PostgresqlServer&) = delete;

  /// @param options of the server: "-c max_connections=4"
  void start(const std::string& options = {}) {
    command(
        fmt::format("{}/pg_ctl -D {}/data -l {}/log -w -o \"-p {} -k {} -c "
                    "listen_addresses=127.0.0.1 -c fsync=off {}\" start",
                    programs(), folder_, folder_, port_, folder_, options));
  }
  /// Starts one that refuses connections, as a server does while it recovers, until `end_recovery`.
  void start_in_recovery() {
    command(fmt::format("touch {}/data/standby.signal", folder_));
    start("-c hot_standby=off");
  }
  void end_recovery() { command(fmt::format("{}/pg_ctl -D {}/data promote", programs(), folder_)); }
  /// @param mode fast, or immediate: as after a crash
  void stop(const std::string& mode) {
    command(fmt::format("{}/pg_ctl -D {}/data -m {} stop", programs(), folder_, mode));
  }

  [[nodiscard]] std::string url(const std::string& password = "secret",
                                const std::string& database = "postgres") const {
    return fmt::format("postgresql://fleet:{}@127.0.0.1:{}/{}", password, port_, database);
  }
  /// An empty database of its own.
  std::string new_database() {
    const std::string name = fmt::format("test_{}", ++databases_);
    command(fmt::format("env PGPASSWORD=secret {}/createdb -h 127.0.0.1 -p {} -U fleet {}",
                        programs(), port_, name));
    return url("secret", name);
  }

 private:
  void command(const std::string& line) const {
    if (std::system((as_user_ + line + " >> " + folder_ + "/commands.log 2>&1").c_str()) != 0)
      throw std::runtime_error("failed: " + line);
  }

  static int free_port() {
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    if (bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no free port");
    close(descriptor);
    return ntohs(address.sin_port);
  }

  int port_;
  int databases_ = 0;
  std::string folder_;
  std::string as_user_;
};

}  // namespace torsio::test
