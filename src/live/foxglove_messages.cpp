#include "live/foxglove_messages.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "live/telemetry_json.hpp"

namespace torsio::foxglove {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

constexpr std::uint8_t kMessageData = 1;
constexpr std::size_t kShownText = 60;

std::string dump(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

void add_low_byte_first(std::vector<std::uint8_t>& bytes, std::uint64_t number, int size) {
  for (int n = 0; n < size; ++n) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * n)));
}

std::optional<std::uint32_t> id_of(const Json& json) {
  if (!json.is_number_unsigned()) return std::nullopt;
  const auto number = json.get<std::uint64_t>();
  if (number > UINT32_MAX) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

/// The element of an object; null: it has none, or is not an object.
const Json& element(const Json& object, const char* name) {
  static const Json none;
  if (!object.is_object()) return none;
  const auto found = object.find(name);
  return found == object.end() ? none : *found;
}

std::variant<Subscribe, Unsubscribe, Mistake> subscribe_of(const Json& message) {
  const Json& list = element(message, "subscriptions");
  if (!list.is_array()) return Mistake{"subscribe: expected a list of subscriptions"};
  Subscribe made;
  for (const Json& each : list) {
    const auto id = id_of(element(each, "id"));
    const auto channel = id_of(element(each, "channelId"));
    if (!id || !channel)
      return Mistake{"subscribe: expected whole numbers as id and channelId of each subscription"};
    made.entries.push_back({.id = *id, .channel = *channel});
  }
  return made;
}

std::variant<Subscribe, Unsubscribe, Mistake> unsubscribe_of(const Json& message) {
  const Json& list = element(message, "subscriptionIds");
  if (!list.is_array()) return Mistake{"unsubscribe: expected a list of subscriptionIds"};
  Unsubscribe made;
  for (const Json& each : list) {
    const auto id = id_of(each);
    if (!id) return Mistake{"unsubscribe: expected whole numbers as subscriptionIds"};
    made.ids.push_back(*id);
  }
  return made;
}

}  // namespace

std::string server_info(std::string_view name, std::string_view session) {
  return dump({{"op", "serverInfo"},
               {"name", name},
               {"capabilities", OrderedJson::array()},
               {"metadata", OrderedJson::object()},
               {"sessionId", session}});
}

std::string advertise(std::span<const Channel> channels) {
  OrderedJson list = OrderedJson::array();
  for (const Channel& each : channels)
    list.push_back({{"id", each.id},
                    {"topic", each.topic},
                    {"encoding", "json"},
                    {"schemaName", each.schema_name},
                    {"schemaEncoding", "jsonschema"},
                    {"schema", each.schema}});
  return dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string status(Level level, std::string_view text) {
  return dump({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", text}});
}

std::vector<std::uint8_t> message_data(std::uint32_t subscription, std::uint64_t time_ns,
                                       std::string_view message) {
  constexpr std::size_t kHeader_B = 13;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kHeader_B + message.size());
  bytes.push_back(kMessageData);
  add_low_byte_first(bytes, subscription, 4);
  add_low_byte_first(bytes, time_ns, 8);
  bytes.insert(bytes.end(), message.begin(), message.end());
  return bytes;
}

std::variant<Subscribe, Unsubscribe, Mistake> client_message(std::string_view text) {
  const Json message = Json::parse(text, nullptr, false);
  const Json& op = element(message, "op");
  if (!op.is_string()) return Mistake{"expected a JSON object with a field op"};
  const auto& name = op.get_ref<const std::string&>();
  if (name == "subscribe") return subscribe_of(message);
  if (name == "unsubscribe") return unsubscribe_of(message);
  return Mistake{fmt::format("{}: not offered by this server, which publishes telemetry only",
                             name.substr(0, kShownText))};
}

}  // namespace torsio::foxglove
