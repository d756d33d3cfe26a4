#pragma once

#include <complex>
#include <cstddef>
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

/// A value that is taken at every `ticks`-th tick and held in between, for the frequency response: a low-pass of second
/// order with the mean delay of the hold, (ticks − 1) / 2, and the variance of its delay. Near half the rate of the
/// values and above it is not valid; 1 for one tick.
[[nodiscard]] LinearSystem slow_hold(std::size_t ticks, double sample_rate_Hz);

/// The same system in one step of `ticks` ticks, in which its input is held. The numbers of an unstable system may be
/// too large to be finite.
[[nodiscard]] LinearSystem::Matrices over_ticks(const LinearSystem& system, std::size_t ticks);

/// Whether the loop is stable if `held`, a part of its feedback from the deflection besides `feedback`, has its input
/// taken at every `ticks`-th tick and held in between. Exact, for any number of ticks.
[[nodiscard]] bool is_stable_held(const SeriesElasticJoint& joint, const JointFeedback& feedback,
                                  const LinearSystem& held, std::size_t ticks, JointOutput output);

/// H(jω) of `impedance`: from the wanted current to the torque of the drive at the joint.
[[nodiscard]] std::complex<double> current_path(const SeriesElasticJoint& joint,
                                                double sample_rate_Hz, double rad_s);

/// @throws Error naming the output and the phase margin if the loop is unstable when it is closed.
void require_stable(std::string_view place, const LinearSystem& loop, JointOutput output);

}  // namespace torsio
