#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/live/web_server.hpp"

namespace torsio {

/// Telemetry of joints for two programs of others at the same time. PlotJuggler gets one JSON object per sample and joint in a UDP
/// datagram, Foxglove a channel per joint of its WebSocket protocol, with the subprotocols `foxglove.websocket.v1` and
/// `foxglove.sdk.v1`, which differ in their name only. Both get the same time stamps and the same digits: each number is the
/// shortest text that gives the same double again, and one that is not finite is left out, since JSON has none.
///
///     TelemetryPublisher publisher({.joints = {{.name = "elbow", .channels = {"torque_Nm"}}},
///                                   .plotjuggler = UdpAddress{.port = 9870}, .foxglove = WebServer::Settings{.port = 8765}});
///     publisher.publish(0, time_us, values);
///
/// No function waits for a receiver. For one thread.
///
/// Source: the specification in github.com/foxglove/ws-protocol, and the message layouts of version 1 of github.com/foxglove/foxglove-sdk
/// (formats only; the code is our own). docs/robot/publish.md
class TelemetryPublisher {
 public:
  struct Joint {
    std::string name = {};                   ///< topic; different for each joint
    std::vector<std::string> channels = {};  ///< in the order of the values
  };
  struct PlotJuggler {
    std::string address = "127.0.0.1";  ///< IPv4 in numbers
    std::uint16_t port = 9870;
  };
  struct Foxglove {
    std::string address = "127.0.0.1";      ///< interface on which it is served
    std::uint16_t port = 8765;              ///< 0: any free one
    std::vector<std::string> hosts = {};    ///< as `WebServer::Settings::hosts`
    std::vector<std::string> origins = {};  ///< pages that may connect, as `WebEndpoint::origins`
    std::size_t queue_limit_B = std::size_t{8}
                                << 20;  ///< waiting for one client, before it is dropped
    /// Is called in a thread of the server for each refused client.
    std::function<void(const WebRequest&, int status)> on_refused = {};
  };
  struct Settings {
    std::vector<Joint> joints = {};
    std::optional<PlotJuggler> plotjuggler = {};
    std::optional<Foxglove> foxglove = {};
  };
  struct Counts {
    std::uint64_t samples = 0;             ///< given to `publish`
    std::uint64_t datagrams = 0;           ///< to PlotJuggler
    std::uint64_t datagrams_not_sent = 0;  ///< the system did not take them
    std::uint64_t messages = 0;            ///< queued for a client of Foxglove
    std::uint64_t clients = 0;             ///< Foxglove's, that connected
    std::uint64_t dropped = 0;             ///< clients that did not read
    std::uint64_t refused = 0;             ///< host, origin, or another subprotocol
  };

  /// @throws Error if no joint is given, a name is given twice, or an address cannot be used, as `WebServer`
  explicit TelemetryPublisher(const Settings& settings);
  ~TelemetryPublisher();
  TelemetryPublisher(const TelemetryPublisher&) = delete;
  TelemetryPublisher& operator=(const TelemetryPublisher&) = delete;

  /// @param joint index in `Settings::joints`
  /// @param time_us since 1970; whole microseconds are the finest that a double has for PlotJuggler's seconds
  /// @param values one for each channel of the joint
  void publish(std::size_t joint, std::uint64_t time_us, std::span<const float> values);
  /// A warning that Foxglove shows.
  void warn(std::string_view text);

  [[nodiscard]] Counts counts() const;
  /// 0: Foxglove is not served.
  [[nodiscard]] std::uint16_t foxglove_port() const noexcept;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace torsio
