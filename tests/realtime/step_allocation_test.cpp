#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <set>
#include <vector>

#include "model/network/lstm.hpp"
#include "support/allocation_counter.hpp"
#include "support/every_family.hpp"
#include "support/example_models.hpp"
#include "support/example_settings.hpp"
#include "support/grey_box_examples.hpp"
#include "support/numbers.hpp"
#include "torsio/estimate/adaptive_estimator.hpp"
#include "torsio/estimate/motor_referenced_torques.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

using test::example;
using test::example_features;
using test::heap_calls_during;
using test::kInfinity;
using test::kNaN;

TEST(AllocationCounter, DetectsEveryKindOfHeapCall) {
  // volatile: the compiler may remove a pair of new and delete whose result is not used.
  EXPECT_EQ(heap_calls_during([] {
              int* volatile number = new int(1);
              delete number;
            }),
            2U);
  EXPECT_EQ(heap_calls_during([] {
              void* volatile block = std::calloc(3, 5);
              block = std::realloc(block, 5000);
              std::free(block);
            }),
            3U);
  EXPECT_EQ(heap_calls_during([] {
              void* volatile block = std::aligned_alloc(64, 128);
              std::free(block);
            }),
            2U);
  EXPECT_EQ(heap_calls_during([] { const std::vector<double> values(1000, 1.0); }), 2U);
}

TEST(AllocationCounter, DetectsNoneWhereThereIsNone) {
  double sum = 0.0;
  EXPECT_EQ(heap_calls_during([&] { sum = std::sin(1.0); }), 0U);
  EXPECT_GT(sum, 0.0);
}

