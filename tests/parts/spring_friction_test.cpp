#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "parts/bouc_wen.hpp"
#include "parts/lugre_slip.hpp"
#include "parts/maxwell_slip.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

const double kKnee_rad = rad_from_deg(0.15);
constexpr double kSlow_rad_s = 0.0;
constexpr double kFast_rad_s = 10.0;

template <class Friction>
Friction friction_of(double constant_Nm, double load_factor);
template <>
MaxwellSlip<4> friction_of(double constant_Nm, double load_factor) {
  return MaxwellSlip<4>({.constant_Nm = constant_Nm,
                         .load_factor = load_factor,
                         .share = {0.30, 0.30, 0.25, 0.15},
                         .break_away_rad = {rad_from_deg(0.02), rad_from_deg(0.06),
                                            rad_from_deg(0.18), rad_from_deg(0.5)}});
}
template <>
BoucWen friction_of(double constant_Nm, double load_factor) {
  return BoucWen({.constant_Nm = constant_Nm, .load_factor = load_factor, .knee_rad = kKnee_rad});
}
template <>
LuGreSlip friction_of(double constant_Nm, double load_factor) {
  return LuGreSlip(
      {.constant_Nm = constant_Nm, .load_factor = load_factor, .bristle_rad = kKnee_rad});
}

/// The largest force over f.
template <class Friction>
constexpr double kPeak = 1.0;
template <>
constexpr double kPeak<LuGreSlip> = 1.15;

/// A random walk over about the knee, the rate changing on the way between creeping and fast.
struct Motion {
  double increment_rad = 0.0;
  double rate_rad_s = 0.0;
};
std::vector<Motion> random_motion(std::uint64_t seed, double step_rad) {
  Random random(seed);
  std::vector<Motion> motion(100000);
  double drift = 0.0;
  for (Motion& now : motion) {
    drift += 0.02 * (random.normal() - drift);
    now = {.increment_rad = step_rad * (random.normal() + 10.0 * drift),
           .rate_rad_s = 0.2 * random.uniform()};
  }
  return motion;
}

template <class Friction>
class SpringFrictionLaws : public testing::Test {};
using Variants = testing::Types<MaxwellSlip<4>, BoucWen, LuGreSlip>;
TYPED_TEST_SUITE(SpringFrictionLaws, Variants);

TYPED_TEST(SpringFrictionLaws, LoopIsAsWideAsTwiceTheLimit) {
  auto friction = friction_of<TypeParam>(1.5, 0.1);
  const double load_Nm = -5.0;
  for (const double direction : {1.0, -1.0, 1.0}) {
    for (int i = 0; i < 6000; ++i) {
      friction.step(direction * 1e-5, kSlow_rad_s, load_Nm);
    }
    EXPECT_NEAR(friction.step(direction * 1e-5, kSlow_rad_s, load_Nm),
                direction * 2.0 * kPeak<TypeParam>, 1e-6);
  }
}

struct Fall {
  double deepest_J = 0.0;  ///< largest decrease of work minus F² / 2k below its earlier maximum
  double lost_J = 0.0;     ///< at the end
  double max_stored_J = 0.0;
};

/// On a random walk inside a spring whose torque presses the surfaces.
template <class Friction>
Fall fall_of_loss(Friction friction, double spring_Nm_rad, std::uint64_t seed) {
  double last_Nm = 0.0;
  double work_J = 0.0;
  double max_lost_J = 0.0;
  double x_rad = 0.0;
  Fall fall;
  for (const Motion& now : random_motion(seed, 0.01 * kKnee_rad)) {
    x_rad += now.increment_rad;
    const double force_Nm = friction.step(now.increment_rad, now.rate_rad_s, spring_Nm_rad * x_rad);
    work_J += 0.5 * (last_Nm + force_Nm) * now.increment_rad;
    last_Nm = force_Nm;
    fall.lost_J = work_J - friction.energy();
    max_lost_J = std::max(max_lost_J, fall.lost_J);
    fall.deepest_J = std::max(fall.deepest_J, max_lost_J - fall.lost_J);
    fall.max_stored_J = std::max(fall.max_stored_J, friction.energy());
  }
  return fall;
}

