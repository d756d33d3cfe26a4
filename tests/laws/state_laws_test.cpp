// Laws of the state as bytes, for an estimator around every family.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <tuple>
#include <vector>

#include "support/every_family.hpp"
#include "support/example_models.hpp"
#include "support/example_settings.hpp"
#include "support/grey_box_examples.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/estimate/adaptive_estimator.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio::test {
namespace {

/// Settings with every operation that has a memory.
EstimatorSettings remembering_settings() {
  EstimatorSettings settings = example_settings();
  settings.features.inputs = {
      "stop(spring_deflection_rad, 0.6rad) + 0.1 * dahl(spring_deflection_rad, 0.2rad)",
      "lowpass(rate(lag(spring_deflection_rad, 3)), 50Hz) / 200"};
  settings.disturbances.largest_step = {0.4, 0.4};
  settings.disturbances.largest_travel = 0.02;
  settings.disturbances.warm_up_s = 0.05;
  return settings;
}

/// Bits of an estimate, so that NaN equals itself.
using Bits = std::tuple<std::uint64_t, std::uint64_t, std::uint64_t, Fault>;
Bits bits(const Estimate& estimate) {
  return {std::bit_cast<std::uint64_t>(estimate.value),
          std::bit_cast<std::uint64_t>(estimate.std_dev),
          std::bit_cast<std::uint64_t>(estimate.novelty), estimate.fault};
}

/// A motion with missing samples, gaps, jumps, an excursion, and ticks at a wrong rate.
class Motion {
 public:
  explicit Motion(std::uint64_t seed) : random_(seed) {}

  JointSample next() {
    t_s_ += (tick_ / 150) % 4 == 3 ? 2e-3 : 1e-3;
    ++tick_;
    const auto t = static_cast<double>(tick_);
    double gear_rad = 0.7 * std::sin(0.02 * t) + 0.01 * random_.normal();
    if (gap_ == 0 && random_.uniform() < 0.01)
      gap_ = static_cast<int>(20.0 * random_.uniform()) + 1;
    if (gap_ > 0) {
      --gap_;
      gear_rad = kNaN;
    } else if (random_.uniform() < 0.01) {
      gear_rad += 3.0;
    }
    return {.t_s = t_s_, .gear_angle_rad = gear_rad, .joint_angle_rad = 0.05};
  }

 private:
  Random random_;
  double t_s_ = 0.0;
  int tick_ = 0;
  int gap_ = 0;
};

std::vector<Bits> run(TorqueEstimator& estimator, Motion& motion, int ticks) {
  std::vector<Bits> all;
  for (int n = 0; n < ticks; ++n) all.push_back(bits(estimator.step(motion.next())));
  return all;
}

template <class M>
TorqueEstimator estimator_of(const M& model) {
  TorqueEstimator estimator(Estimator(remembering_settings(), model));
  estimator.set_zero("joint_angle_rad", 0.02);
  return estimator;
}

std::vector<std::byte> saved(const TorqueEstimator& estimator) {
  std::vector<std::byte> state(estimator.state_size());
  EXPECT_TRUE(estimator.save(state));
  return state;
}

template <class M>
class StateLaws : public testing::Test {
 protected:
  TorqueEstimator estimator_ = estimator_of(example<M>());
};
TYPED_TEST_SUITE(StateLaws, EveryModel, ModelName);

TYPED_TEST(StateLaws, ALoadedStateContinuesToTheBit) {
  std::ptrdiff_t usable = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Motion motion(seed);
    this->estimator_.reset();
    (void)run(this->estimator_, motion, static_cast<int>(37 * seed));
    const std::vector<std::byte> state = saved(this->estimator_);
    Motion elsewhere(100 + seed);
    Motion again = motion;
    const std::vector<Bits> expected = run(this->estimator_, motion, 400);
    usable += std::ranges::count_if(
        expected, [](const Bits& each) { return std::get<Fault>(each) == Fault::none; });
    if (seed % 2 == 0) this->estimator_.reset();
    (void)run(this->estimator_, elsewhere, static_cast<int>(13 * seed));
    ASSERT_TRUE(this->estimator_.load(state));
    EXPECT_EQ(saved(this->estimator_), state);
    TorqueEstimator fresh = estimator_of(example<TypeParam>());
    ASSERT_TRUE(fresh.load(state));
    Motion once_more = again;
    EXPECT_EQ(run(this->estimator_, again, 400), expected);
    EXPECT_EQ(run(fresh, once_more, 400), expected);
  }
  EXPECT_GT(usable, 200) << "of 8000: else only the fallback was compared";
}

