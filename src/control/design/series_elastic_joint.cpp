#include "torsio/control/design/series_elastic_joint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>

#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

// States δ, θ̇, i, and with a free output q̇, q; outputs δ, θ̇, q.
LinearSystem::Matrices joint_plant(const SeriesElasticJoint& joint, JointOutput output) {
  joint.check();
  const Drive& drive = joint.drive;
  const bool is_free = output == JointOutput::free;
  const std::size_t states = is_free ? 5 : 3;
  LinearSystem::Matrices plant{Matrix(states, states), Matrix(states, 1), Matrix(3, states),
                               Matrix(3, 1)};
  Matrix& a = plant.a;
  a(0, 1) = 1.0;
  a(1, 0) = -joint.stiffness_Nm_rad / drive.inertia();
  a(1, 1) = -drive.viscous_Nms_rad / drive.inertia();
  a(1, 2) = drive.torque_per_current() / drive.inertia();
  a(2, 2) = -1.0 / drive.current_time_constant_s;
  plant.b(2, 0) = 1.0 / drive.current_time_constant_s;
  plant.c(0, 0) = 1.0;
  plant.c(1, 1) = 1.0;
  if (is_free) {
    a(0, 3) = -1.0;
    a(3, 0) = joint.stiffness_Nm_rad / joint.joint_inertia_kg_m2;
    a(3, 3) = -joint.joint_viscous_Nms_rad / joint.joint_inertia_kg_m2;
    a(4, 3) = 1.0;
    plant.c(2, 4) = 1.0;
  }
  return plant;
}

LinearSystem all_feedback(const JointFeedback& feedback) {
  return side_by_side(side_by_side(feedback.deflection, feedback.speed), feedback.joint);
}

bool is_finite(const Matrix& matrix) {
  return std::ranges::all_of(matrix.values, [](double value) { return std::isfinite(value); });
}

}  // namespace

void SeriesElasticJoint::check() const {
  drive.check();
  constexpr auto kPlace = "series-elastic joint";
  require_positive(kPlace, "stiffness_Nm_rad", stiffness_Nm_rad);
  require_positive(kPlace, "joint_inertia_kg_m2", joint_inertia_kg_m2);
  require_not_negative(kPlace, "joint_viscous_Nms_rad", joint_viscous_Nms_rad);
}

LinearSystem open_loop(const SeriesElasticJoint& joint, const JointFeedback& feedback,
                       JointOutput output) {
  const double rate_Hz = feedback.deflection.sample_rate_Hz();
  return LinearSystem::delay(rate_Hz) * all_feedback(feedback) *
         LinearSystem::held(joint_plant(joint, output), rate_Hz);
}

// The held deflection is a second input, and a fourth output of the joint that leads to `held`. With the current closed
// the loop is one from the held deflection to the deflection, which a step of `ticks` ticks closes.
bool is_stable_held(const SeriesElasticJoint& joint, const JointFeedback& feedback,
                    const LinearSystem& held, std::size_t ticks, JointOutput output) {
  const double rate_Hz = feedback.deflection.sample_rate_Hz();
  LinearSystem::Matrices plant = LinearSystem::held(joint_plant(joint, output), rate_Hz).matrices();
  const std::size_t states = plant.a.rows;
  Matrix b(states, 2);
  Matrix c(4, states);
  Matrix d(4, 2);
  for (std::size_t state = 0; state < states; ++state) {
    b(state, 0) = plant.b(state, 0);
    for (std::size_t row = 0; row < 3; ++row) c(row, state) = plant.c(row, state);
  }
  d(3, 1) = 1.0;
  const LinearSystem both({plant.a, std::move(b), std::move(c), std::move(d)}, rate_Hz);
  const LinearSystem open =
      LinearSystem::delay(rate_Hz) * side_by_side(all_feedback(feedback), held) * both;
  const LinearSystem::Matrices& loop = open.matrices();
  LinearSystem::Matrices cut{Matrix(loop.a.rows, loop.a.rows), Matrix(loop.a.rows, 1),
                             Matrix(1, loop.a.rows), Matrix(1, 1)};
  for (std::size_t row = 0; row < loop.a.rows; ++row) {
    cut.b(row, 0) = loop.b(row, 1);
    for (std::size_t column = 0; column < loop.a.rows; ++column)
      cut.a(row, column) = loop.a(row, column) - loop.b(row, 0) * loop.c(0, column);
  }
  cut.c(0, 0) = -1.0;  // the deflection is the first state; negative, since `closed` subtracts it
  const LinearSystem::Matrices period = over_ticks(LinearSystem(cut, rate_Hz), ticks);
  return is_finite(period.a) && is_finite(period.b) &&
         is_stable_closed(LinearSystem(period, rate_Hz / static_cast<double>(ticks)));
}

