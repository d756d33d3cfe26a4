#pragma once

#include <cstdint>
#include <string>

#include "torsio/link/link_transport.hpp"

namespace torsio::bench {

/// A port of the local machine that nothing used just now.
inline std::uint16_t free_port() {
  UdpSettings settings;
  settings.listen.port = 0;
  settings.peers.front().port = 9;
  const std::string place = open_udp(settings)->place();
  return static_cast<std::uint16_t>(std::stoi(place.substr(place.find(':') + 1)));
}

}  // namespace torsio::bench