TYPED_TEST(StateLaws, JunkIsRefusedAndChangesNothing) {
  Motion motion(7);
  (void)run(this->estimator_, motion, 333);
  const std::vector<std::byte> state = saved(this->estimator_);
  Random random(11);
  const auto refuse = [&](std::span<const std::byte> junk) {
    EXPECT_FALSE(this->estimator_.load(junk));
    EXPECT_EQ(saved(this->estimator_), state);
  };
  refuse({});
  refuse(std::span(state).first(state.size() - 1));
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> junk = state;
    const auto place =
        std::min(junk.size() - 1,
                 static_cast<std::size_t>(random.uniform() * static_cast<double>(junk.size())));
    junk[place] ^= std::byte(1U << static_cast<unsigned>(i % 8));
    refuse(junk);
  }
  std::vector<std::byte> noise(state.size());
  for (std::byte& each : noise) each = std::byte(static_cast<unsigned>(255.0 * random.uniform()));
  refuse(noise);
}

/// A state with a right header and any members: it may be refused, but a step after it is one as after
/// any other.
TYPED_TEST(StateLaws, ForgedMembersNeverBreakAStep) {
  Motion motion(3);
  (void)run(this->estimator_, motion, 200);
  const std::vector<std::byte> state = saved(this->estimator_);
  std::uint64_t identity = this->estimator_.estimator().state_identity();
  for (std::size_t place = detail::kStateHeaderBytes; place < state.size(); ++place) {
    std::vector<std::byte> forged = state;
    std::fill_n(forged.begin() + static_cast<std::ptrdiff_t>(place),
                std::min<std::size_t>(8, forged.size() - place), std::byte{0xFF});
    detail::write_state_header(forged, identity);
    (void)this->estimator_.load(forged);
    ASSERT_TRUE(std::isfinite(this->estimator_.step({}).value)) << "byte " << place;  // held
    for (int n = 0; n < 5; ++n)
      ASSERT_TRUE(std::isfinite(this->estimator_.step(motion.next()).value)) << "byte " << place;
  }
}

TYPED_TEST(StateLaws, AStateOfAnotherModelIsRefused) {
  const std::vector<std::byte> state = saved(this->estimator_);
  EstimatorSettings settings = remembering_settings();
  settings.fallback.intercept += 0.1;
  TorqueEstimator other(Estimator(settings, example<TypeParam>()));
  ASSERT_EQ(other.state_size(), state.size());
  EXPECT_FALSE(other.load(state));
  std::vector<std::byte> inner(this->estimator_.estimator().state_size());
  ASSERT_TRUE(this->estimator_.estimator().save(inner));
  EXPECT_FALSE(this->estimator_.load(inner));
}

TEST(State, OfABankContinuesToTheBit) {
  TorqueEstimator estimator = estimator_of(GreyBox(example<GreyBoxWithBanks>().parameters()));
  Motion motion(3);
  (void)run(estimator, motion, 500);
  const std::vector<std::byte> state = saved(estimator);
  Motion same = motion;
  const std::vector<Bits> expected = run(estimator, motion, 300);
  ASSERT_TRUE(estimator.load(state));
  EXPECT_EQ(run(estimator, same, 300), expected);
}

TEST(State, OfAModelWithOtherParametersIsRefused) {
  auto parameters = example<Linear>().parameters();
  const std::vector<std::byte> state = saved(estimator_of(example<Linear>()));
  parameters.coefficients.values.values.front() += 1.0;
  TorqueEstimator other = estimator_of(Linear(parameters));
  ASSERT_EQ(other.state_size(), state.size());
  EXPECT_FALSE(other.load(state));
}

TEST(State, OfAnAdaptedModelCannotBeSaved) {
  const BasicEstimator<AdaptiveModel> adaptive(
      example_settings(),
      AdaptiveModel(
          {.base = example<Mlp>().parameters(), .adaptation = {}, .sample_period_s = 1e-3}));
  EXPECT_EQ(adaptive.state_size(), 0U);
  std::vector<std::byte> bytes(1000);
  EXPECT_FALSE(adaptive.save(bytes));
}

}  // namespace
}  // namespace torsio::test