void require_stable(std::string_view place, const LinearSystem& loop, JointOutput output) {
  if (is_stable_closed(loop)) return;
  const Margins found = margins(loop);
  throw Error(
      {.place = std::string(place),
       .problem = fmt::format("unstable with its output {}",
                              output == JointOutput::locked ? "locked" : "free"),
       .expected = found.phase_rad > 0.0 ? "closed-loop poles within the unit circle"
                                         : "a positive phase margin",
       .found = fmt::format("{:.3g} degrees at {:.4g} rad/s{}", deg_from_rad(found.phase_rad),
                            found.crossover_rad_s,
                            found.phase_rad > 0.0 ? " of phase margin, but poles outside" : ""),
       .advice = "Take less bandwidth, smaller gains or a higher sample rate."});
}

Complex current_path(const SeriesElasticJoint& joint, double sample_rate_Hz, double rad_s) {
  const Complex s(0.0, rad_s);
  const double period_s = 1.0 / sample_rate_Hz;
  const Complex late = std::exp(-s * period_s);
  return late * (1.0 - late) / (s * period_s * (1.0 + s * joint.drive.current_time_constant_s)) *
         joint.drive.torque_per_current();
}

Complex impedance(const SeriesElasticJoint& joint, const JointFeedback& feedback, double rad_s) {
  const Drive& drive = joint.drive;
  const Complex s(0.0, rad_s);
  const Complex current = current_path(joint, feedback.deflection.sample_rate_Hz(), rad_s);
  const Complex inner = s * (drive.inertia() * s + drive.viscous_Nms_rad) +
                        current * s * feedback.speed.response(rad_s);
  return joint.stiffness_Nm_rad / s * (inner + current * feedback.joint.response(rad_s)) /
         (inner + joint.stiffness_Nm_rad + current * feedback.deflection.response(rad_s));
}

Passivity passivity(const SeriesElasticJoint& joint, const JointFeedback& feedback) {
  joint.check();
  constexpr int kGrid = 1000;
  constexpr double kLowestShare = 1e-5;  // share of the Nyquist frequency
  const double highest_rad_s = std::numbers::pi * feedback.deflection.sample_rate_Hz();
  Passivity found = {.passive_to_rad_s = highest_rad_s};
  double last_rad_s = 0.0;
  for (int n = 0; n <= kGrid; ++n) {
    const double rad_s =
        highest_rad_s * std::pow(kLowestShare, 1.0 - static_cast<double>(n) / kGrid);
    const double real_Nms_rad = impedance(joint, feedback, rad_s).real();
    if (!(real_Nms_rad >= 0.0) && found.passive_to_rad_s == highest_rad_s)
      found.passive_to_rad_s = last_rad_s;
    if (!(real_Nms_rad >= found.least_Nms_rad)) {
      found.least_Nms_rad = real_Nms_rad;
      found.least_rad_s = rad_s;
    }
    last_rad_s = rad_s;
  }
  return found;
}

}  // namespace torsio