TEST(MotorReferencedTorques, StepNeverTouchesTheHeap) {
  MotorReferencedTorques torques({.torque_constant_Nm_A = 0.2, .gear_ratio = 160.0});
  double sum = 0.0;
  EXPECT_EQ(heap_calls_during([&] {
              for (const double each : {0.1, kNaN, kInfinity, 1e308})
                sum += torques.step({.motor_current_A = each}, each).motor_Nm;
            }),
            0U);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(FeaturePipeline, StepNeverTouchesTheHeap) {
  FeaturePipeline pipeline(
      {.inputs = {"a_rad - b_rad", "lowpass(rate(a_rad), 10Hz)", "lag(b_rad, 7)",
                  "sign(a_rad) * tanh(b_rad / 0.3)", "sqrt(abs(a_rad)) + exp(b_rad)",
                  "min(a_rad, b_rad) / max(a_rad, 2) ^ 3"},
       .definitions = {}},
      1000.0);
  EXPECT_EQ(heap_calls_during([&] {
              for (const double value : {0.1, 0.2, -0.3, 1e200, kInfinity, kNaN, 0.1})
                (void)pipeline.step(std::array{value, -value});
              pipeline.reset();
              (void)pipeline.step(std::array{0.1, 0.2});
            }),
            0U);
}

template <class Family>
class EveryFamily : public testing::Test {};
TYPED_TEST_SUITE(EveryFamily, test::EveryFamily);

TYPED_TEST(EveryFamily, StepNeverTouchesTheHeap) {
  auto model = example<TypeParam>();
  const Matrix features = example_features(300, model.input_count());
  const std::vector<double> overflowing(model.input_count(), 1e300);
  EXPECT_EQ(heap_calls_during([&] {
              for (std::size_t n = 0; n < features.rows; ++n) (void)model.step(features.row(n));
              (void)model.step(overflowing);
              model.reset();
              (void)model.step(features.row(0));
            }),
            0U);
}

TYPED_TEST(EveryFamily, SavingAndLoadingTheStateNeverTouchesTheHeap) {
  TorqueEstimator estimator(Estimator(test::example_settings(), example<TypeParam>()));
  std::vector<std::byte> state(estimator.state_size());
  ASSERT_GT(state.size(), 0U);
  bool saved = false;
  bool loaded = false;
  bool junk_loaded = true;
  EXPECT_EQ(heap_calls_during([&] {
              (void)estimator.step({.gear_angle_rad = 0.1, .joint_angle_rad = 0.0});
              saved = estimator.state_size() == state.size() && estimator.save(state);
              loaded = estimator.load(state);
              state[state.size() / 2] ^= std::byte{1};
              junk_loaded = estimator.load(state);
            }),
            0U);
  EXPECT_TRUE(saved && loaded);
  EXPECT_FALSE(junk_loaded);
}

TEST(GreyBoxBanks, StepNeverTouchesTheHeap) {
  TorqueEstimator estimator(
      Estimator(test::example_settings(), GreyBox(example<test::GreyBoxWithBanks>().parameters())));
  EXPECT_EQ(heap_calls_during([&] {
              for (const double angle_rad : {0.1, 0.2, std::nan(""), -0.1, 5.0, 0.0})
                (void)estimator.step({.gear_angle_rad = angle_rad, .joint_angle_rad = 0.0});
              estimator.reset();
            }),
            0U);
}

TEST(RecurrentNetwork, StepAndStatesOfManyJointsNeverTouchTheHeap) {
  constexpr std::size_t kJoints = 7;
  Lstm network = example<Lstm>();
  RecurrentNetwork<LstmLayer> many(network.parameters(), kJoints, Lstm::kFamily);
  const Matrix features = example_features(50, kJoints * many.input_count());
  std::vector<Estimate> estimates(kJoints);
  std::vector<float> state(network.state_size());
  EXPECT_EQ(heap_calls_during([&] {
              for (std::size_t n = 0; n < features.rows; ++n) many.step(features.row(n), estimates);
              many.reset(3);
              many.reset();
              network.get_state(state);
              network.reset(state);
            }),
            0U);
}

/// A reference that runs into every guard: it swings about the frozen value, small or large.
ReferenceSample troublesome(int n, double output, double frozen) {
  const double swing = (n % 2 == 0 ? 1.0 : -1.0) * (n / 500 % 2 == 0 ? 0.5 : 20.0);
  const double value = n % 7 == 0    ? kNaN
                       : n % 11 == 0 ? 200.0
                       : n % 13 == 0 ? output
                       : n % 17 == 0 ? output + 60.0
                                     : frozen + swing;
  return {.value = value, .age_s = n % 19 == 0 ? 1.0 : 0.0};
}

/// Steps with every trouble of a reference, a pause, a missing input and a reset.
std::size_t heap_calls_while_adapting(AdaptiveEstimator& estimator, Estimator& frozen, int steps) {
  return heap_calls_during([&] {
    for (int n = 0; n < steps; ++n) {
      const std::array raw{0.1 * std::sin(0.01 * n), 0.0};
      const double output = estimator.step(raw).value;
      (void)estimator.learn(troublesome(n, output, frozen.step(raw).value));
      if (n == 2000) estimator.pause();
      if (n == 2100) estimator.resume();
    }
    (void)estimator.step(std::array{kNaN, 0.0});
    (void)estimator.learn({.value = 1.0});
    estimator.reset();
  });
}

TEST(AdaptiveEstimator, NeverTouchesTheHeapOnAnyPath) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels.clear();
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    Estimator frozen(settings, AnyModel(example<Lstm>()));
    AdaptiveEstimator estimator(settings, example<Lstm>().parameters(),
                                {.rule = rule,
                                 .step_size = 1.0,
                                 .forgetting = 0.9,
                                 .initial_covariance = 1.0,
                                 .sensor_std = 0.01,
                                 .saturation = 100.0,
                                 .largest_change = 0.1,
                                 .comparison_s = 0.5,
                                 .confirmation_s = 0.0});
    EXPECT_EQ(heap_calls_while_adapting(estimator, frozen, 4000), 0U);
    const AdaptationCounts counts = estimator.adapter().counts();
    constexpr auto kOfTheCheck = static_cast<std::size_t>(UpdateOutcome::reference_unconfirmed);
    for (std::size_t outcome = 0; outcome < kOfTheCheck; ++outcome)
      // A layer is restored at once.
      EXPECT_EQ(counts.outcomes[outcome] > 0U,
                outcome != static_cast<std::size_t>(UpdateOutcome::rolling_back))
          << name(static_cast<UpdateOutcome>(outcome));
    EXPECT_GT(counts.roll_backs, 0U);
    EXPECT_EQ(heap_calls_during([&] { estimator.forget(); }), 0U);
    AdaptiveEstimator checking(settings, example<Lstm>().parameters(),
                               {.rule = rule, .comparison_s = 1.0, .confirmation_s = 0.5});
    EXPECT_EQ(heap_calls_while_adapting(checking, frozen, 4000), 0U);
    EXPECT_GT(checking.adapter().counts().of(UpdateOutcome::reference_unconfirmed), 0U);
  }
}

/// The parameters of a mixture and of a grey box for the channels of `example_settings`.
template <class Family>
class AdaptedInPlace : public testing::Test {};
using InPlace = testing::Types<Dgmm, GreyBox>;
TYPED_TEST_SUITE(AdaptedInPlace, InPlace);

