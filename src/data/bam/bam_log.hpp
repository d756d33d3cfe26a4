#pragma once

#include <string>
#include <string_view>

#include "data/byte_source.hpp"
#include "data/log_table.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Whether a file begins like a log of Rhoban's BAM: an object of JSON that has "entries".
[[nodiscard]] bool is_bam_log(std::string_view start) noexcept;

/// A log of a servo with a pendulum, as the recorders of BAM write it: a JSON object with mass, arm_mass, length, kp, vin,
/// motor and trajectory, and in "entries" an object for each sample. Columns are `t_s`, `joint_angle_rad`, and, where the log
/// has them, `joint_speed_rad_s`, `goal_angle_rad`, `duty_1`, `drive_supply_V`, `temperature_degC` and `enabled_1`; masses,
/// length, gain and supply are conditions, motor and trajectory are labels. A raw PWM of 16 bits becomes a duty where its full
/// scale is known or reached, otherwise it is `load_1`; a note states which. Source: github.com/Rhoban/bam.
/// @throws Error with byte or entry if it is truncated, is not such a log, or exceeds the budget of
/// readers (decision 0030); Cancelled.
[[nodiscard]] LogTable read_bam_log(ByteSource& source, const std::string& name,
                                    const Progress& progress = {});

}  // namespace torsio
