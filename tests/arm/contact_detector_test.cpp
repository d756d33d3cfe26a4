#include "torsio/arm/contact_detector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kDetectorRate_Hz = 1000.0;

ContactDetector::Settings six_joints(const ExternalTorqueTerms& coefficients, double factor) {
  ContactDetector::Settings settings{.settling_s = 0.01};
  settings.joints.assign(test::kArm6Joints,
                         {.error = {.coefficients = coefficients}, .factor = factor});
  return settings;
}

/// A detector on an arm at rest in one pose, that begins to move.
class DetectorAtRest : public testing::Test {
 protected:
  const ContactDetector::Output& step(ContactDetector& detector,
                                      const test::Arm6Joints& external_Nm) {
    return detector.step(dynamics_, angle_rad_, speed_rad_s_, acceleration_rad_s2_, external_Nm);
  }
  void settle(ContactDetector& detector) {
    for (int n = 0; n < 20; ++n) step(detector, {});
  }

  ArmDynamics dynamics_ = ArmDynamics(test::arm6());
  test::Arm6Joints angle_rad_ = {0.1, -0.6, 1.2, 0.2, 0.6, 0.1};
  test::Arm6Joints speed_rad_s_ = {};
  test::Arm6Joints acceleration_rad_s2_ = {1.0, -2.0, 0.5, 3.0, -1.0, 2.0};
};

TEST_F(DetectorAtRest, HasTheVarianceOfItsFormula) {
  ExternalTorqueMotion motion(kDetectorRate_Hz);
  const auto terms = motion.step(dynamics_, angle_rad_, speed_rad_s_, acceleration_rad_s2_);
  ArmDynamics::JointMatrix mass;
  dynamics_.mass_matrix(angle_rad_, mass);
  test::Arm6Joints torque_Nm = {};
  dynamics_.inverse(angle_rad_, speed_rad_s_, acceleration_rad_s2_, torque_Nm);
  for (std::size_t i = 0; i < test::kArm6Joints; ++i) {
    double row = 0.0;
    double inertial_Nm = 0.0;
    for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
      row += mass[6 * i + j] * mass[6 * i + j];
      inertial_Nm += mass[6 * i + j] * acceleration_rad_s2_[j];
    }
    EXPECT_EQ(terms[i][0], 1.0);
    EXPECT_NEAR(terms[i][1], row, 1e-9);
    EXPECT_NEAR(terms[i][2], torque_Nm[i] * torque_Nm[i], 1e-6);
    EXPECT_NEAR(terms[i][3], inertial_Nm * inertial_Nm, 1e-9);
  }
  ContactDetector detector(six_joints({0.04, 2.0, 0.01, 0.5}, 5.0), kDetectorRate_Hz);
  const auto& output = step(detector, {0.5, 1.0, -1.0});
  for (std::size_t i = 0; i < test::kArm6Joints; ++i)
    EXPECT_NEAR(output.std_dev_Nm[i],
                std::sqrt(0.04 + 2.0 * terms[i][1] + 0.01 * terms[i][2] + 0.5 * terms[i][3]), 1e-9);
}

TEST_F(DetectorAtRest, KeepsTheErrorBarOfAnAccelerationForAWhile) {
  const ExternalTorqueTerms accelerations_alone = {1e-6, 0.0, 0.0, 0.5};
  ContactDetector detector(six_joints(accelerations_alone, 5.0), kDetectorRate_Hz);
  const double moving_Nm = step(detector, {}).std_dev_Nm[1];
  acceleration_rad_s2_ = {};
  for (int n = 0; n < 199; ++n) step(detector, {});
  // Its square has fallen to 1 / e after 0.2 s.
  EXPECT_NEAR(step(detector, {}).std_dev_Nm[1], moving_Nm * std::exp(-0.5), 1e-4 * moving_Nm);
  acceleration_rad_s2_.fill(std::numeric_limits<double>::quiet_NaN());
  step(detector, {});
  acceleration_rad_s2_ = {};
  EXPECT_TRUE(std::isfinite(step(detector, {}).std_dev_Nm[1]));
}

TEST_F(DetectorAtRest, FindsWhatIsAboveItsThresholdAndNamesTheJoint) {
  ContactDetector detector(six_joints({0.25, 0.0, 0.0, 0.0}, 4.0), kDetectorRate_Hz);
  EXPECT_FALSE(step(detector, {0.0, 0.0, 9.0}).is_contact);  // it has not settled
  settle(detector);
  EXPECT_FALSE(step(detector, {0.0, 0.0, 1.99}).is_contact);
  const auto& output = step(detector, {-2.5, 1.0, 2.1});
  EXPECT_TRUE(output.is_contact);
  EXPECT_EQ(output.joint, 0U);
  EXPECT_NEAR(output.largest_share, 1.25, 1e-9);
  detector.reset();
  EXPECT_FALSE(step(detector, {9.0}).is_contact);
}

TEST_F(DetectorAtRest, TakesNothingThatIsNotFiniteForAContact) {
  ContactDetector detector(six_joints({0.25, 0.1, 0.0, 0.0}, 4.0), kDetectorRate_Hz);
  settle(detector);
  EXPECT_FALSE(step(detector, {std::numeric_limits<double>::quiet_NaN()}).is_contact);
  EXPECT_FALSE(step(detector, {std::numeric_limits<double>::infinity()}).is_contact);
  EXPECT_TRUE(step(detector, {50.0}).is_contact);
}

TEST(ContactDetector, RefusesSettingsThatCannotWork) {
  const auto message = [](const ContactDetector::Settings& settings) {
    return test::error_message([&] { const ContactDetector detector(settings, kDetectorRate_Hz); });
  };
  EXPECT_THAT(message({}), HasSubstr("1 to 8 joints"));
  EXPECT_THAT(message(six_joints({0.1, -1.0, 0.0, 0.0}, 5.0)),
              AllOf(HasSubstr("joint 1"), HasSubstr("coefficient")));
  EXPECT_THAT(message(six_joints({0.0, 0.0, 0.0, 0.0}, 5.0)), HasSubstr("sum"));
  EXPECT_THAT(message(six_joints({0.1, 0.0, 0.0, 0.0}, 0.0)), HasSubstr("factor"));
  EXPECT_THAT(message(six_joints({std::nan(""), 0.0, 0.0, 0.0}, 5.0)), HasSubstr("coefficient"));
}

}  // namespace
}  // namespace torsio