TYPED_TEST(SpringFrictionLaws, LossNeverFallsUnderAConstantLimit) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Fall fall = fall_of_loss(friction_of<TypeParam>(1.5, 0.0), 0.0, seed);
    EXPECT_LT(fall.deepest_J, 1e-6 * 1.5 * kKnee_rad) << "seed " << seed;
    EXPECT_GT(fall.lost_J, 1.5 * kKnee_rad) << "seed " << seed;
  }
}

// If the limit follows the load, F² / 2k(load) is not an exact storage function: on a stroke that
// sticks while the load falls, k falls with it and F² / 2k seems to rise. This is not energy: the
// work of a closed path is never negative. Measured: up to 0.7 % of the largest stored energy
// (2.1e-5 J), whatever the step.
TYPED_TEST(SpringFrictionLaws, LossFallsByAShareOfWhatIsStoredWhereTheLimitFollowsTheLoad) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Fall fall = fall_of_loss(friction_of<TypeParam>(1.5, 0.05), 500.0, seed);
    EXPECT_LT(fall.deepest_J, 0.01 * fall.max_stored_J) << "seed " << seed;
    EXPECT_GT(fall.lost_J, 1.5 * kKnee_rad) << "seed " << seed;
  }
}

TYPED_TEST(SpringFrictionLaws, StaysBoundedForAnyIncrement) {
  for (const double constant_Nm : {0.0, 1e-300, 1.5}) {
    auto friction = friction_of<TypeParam>(constant_Nm, 0.05);
    Random random(7);
    for (int i = 0; i < 20000; ++i) {
      const double size_rad = std::pow(10.0, -9.0 + 12.0 * random.uniform());
      const double increment_rad = random.uniform() < 0.5 ? -size_rad : size_rad;
      const double rate_rad_s = std::pow(10.0, -9.0 + 15.0 * random.uniform());
      const double load_Nm = random.uniform() < 0.2 ? 0.0 : 400.0 * (random.uniform() - 0.5);
      const double limit_Nm = kPeak<TypeParam> * (constant_Nm + 0.05 * std::abs(load_Nm));
      const double force_Nm = friction.step(increment_rad, rate_rad_s, load_Nm);
      ASSERT_LE(std::abs(force_Nm), limit_Nm * (1.0 + 1e-12))  // false for NaN
          << "case " << i << ": " << increment_rad << " rad, " << load_Nm << " Nm";
      ASSERT_TRUE(std::isfinite(friction.energy())) << "case " << i;
      if (size_rad < 20.0 * kKnee_rad) continue;
      const double slipping_Nm = friction.step(increment_rad, rate_rad_s, load_Nm);
      ASSERT_GE(std::copysign(1.0, increment_rad) * slipping_Nm,
                limit_Nm / kPeak<TypeParam> * (1.0 - 1e-6))
          << "case " << i << ": " << increment_rad << " rad, " << load_Nm << " Nm";
    }
  }
}

TYPED_TEST(SpringFrictionLaws, WithoutLimitThereIsNoForce) {
  auto friction = friction_of<TypeParam>(0.0, 0.1);
  EXPECT_EQ(friction.step(1e-3, 0.1, 0.0), 0.0);
  EXPECT_GT(friction.step(1e-3, 0.1, 10.0), 0.1);
  EXPECT_EQ(friction.step(1e-3, 0.1, 0.0), 0.0);
  EXPECT_EQ(friction.energy(), 0.0);
  EXPECT_EQ(friction.stiffness(0.0), 0.0);
}

TYPED_TEST(SpringFrictionLaws, ShrinkingLimitDropsTheForceWithoutMotion) {
  auto friction = friction_of<TypeParam>(1.0, 0.1);
  EXPECT_NEAR(friction.step(1.0, kSlow_rad_s, 20.0), 3.0 * kPeak<TypeParam>, 1e-12);
  EXPECT_NEAR(friction.step(0.0, kSlow_rad_s, 5.0), 1.5 * kPeak<TypeParam>, 1e-12);
  EXPECT_NEAR(friction.step(0.0, kSlow_rad_s, 20.0), 1.5 * kPeak<TypeParam>, 1e-12);
}

