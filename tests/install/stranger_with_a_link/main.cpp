#include <array>
#include <cstdint>
#include <cstdio>

#include "torsio/link.hpp"

int main() {
  torsio::HostEndpoint host({.id = 254, .joint = 1});
  std::array<std::uint8_t, torsio::kNdlcomMaxEncodedBytes> frame;
  std::printf("a ping of %zu bytes\n", host.build(torsio::LinkPing{.token = 1}, frame));
}
