// Estimator and inverse have one verdict on the training range: docs/decisions/0027-beyond-the-range.md.
#include "torsio/control/model_inverse.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/example_settings.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/hysteresis.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/viscoelastic.hpp"
#include "support/numbers.hpp"
#include "torsio/control/exchangeable_inverse.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {
namespace {

using test::kInfinity;
using test::kRate_Hz;
constexpr int kTicks = 1000;

/// A deflection of +-0.1 rad with a border of 0.02, and a rate of +-0.4 rad/s; a model that continues is
/// in use up to 0.3 rad. Jumps are changes by more than 0.2 rad.
EstimatorSettings trained() {
  EstimatorSettings settings = test::example_settings();
  settings.features.inputs = {"spring_deflection_rad", "rate(joint_angle_rad)"};
  settings.zeroed_channels.clear();
  settings.ranges = {.lowest = {-0.1, -0.4}, .highest = {0.1, 0.4}, .margin = 0.1};
  settings.fallback = {.intercept = 0.5, .slope = {600.0, 0.0}, .residual_std = 2.0};
  settings.disturbances = {.largest_step = {0.1, 0.1}, .largest_travel = 1e-3};
  return settings;
}

std::vector<AnyModel> continuing() {
  return {test::example<Linear>(),       test::example<LinearCoulomb>(),
          test::example<Viscoelastic>(), test::example<MaxwellSlipModel>(),
          test::example<BoucWenModel>(), test::example<PrandtlIshlinskii>(),
          test::example<GreyBox>()};
}

JointSample sample_of(double deflection_rad, double joint_rad) {
  JointSample sample;
  sample.gear_angle_rad = joint_rad + deflection_rad;
  sample.joint_angle_rad = joint_rad;
  return sample;
}

/// An estimator and the inverse of its model on one motion; the inverse is asked for the estimate.
struct Pair {
  explicit Pair(const AnyModel& model)
      : estimator(Estimator(trained(), model)),
        inverse(trained(), model, kInfinity),
        // A branch relaxes within the tick; the inverse is that of an immediate change.
        tolerance_rad(model.family() == "viscoelastic" || model.family() == "grey_box" ? 1e-4
                                                                                       : 1e-7) {}

  void step(double deflection_rad, double angle_rad) {
    deflection = deflection_rad;
    const JointSample sample = sample_of(deflection_rad, angle_rad);
    estimate = estimator.step(sample);
    request = inverse.step(estimate.value, sample);
  }
  /// From rest to this deflection, and as long there; the joint at a constant speed.
  void move(double deflection_rad, double speed_rad_s = 0.1) {
    for (int n = 0; n <= 2 * kTicks; ++n)
      step(deflection_rad * std::min(n, kTicks) / kTicks, joint_rad = speed_rad_s * n / kRate_Hz);
  }
  void expect_agreement(Fault fault, const std::string& where) const {
    EXPECT_EQ(estimate.fault, fault) << where;
    EXPECT_EQ(request.fault, fault) << where;
    EXPECT_NEAR(request.value, deflection, tolerance_rad) << where;
  }

