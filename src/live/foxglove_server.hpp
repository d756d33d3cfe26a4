#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "live/foxglove_messages.hpp"
#include "torsio/live/web_server.hpp"

namespace torsio {

/// Channels that clients of Foxglove subscribe to. A client that sends something else gets a status that names it; one that does
/// not read is dropped. `publish` and `status` may be called from any thread, and wait for none.
class FoxgloveServer {
 public:
  /// @param settings without endpoints @param origins of pages that may connect
  /// @throws Error as `WebServer`
  FoxgloveServer(WebServer::Settings settings, const std::vector<std::string>& origins,
                 std::vector<foxglove::Channel> channels);

  [[nodiscard]] bool has_subscribers(std::size_t channel) const;
  void publish(std::size_t channel, std::uint64_t time_ns, std::string_view message);
  void status(foxglove::Level level, std::string_view text);

  [[nodiscard]] std::uint16_t port() const noexcept { return server_->port(); }
  [[nodiscard]] WebServer::Counts counts() const { return server_->counts(); }
  [[nodiscard]] std::uint64_t messages() const;  ///< queued for a client

 private:
  using ClientPointer = WebEndpoint::ClientPointer;
  struct Subscriber {
    ClientPointer client;
    std::uint32_t id = 0;  ///< number of the subscription
  };

  [[nodiscard]] WebEndpoint endpoint(std::string_view subprotocol,
                                     const std::vector<std::string>& origins);
  void open(const ClientPointer& client);
  void take(const ClientPointer& client, std::string_view text);
  void close(const ClientPointer& client);
  /// With the lock. @returns what is wrong; empty: nothing
  std::string subscribe(const ClientPointer& client, const foxglove::Subscribe::Entry& entry);
  std::string unsubscribe(const ClientPointer& client, std::uint32_t id);

  std::vector<foxglove::Channel> channels_;
  std::string session_;
  mutable std::mutex mutex_ = {};  ///< for what follows
  std::map<std::uint64_t, ClientPointer> clients_ = {};
  std::vector<std::vector<Subscriber>> subscribers_;  ///< by channel
  std::uint64_t messages_ = 0;
  std::unique_ptr<WebServer> server_;  ///< last: its thread uses what is above
};

}  // namespace torsio
