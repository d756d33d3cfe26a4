#include "torsio/estimate/estimator_batch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/example_settings.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/hysteresis.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/narx.hpp"
#include "support/examples/network.hpp"
#include "support/random_network.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::example;

constexpr std::size_t kRows = 150;  // more than one block and one group of a network
constexpr std::size_t kTicks = 400;

/// An output that overflows to infinity now and then, inside the ranges, and a memory.
class Overflowing {
 public:
  static constexpr std::string_view kFamily = "overflowing";
  struct Parameters {
    using Family = Overflowing;
    double level = 0.0;
    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("level", self.level);
    }
  };
  explicit Overflowing(Parameters parameters) : parameters_(parameters) {}
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] static std::size_t input_count() noexcept { return 2; }
  [[nodiscard]] static std::size_t parameter_count() noexcept { return 1; }
  void reset() noexcept { sum_ = 0.0; }
  Estimate step(Features features) noexcept {
    sum_ += features[0];
    if (features[0] > parameters_.level) return {.value = std::numeric_limits<double>::infinity()};
    if (features[0] < -parameters_.level) return {.value = sum_, .fault = Fault::model_not_finite};
    return {.value = sum_};
  }
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(sum_); }

 private:
  Parameters parameters_;
  double sum_ = 0.0;
};

/// A network whose units fill whole vectors of every machine.
Lstm wide_lstm() {
  return Lstm(test::random_network<Lstm>({.units = {32}, .hidden = {}, .warm_up_samples = 3}, 8));
}

/// Every kind of term that a grey box may have, with knots at several places.
GreyBox::Parameters grey_box_with_banks(std::size_t friction_knots) {
  GreyBox::Parameters parameters;
  std::vector<double> friction;
  for (std::size_t k = 0; k < friction_knots; ++k)
    friction.push_back(-0.05 + 0.04 * static_cast<double>(k));
  parameters.terms = {.curve_knots = {-0.05, -0.01, 0.02, 0.04},
                      .thresholds = {0.001, 0.004, 0.02},
                      .friction_knots = friction,
                      .time_constants_s = {0.02, 0.3},
                      .rate_scales = {0.0, 0.02},
                      .sample_period_s = 0.001,
                      .banks = {{.input = 1, .thresholds = {0.002}, .force_knots = friction},
                                {.input = 1,
                                 .is_integrated = true,
                                 .thresholds = {1e-6, 1e-5},
                                 .curve_knots = {-0.01, -0.002, 0.003, 0.008},
                                 .product_knots = {-0.02, 0.0, 0.03},
                                 .time_constants_s = {0.05}}}};
  Random random(friction_knots);
  parameters.coefficients.values = Matrix(1, parameters.terms.columns());
  for (double& each : parameters.coefficients.values.values) each = random.normal();
  return parameters;
}

std::vector<AnyModel> models() {
  return {example<Lstm>(),
          example<Gru>(),
          wide_lstm(),
          example<GreyBox>(),
          GreyBox(grey_box_with_banks(1)),
          GreyBox(grey_box_with_banks(3)),
          example<MaxwellSlipModel>(),
          example<Narx<Linear>>(),
          example<Polynomial>(),
          example<LstmEnsemble>(),
          Overflowing({.level = 0.055})};
}

EstimatorSettings batch_settings(const std::string& second) {
  EstimatorSettings of = test::example_settings();
  of.zeroed_channels = {};
  of.features.inputs[1] = second;
  of.disturbances = {.largest_step = {0.01, 0.01}, .largest_travel = 0.01, .warm_up_s = 0.02};
  of.target_uncertainty = {.constant = 0.3, .relative = 0.05};
  of.strokes = {.longest_s = 0.05, .dead_band = 0.004, .growth = 0.5, .limit = 30.0};
  return of;
}

/// Slow motions of two angles, with faults: NaN, infinity, jumps, excursions and gaps of all lengths.
class Motion {
 public:
  explicit Motion(std::uint64_t seed) : random_(seed), phase_(6.0 * random_.uniform()) {}

  void next(double* raw) {
    phase_ += 0.004;
    raw[0] = 0.06 * std::sin(phase_) + 0.5;
    raw[1] = 0.01 * std::sin(3.0 * phase_) + 0.5;
    if (fault_ticks_ == 0 && random_.uniform() < 0.01) {
      kind_ = static_cast<int>(5.0 * random_.uniform());
      fault_ticks_ = 1 + static_cast<int>(20.0 * random_.uniform() * random_.uniform());
    }
    if (fault_ticks_ == 0) return;
    --fault_ticks_;
    if (kind_ == 0) raw[0] = std::numeric_limits<double>::quiet_NaN();
    if (kind_ == 1) raw[1] = -std::numeric_limits<double>::infinity();
    if (kind_ == 2) raw[0] += 0.03;  // a jump inside the ranges
    if (kind_ == 3) raw[0] += 5.0;   // and one that leaves them
    if (kind_ == 4) raw[1] = 1e308;  // overflows in the rate
  }

