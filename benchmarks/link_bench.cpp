#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "link_bytewise.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kFrames = 4096;

/// Frames with payloads of 64 to 255 bytes, and the stream that they are encoded to.
struct LinkTraffic {
  std::vector<std::vector<std::uint8_t>> payloads = {};
  std::vector<std::uint8_t> stream = {};
  std::size_t payload_bytes = 0;
};

/// @param byte of all payloads; none: random bytes
LinkTraffic link_traffic(std::optional<std::uint8_t> byte = std::nullopt) {
  Random random(51);
  LinkTraffic traffic;
  std::array<std::uint8_t, kNdlcomMaxEncodedBytes> out;
  for (std::size_t n = 0; n < kFrames; ++n) {
    auto& payload = traffic.payloads.emplace_back(64 + random.below(192));
    for (std::uint8_t& each : payload)
      each = byte.value_or(static_cast<std::uint8_t>(random.bits()));
    traffic.payload_bytes += payload.size();
    const std::size_t size = encode_ndlcom(
        {.receiver = 1, .sender = 2, .counter = static_cast<std::uint8_t>(n), .payload = payload},
        out);
    traffic.stream.insert(traffic.stream.end(), out.data(), out.data() + size);
  }
  return traffic;
}

template <class Encode>
double encode_seconds(const LinkTraffic& traffic, const Encode& encode) {
  std::vector<std::uint8_t> out(traffic.stream.size() + kNdlcomMaxEncodedBytes);
  const double seconds = best_seconds([&] {
    std::size_t at = 0;
    for (std::size_t n = 0; n < kFrames; ++n)
      at += encode(NdlcomFrame{.receiver = 1,
                               .sender = 2,
                               .counter = static_cast<std::uint8_t>(n),
                               .payload = traffic.payloads[n]},
                   std::span(out).subspan(at));
  });
  if (!std::equal(traffic.stream.begin(), traffic.stream.end(), out.begin()))
    throw std::runtime_error("the encoders differ");
  return seconds;
}

template <class Decoder>
double decode_seconds(const LinkTraffic& traffic) {
  return best_seconds([&] {
    Decoder decoder;
    std::span<const std::uint8_t> bytes = traffic.stream;
    std::size_t sum = 0;
    while (const auto frame = decoder.next(bytes)) sum += frame->payload.size();
    if (sum != traffic.payload_bytes) throw std::runtime_error("a decoder has lost frames");
  });
}

Row link_rate(const LinkTraffic& traffic, double seconds) {
  return {.value = 1e-6 * static_cast<double>(traffic.payload_bytes) / seconds, .unit = "MB/s"};
}

}  // namespace

Row link_encode() {
  const LinkTraffic traffic = link_traffic();
  return link_rate(traffic, encode_seconds(traffic, encode_ndlcom));
}

Row link_encode_bytewise() {
  const LinkTraffic traffic = link_traffic();
  return link_rate(traffic, encode_seconds(traffic, encode_bytewise));
}

Row link_encode_escapes() {
  const LinkTraffic traffic = link_traffic(0x7E);
  return link_rate(traffic, encode_seconds(traffic, encode_ndlcom));
}

Row link_decode() {
  const LinkTraffic traffic = link_traffic();
  return link_rate(traffic, decode_seconds<NdlcomDecoder>(traffic));
}

Row link_decode_bytewise() {
  const LinkTraffic traffic = link_traffic();
  return link_rate(traffic, decode_seconds<BytewiseDecoder>(traffic));
}

Row link_decode_escapes() {
  const LinkTraffic traffic = link_traffic(0x7E);
  return link_rate(traffic, decode_seconds<NdlcomDecoder>(traffic));
}

}  // namespace torsio::bench
