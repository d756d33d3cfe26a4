#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/link/joint_connection.hpp"

namespace torsio {

/// The telemetry of several joints of one line at the same time. It observes and never takes control, also while another
/// host is in control. For one thread; it uses the heap and the machine's clock.
///
///     JointGroup joints(JointLine{}, {.joints = {1, 2, 3}});
///     joints.subscribe({"torque_Nm"}, 1000.0);
///     while (...) joints.poll([&](std::size_t n, const LinkTelemetry& telemetry) { ... }, 0.02);
///
/// Each joint has a `JointConnection` of its own, with its requests, repetitions, pings and renewals; the frames of the line
/// are given to the one whose joint has sent them. A joint that becomes silent does not disturb the others. Its subscription
/// is renewed as before, so that its telemetry continues when it has returned, also after a restart.
class JointGroup {
 public:
  struct Settings {
    std::uint8_t id = 254;                  ///< this host's
    std::vector<std::uint8_t> joints = {};  ///< ids, each once; at least one
    NdlcomRules rules = NdlcomRules::strict;
    double timeout_s = 0.1;      ///< for a reply; 1 ms to 60 s
    int tries = 5;               ///< at least 1
    double ping_period_s = 0.1;  ///< while nothing of a joint is heard; 1 ms to 60 s
    double silence_s = 0.5;      ///< without telemetry, after which a joint is silent
  };
  /// @param joint index in `Settings::joints`
  using VisitTelemetry = std::function<void(std::size_t joint, const LinkTelemetry&)>;

  /// Asks every joint for its information and the names of its channels.
  /// @param line is shared with no other user
  /// @param place address of the joints, for messages
  /// @throws Error that names the joint without a reply; if an id is not possible or given twice
  JointGroup(std::shared_ptr<LinkTransport> line, const std::string& place,
             const Settings& settings);
  /// @throws Error also if the line cannot be opened
  JointGroup(const JointLine& line, const Settings& settings);
  ~JointGroup();
  JointGroup(JointGroup&& other) noexcept;
  JointGroup& operator=(JointGroup&& other) noexcept;

  /// Telemetry of these channels, of all if there are none, from every joint; the last call holds.
  /// @throws Error that names the joint which does not have a channel, or refuses
  void subscribe(const std::vector<std::string>& names, double rate_Hz);
  /// Calls `visit` for each telemetry that arrives within `wait_s`, or has before: in order for a joint, in no order between
  /// joints. @returns their number
  std::size_t poll(const VisitTelemetry& visit, double wait_s = 0.0);

  [[nodiscard]] std::size_t size() const noexcept;
  [[nodiscard]] std::uint8_t id(std::size_t joint) const;
  /// The value of a register, and the state of the drive. Both wait for the reply of the joint; telemetry that arrives meanwhile
  /// is stored for `poll`.
  /// @throws Error if there is no reply, or no register of that name
  [[nodiscard]] JointConnection::Value read(std::size_t joint, std::string_view name);
  [[nodiscard]] LinkDriveState state(std::size_t joint);

  /// As it was at the start.
  [[nodiscard]] const JointConnection::Information& information(std::size_t joint) const;
  /// All that the joint has.
  [[nodiscard]] const std::vector<std::string>& channels(std::size_t joint) const;
  /// Channels in the order of the values, and the rate of the joint.
  [[nodiscard]] const JointConnection::Subscription& subscription(std::size_t joint) const;
  /// Telemetry received and lost, by its sequence.
  [[nodiscard]] const JointConnection::Counts& counts(std::size_t joint) const;
  /// No telemetry of a subscription for `silence_s`, or for three of its periods if these are longer. Changes in `poll`.
  [[nodiscard]] bool is_silent(std::size_t joint) const;
  /// "joint 1 at 127.0.0.1:34001"
  [[nodiscard]] const std::string& place(std::size_t joint) const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace torsio