 private:
  Random random_;
  double phase_;
  int fault_ticks_ = 0;
  int kind_ = 0;
};

void expect_same(const Estimate& mine, const Estimate& expected, const std::string& where) {
  const auto bits = [](double of) { return std::bit_cast<std::uint64_t>(of); };
  ASSERT_EQ(mine.fault, expected.fault) << where;
  ASSERT_EQ(bits(mine.value), bits(expected.value)) << where << mine.value << expected.value;
  ASSERT_EQ(bits(mine.std_dev), bits(expected.std_dev)) << where;
  ASSERT_EQ(bits(mine.novelty), bits(expected.novelty)) << where;
}

class EstimatorBatchLaw : public testing::TestWithParam<std::string> {};

TEST_P(EstimatorBatchLaw, GivesEachRowWhatAnEstimatorOfItsOwnDoes) {
  for (const AnyModel& model : models()) {
    const EstimatorSettings of = batch_settings(GetParam());
    EstimatorBatch batch(of, model, kRows);
    std::vector<Estimator> alone(kRows, Estimator(of, model));
    batch.set_zero("joint_angle_rad", 0.003);
    for (Estimator& each : alone) each.set_zero("joint_angle_rad", 0.003);
    std::vector<Motion> motions;
    for (std::size_t row = 0; row < kRows; ++row) motions.emplace_back(row + 1);
    std::vector<double> raw(2 * kRows);
    std::vector<Estimate> estimates(kRows);
    std::vector<std::byte> mine(batch.state_size());
    std::vector<std::byte> expected(alone[0].state_size());
    ASSERT_EQ(mine.size(), expected.size());
    std::size_t usable = 0;
    std::size_t faults = 0;
    for (std::size_t tick = 0; tick < kTicks; ++tick) {
      for (std::size_t row = 0; row < kRows; ++row) motions[row].next(raw.data() + 2 * row);
      if (tick == 210) batch.reset(7), alone[7].reset();
      batch.step(raw, estimates);
      for (std::size_t row = 0; row < kRows; ++row) {
        const Estimate one = alone[row].step(std::span(raw).subspan(2 * row, 2));
        expect_same(estimates[row], one,
                    std::string(model.family()) + ", tick " + std::to_string(tick) + ", row " +
                        std::to_string(row) + ": ");
        if (HasFatalFailure()) return;
        (one.fault == Fault::none ? usable : faults) += 1;
      }
      if (tick % 100 != 99) continue;
      for (const std::size_t row : {std::size_t{3}, kRows - 1}) {
        ASSERT_TRUE(batch.save(row, mine));
        ASSERT_TRUE(alone[row].save(expected));
        ASSERT_EQ(mine, expected) << model.family();
        // Row 0 continues from there, too.
        ASSERT_TRUE(batch.load(0, expected));
        ASSERT_TRUE(alone[0].load(expected));
      }
    }
    EXPECT_GT(usable, kRows * kTicks / 20) << model.family();
    EXPECT_GT(faults, kRows * kTicks / 100) << model.family();
  }
}

INSTANTIATE_TEST_SUITE_P(Features, EstimatorBatchLaw,
                         testing::Values("lowpass(rate(spring_deflection_rad), 50Hz)",
                                         "tanh(2 * joint_angle_rad) / 3",
                                         "stop(joint_angle_rad, 0.002rad)",
                                         "lag(gear_angle_rad, 3) - joint_angle_rad"));

TEST(EstimatorBatch, RefusesNoRows) {
  EXPECT_THAT(test::error_message(
                  [] { EstimatorBatch(test::example_settings(), example<MaxwellSlipModel>(), 0); }),
              testing::HasSubstr("at least one row"));
}

TEST(EstimatorBatch, RefusesTheStatesOfOthers) {
  EstimatorBatch batch(test::example_settings(), example<Lstm>(), 2);
  std::vector<std::byte> state(batch.state_size());
  ASSERT_TRUE(batch.save(1, state));
  EXPECT_TRUE(batch.load(0, state));
  EXPECT_FALSE(batch.save(0, std::span(state).first(9)));
  state.back() = ~state.back();
  EXPECT_FALSE(batch.load(0, state));
  EXPECT_FALSE(batch.load(0, {}));
}

TEST(EstimatorBatch, ReportsZerosThatAreNotSet) {
  EstimatorBatch batch(test::example_settings(), example<Polynomial>(), 1);
  EXPECT_THAT(batch.unset_zeros(), testing::ElementsAre("joint_angle_rad"));
  std::vector<Estimate> estimate(1);
  for (int n = 0; n < 100; ++n) batch.step({{0.1, 0.1}}, estimate);
  EXPECT_EQ(estimate[0].fault, Fault::zero_not_set);
  batch.set_zero("joint_angle_rad", 0.0);
  batch.step({{0.1, 0.1}}, estimate);
  EXPECT_EQ(estimate[0].fault, Fault::none);
}

}  // namespace
}  // namespace torsio
