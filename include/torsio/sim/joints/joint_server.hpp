#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/link/can_simple.hpp"
#include "torsio/link/drive_state.hpp"
#include "torsio/link/joint_endpoint.hpp"
#include "torsio/link/link_transport.hpp"
#include "torsio/sim/arm/arm_setup.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// An arm, or a single joint as an arm of one (`single_joint_setup`), and the ids of its joints on the line.
struct ServedArm {
  ArmSetup setup;
  std::uint8_t first_id = 1;               ///< the others follow
  std::vector<FaultSchedule> faults = {};  ///< one per joint, or none; times since the start
};

/// Simulated joints on one line, each with its endpoint: who drives them does not see a difference to electronics with torsio.
/// docs/robot/joint.md has their behaviour.
///
///     JointServer server({{.setup = single_joint_setup(data_sheet("dfki-50"))}}, *transport);
///     loop.run([&](const Tick&) noexcept { server.cycle(now_ns); return true; });
class JointServer {
 public:
  struct Settings {
    double watchdog_s = 0.05;
    NdlcomRules rules = NdlcomRules::strict;
    /// With the elasticity of the gears, which takes twice the time: else rotor and gear output turn together.
    bool has_gear_stage = false;
    std::uint64_t seed = 1;      ///< for the noise of the sensors
    double can_rate_Hz = 100.0;  ///< as `CanSimpleNode::Settings::estimate_rate_Hz`
  };
  /// What a joint is, and what has happened to it.
  struct JointStatus {
    std::uint8_t id = 0;
    std::string name = {};
    std::string actuator = {};
    std::string model = {};
    LinkDriveState state = LinkDriveState::initialising;
    LinkStateReason reason = LinkStateReason::none;
    std::uint8_t host = 0;  ///< in control; 0: none
    JointEndpoint::Counts counts = {};
  };
  /// What happened on the line.
  struct LineStatus {
    std::string place = {};
    NdlcomDecoder::Counts frames = {};
    LinkTransport::Counts transport = {};
    std::uint64_t to_no_joint = 0;  ///< frames for an id that is not here
  };
  /// What happened on the CAN bus.
  struct CanStatus {
    std::string place = {};
    CanSimpleLine::Counts frames = {};
    CanBus::Counts bus = {};
  };
  /// The host that all hosts of the CAN bus are for the joints: as `JointEndpoint::Settings::bus_host`.
  static constexpr std::uint8_t kCanHost = 253;

  /// @param transport outlives the server, as does the bus
  /// @param can the joints are also nodes of this bus, with their ids as numbers; null: they are not
  /// @throws Error as `ArmController` and `JointEndpoint`, if two joints have one id, or an id is not from 1 to 254, on a CAN bus
  /// from 1 to 62
  JointServer(std::vector<ServedArm> arms, const Settings& settings, LinkTransport& transport,
              CanBus* can = nullptr);
  ~JointServer();
  JointServer(const JointServer&) = delete;
  JointServer& operator=(const JointServer&) = delete;

  /// A tick of 1 ms: the joints measure, the endpoints work off what has arrived, the joints move.
  /// @param now_ns clock of the joints, as `CommandGuard` requires
  void cycle(std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// Begins a stop of all joints, as if a host had requested it.
  void stop_all(StopCategory category) noexcept TORSIO_REALTIME;
  /// All joints are at rest, without power and with their brakes. By the thread of `cycle`.
  [[nodiscard]] bool is_off() const noexcept TORSIO_REALTIME;

  /// What has happened since the last call, in words, a line each: control, states, models, refused frames. By one other
  /// thread than that of `cycle`.
  [[nodiscard]] std::vector<std::string> take_events();
  /// Not while another thread is in `cycle`.
  [[nodiscard]] std::vector<JointStatus> joints() const;
  [[nodiscard]] LineStatus line() const;
  /// None without a CAN bus. Not while another thread is in `cycle`.
  [[nodiscard]] std::optional<CanStatus> can() const;
  /// As `json_of(RegisterTable)`. Not while another thread is in `cycle`.
  [[nodiscard]] std::string registers(std::uint8_t id) const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace torsio
