#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

/// Messages of Foxglove's WebSocket protocol, version 1. Source: the specification in github.com/foxglove/ws-protocol.
namespace torsio::foxglove {

inline constexpr std::string_view kSubprotocol = "foxglove.websocket.v1";
/// Another name of the same messages, by which newer versions of Foxglove ask first.
inline constexpr std::string_view kSdkSubprotocol = "foxglove.sdk.v1";

struct Channel {
  std::uint32_t id = 0;
  std::string topic = {};
  std::string schema_name = {};
  std::string schema = {};  ///< JSON schema of its messages, which are JSON
};
enum class Level : std::uint8_t { info, warning, error };

[[nodiscard]] std::string server_info(std::string_view name, std::string_view session);
[[nodiscard]] std::string advertise(std::span<const Channel> channels);
[[nodiscard]] std::string status(Level level, std::string_view text);
/// 1, subscription and time with their low byte first, and the message.
[[nodiscard]] std::vector<std::uint8_t> message_data(std::uint32_t subscription,
                                                     std::uint64_t time_ns,
                                                     std::string_view message);

struct Subscribe {
  struct Entry {
    std::uint32_t id = 0;  ///< chosen by the client
    std::uint32_t channel = 0;
  };
  std::vector<Entry> entries = {};
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids = {};
};
/// What is wrong with a message, for a status.
struct Mistake {
  std::string text = {};
};
/// What a client sends as text. Whatever it is, there is no exception.
[[nodiscard]] std::variant<Subscribe, Unsubscribe, Mistake> client_message(std::string_view text);

}  // namespace torsio::foxglove
