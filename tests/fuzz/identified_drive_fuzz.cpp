#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/aligned_vector.hpp"
#include "identify/drive/drive_logs.hpp"
#include "identify/drive/drive_rollout.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/drive/drive_file.hpp"

namespace {

constexpr std::size_t kSamples = 40;

/// A short recording that has the command of each law and conditions of each unit.
torsio::Recording recording_of_each_law() {
  torsio::Recording recording("r", 200.0);
  for (const char* const channel : {"goal_angle_rad", "joint_angle_rad", "motor_angle_rad",
                                    "duty_1", "drive_V", "motor_current_A", "command_torque_Nm"}) {
    std::vector<double> values(kSamples);
    for (std::size_t n = 0; n < kSamples; ++n) values[n] = std::sin(0.2 * static_cast<double>(n));
    recording.add({channel, values});
  }
  std::vector<double> enabled(kSamples, 1.0);
  enabled.back() = 0.0;
  recording.add({"enabled_1", enabled});
  for (const char* const condition : {"mass_kg", "lever_m", "arm_mass_kg", "tilt_rad", "kp_1",
                                      "supply_V", "kp_Nm_rad", "kd_Nms_rad", "torque_limit_Nm"})
    recording.add_condition(condition, 0.5);
  return recording;
}

// A shorter step only takes longer, minutes under the sanitizers.
constexpr double kShortestStep_s = 1e-4;

/// `simulate_drive` without the fits, which take minutes to compile with the sanitizers.
void run_free(const torsio::DriveIdentification& drive) {
  static const torsio::Recording recording = recording_of_each_law();
  const torsio::DriveLog log = torsio::drive_log(recording, drive.load, drive.drive);
  torsio::detail::AlignedVector<double> angle(log.size() * torsio::kDriveLanes);
  torsio::detail::AlignedVector<double> joint(log.size() * torsio::kDriveLanes);
  torsio::detail::AlignedVector<double> torque(log.size() * torsio::kDriveLanes);
  torsio::roll_out(log, {.samples = log.size(), .angle_rad = log.angle_rad.front()},
                   torsio::DriveLanes::all(drive.values),
                   {drive.terms, std::max(drive.step_s, kShortestStep_s)},
                   {angle.data(), joint.data(), torque.data()});
  if (!std::isfinite(angle.front())) std::abort();
}

bool is_pendulum(const torsio::DriveIdentification& drive) {
  return std::holds_alternative<torsio::PendulumFacts>(drive.load.facts);
}

/// The text of a drive is accepted and is the text of what it gives.
void write_again(const torsio::DriveIdentification& drive) {
  const std::string text = torsio::identified_drive_text(drive);
  try {
    if (torsio::identified_drive_text(torsio::parse_identified_drive(text, "again.json")) != text)
      std::abort();
  } catch (const torsio::Error& /*error*/) {
    std::abort();
  }
}

}  // namespace

/// Any text is an identified drive, whose text comes back and whose free run ends, or an Error with a text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const torsio::DriveIdentification drive = torsio::parse_identified_drive(text, "fuzz.json");
    // A URDF would be read from the disk: its reader has a target of its own.
    if (!is_pendulum(drive)) return 0;
    write_again(drive);
    run_free(drive);
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
