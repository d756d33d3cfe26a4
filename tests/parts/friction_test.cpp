#include "parts/friction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr LuGreFriction::Parameters kRotor = {.coulomb_Nm = 0.05,
                                              .load_factor = 1e-3,
                                              .static_ratio = 1.15,
                                              .stribeck_rad_s = 3.0,
                                              .bristle_rad = 0.02,
                                              .viscous_Nms_rad = 7e-4};

TEST(LuGreFriction, SettlesAtTheStribeckCurve) {
  for (const double speed : {0.5, 3.0, 10.0, 25.0, -6.0}) {
    LuGreFriction friction(kRotor);
    double torque_Nm = 0.0;
    for (int i = 0; i < 20000; ++i) torque_Nm = friction.step(speed, 20.0, 1e-4);
    const double level_Nm = 0.07 * (1.0 + 0.15 * std::exp(-(speed / 3.0) * (speed / 3.0)));
    EXPECT_NEAR(torque_Nm, std::copysign(level_Nm, speed) + 7e-4 * speed, 1e-12) << speed;
  }
}

TEST(LuGreFriction, StepSizeDoesNotMatterAtConstantSpeed) {
  LuGreFriction coarse(kRotor);
  LuGreFriction fine(kRotor);
  const double coarse_Nm = coarse.step(5.0, 0.0, 1e-3);
  double fine_Nm = 0.0;
  for (int i = 0; i < 1000; ++i) fine_Nm = fine.step(5.0, 0.0, 1e-6);
  EXPECT_NEAR(coarse_Nm, fine_Nm, 1e-12);
}

TEST(LuGreFriction, HoldsItsTorqueAtRest) {
  LuGreFriction friction(kRotor);
  friction.step(1.0, 0.0, 5e-3);
  const double held_Nm = friction.step(0.0, 0.0, 1e-4);
  EXPECT_GT(held_Nm, 0.0);
  EXPECT_EQ(friction.step(0.0, 0.0, 1.0), held_Nm);
}

/// A sum of three sines with random heights, phases and whole numbers of turns, at most 1 large.
class ClosedPath {
 public:
  explicit ClosedPath(Random& random) {
    for (int k = 0; k < 3; ++k) {
      height_[k] = random.uniform() / 3.0;
      phase_[k] = 2.0 * std::numbers::pi * random.uniform();
      turns_[k] = static_cast<double>(1 + random.below(9));
    }
  }
  /// @param share of the way, 0 to 1
  double operator()(double share) const {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k)
      sum += height_[k] * std::sin(2.0 * std::numbers::pi * turns_[k] * share + phase_[k]);
    return sum;
  }

 private:
  double height_[3] = {};
  double phase_[3] = {};
  double turns_[3] = {};
};

struct Taken {
  double least_J = 0.0;         ///< the lowest supplied energy at any time, from a relaxed start
  double deepest_fall_J = 0.0;  ///< largest decrease of the loss below its earlier maximum
  double throughput_J = 0.0;
};

/// Angle and load on closed paths that know nothing of each other, at a random tempo.
Taken on_a_closed_path(const LuGreFriction::Parameters& parts, double largest_load_Nm,
                       std::uint64_t seed) {
  constexpr int kSamples = 20000;
  Random random(seed);
  LuGreFriction friction(parts);
  const ClosedPath angle(random);
  const ClosedPath load(random);
  const double reach_rad = parts.bristle_rad * std::pow(10.0, -1.0 + 2.0 * random.uniform());
  const double dt_s = std::pow(10.0, -7.0 + 4.0 * random.uniform());
  double last_Nm = 0.0;
  double work_J = 0.0;
  double max_lost_J = 0.0;
  Taken taken;
  for (int i = 1; i <= kSamples; ++i) {
    const double share = static_cast<double>(i) / kSamples;
    const double moved_rad = reach_rad * (angle(share) - angle(share - 1.0 / kSamples));
    const double speed_rad_s = moved_rad / dt_s;
    const double force_Nm = friction.step(speed_rad_s, largest_load_Nm * load(share), dt_s) -
                            parts.viscous_Nms_rad * speed_rad_s;
    const double step_J = 0.5 * (last_Nm + force_Nm) * moved_rad;
    last_Nm = force_Nm;
    work_J += step_J;
    taken.throughput_J += std::abs(step_J);
    taken.least_J = std::min(taken.least_J, work_J);
    max_lost_J = std::max(max_lost_J, work_J - friction.energy());
    taken.deepest_fall_J =
        std::max(taken.deepest_fall_J, max_lost_J - (work_J - friction.energy()));
  }
  return taken;
}

