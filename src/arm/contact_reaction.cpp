#include "torsio/arm/contact_reaction.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kReactionPlace = "reaction to a contact";

}  // namespace

std::string_view name(ContactReaction reaction) noexcept {
  switch (reaction) {
    case ContactReaction::none: return "none";
    case ContactReaction::stop: return "stop";
    case ContactReaction::hold: return "hold";
    case ContactReaction::retract: return "retract";
    case ContactReaction::floating: return "float";
  }
  return "unknown";
}

ReactionMotion::ReactionMotion(const Settings& settings, double sample_rate_Hz)
    : settings_(settings),
      period_s_(1.0 / sample_rate_Hz),
      decay_(std::exp(-1.0 / (settings.time_constant_s * sample_rate_Hz))) {
  require_positive(kReactionPlace, "the sample rate", sample_rate_Hz);
  require_positive(kReactionPlace, "the time constant", settings.time_constant_s);
  require_positive(kReactionPlace, "the speed of the retreat", settings.retreat_speed_m_s);
  require_positive(kReactionPlace, "the way of the retreat", settings.retreat_m);
}

void ReactionMotion::find_retreat(const ArmDynamics& dynamics, std::span<const double> external_Nm,
                                  std::span<const double> rotor_kg_m2,
                                  std::span<const double> speed_limit_rad_s) noexcept {
  const std::size_t n = dynamics.size();
  ArmDynamics::JointMatrix mass_kg_m2;
  ArmDynamics::Jacobian jacobian;
  dynamics.mass_matrix(output_.position_rad, mass_kg_m2);
  dynamics.jacobian(output_.position_rad, jacobian);
  for (std::size_t j = 0; j < n; ++j) {
    mass_kg_m2[j * (n + 1)] += rotor_kg_m2[j];
    retreat_rad_s_[j] = external_Nm[j];
  }
  if (!solve_positive(std::span(mass_kg_m2).first(n * n), std::span(retreat_rad_s_).first(n))) {
    retreat_rad_s_ = {};
    return;
  }
  double squares = 0.0;
  for (std::size_t row = 0; row < 3; ++row) {
    double speed = 0.0;
    for (std::size_t j = 0; j < n; ++j) speed += jacobian[row * n + j] * retreat_rad_s_[j];
    squares += speed * speed;
  }
  // A torque that does not move the flange: no joint is faster than its limit.
  double scale = settings_.retreat_speed_m_s / std::max(std::sqrt(squares), 1e-9);
  for (std::size_t j = 0; j < n; ++j)
    if (std::abs(retreat_rad_s_[j]) * scale > speed_limit_rad_s[j])
      scale = speed_limit_rad_s[j] / std::abs(retreat_rad_s_[j]);
  for (std::size_t j = 0; j < n; ++j) retreat_rad_s_[j] *= scale;
}

void ReactionMotion::begin(const ArmDynamics& dynamics, std::span<const double> position_rad,
                           std::span<const double> velocity_rad_s,
                           std::span<const double> external_Nm, std::span<const double> rotor_kg_m2,
                           std::span<const double> speed_limit_rad_s, bool is_retreat) noexcept {
  const auto n = static_cast<std::ptrdiff_t>(dynamics.size());
  output_ = {};
  std::copy_n(position_rad.begin(), n, output_.position_rad.begin());
  std::copy_n(velocity_rad_s.begin(), n, output_.velocity_rad_s.begin());
  retreat_rad_s_ = {};
  time_s_ = 0.0;
  retreat_s_ = is_retreat ? settings_.retreat_m / settings_.retreat_speed_m_s : 0.0;
  if (is_retreat) find_retreat(dynamics, external_Nm, rotor_kg_m2, speed_limit_rad_s);
}

const ReactionMotion::Output& ReactionMotion::step() noexcept {
  const bool is_retreating = time_s_ < retreat_s_;
  for (std::size_t j = 0; j < kMaxArmJoints; ++j) {
    const double target_rad_s = is_retreating ? retreat_rad_s_[j] : 0.0;
    const double last_rad_s = output_.velocity_rad_s[j];
    const double next_rad_s = target_rad_s + (last_rad_s - target_rad_s) * decay_;
    output_.position_rad[j] += 0.5 * period_s_ * (last_rad_s + next_rad_s);
    output_.velocity_rad_s[j] = next_rad_s;
    output_.acceleration_rad_s2[j] = (target_rad_s - next_rad_s) / settings_.time_constant_s;
  }
  time_s_ += period_s_;
  return output_;
}

}  // namespace torsio
