#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/link/can_bus.hpp"
#include "torsio/link/joint_endpoint.hpp"
#include "torsio/link/register_table.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {

/// Commands of ODrive's CANSimple protocol, the lower five bits of an id; the upper six are the node.
///
/// Source: docs.odriverobotics.com/v/latest/manual/can-protocol.html, firmware 0.6. docs/robot/can.md has units and refusals.
enum class CanSimpleCommand : std::uint8_t {
  get_version = 0x00,
  heartbeat = 0x01,
  estop = 0x02,
  get_error = 0x03,
  rx_sdo = 0x04,
  tx_sdo = 0x05,
  address = 0x06,
  set_axis_state = 0x07,
  get_encoder_estimates = 0x09,
  set_controller_mode = 0x0B,
  set_input_pos = 0x0C,
  set_input_vel = 0x0D,
  set_input_torque = 0x0E,
  set_limits = 0x0F,
  set_traj_vel_limit = 0x11,
  set_traj_accel_limits = 0x12,
  set_traj_inertia = 0x13,
  get_iq = 0x14,
  get_temperature = 0x15,
  reboot = 0x16,
  get_bus_voltage_current = 0x17,
  clear_errors = 0x18,
  set_absolute_position = 0x19,
  set_pos_gain = 0x1A,
  set_vel_gains = 0x1B,
  get_torques = 0x1C,
  get_powers = 0x1D,
  enter_dfu_mode = 0x1F,
};

inline constexpr std::uint8_t kCanSimpleLastNode = 62;
inline constexpr std::uint8_t kCanSimpleBroadcast = 63;

/// @returns the 11-bit id of a command to a node, or from it
[[nodiscard]] constexpr std::uint32_t can_simple_id(std::uint8_t node,
                                                    CanSimpleCommand command) noexcept {
  return std::uint32_t{node} << 5U | static_cast<std::uint32_t>(command);
}

/// Bits of errors in Heartbeat and Get_Error that a joint reports.
struct CanSimpleError {
  static constexpr std::uint32_t kNone = 0;
  static constexpr std::uint32_t kInitializing = 0x1;
  static constexpr std::uint32_t kSystemLevel = 0x2;
  static constexpr std::uint32_t kTimingError = 0x4;
  static constexpr std::uint32_t kMissingEstimate = 0x8;
  static constexpr std::uint32_t kMissingInput = 0x40;
  static constexpr std::uint32_t kWatchdogTimerExpired = 0x0100'0000;
  static constexpr std::uint32_t kEstopRequested = 0x0200'0000;
};

enum class CanSimpleAxisState : std::uint8_t { undefined = 0, idle = 1, closed_loop_control = 8 };
/// Result of the last request of a state, in Heartbeat.
enum class CanSimpleResult : std::uint8_t {
  success = 0,
  busy = 1,  ///< in closed loop control
  cancelled = 2,
  disarmed = 3,
  invalid_state = 13,
};
enum class CanSimpleControlMode : std::uint8_t {
  voltage = 0,
  torque = 1,
  velocity = 2,
  position = 3
};
inline constexpr std::uint32_t kCanSimplePassthrough = 1;  ///< the input mode that is offered

/// A joint as a node of CANSimple, beside its NDLCom endpoint: what a frame commands is executed by the endpoint, so that guard,
/// watchdog, states, registers and limits are the same. All hosts of the bus are one host there, since frames do not name their
/// sender. No heap, thread or clock of its own.
///
/// Angles, speeds and torques are those of the joint, at the gear's output. The position is that of the motor side, rotor over
/// gear ratio, as in the joint's own position mode; the speed is its low-passed difference.
class CanSimpleNode {
 public:
  struct Settings {
    std::uint8_t node = 0;  ///< 0 to 62
    double tick_rate_Hz = 1000.0;
    double status_rate_Hz =
        10.0;  ///< Heartbeat, Get_Error, Get_Bus_Voltage_Current; 0: on request only
    double estimate_rate_Hz =
        100.0;  ///< Get_Encoder_Estimates, Get_Iq, Get_Torques; 0: on request only
    double speed_cutoff_Hz = 60.0;  ///< low-pass of the speed
  };

  /// The joint needs the channels motor_angle_rad, motor_current_A, command_current_A, torque_Nm and wanted_torque_Nm, and the
  /// register gear_ratio. With is_ready_1 references wait until it is 1; with supply_V, torque_constant_Nm_A, largest_speed_rad_s,
  /// largest_torque_Nm and stop_cause bus voltage, limits and causes of faults are offered.
  /// @param endpoint of the joint, with a `bus_host`; all outlive the node
  /// @throws Error if a channel or register is missing, the node or a rate is out of its range, or there is no `bus_host`
  CanSimpleNode(const Settings& settings, JointEndpoint& endpoint, const LinkJoint& joint,
                const RegisterTable& registers, CanSink& bus);

