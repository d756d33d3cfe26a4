#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sim/joints/joint_faults.hpp"
#include "sim/joints/model_upload.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/link/joint_endpoint.hpp"

namespace torsio {

class LinkedArm;

/// What a joint sends in its telemetry, in this order.
enum class JointChannel : std::uint8_t {
  motor_angle,
  gear_angle,
  joint_angle,
  joint_speed,
  motor_current,
  torque,
  torque_std_dev,
  wanted_torque,
  external_torque,
  thermal_load,
  command_current,
  reference_mode,
  reference_position,
  reference_velocity,
  reference_torque,
  phase,
  limit,
  fault,
  is_ready,
  truth_torque,
  truth_external_torque,
};
inline constexpr std::size_t kJointChannels = 21;

/// A joint of a `LinkedArm`, as the endpoint of its link drives it.
class LinkedJoint final : public LinkJoint {
 public:
  /// Limits of its references, and of its motion in every mode.
  struct Limits {
    double lowest_rad = 0.0;
    double highest_rad = 0.0;
    double speed_rad_s = 0.0;
    double torque_Nm = 0.0;
  };

  /// @param arm, sheet outlive it
  LinkedJoint(LinkedArm& arm, std::size_t index, const DataSheet& sheet, const ArmJoint& joint,
              const ArmController::Joint& settings, std::string model);

  // The functions of `LinkJoint`.
  [[nodiscard]] Identity identity() const noexcept override;
  [[nodiscard]] bool is_initialised() const noexcept override;
  [[nodiscard]] bool is_at_rest() const noexcept override;
  [[nodiscard]] bool has_fault() const noexcept override { return fault_ticks_ > 0; }
  [[nodiscard]] LinkStateReason own_stop() const noexcept override;
  LinkRefusal enable() noexcept override;
  void disable() noexcept override;
  void stop(StopCategory category) noexcept override;
  LinkRefusal apply(const JointReference& reference) noexcept override;
  LinkRefusal change_mode(JointMode mode) noexcept override;
  [[nodiscard]] std::span<const std::string_view> channels() const noexcept override;
  void measure(std::span<float> values) const noexcept override;
  LinkRefusal zero(std::uint8_t channel, double value) noexcept override;
  LinkRefusal inject_fault(const LinkInjectFault& fault) noexcept override;
  std::span<std::uint8_t> begin_upload(std::size_t size,
                                       std::string_view actuator) noexcept override;
  LinkRefusal commit_upload(std::span<const std::uint8_t> file) noexcept override;
  std::optional<LinkRefusal> poll_upload() noexcept override;

  // For its arm.

  [[nodiscard]] bool is_enabled() const noexcept { return is_enabled_; }
  /// The signals with the zeros that a host has set. Counts samples that are missing.
  [[nodiscard]] JointSample zeroed(const JointSample& sample) noexcept TORSIO_REALTIME;
  /// What it follows in this tick. @param is_ready the arm follows references
  [[nodiscard]] JointReference reference(bool is_ready) noexcept TORSIO_REALTIME;
  /// Its signals are missing for longer than the controller tolerates.
  [[nodiscard]] bool is_lost() const noexcept { return lost_ > kToleratedLosses; }
  /// The arm has found a fault in it.
  void found_fault() noexcept TORSIO_REALTIME { fault_ticks_ = kShortestFaultTicks; }
  /// A fault ends when its cause has ended and the arm is at rest.
  void end_fault(bool has_ended) noexcept TORSIO_REALTIME;
  /// Once per tick, after the controller: the uploaded model runs in parallel, and is then used.
  void try_model() noexcept TORSIO_REALTIME;

  // For its registers and the server.

  [[nodiscard]] const LinkedArm& arm() const noexcept { return arm_; }
  [[nodiscard]] LinkedArm& arm() noexcept { return arm_; }
  [[nodiscard]] std::size_t index() const noexcept { return index_; }
  [[nodiscard]] const ArmController::JointOutput& output() const noexcept;
  [[nodiscard]] const DataSheet& sheet() const noexcept { return sheet_; }
  [[nodiscard]] const Drive& drive() const noexcept { return drive_; }
  [[nodiscard]] double stiffness_Nm_rad() const noexcept { return stiffness_Nm_rad_; }
  [[nodiscard]] const std::string& actuator() const noexcept { return actuator_; }
  [[nodiscard]] std::string_view model() const noexcept { return {model_.data(), model_size_}; }
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  [[nodiscard]] const Limits& largest_limits() const noexcept { return largest_limits_; }
  /// @returns `out_of_range` if the controller cannot keep them, or they exclude the present position
  LinkRefusal set_limits(const Limits& limits) noexcept TORSIO_REALTIME;
  [[nodiscard]] const JointCascade::Gains& gains() const noexcept { return gains_; }
  LinkRefusal set_gains(const JointCascade::Gains& gains) noexcept TORSIO_REALTIME;
  /// Stiffness and damping of the impedance until a reference has its own.
  struct Impedance {
    double stiffness_Nm_rad = 0.0;
    double damping_Nms_rad = 0.0;
  };
  Impedance impedance = {};
  [[nodiscard]] double highest_damping_Nms_rad() const noexcept { return highest_damping_Nms_rad_; }
  [[nodiscard]] ModelUpload& upload() noexcept { return upload_; }

 private:
  static constexpr std::uint32_t kShortestFaultTicks = 10;
  static constexpr std::uint32_t kToleratedLosses = 3;  ///< as `ArmController::Settings`

  [[nodiscard]] bool is_in_range(const JointReference& reference) const noexcept;
  [[nodiscard]] std::optional<JointReference> present(JointMode mode) const noexcept;

  LinkedArm& arm_;
  std::size_t index_;
  const DataSheet& sheet_;
  std::string actuator_;  ///< "dfki-50#03"
  std::string serial_;
  Drive drive_;
  double stiffness_Nm_rad_;
  double wound_rad_;  ///< deflection at the largest torque
  double highest_damping_Nms_rad_;
  Limits limits_;
  Limits largest_limits_;
  JointCascade::Gains gains_;
  JointFaults faults_;
  ModelUpload upload_;
  std::array<char, 128> model_ = {};  ///< its description
  std::size_t model_size_ = 0;

  bool is_enabled_ = false;
  bool has_reference_ = false;
  JointReference reference_ = {};
  JointReference followed_ = {};
  JointMode held_mode_ = JointMode::position;  ///< until the first reference
  JointSample zero_ = {.motor_angle_rad = 0.0, .gear_angle_rad = 0.0, .joint_angle_rad = 0.0};
  double torque_zero_Nm_ = 0.0;
  std::uint32_t lost_ = 0;         ///< ticks in a row without a sample
  std::uint32_t fault_ticks_ = 0;  ///< above 0: there is a fault
  std::uint32_t tried_ticks_ = 0;  ///< since the uploaded model runs in parallel
  std::optional<LinkRefusal> upload_result_ = {};
};

}  // namespace torsio
