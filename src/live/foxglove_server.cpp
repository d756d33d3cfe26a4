#include "live/foxglove_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace torsio {

using foxglove::Level;

FoxgloveServer::FoxgloveServer(WebServer::Settings settings,
                               const std::vector<std::string>& origins,
                               std::vector<foxglove::Channel> channels)
    : channels_(std::move(channels)),
      session_(fmt::format("{}", std::chrono::system_clock::now().time_since_epoch().count())),
      subscribers_(channels_.size()) {
  settings.endpoints = {endpoint(foxglove::kSdkSubprotocol, origins),
                        endpoint(foxglove::kSubprotocol, origins)};
  server_ = std::make_unique<WebServer>(std::move(settings));
}

WebEndpoint FoxgloveServer::endpoint(std::string_view subprotocol,
                                     const std::vector<std::string>& origins) {
  return {
      .subprotocol = std::string(subprotocol),
      .origins = origins,
      .on_open = [this](const ClientPointer& client) { open(client); },
      .on_text = [this](const ClientPointer& client, std::string_view text) { take(client, text); },
      .on_binary =
          [](const ClientPointer& client, std::span<const std::uint8_t>) {
            client->send_text(
                foxglove::status(Level::error, "binary message: not offered by this server"));
          },
      .on_close = [this](const ClientPointer& client) { close(client); }};
}

void FoxgloveServer::open(const ClientPointer& client) {
  client->send_text(foxglove::server_info("torsio", session_));
  client->send_text(foxglove::advertise(channels_));
  const std::lock_guard lock(mutex_);
  clients_[client->id()] = client;
}

void FoxgloveServer::close(const ClientPointer& client) {
  const std::lock_guard lock(mutex_);
  clients_.erase(client->id());
  for (auto& each : subscribers_)
    std::erase_if(each, [&](const Subscriber& other) { return other.client == client; });
}

std::string FoxgloveServer::subscribe(const ClientPointer& client,
                                      const foxglove::Subscribe::Entry& entry) {
  const auto found = std::ranges::find(channels_, entry.channel, &foxglove::Channel::id);
  if (found == channels_.end())
    return fmt::format("subscribe: there is no channel {}", entry.channel);
  for (std::size_t k = 0; k < channels_.size(); ++k)
    for (const Subscriber& each : subscribers_[k]) {
      if (each.client != client) continue;
      if (each.id == entry.id)
        return fmt::format("subscribe: id {} is in use for another subscription", entry.id);
      if (channels_[k].id == entry.channel)
        return fmt::format("subscribe: channel {} has a subscription already", entry.channel);
    }
  subscribers_[static_cast<std::size_t>(found - channels_.begin())].push_back(
      {.client = client, .id = entry.id});
  return {};
}

std::string FoxgloveServer::unsubscribe(const ClientPointer& client, std::uint32_t id) {
  std::size_t erased = 0;
  for (auto& each : subscribers_)
    erased += std::erase_if(
        each, [&](const Subscriber& other) { return other.client == client && other.id == id; });
  return erased > 0 ? std::string() : fmt::format("unsubscribe: there is no subscription {}", id);
}

void FoxgloveServer::take(const ClientPointer& client, std::string_view text) {
  const auto message = foxglove::client_message(text);
  std::vector<std::string> mistakes;
  if (const auto* const mistake = std::get_if<foxglove::Mistake>(&message))
    mistakes.push_back(mistake->text);
  {
    const std::lock_guard lock(mutex_);
    if (const auto* const wanted = std::get_if<foxglove::Subscribe>(&message))
      for (const auto& each : wanted->entries) mistakes.push_back(subscribe(client, each));
    if (const auto* const ended = std::get_if<foxglove::Unsubscribe>(&message))
      for (const std::uint32_t each : ended->ids) mistakes.push_back(unsubscribe(client, each));
  }
  // One status for a message, however many mistakes are in it.
  const auto first =
      std::ranges::find_if(mistakes, [](const std::string& each) { return !each.empty(); });
  if (first != mistakes.end()) client->send_text(foxglove::status(Level::error, *first));
}

bool FoxgloveServer::has_subscribers(std::size_t channel) const {
  const std::lock_guard lock(mutex_);
  return !subscribers_[channel].empty();
}

void FoxgloveServer::publish(std::size_t channel, std::uint64_t time_ns, std::string_view message) {
  const std::lock_guard lock(mutex_);
  for (const Subscriber& each : subscribers_[channel]) {
    const bool is_queued = each.client->send_binary(std::make_shared<std::vector<std::uint8_t>>(
        foxglove::message_data(each.id, time_ns, message)));
    messages_ += is_queued ? 1 : 0;
  }
}

void FoxgloveServer::status(Level level, std::string_view text) {
  const WebBuffer message = web_buffer(foxglove::status(level, text));
  const std::lock_guard lock(mutex_);
  for (const auto& [id, client] : clients_) client->send_text(message);
}

std::uint64_t FoxgloveServer::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

}  // namespace torsio
