#pragma once

#include <functional>
#include <optional>
#include <string>

#include "sim/closed_loop/impedance_loop.hpp"

namespace torsio {

/// Gains for an impedance on a torque loop through a spring that is unstable, to three digits and as words: "a damping
/// from 2 Nms/rad on, or at most 30 Nm/rad with this damping". What they propose is stable.
[[nodiscard]] std::string stable_gains(const ImpedancePlan& plan);

/// The largest bandwidth of the correction, below that of the plan and to three digits, with which a plan is as it must
/// be. @returns none if a hundredth of a rad/s is too much
[[nodiscard]] std::optional<double> largest_correction_rad_s(
    const ImpedancePlan& plan, const std::function<bool(const ImpedancePlan&)>& is_good);

}  // namespace torsio
