#pragma once

#include <complex>
#include <string_view>

#include "torsio/control/design/linear_system.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"

namespace torsio {

/// Each on inputs of its own, their outputs added. @throws Error if they do not fit.
[[nodiscard]] LinearSystem side_by_side(const LinearSystem& one, const LinearSystem& other);

/// Whether the loop, closed with negative feedback, is stable; a mode that is constant in time may
/// remain. @throws Error as `LinearSystem::closed`.
[[nodiscard]] bool is_stable_closed(const LinearSystem& loop);

/// The loop cut at the current: feedback, one sample of delay, hold, joint.
[[nodiscard]] LinearSystem open_loop(const SeriesElasticJoint& joint, const JointFeedback& feedback,
                                     JointOutput output);

/// H(jω) of `impedance`: from the wanted current to the torque of the drive at the joint.
[[nodiscard]] std::complex<double> current_path(const SeriesElasticJoint& joint,
                                                double sample_rate_Hz, double rad_s);

/// @throws Error naming the output and the phase margin if the loop is unstable when it is closed.
void require_stable(std::string_view place, const LinearSystem& loop, JointOutput output);

}  // namespace torsio
