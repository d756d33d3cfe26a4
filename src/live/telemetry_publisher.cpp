#include "torsio/live/telemetry_publisher.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <set>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "live/foxglove_server.hpp"
#include "live/telemetry_json.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLargestRequest_B = 65536;

/// Datagrams to one address, which may listen or not.
class DatagramSender {
 public:
  explicit DatagramSender(const TelemetryPublisher::PlotJuggler& to)
      : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(to.port);
    if (::inet_pton(AF_INET, to.address.c_str(), &address_.sin_addr) != 1)
      refuse("address of PlotJuggler", "an IPv4 address in numbers", "'" + to.address + "'");
    require(to.port != 0, "port of PlotJuggler", "1 to 65535", "0");
    if (!socket_.is_open())
      detail::refuse_system("UDP to PlotJuggler", "no socket can be opened", errno);
  }
  /// @returns whether the system took it
  bool send(std::string_view text) {
    // Not connected: a connected socket would lose a datagram for each one that did not arrive.
    return ::sendto(socket_.number(), text.data(), text.size(), 0,
                    reinterpret_cast<const sockaddr*>(&address_),
                    sizeof(address_)) == static_cast<ssize_t>(text.size());
  }

 private:
  detail::Descriptor socket_;
  sockaddr_in address_ = {};
};

}  // namespace

class TelemetryPublisher::Parts {
 public:
  explicit Parts(const Settings& settings) : settings_(settings) {
    require(!settings.joints.empty(), "telemetry publisher: joints", "at least one", "none");
    std::set<std::string> names;
    std::vector<foxglove::Channel> channels;
    for (const Joint& each : settings.joints) {
      require(names.insert(each.name).second, "telemetry publisher: joints", "each name once",
              fmt::format("'{}' twice", each.name));
      json_.emplace_back(each.channels);
      channels.push_back({.id = static_cast<std::uint32_t>(channels.size() + 1),
                          .topic = "/" + each.name,
                          .schema_name = "torsio." + each.name,
                          .schema = json_.back().schema()});
    }
    if (settings.plotjuggler) datagrams_.emplace(*settings.plotjuggler);
    if (!settings.foxglove) return;
    const Foxglove& wanted = *settings.foxglove;
    foxglove_ =
        std::make_unique<FoxgloveServer>(WebServer::Settings{.address = wanted.address,
                                                             .port = wanted.port,
                                                             .hosts = wanted.hosts,
                                                             .queue_limit_B = wanted.queue_limit_B,
                                                             .message_limit_B = kLargestRequest_B,
                                                             .on_refused = wanted.on_refused},
                                         wanted.origins, std::move(channels));
  }

  void publish(std::size_t joint, std::uint64_t time_us, std::span<const float> values) {
    constexpr std::uint64_t kMicrosecond_ns = 1000;
    ++counts_.samples;
    const bool is_subscribed = foxglove_ && foxglove_->has_subscribers(joint);
    if (!datagrams_ && !is_subscribed) return;
    const std::string text = json_.at(joint).text_of(values);
    if (datagrams_) {
      const bool is_sent =
          datagrams_->send(plotjuggler_text(settings_.joints[joint].name, time_us, text));
      ++(is_sent ? counts_.datagrams : counts_.datagrams_not_sent);
    }
    if (is_subscribed) foxglove_->publish(joint, kMicrosecond_ns * time_us, text);
  }

  void warn(std::string_view text) {
    if (foxglove_) foxglove_->status(foxglove::Level::warning, text);
  }

  [[nodiscard]] Counts counts() const {
    Counts all = counts_;
    if (!foxglove_) return all;
    const WebServer::Counts served = foxglove_->counts();
    all.messages = foxglove_->messages();
    all.clients = served.opened;
    all.dropped = served.dropped;
    all.refused = served.refused;
    return all;
  }
  [[nodiscard]] std::uint16_t foxglove_port() const noexcept {
    return foxglove_ ? foxglove_->port() : std::uint16_t{0};
  }

 private:
  Settings settings_;
  std::vector<TelemetryJson> json_ = {};
  std::optional<DatagramSender> datagrams_ = {};
  Counts counts_ = {};
  std::unique_ptr<FoxgloveServer> foxglove_ = {};
};

TelemetryPublisher::TelemetryPublisher(const Settings& settings)
    : parts_(std::make_unique<Parts>(settings)) {}
TelemetryPublisher::~TelemetryPublisher() = default;

void TelemetryPublisher::publish(std::size_t joint, std::uint64_t time_us,
                                 std::span<const float> values) {
  parts_->publish(joint, time_us, values);
}
void TelemetryPublisher::warn(std::string_view text) { parts_->warn(text); }
TelemetryPublisher::Counts TelemetryPublisher::counts() const { return parts_->counts(); }
std::uint16_t TelemetryPublisher::foxglove_port() const noexcept { return parts_->foxglove_port(); }

}  // namespace torsio
