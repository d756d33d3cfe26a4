#include "link/connect_flags.hpp"

#include <CLI/Validators.hpp>

#include "common/data_flags.hpp"
#include "torsio/core/units.hpp"

namespace {

constexpr unsigned kHighestId = 254;

}  // namespace

void ConnectFlags::add_line(CLI::App& verb) {
  verb.add_option("--host", line.host, "IPv4 address of the joints")->capture_default_str();
  verb.add_option("--port", line.port, "UDP port of the joints")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb.add_option("--host-port", line.host_port, "UDP port on which this program listens")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb.add_option("--unix", line.unix_path,
                  "socket of the joints in the file system; this program's is PATH.host");
  verb.add_option("--serial", line.serial, "serial line, for example /dev/ttyUSB0");
  verb.add_option("--baud", line.baud, "rate of the serial line")->capture_default_str();
  verb.add_option("--id", id, "id of this program among the hosts")
      ->check(CLI::Range(1U, kHighestId))
      ->capture_default_str();
  verb.add_option("--timeout", timeout, "time for a reply, after which a request is repeated")
      ->capture_default_str();
  verb.add_flag("--lenient", is_lenient,
                "accept also frames that only the public parser of NDLCom accepts");
  verb.add_option("--json", json.destination,
                  "write the result as JSON to a file, or - for standard output");
}

void ConnectFlags::add(CLI::App& verb) {
  verb.add_option("--joint", joint, "id of the joint")
      ->check(CLI::Range(1U, kHighestId))
      ->capture_default_str();
  add_line(verb);
}

torsio::JointConnection::Settings ConnectFlags::settings() const {
  return {.id = static_cast<std::uint8_t>(id),
          .joint = static_cast<std::uint8_t>(joint),
          .rules = is_lenient ? torsio::NdlcomRules::lenient : torsio::NdlcomRules::strict,
          .timeout_s = above_zero(torsio::si_quantity(timeout, "s", "--timeout"), "--timeout")};
}

torsio::JointConnection ConnectFlags::connection() const { return {line, settings()}; }
