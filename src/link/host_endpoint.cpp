#include "torsio/link/host_endpoint.hpp"

#include <fmt/format.h>

#include "core/checks.hpp"

namespace torsio {
namespace {

void require_device(std::string_view what, std::uint8_t id) {
  require(id != kNdlcomReserved && id != kNdlcomBroadcast, "host endpoint",
          fmt::format("{} of 1 to 254", what), fmt::format("{}", id));
}

}  // namespace

HostEndpoint::HostEndpoint(const Settings& settings)
    : settings_(settings), decoder_(settings.rules) {
  require_device("an id", settings.id);
  require_device("a joint", settings.joint);
  require(settings.id != settings.joint, "host endpoint", "an id that is not that of the joint",
          fmt::format("{} for both", settings.id));
}

std::size_t HostEndpoint::build_stop_of_all(std::uint8_t category,
                                            std::span<std::uint8_t> out) noexcept {
  const LinkRoute route{.receiver = kNdlcomBroadcast, .sender = settings_.id};
  std::array<std::uint8_t, kNdlcomMaxPayloadBytes> payload;
  const std::size_t size = encode_payload(LinkStop{.category = category}, route, payload);
  return frame_of(std::span(payload).first(size), kNdlcomBroadcast, out);
}

std::size_t HostEndpoint::frame_of(std::span<const std::uint8_t> payload, std::uint8_t receiver,
                                   std::span<std::uint8_t> out) noexcept {
  if (payload.empty()) return 0;
  return encode_ndlcom({.receiver = receiver,
                        .sender = settings_.id,
                        .counter = sent_.next(receiver),
                        .payload = payload},
                       out);
}

bool HostEndpoint::is_for_this_host(const NdlcomFrame& frame) noexcept {
  if (frame.receiver != settings_.id || frame.sender != settings_.joint) {
    ++counts_.to_others;
    return false;
  }
  received_.add(frame.sender, frame.receiver, frame.counter);
  return true;
}

}  // namespace torsio