// With a bristle whose stiffness follows load and speed a third of these paths give work, up to 13
// % (share of the throughput).
TEST(LuGreFriction, NeverGivesWorkHoweverSpeedAndLoadVary) {
  for (const DataSheet& sheet : data_sheets()) {
    const PlantParameters plant = plant_parameters(sheet);
    for (const auto& parts : {plant.rotor_friction, plant.middle_friction, plant.bearing}) {
      if (parts.coulomb_Nm == 0.0) continue;
      for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const Taken taken = on_a_closed_path(parts, 2.0 * plant.rated_torque_Nm, seed);
        EXPECT_GE(taken.least_J, 0.0) << sheet.name << ", seed " << seed;
        EXPECT_LT(taken.deepest_fall_J, 1e-6 * taken.throughput_J)
            << sheet.name << ", seed " << seed;
      }
    }
  }
}

TEST(LuGreFriction, StartsAsASpringWhateverTheLoad) {
  for (const double load_Nm : {0.0, 40.0}) {
    LuGreFriction friction(kRotor);
    const double turned_rad = 1e-9;
    const double force_Nm = friction.step(1e-3, load_Nm, 1e-6) - 7e-4 * 1e-3;
    EXPECT_NEAR(force_Nm, 1.15 * 0.05 / 0.02 * turned_rad, 1e-6 * force_Nm) << load_Nm;
    EXPECT_NEAR(friction.energy(), 0.5 * force_Nm * turned_rad, 1e-6 * friction.energy());
  }
}

TEST(LuGreFriction, ShrinkingLevelDropsTheForceWithoutMotion) {
  LuGreFriction friction(kRotor);
  for (int i = 0; i < 1000; ++i) friction.step(1e-6, 100.0, 1e4);
  EXPECT_NEAR(friction.step(0.0, 100.0, 1.0), 1.15 * 0.15, 1e-9);
  EXPECT_NEAR(friction.step(0.0, 0.0, 1.0), 1.15 * 0.05, 1e-12);
  EXPECT_NEAR(friction.step(0.0, 100.0, 1.0), 1.15 * 0.05, 1e-12);
  EXPECT_NEAR(friction.energy(), 0.5 * std::pow(1.15 * 0.05, 2) / friction.stiffness(), 1e-12);
}

TEST(LuGreFriction, SteepestIsTheLargestSlopeThatOccurs) {
  LuGreFriction friction(kRotor);
  for (int i = 0; i < 100; ++i) friction.step(1e-6, 10.0, 1e4);
  const double sliding_Nm = friction.step(0.0, 10.0, 1.0);
  const double turned_Nm = friction.step(-30.0, 10.0, 1e-9) + 7e-4 * 30.0;
  EXPECT_NEAR((sliding_Nm - turned_Nm) / 30e-9, friction.steepest(), 1e-3 * friction.steepest());
}

TEST(LuGreFriction, RefusesImpossibleParameters) {
  auto parameters = kRotor;
  parameters.bristle_rad = 0.0;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
  parameters = kRotor;
  parameters.static_ratio = 0.9;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
  parameters = kRotor;
  parameters.coulomb_Nm = -1.0;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
  parameters.coulomb_Nm = 0.0;
  EXPECT_THROW(LuGreFriction{parameters}, Error) << "a load factor without a stiffness";
  parameters.load_factor = 0.0;
  EXPECT_NO_THROW(LuGreFriction{parameters});
}

}  // namespace
}  // namespace torsio