TYPED_TEST(SpringFrictionLaws, StartsWithTheEnergyOfASpring) {
  auto friction = friction_of<TypeParam>(1.0, 0.1);
  const double tiny_rad = 1e-5 * kKnee_rad;
  const double force_Nm = friction.step(tiny_rad, 0.02, 5.0);
  EXPECT_GT(force_Nm, 0.0);
  EXPECT_NEAR(friction.energy(), 0.5 * force_Nm * tiny_rad, 1e-4 * friction.energy());
}

TYPED_TEST(SpringFrictionLaws, StiffnessIsTheLargestSlopeThatOccurs) {
  auto friction = friction_of<TypeParam>(1.0, 0.1);
  const double max_Nm_rad = friction.stiffness(5.0);
  double steepest_Nm_rad = 0.0;
  double last_Nm = 0.0;
  for (const Motion& now : random_motion(5, 0.01 * kKnee_rad)) {
    const double force_Nm = friction.step(now.increment_rad, now.rate_rad_s, 5.0);
    steepest_Nm_rad = std::max(steepest_Nm_rad, (force_Nm - last_Nm) / now.increment_rad);
    last_Nm = force_Nm;
  }
  EXPECT_LE(steepest_Nm_rad, max_Nm_rad * (1.0 + 1e-6));  // rounding of short increments
  EXPECT_GE(steepest_Nm_rad, max_Nm_rad * 0.9);
}

TYPED_TEST(SpringFrictionLaws, ResetMakesARunRepeatable) {
  auto friction = friction_of<TypeParam>(1.0, 0.1);
  const auto run = [&friction] {
    std::vector<double> forces;
    for (const Motion& now : random_motion(3, 0.1 * kKnee_rad)) {
      forces.push_back(friction.step(now.increment_rad, now.rate_rad_s, 10.0));
    }
    return forces;
  };
  const auto first = run();
  friction.reset();
  EXPECT_EQ(friction.energy(), 0.0);
  EXPECT_EQ(run(), first);
}

/// The forces after every tenth of a knee on a triangle up to 1.1 knees, down to -0.7 and up to
/// 0.4, in steps of a tenth over `parts`.
template <class Friction>
std::vector<double> triangle(int parts, double load_Nm_rad) {
  auto friction = friction_of<Friction>(1.5, 0.1);
  std::vector<double> forces;
  double x = 0.0;
  for (const int tenths : {11, -18, 11}) {
    const double increment_rad = std::copysign(0.1 * kKnee_rad / parts, tenths);
    for (int i = 0; i < std::abs(tenths); ++i) {
      for (int part = 0; part < parts - 1; ++part) {
        x += increment_rad;
        friction.step(increment_rad, 0.03, load_Nm_rad * x);
      }
      x += increment_rad;
      forces.push_back(friction.step(increment_rad, 0.03, load_Nm_rad * x));
    }
  }
  return forces;
}

/// The largest error [Nm] on the triangle, against steps far finer.
template <class Friction>
double error_of(int parts, double load_Nm_rad) {
  const auto forces = triangle<Friction>(parts, load_Nm_rad);
  const auto exact = triangle<Friction>(4096, load_Nm_rad);
  double largest_Nm = 0.0;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    largest_Nm = std::max(largest_Nm, std::abs(forces[i] - exact[i]));
  }
  return largest_Nm;
}

TEST(BoucWen, ErrorFallsWithTheSquareOfTheIncrementAtConstantLoad) {
  const double coarse_Nm = error_of<BoucWen>(2, 0.0);
  EXPECT_LT(coarse_Nm, 1e-3);
  EXPECT_NEAR(coarse_Nm / error_of<BoucWen>(4, 0.0), 4.0, 0.8);
}

