// Laws of an estimator around every family after inputs that it must not use.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <numbers>
#include <string_view>
#include <vector>

#include "fit/common/guards.hpp"
#include "support/bench_dataset.hpp"
#include "support/every_family.hpp"
#include "support/example_models.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio::test {
namespace {

constexpr double kSeconds = 8.0;

const FeatureSpec kFeatures{.inputs = {"spring_deflection_rad", "rate(spring_deflection_rad)"},
                            .definitions = {}};

/// The examples' own sample rate, or 1 kHz.
template <class M>
double rate_Hz(const M& model) {
  if constexpr (HasSamplePeriod<M>) return 1.0 / model.sample_period();
  return 1000.0;
}

/// A deflection of up to +-0.1 rad; `shift_s` selects another part of it.
std::vector<double> deflection(double rate_Hz, double shift_s) {
  std::vector<double> values(static_cast<std::size_t>(kSeconds * rate_Hz));
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double t_s = shift_s + static_cast<double>(n) / rate_Hz;
    values[n] = 0.065 * std::sin(5.0 * t_s) + 0.035 * std::sin(8.3 * t_s + 1.0);
  }
  return values;
}

/// Guards from a record that the model made itself, with 1 % of noise.
template <class M>
Estimator guarded(const M& model) {
  Dataset dataset;
  for (const double shift_s : {0.0, 20.0, 40.0}) {
    M fresh = model;
    fresh.reset();
    Channel x{"spring_deflection_rad", deflection(rate_Hz(model), shift_s)};
    Channel y{"torque_Nm", std::vector<double>(x.values.size())};
    FeaturePipeline pipeline(kFeatures, rate_Hz(model));
    for (std::size_t n = 0; n < y.values.size(); ++n)
      y.values[n] = fresh.step(pipeline.step({&x.values[n], 1})).value;
    const auto [lowest, highest] = std::ranges::minmax(y.values);
    Random random(7);
    for (double& value : y.values) value += 0.01 * (highest - lowest) * random.normal();
    Recording recording("bench", rate_Hz(model));
    recording.add(std::move(x));
    recording.add(std::move(y));
    add_record(dataset, std::move(recording), Role::train);
  }
  const TrainingData training = training_data(dataset, kFeatures);
  return {guarded_settings(kFeatures, training, AnyModel(model)), AnyModel(model)};
}

struct Disturbance {
  std::string_view name;
  double duration_s;                         ///< 0: one sample
  double (*apply)(double x, std::size_t n);  ///< n samples after its beginning
};

constexpr std::string_view kWithinTheRange = "one sample at the other end";

// All of them leave the range or the largest step of the training.
constexpr Disturbance kDisturbances[] = {
    {"one sample of 2 pi", 0.0, [](double, std::size_t) { return 2.0 * std::numbers::pi; }},
    {"one sample of 1e4", 0.0, [](double, std::size_t) { return 1e4; }},
    {"one sample of -1e6", 0.0, [](double, std::size_t) { return -1e6; }},
    {kWithinTheRange, 0.0, [](double x, std::size_t) { return std::copysign(0.09, -x); }},
    {"1 rad off for 0.1 s", 0.1, [](double x, std::size_t) { return x + 1.0; }},
    {"-1 rad off for 1 s", 1.0, [](double x, std::size_t) { return x - 1.0; }},
    {"spikes for 1 s", 1.0,
     [](double x, std::size_t n) { return n % 50 == 0 ? 2.0 * std::numbers::pi : x; }},
    {"missing for 1 s", 1.0, [](double, std::size_t) { return kNaN; }},
};
constexpr double kOnsets_s[] = {1.0, 1.7, 2.3, 3.1};

std::vector<Estimate> run(Estimator estimator, const std::vector<double>& x) {
  std::vector<Estimate> estimates;
  for (const double each : x) estimates.push_back(estimator.step({&each, 1}));
  return estimates;
}

std::vector<double> disturbed(std::vector<double> x, double rate_Hz, double onset_s,
                              const Disturbance& disturbance) {
  const auto begin = static_cast<std::size_t>(onset_s * rate_Hz);
  const auto samples =
      std::max<std::size_t>(1, static_cast<std::size_t>(disturbance.duration_s * rate_Hz));
  for (std::size_t n = begin; n < begin + samples; ++n) x[n] = disturbance.apply(x[n], n - begin);
  return x;
}

template <class M>
class DisturbanceLaws : public testing::Test {
 protected:
  M model_ = example<M>();
  Estimator estimator_ = guarded(model_);
  std::vector<double> x_ = deflection(rate_Hz(model_), 60.0);
};

TYPED_TEST_SUITE(DisturbanceLaws, EveryFamily, ModelName);