TYPED_TEST(AdaptedInPlace, NeverTouchesTheHeapOnAnyPath) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels.clear();
  const auto parameters = example<TypeParam>().parameters();
  Estimator frozen(settings, AnyModel(example<TypeParam>()));
  AdaptiveEstimator estimator(settings, parameters,
                              {.forgetting = 0.9,
                               .initial_covariance = 1.0,
                               .trace_cap = 100.0,
                               .component_samples = 1.0,
                               .sensor_std = 0.01,
                               .saturation = 100.0,
                               .largest_change = 0.02,
                               .comparison_s = 0.5});
  EXPECT_EQ(heap_calls_while_adapting(estimator, frozen, 8000), 0U);
  const AdaptationCounts counts = estimator.adapter().counts();
  EXPECT_GT(counts.of(UpdateOutcome::updated), 0U);
  EXPECT_GT(counts.of(UpdateOutcome::limited), 0U);
  EXPECT_GT(counts.roll_backs, 0U);
  EXPECT_EQ(heap_calls_during([&] { estimator.forget(); }), 0U);
}

TYPED_TEST(EveryFamily, AnEstimatorAroundItNeverTouchesTheHeapOnAnyPath) {
  EstimatorSettings settings = test::example_settings();
  settings.disturbances = {.largest_step = {0.05, 0.05}, .largest_travel = 1e-3, .warm_up_s = 0.05};
  Estimator estimator(settings, AnyModel(example<TypeParam>()));
  std::set<Fault> seen;  // filled outside of what is counted
  std::vector<Fault> faults(4000, Fault::none);
  std::size_t at = 0;
  Fault in_border = Fault::warming_up;
  const auto step = [&](double gear, double joint) {
    faults[at++] = estimator.step(std::array{gear, joint}).fault;
  };
  EXPECT_EQ(heap_calls_during([&] {
              for (int i = 0; i < 500; ++i) step(0.1, 0.0);
            }),
            0U);
  estimator.set_zero("joint_angle_rad", 0.0);
  EXPECT_EQ(heap_calls_during([&] {
              for (int i = 0; i < 500; ++i) step(0.1 * std::cos(0.01 * i), 0.0);
              for (int i = 0; i < 1250; ++i) step(0.03 + 8.2e-4 * i, 0.0);  // into the border
              in_border = faults[at - 1];
              step(kNaN, 0.0);                                    // a short gap
              step(0.0, 0.0);                                     //
              for (int i = 0; i < 50; ++i) step(0.0, kInfinity);  // a long one
              for (int i = 0; i < 500; ++i) step(0.0, 0.0);
              step(5.0, 0.0);       // outside the training range
              step(1e308, -1e308);  // overflows the pipeline
              step(0.0, 0.0);
              faults[at++] = estimator.step({}).fault;
              estimator.reset();
              step(0.0, 0.0);
            }),
            0U);
  // The curves of these two end at 0.1, far inside the estimator's range, and report a fault
  // themselves.
  constexpr bool kEndsEarlier =
      std::same_as<TypeParam, Polynomial> || std::same_as<TypeParam, HammersteinWiener>;
  EXPECT_EQ(in_border, kEndsEarlier ? Fault::outside_training_range : Fault::none);
  seen.insert(faults.begin(), faults.begin() + static_cast<std::ptrdiff_t>(at));
  seen.erase(Fault::recovering);  // only models with memory recover after the gap
  EXPECT_EQ(seen,
            (std::set{Fault::none, Fault::input_not_finite, Fault::input_count_wrong,
                      Fault::warming_up, Fault::zero_not_set, Fault::outside_training_range}));
}

/// A model that fails at each second step.
class Failing {
 public:
  struct Parameters {};
  explicit Failing(Parameters /*none*/) {}
  [[nodiscard]] Parameters parameters() const { return {}; }
  [[nodiscard]] std::size_t input_count() const noexcept { return 2; }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return 0; }
  void reset() noexcept {}
  Estimate step(Features /*features*/) noexcept {
    fails_ = !fails_;
    return {.value = fails_ ? kNaN : 1.0};
  }

 private:
  bool fails_ = false;
};

TEST(TorqueEstimator, StepNeverTouchesTheHeapWhenTheModelFails) {
  BasicTorqueEstimator<Failing> estimator(
      BasicEstimator<Failing>(test::example_settings(), Failing({})));
  estimator.set_zero("joint_angle_rad", 0.0);
  bool failed = false;
  EXPECT_EQ(heap_calls_during([&] {
              for (int i = 0; i < 500; ++i)
                failed |= estimator.step({.gear_angle_rad = 0.1, .joint_angle_rad = 0.0}).fault ==
                          Fault::model_not_finite;
            }),
            0U);
  EXPECT_TRUE(failed);
}

}  // namespace
}  // namespace torsio