TEST(LuGreSlip, IsExactForAnyIncrementAtConstantRateAndLoad) {
  EXPECT_LT(error_of<LuGreSlip>(1, 0.0), 1e-12);
}

TYPED_TEST(SpringFrictionLaws, ErrorFallsWithTheIncrementUnderAChangingLoad) {
  EXPECT_NEAR(error_of<TypeParam>(16, 2000.0) / error_of<TypeParam>(32, 2000.0), 2.0, 0.2);
}

TEST(BoucWen, LoadsAlongItsCurveAndUnloadsElastically) {
  auto friction = friction_of<BoucWen>(1.0, 0.0);
  double share = 0.0;
  for (int i = 0; i < 1000; ++i) share = friction.step(1e-3 * kKnee_rad, 0.0, 0.0);
  // ∫ dz / (1 - z^1.5) from 0 to z is the travel in knees: one here.
  double travel = 0.0;
  constexpr int kParts = 100000;
  for (int i = 0; i < kParts; ++i) {
    travel += share / kParts / (1.0 - std::pow((i + 0.5) * share / kParts, 1.5));
  }
  EXPECT_NEAR(travel, 1.0, 1e-5);
  EXPECT_NEAR(friction.step(-0.5 * kKnee_rad, 0.0, 0.0), share - 0.5, 1e-12);
}

TEST(LuGreSlip, ForceFollowsTheStribeckCurveOfTheRate) {
  auto friction = friction_of<LuGreSlip>(2.0, 0.0);
  EXPECT_NEAR(friction.step(-1.0, kSlow_rad_s, 0.0), -2.3, 1e-12);
  EXPECT_NEAR(friction.step(-1.0, -0.05, 0.0), -2.0 * (1.0 + 0.15 * std::exp(-1.0)), 1e-12);
  EXPECT_NEAR(friction.step(-1.0, -kFast_rad_s, 0.0), -2.0, 1e-12);
  EXPECT_NEAR(friction.step(1.0, 0.05, 0.0), 2.0 * (1.0 + 0.15 * std::exp(-1.0)), 1e-12);
}

TEST(LuGreSlip, LoadedSlowlyAndReleasedFastItGivesNoWork) {
  auto friction = friction_of<LuGreSlip>(1.5, 0.0);
  const double increment_rad = 1e-5 * kKnee_rad;
  double work_J = 0.0;
  double last_Nm = 0.0;
  const auto move = [&](double rate_rad_s) {
    const double moved_rad = std::copysign(increment_rad, rate_rad_s);
    const double force_Nm = friction.step(moved_rad, rate_rad_s, 0.0);
    work_J += 0.5 * (force_Nm + last_Nm) * moved_rad;
    last_Nm = force_Nm;
  };
  for (int i = 0; i < 1000; ++i) move(1e-9);
  while (last_Nm > 0.0) move(-kFast_rad_s);
  EXPECT_GT(work_J, 0.0);
}

TEST(SpringFriction, RefusesImpossibleParameters) {
  EXPECT_NO_THROW(BoucWen({.constant_Nm = 0.0, .knee_rad = 1e-3}));
  EXPECT_THROW(BoucWen({.constant_Nm = -1.0}), Error);
  EXPECT_THROW(BoucWen({.load_factor = -0.1}), Error);
  EXPECT_THROW(BoucWen({.knee_rad = 0.0}), Error);
  EXPECT_NO_THROW(LuGreSlip({.constant_Nm = 0.0, .bristle_rad = 1e-3}));
  EXPECT_THROW(LuGreSlip({.constant_Nm = -1.0}), Error);
  EXPECT_THROW(LuGreSlip({.load_factor = -0.1}), Error);
  EXPECT_THROW(LuGreSlip({.static_ratio = 0.9}), Error);
  EXPECT_THROW(LuGreSlip({.stribeck_rad_s = 0.0}), Error);
  EXPECT_THROW(LuGreSlip({.bristle_rad = 0.0}), Error);
}

}  // namespace
}  // namespace torsio
