#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/link/can_bus.hpp"
#include "torsio/link/link_transport.hpp"
#include "torsio/sim/joints/joint_server.hpp"

/// The line on which joints listen.
struct JointLineFlags {
  std::uint16_t port = torsio::kNdlcomJointPort;
  std::uint16_t host_port = torsio::kNdlcomHostPort;
  std::string listen = "127.0.0.1";
  std::vector<std::string> allowed;  ///< addresses, perhaps with a port
  std::string unix_path;
  std::string serial;
  std::string pty;
  double baud = torsio::SerialSettings{}.baud;
  std::string can;  ///< INTERFACE:CHANNEL

  void add(CLI::App& verb);
  /// @throws torsio::UsageError for two lines at once, or an address beyond this machine without a list of hosts
  [[nodiscard]] std::unique_ptr<torsio::LinkTransport> open(const CLI::App& verb) const;
  /// @returns null without --can
  /// @throws torsio::UsageError for another interface than udp_multicast and socketcan
  [[nodiscard]] std::unique_ptr<torsio::CanBus> open_can() const;
};

/// Which joints there are, and what happens to them.
struct ServedJointFlags {
  std::vector<std::string> joints;  ///< [ID=]ACTUATOR[,model=FILE]
  std::string arm;
  std::string link_mass;
  std::string link_length;
  bool has_vertical_axis = false;
  std::vector<std::string> injected;  ///< ID:WHAT=AMOUNT@TIME
  std::string faults;

  void add(CLI::App& verb);
  [[nodiscard]] std::vector<torsio::ServedArm> arms(const torsio::Progress& progress) const;

 private:
  [[nodiscard]] std::vector<torsio::ServedArm> single_joints(
      const torsio::Progress& progress) const;
  void add_faults(std::vector<torsio::ServedArm>& arms, const torsio::Progress& progress) const;
};
