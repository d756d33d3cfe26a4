#include "link/connect_flags.hpp"

#include <CLI/Validators.hpp>
#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "common/data_flags.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace {

constexpr unsigned kHighestId = 254;

std::optional<unsigned> id_of(std::string_view text) {
  unsigned id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc{} || end != text.data() + text.size() || id < 1 || id > kHighestId)
    return std::nullopt;
  return id;
}

}  // namespace

std::vector<std::uint8_t> joint_ids(const std::string& text) {
  std::vector<std::uint8_t> ids;
  const auto refuse = [&text] {
    throw torsio::UsageError({.place = "--joints",
                              .expected = "ids from 1 to 254, each once, such as 1,3,5-8",
                              .found = text});
  };
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view part = std::string_view(text).substr(begin, end - begin);
    const std::size_t dash = part.find('-');
    const auto first = id_of(part.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : id_of(part.substr(dash + 1));
    if (!first || !last || *first > *last) refuse();
    for (unsigned id = *first; id <= *last; ++id) {
      if (std::ranges::find(ids, id) != ids.end()) refuse();
      ids.push_back(static_cast<std::uint8_t>(id));
    }
    begin = end + 1;
  }
  return ids;
}

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
  verb.add_option("--serial-line", line.serial, "serial line, for example /dev/ttyUSB0");
  verb.add_option("--baud", line.baud, "rate of the serial line")->capture_default_str();
  verb.add_option("--id", id, "id of this program among the hosts")
      ->check(CLI::Range(1U, kHighestId))
      ->capture_default_str();
  verb.add_option("--timeout", timeout, "time for a reply, after which a request is repeated")
      ->capture_default_str();
  verb.add_flag("--lenient", is_lenient,
                "accept also frames that only the public parser of NDLCom accepts");
  json.add(verb, "the result");
}

void ConnectFlags::add_bridge(CLI::App& verb) {
  verb.add_option(
          "--bridge", bridge,
          "longest gap of samples that did not arrive which is bridged by straight lines; 0s: none")
      ->capture_default_str();
}

double ConnectFlags::bridge_s() const {
  const double longest_s = torsio::signed_quantity_with_unit(bridge, "s", "--bridge");
  if (!(longest_s >= 0.0) || longest_s > 1.0)
    throw torsio::UsageError({.place = "--bridge", .expected = "0s to 1s", .found = bridge});
  return longest_s;
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
          .timeout_s = above_zero(torsio::signed_quantity_with_unit(timeout, "s", "--timeout"),
                                  "--timeout")};
}

torsio::JointConnection ConnectFlags::connection() const { return {line, settings()}; }
