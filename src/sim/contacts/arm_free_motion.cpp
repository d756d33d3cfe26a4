#include "sim/contacts/arm_free_motion.hpp"

#include <fmt/format.h>

#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kMargin_rad = 0.05;  // to the limits of the joints
constexpr double kSlowest = 0.4;
constexpr double kLongestRest_s = 1.0;
constexpr std::size_t kSettlingTicks = 1000;

}  // namespace

std::vector<double> ArmFreeMotion::configuration(const ArmSetup& setup, Random& random) {
  std::vector<double> angle_rad;
  angle_rad.reserve(setup.moves.size());
  for (const JointMoveLimits& limits : setup.moves)
    angle_rad.push_back(
        random.uniform(limits.lowest_rad + kMargin_rad, limits.highest_rad - kMargin_rad));
  return angle_rad;
}

ArmFreeMotion::ArmFreeMotion(const ArmSetup& setup, ArmController::Settings settings,
                             FirstStageForm form, std::uint64_t seed)
    : setup_(setup),
      random_(seed),
      at_rad_(configuration(setup, random_)),
      session_(setup, std::move(settings), form, {}, random_.bits(), at_rad_) {
  session_.open_brakes();
  for (std::size_t j = 0; j < at_rad_.size(); ++j) reference_.position_rad[j] = at_rad_[j];
  for (std::size_t tick = 0; tick < kSettlingTicks; ++tick) {
    (void)session_.control(reference_);
    session_.act({});
  }
}

void ArmFreeMotion::next() {
  std::vector<double> to_rad = configuration(setup_, random_);
  const double share = random_.uniform(kSlowest, 1.0);
  std::vector<JointMoveLimits> limits = setup_.moves;
  for (JointMoveLimits& limit : limits) limit.speed_rad_s *= share;
  move_.emplace(std::vector{at_rad_, to_rad}, limits, kBenchRate_Hz);
  rest_ticks_ = static_cast<std::size_t>(random_.uniform(0.0, kLongestRest_s) * kBenchRate_Hz);
  at_rad_ = std::move(to_rad);
}

const ArmController::Output& ArmFreeMotion::control() {
  if (!move_) next();
  const ArmMove::Output moved = move_->step();
  reference_.position_rad = moved.position_rad;
  reference_.velocity_rad_s = moved.velocity_rad_s;
  reference_.acceleration_rad_s2 = moved.acceleration_rad_s2;
  if (moved.is_done && rest_ticks_-- == 0) move_.reset();
  const ArmController::Output& output = session_.control(reference_);
  if (output.cause != ArmStopCause::none)
    throw Error({.place = setup_.arm.name,
                 .problem = fmt::format("stopped at {:.2f} s in {}: {}", session_.time_s(),
                                        setup_.arm.joints[output.joint].name, name(output.cause))});
  return output;
}

}  // namespace torsio
