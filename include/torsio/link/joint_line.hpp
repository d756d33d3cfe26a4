#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "torsio/link/link_transport.hpp"

namespace torsio {

/// Where a host reaches joints: UDP, unless a path or a device is given.
struct JointLine {
  std::string host = "127.0.0.1";  ///< UDP: IPv4 address of the joints, in numbers
  std::uint16_t port = kNdlcomJointPort;
  std::uint16_t host_port = kNdlcomHostPort;  ///< on which this host listens
  /// The socket of the joints in the file system; that of this host is `<path>.host`.
  std::string unix_path = {};
  std::string serial = {};  ///< "/dev/ttyUSB0"
  double baud = 921600.0;   ///< rate of the serial line
};

/// "127.0.0.1:34001", "/run/joint", "/dev/ttyUSB0": for messages.
[[nodiscard]] std::string name(const JointLine& line);

/// Opens this host's end. UDP listens only on the interface that leads to the joints.
/// @throws Error as the functions of link_transport.hpp, UsageError if both a path and a device are given.
[[nodiscard]] std::unique_ptr<LinkTransport> open_joint_line(const JointLine& line);

/// The ids of 1 to 253 that reply to a ping within `wait_s`, in order. Not for real-time code.
/// @param host_id this host's id, which is left out
[[nodiscard]] std::vector<std::uint8_t> find_joints(LinkTransport& line, std::uint8_t host_id,
                                                    double wait_s);

}  // namespace torsio