  BasicTorqueEstimator<AnyModel> estimator;
  ModelInverse inverse;
  double tolerance_rad;
  double joint_rad = 0.0;
  double deflection = 0.0;
  Estimate estimate;
  Estimate request;
};

struct Place {
  const char* name;
  double deflection_rad;
  double speed_rad_s;
  Fault fault;
};

TEST(ModelInverse, HasTheVerdictOfTheEstimatorAndLeadsBackToTheDeflection) {
  for (const AnyModel& model : continuing())
    for (const Place& place :
         {Place{"inside", 0.08, 0.1, Fault::none}, Place{"in the border", 0.115, 0.1, Fault::none},
          Place{"outside", 0.25, 0.1, Fault::outside_training_range},
          Place{"outside on the other side", -0.25, -0.1, Fault::outside_training_range},
          Place{"far outside", 3.0, 0.1, Fault::outside_training_range}}) {
      Pair pair(model);
      pair.move(place.deflection_rad, place.speed_rad_s);
      pair.expect_agreement(place.fault, std::string(model.family()) + ", " + place.name);
    }
}

TEST(ModelInverse, HasTheVerdictOfTheEstimatorOfAModelThatDoesNotContinue) {
  const AnyModel model = test::example<Polynomial>();
  for (const Place& place : {Place{"inside", 0.08, 0.1, Fault::none},
                             Place{"outside", 0.25, 0.1, Fault::outside_training_range}}) {
    Pair pair(model);
    pair.move(place.deflection_rad, place.speed_rad_s);
    pair.expect_agreement(place.fault, place.name);
  }
}

// A model that was trained slowly can make a fast loop unstable; the line does not.
TEST(ModelInverse, UsesTheLineAtARateBeyondItsRange) {
  std::vector<AnyModel> models = continuing();
  models.push_back(test::example<Polynomial>());
  for (const AnyModel& model : models) {
    Pair pair(model);
    pair.move(0.05, 3.0);
    EXPECT_EQ(pair.estimate.fault, Fault::outside_training_range) << model.family();
    EXPECT_EQ(pair.request.fault, Fault::outside_training_range) << model.family();
    EXPECT_NEAR(pair.request.value, (pair.estimate.value - 0.5) / 600.0, 1e-12) << model.family();
  }
}

TEST(ModelInverse, HasTheVerdictOfTheEstimatorDuringAndAfterAJump) {
  for (const AnyModel& model : continuing()) {
    Pair pair(model);
    const std::string family(model.family());
    pair.move(0.05);
    constexpr int kHeldTicks = 10;
    for (int n = 0; n < kHeldTicks; ++n) {
      pair.step(0.05, pair.joint_rad + 1.0);
      EXPECT_EQ(pair.estimate.fault, Fault::outside_training_range) << family;
      EXPECT_EQ(pair.request.fault, Fault::outside_training_range) << family;
    }
    pair.step(0.05, pair.joint_rad + 1.0);
    pair.expect_agreement(Fault::warming_up, family + ", after it");
    pair.move(0.05);
    for (int n = 0; n <= kHeldTicks; ++n) pair.step(0.26, pair.joint_rad);
    pair.expect_agreement(Fault::outside_training_range, family + ", a jump out of the range");
    EXPECT_NEAR(pair.estimate.value, 0.5 + 600.0 * 0.26, 1e-9) << family << ": the fallback";
  }
}

// The inverse has the verdict of the deflection that it requests, wherever the measured one is.
TEST(ModelInverse, GivesItsVerdictOnTheRequestedDeflection) {
  ModelInverse inverse(trained(), test::example<Linear>());
  Estimate request;
  for (int n = 0; n <= kTicks; ++n) request = inverse.step(12.5, sample_of(0.25 * n / kTicks, 0.0));
  EXPECT_EQ(request.fault, Fault::none);
  EXPECT_NEAR(request.value, 0.02, 1e-12);
  EXPECT_EQ(inverse.step(120.5, sample_of(0.25, 0.0)).fault, Fault::outside_training_range);
}

TEST(ModelInverse, LeavesTheLineOnlySoFarBeyondItsRangeToo) {
  ModelInverse inverse(trained(), test::example<GreyBox>(), 0.5);
  Estimate request;
  for (int n = 0; n <= kTicks; ++n) request = inverse.step(150.0 * n / kTicks, sample_of(0.0, 0.0));
  EXPECT_EQ(request.fault, Fault::outside_training_range);
  EXPECT_NEAR(std::abs(request.value - 149.5 / 600.0), 0.5 * 2.0 / 600.0, 1e-12);
}

// The step that a change from the model to the line would be is not in the request.
TEST(ModelInverse, RequestsWithoutAStepAcrossTheEndsOfItsRange) {
  for (const AnyModel& model : continuing()) {
    ModelInverse inverse(trained(), model);
    double last_rad = 0.0;
    for (int n = 0; n <= 10 * kTicks; ++n) {
      const double request_rad = inverse.step(0.025 * n, sample_of(0.0, 0.0)).value;
      if (n > 10) {
        ASSERT_NEAR(request_rad, last_rad, 5e-4) << model.family() << " at " << 0.025 * n << " Nm";
      }
      last_rad = request_rad;
    }
  }
}

TEST(ExchangeableInverse, ContinuesFromItsLastDeflection) {
  ExchangeableInverse inverse(LinearInverse(100.0), 0.1, 1000.0);
  EXPECT_EQ(inverse.step(5.0, {}).value, 0.05);
  AnyInverse other = LinearInverse(200.0);
  inverse.exchange(other);
  EXPECT_EQ(other.step(5.0, {}).value, 0.05) << "the one before";
  EXPECT_NEAR(inverse.step(5.0, {}).value, 0.05, 1e-12);
  double last_rad = 0.05;
  for (int n = 0; n < 2000; ++n) {
    const double wanted_rad = inverse.step(5.0, {}).value;
    ASSERT_LE(wanted_rad, last_rad);
    ASSERT_GT(wanted_rad, last_rad - 0.3e-3);
    last_rad = wanted_rad;
  }
  EXPECT_NEAR(last_rad, 0.025, 1e-9);
}

}  // namespace
}  // namespace torsio