TYPED_TEST(DisturbanceLaws, WhereThereIsNoFaultTheValueIsThatOfTheUndisturbedRun) {
  const std::vector<Estimate> expected = run(this->estimator_, this->x_);
  const auto [lowest, highest] = std::ranges::minmax(expected, {}, &Estimate::value);
  const double width = highest.value - lowest.value;
  for (const Disturbance& disturbance : kDisturbances) {
    // A force may jump within its range.
    if (!detail::traits_of<TypeParam>().is_spring && disturbance.name == kWithinTheRange) continue;
    for (const double onset_s : kOnsets_s) {
      const std::vector<Estimate> found =
          run(this->estimator_, disturbed(this->x_, rate_Hz(this->model_), onset_s, disturbance));
      double worst = 0.0;  // in error bars
      for (std::size_t n = 0; n < found.size(); ++n) {
        ASSERT_TRUE(std::isfinite(found[n].value));
        if (found[n].fault != Fault::none || expected[n].fault != Fault::none) continue;
        worst = std::max(worst, std::abs(found[n].value - expected[n].value) / found[n].std_dev);
        ASSERT_GE(found[n].value, lowest.value - width);
        ASSERT_LE(found[n].value, highest.value + width);
      }
      EXPECT_LE(worst, 3.0) << disturbance.name << " at " << onset_s << " s";
    }
  }
}

TYPED_TEST(DisturbanceLaws, TheFaultEndsOnceTheMemoryHasRecovered) {
  const Disturbance& missing = *std::rbegin(kDisturbances);
  const std::vector<Estimate> found =
      run(this->estimator_, disturbed(this->x_, rate_Hz(this->model_), 1.0, missing));
  // The position of a drive is an integral of its force: what was missed is missing for ever.
  // With others the fit may find no time after which two of their runs agree.
  const bool forgets = TypeParam::kFamily != RigidDrive::kFamily &&
                       !std::isnan(this->estimator_.settings().disturbances.warm_up_s);
  EXPECT_EQ(found.back().fault, forgets ? Fault::none : Fault::recovering);
}

TYPED_TEST(DisturbanceLaws, ADependenceOnPastInputsIsDeclared) {
  if (!AnyModel(this->model_)
           .memory({.lowest = std::vector{-0.1, -0.4}, .highest = std::vector{0.1, 0.4}})
           .is_empty())
    return;
  TypeParam fresh = this->model_;
  TypeParam used = this->model_;
  fresh.reset();
  used.reset();
  const Matrix features = example_features(200, this->model_.input_count());
  for (std::size_t n = 0; n + 1 < features.rows; ++n) used.step(features.row(n));
  EXPECT_EQ(used.step(features.row(199)).value, fresh.step(features.row(199)).value);
}

/// The largest error after a disturbance that nothing can detect, in error bars.
struct Remainder {
  double at_once = 0.0;
  double after_1_s = 0.0;
};

/// 1.2 times what was measured. The rate of the deflection is filtered, which leaves up to 0.038 at
/// once (mlp), also where the model has no memory. The memory of a model adds to it:
constexpr Remainder kOfTheInputs{.at_once = 0.046, .after_1_s = 1e-8};
const std::map<std::string_view, Remainder> kRemainders{
    // The offset of a slip element lasts until the element slips again.
    {"maxwell_slip", {.at_once = 0.61, .after_1_s = 0.61}},
    {"prandtl_ishlinskii", {.at_once = 0.61, .after_1_s = 0.61}},
    // The branches relax, the slowest one by a factor of 8 in 1 s.
    {"viscoelastic", {.at_once = 0.44, .after_1_s = 0.053}},
    // The hysteretic force decays with the travel, not with the time.
    {"dynamic_bouc_wen", {.at_once = 0.56, .after_1_s = 0.51}},
    // Its position is an integral of the input, so that what was missed is missing for ever.
    {"rigid_drive", {.at_once = 24.3, .after_1_s = 20.3}},
};

// Nothing can detect a disturbance that a sound joint could have made: 1 s of an input that is up to
// 40 % too small. Only what remains of it afterwards can be limited.
TYPED_TEST(DisturbanceLaws, WhatRemainsOfADisturbanceWithinTheRangeIsLimited) {
  const std::vector<Estimate> expected = run(this->estimator_, this->x_);
  std::vector<double> x = this->x_;
  const double rate = rate_Hz(this->model_);
  const auto begin = static_cast<std::size_t>(2.0 * rate);
  const auto samples = static_cast<std::size_t>(rate);
  for (std::size_t n = begin; n < begin + samples; ++n) {
    const double share = static_cast<double>(n - begin) / static_cast<double>(samples);
    x[n] *= 1.0 - 0.4 * std::pow(std::sin(std::numbers::pi * share), 2.0);
  }
  const std::vector<Estimate> found = run(this->estimator_, x);
  Remainder worst;
  std::size_t compared = 0;
  for (std::size_t n = begin + samples; n < found.size(); ++n) {
    if (found[n].fault != Fault::none || expected[n].fault != Fault::none) continue;
    const double error = std::abs(found[n].value - expected[n].value) / found[n].std_dev;
    worst.at_once = std::max(worst.at_once, error);
    if (n > begin + 2 * samples) worst.after_1_s = std::max(worst.after_1_s, error);
    ++compared;
  }
  // Hardly any sample has a fault, or there would be nothing to compare.
  EXPECT_GE(compared, 4 * samples);
  const auto own = kRemainders.find(TypeParam::kFamily);
  const Remainder limit = own == kRemainders.end() ? kOfTheInputs : own->second;
  EXPECT_LE(worst.at_once, limit.at_once);
  EXPECT_LE(worst.after_1_s, limit.after_1_s);
}

}  // namespace
}  // namespace torsio::test
