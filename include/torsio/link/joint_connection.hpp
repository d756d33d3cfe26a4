#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "torsio/control/joint_stop.hpp"
#include "torsio/link/host_endpoint.hpp"
#include "torsio/link/joint_line.hpp"

namespace torsio {

/// A host's connection to one joint, for programs of a person: calls that wait for the reply and repeat a request that got
/// none. It uses the heap and the machine's clock; a real-time loop uses `HostEndpoint`. For one thread.
///
///     JointConnection joint(JointLine{}, {.joint = 3});
///     joint.write("gain", 2.0);
///     joint.enable();
///     while (...) joint.send({.mode = JointMode::torque, .torque_Nm = 5.0F}), joint.poll(visit, 1e-3);
///     joint.disable();
///
/// A request that is repeated may be executed twice if only the reply was lost; each has the same effect twice as once.
/// `poll`, `send` and every request ping the joint so often that its commands are young. After `enable` a joint stops without
/// a `send` or `heartbeat` within the time of its watchdog. The destructor gives up control: an enabled joint then stops.
///
/// Every call throws Error with the joint's address, what was sent, the reason of a refusal in words, and what to do.
class JointConnection {
 public:
  struct Settings {
    std::uint8_t id = 254;   ///< this host's
    std::uint8_t joint = 1;  ///< 1 to 254
    NdlcomRules rules = NdlcomRules::strict;
    double timeout_s = 0.1;  ///< for a reply; 1 ms to 60 s
    int tries = 5;           ///< at least 1
    /// While nothing else of the joint is heard; 1 ms to 60 s. Commands are as old as this: longer only for a host that sends
    /// none.
    double ping_period_s = 0.005;
  };
  struct Information {
    LinkDriveState state = {};
    std::size_t registers = 0;
    std::size_t channels = 0;
    double watchdog_s = 0.0;
    std::string name = {};
    std::string version = {};
    std::string serial = {};
    std::string actuator = {};
  };
  using Value = std::variant<bool, std::int32_t, std::uint32_t, double, std::string>;
  struct Register {
    std::uint16_t index = 0;
    LinkValueType type = {};
    LinkAccess access = {};
    bool is_persistent = false;
    double lowest = 0.0;
    double highest = 0.0;
    std::string name = {};
    std::string unit = {};
    std::string description = {};
  };
  struct Subscription {
    std::vector<std::string> channels = {};  ///< in the order of the values of `LinkTelemetry`
    double rate_Hz = 0.0;                    ///< after rounding by the joint
  };
  struct Counts {
    std::uint64_t references = 0;                           ///< sent
    std::uint64_t telemetry = 0;                            ///< received
    std::uint64_t lost = 0;                                 ///< telemetry, by its sequence
    std::array<std::uint64_t, kLinkRefusals> refused = {};  ///< references, by reason
  };
  using VisitTelemetry = std::function<void(const LinkTelemetry&)>;

  /// Nothing is sent yet.
  /// @throws Error if the line cannot be opened or a setting is out of its range.
  JointConnection(const JointLine& line, const Settings& settings);
  /// On a line that is open, of which it may be one of several users, one after the other.
  /// @param place address of the joints, for messages
  JointConnection(std::shared_ptr<LinkTransport> line, const std::string& place,
                  const Settings& settings);
  ~JointConnection();
  JointConnection(JointConnection&& other) noexcept;
  JointConnection& operator=(JointConnection&& other) noexcept;

  [[nodiscard]] Information information();
  /// The descriptions of all registers; they are requested once.
  const std::vector<Register>& registers();
  /// @throws Error also with the names that are similar, if there is none of that name.
  const Register& find(std::string_view name);
  /// The names of all channels of the telemetry; they are requested once.
  const std::vector<std::string>& channels();
  [[nodiscard]] Value read(std::string_view name);
  /// @param value a number may have another type than the register if that has the same number
  void write(std::string_view name, const Value& value);

  void enable();
  void disable();
  void reset_fault();
  /// Needs no control, and is also sent if another host is in control.
  void stop(StopCategory category);
  void set_mode(JointMode mode);
  /// Makes the present value of a channel this value, in the channel's unit.
  void zero(std::string_view channel, double value);
  /// @param duration_s 0: until it is ended; an empty name ends all
  void inject_fault(const std::string& fault, std::string_view channel, double magnitude,
                    double duration_s);
  /// @param actuator type of the actuator for which the model was fitted
  /// @param progress is called with the fraction that was sent
  void upload(std::span<const std::uint8_t> file, const std::string& actuator,
              const std::function<void(double)>& progress = {});

  /// Sends a reference without waiting. @param valid_s the joint refuses it later than this after now, and stops this long
  /// after it without another one; `deadline_ns` of the reference is replaced
  void send(LinkReference reference, double valid_s = 0.02);
  /// Keeps an enabled joint from stopping, without waiting for a reply.
  void heartbeat();

  /// Telemetry of these channels, of all if there are none; the last call holds. Is renewed by `poll` and `send`.
  Subscription subscribe(const std::vector<std::string>& names, double rate_Hz);
  /// Calls `visit` for each telemetry that arrives within `wait_s`, or has before. @returns their number
  std::size_t poll(const VisitTelemetry& visit, double wait_s = 0.0);

  [[nodiscard]] const Counts& counts() const noexcept;
  /// The last change of the state that the joint made without a request since the last `enable`, `disable` or `reset_fault`,
  /// such as a stop: the joint sends it to the host that is or was in control.
  [[nodiscard]] std::optional<LinkState> last_change() const noexcept;
  /// "joint 1 at 127.0.0.1:34001"
  [[nodiscard]] const std::string& place() const noexcept;

 private:
  class Exchange;
  std::unique_ptr<Exchange> exchange_;
  std::vector<Register> registers_ = {};
  std::vector<std::string> channels_ = {};

  void change(LinkStateCommand command, LinkDriveState wanted);
  [[nodiscard]] std::uint8_t channel_index(std::string_view channel);
};

/// The value that a text names: "true", "12", "0.5", or the text itself, as the register's type requires.
/// @throws Error that names the register and the type.
[[nodiscard]] JointConnection::Value value_of(const JointConnection::Register& described,
                                              const std::string& text);
[[nodiscard]] std::string text_of(const JointConnection::Value& value);

}  // namespace torsio
