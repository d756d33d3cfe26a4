#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "torsio/link/joint_connection.hpp"

/// The line to a joint and the ids on it, for every verb below `torsio connect`.
struct ConnectFlags {
  torsio::JointLine line = {};
  unsigned joint = 1;
  unsigned id = 254;
  std::string timeout = "100ms";
  bool is_lenient = false;
  JsonOutput json = {};

  std::string bridge = "10ms";

  /// For what is recorded.
  void add_bridge(CLI::App& verb);
  [[nodiscard]] double bridge_s() const;
  /// All but `--joint`.
  void add_line(CLI::App& verb);
  void add(CLI::App& verb);
  [[nodiscard]] torsio::JointConnection::Settings settings() const;
  [[nodiscard]] torsio::JointConnection connection() const;
};

/// The ids that a text names, each once and in its order: "1,3,5-8".
/// @throws torsio::UsageError
[[nodiscard]] std::vector<std::uint8_t> joint_ids(const std::string& text);

// The verbs below `torsio connect` that are not in connect.cpp.

void add_connect_watch(CLI::App& connect);
void add_connect_record(CLI::App& connect);
void add_connect_play(CLI::App& connect);
void add_connect_commands(CLI::App& connect);
void add_connect_page(CLI::App& connect);
void add_connect_proxy(CLI::App& connect);
void add_connect_publish(CLI::App& connect);  ///< only with libwebsockets (TORSIO_HAS_LIVE)