  /// Once per tick, after that of the endpoint: measurements, what waits, cyclic frames.
  void tick(std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// A data or remote frame with an id of 11 bits whose upper six are this node, or the broadcast.
  void receive(const CanFrame& frame, std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::uint8_t node() const noexcept { return settings_.node; }
  [[nodiscard]] CanSimpleControlMode control_mode() const noexcept { return mode_; }
  [[nodiscard]] CanSimpleResult result() const noexcept { return result_; }
  /// Bits of `CanSimpleError`.
  [[nodiscard]] std::uint32_t active_errors() const noexcept;
  [[nodiscard]] std::uint32_t disarm_reason() const noexcept { return disarm_reason_; }
  /// Frames that the bus did not take.
  [[nodiscard]] std::uint64_t not_sent() const noexcept { return not_sent_; }

 private:
  /// What the host sets; in each mode the others are feed-forward, or have no effect.
  struct Inputs {
    std::optional<double> position_rad = {};  ///< none: where the joint is
    double velocity_rad_s = 0.0;
    double torque_Nm = 0.0;
  };
  struct Values {
    double position_rad = 0.0;
    double velocity_rad_s = 0.0;
    float current_A = 0.0F;
    float wanted_current_A = 0.0F;
    float torque_Nm = 0.0F;
    float wanted_torque_Nm = 0.0F;
    bool is_ready = true;
  };
  struct Channels {
    std::size_t motor_angle = 0;
    std::size_t motor_current = 0;
    std::size_t command_current = 0;
    std::size_t torque = 0;
    std::size_t wanted_torque = 0;
    std::optional<std::size_t> is_ready = {};
  };

  [[nodiscard]] LinkRefusal execute(CanSimpleCommand command, std::span<const std::uint8_t> data,
                                    std::uint64_t now_ns) noexcept;
  [[nodiscard]] bool reply(CanSimpleCommand command) noexcept;
  [[nodiscard]] std::optional<CanFrame> frame_of(CanSimpleCommand command) const noexcept;
  [[nodiscard]] LinkRefusal set_axis_state(std::span<const std::uint8_t> data,
                                           std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal set_controller_mode(std::span<const std::uint8_t> data,
                                                std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal set_inputs(CanSimpleCommand command, std::span<const std::uint8_t> data,
                                       std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal set_limits(std::span<const std::uint8_t> data,
                                       std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal clear_errors(std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal send_reference(const Inputs& inputs, std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal change_state(LinkStateCommand command, std::uint64_t now_ns) noexcept;
  [[nodiscard]] LinkRefusal write_at_most(std::uint16_t index, double value,
                                          std::uint64_t now_ns) noexcept;
  [[nodiscard]] double number(std::optional<std::uint16_t> index) const noexcept;
  void measure() noexcept;
  void follow_state() noexcept;
  void send_cyclic() noexcept;

  Settings settings_;
  JointEndpoint& endpoint_;
  const LinkJoint& joint_;
  const RegisterTable& registers_;
  CanSink& bus_;
  Channels channels_;
  double gear_ratio_ = 1.0;
  std::optional<std::uint16_t> supply_;
  std::optional<std::uint16_t> torque_constant_;
  std::optional<std::uint16_t> largest_speed_;
  std::optional<std::uint16_t> largest_torque_;
  std::optional<std::uint16_t> stop_cause_;
  Differentiator speed_;
  Values values_ = {};
  std::uint32_t status_period_ticks_;
  std::uint32_t estimate_period_ticks_;
  std::uint64_t ticks_ = 0;

  CanSimpleControlMode mode_ = CanSimpleControlMode::position;
  Inputs inputs_ = {};
  std::optional<std::uint64_t> waiting_since_ns_ = {};  ///< inputs that the joint is not ready for
  LinkDriveState state_ = LinkDriveState::initialising;
  CanSimpleResult result_ = CanSimpleResult::success;
  std::uint32_t disarm_reason_ = CanSimpleError::kNone;
  CanFrame heartbeat_ = {};  ///< the last that was sent
  std::uint64_t not_sent_ = 0;
};

/// The nodes of a bus: every frame goes to the node that its id names. Of broadcasts only Estop is executed.
class CanSimpleLine {
 public:
  struct Counts {
    std::uint64_t frames = 0;  ///< that were given to a node, or to all of them
    std::uint64_t to_no_node = 0;
    std::uint64_t extended = 0;    ///< ids of 29 bits
    std::uint64_t errors = 0;      ///< error frames
    std::uint64_t broadcasts = 0;  ///< that are not an Estop
  };

  /// @param nodes with different numbers
  /// @throws Error if two have the same
  explicit CanSimpleLine(std::vector<std::unique_ptr<CanSimpleNode>> nodes);

  void receive(const CanFrame& frame, std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  void tick(std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const std::unique_ptr<CanSimpleNode>> nodes() const noexcept {
    return nodes_;
  }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  std::vector<std::unique_ptr<CanSimpleNode>> nodes_;
  std::array<CanSimpleNode*, kCanSimpleBroadcast> by_number_ = {};
  Counts counts_ = {};
};

}  // namespace torsio
