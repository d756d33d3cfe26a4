#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "identify/drive/drive_log.hpp"
#include "torsio/identify/drive/drive_model.hpp"

namespace torsio {

/// Sets of parameters that are simulated at once, one to a lane.
inline constexpr std::size_t kDriveLanes = 16;
struct alignas(64) DriveLanes {
  std::array<std::array<double, kDriveLanes>, kDriveParameters> of;

  /// One set of parameters in every lane.
  [[nodiscard]] static DriveLanes all(const DriveValues& values) {
    DriveLanes lanes{};
    for (std::size_t lane = 0; lane < kDriveLanes; ++lane) lanes.set(lane, values);
    return lanes;
  }

  void set(std::size_t lane, const DriveValues& values) {
    for (std::size_t p = 0; p < kDriveParameters; ++p) of[p][lane] = values[p];
  }
};

/// A free run through a part of a log.
struct DriveRun {
  std::size_t first = 0;  ///< sample
  std::size_t samples = 0;
  double angle_rad = 0.0;  ///< at the first sample
  double speed_rad_s = 0.0;
};

enum class DriveIntegrator : std::uint8_t {
  /// Second order, but for the damping of the spring and of a law with delay or filter: speeds are those in the middle of a step, and the damping by viscous friction and by the winding is
  /// the mean over the step.
  midpoint_speed,
  /// First order, with forces from the beginning of a step: what other simulators have.
  semi_implicit_euler,
  /// The same with the damping by viscous friction and by the winding at the end of a step, as MuJoCo's Euler has it.
  implicit_damping,
};

struct RolloutOptions {
  DriveTerms terms;       ///< terms that are computed at all
  double step_s = 0.001;  ///< longest step of the integrator, a sample period at most
  DriveIntegrator integrator = DriveIntegrator::midpoint_speed;
};

/// Where a rollout puts its values, [sample][lane]; null: not wanted.
struct RolloutOutput {
  double* angle_rad = nullptr;  ///< angle of the encoder that the log has
  double* joint_angle_rad = nullptr;
  double* joint_torque_Nm =
      nullptr;  ///< on the joint: of the spring, or of the motor less friction
};

/// Free runs from the commands alone by the equations of `DriveParameter`; friction stops a motion and never reverses it.
/// Before a run begins, a law is assumed to have given the torque that it gives first. A run that leaves all bounds gives values that are not finite.
void roll_out(const DriveLog& log, const DriveRun& run, const DriveLanes& parameters,
              const RolloutOptions& options, const RolloutOutput& output) noexcept;

}  // namespace torsio
