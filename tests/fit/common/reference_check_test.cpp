#include "fit/common/reference_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

class ReferenceCheck : public testing::Test {
 protected:
  ReferenceCheck() {
    for (int n = 0; n < 2000; ++n) {
      estimated_.push_back(20.0 * std::sin(0.01 * n));
      measured_.push_back(18.0 * std::sin(0.01 * n - 0.1) + 3.0);
    }
  }

  [[nodiscard]] std::string message() const {
    return test::error_message([&] {
      require_plausible_reference("rec: torque_Nm", {estimated_, measured_});
    });
  }

  std::vector<double> estimated_;
  std::vector<double> measured_;
};

TEST_F(ReferenceCheck, AcceptsAnotherJoint) {
  EXPECT_NO_THROW(require_plausible_reference("rec", {estimated_, measured_}));
  for (double& value : measured_) value *= 20.0;
  EXPECT_NO_THROW(require_plausible_reference("rec", {estimated_, measured_}));
  EXPECT_NO_THROW(require_plausible_reference("rec", {}));
}

TEST_F(ReferenceCheck, RefusesAConstantAndOneThatOnlyHasNoise) {
  for (double& value : measured_) value = 3.0;
  EXPECT_THAT(message(), HasSubstr("the constant 3"));
  for (std::size_t n = 0; n < measured_.size(); ++n) measured_[n] = n % 2 == 0 ? 3.0 : 3.1;
  EXPECT_THAT(message(), HasSubstr("does not follow the motion"));
}

TEST_F(ReferenceCheck, RefusesASensorThatIsStuckInAPart) {
  for (std::size_t n = 500; n < 900; ++n) measured_[n] = measured_[499];
  EXPECT_THAT(message(), HasSubstr("does not change in a part of the motion"));
}

TEST_F(ReferenceCheck, AcceptsAShortPauseOfTheSensor) {
  for (std::size_t n = 500; n < 540; ++n) measured_[n] = measured_[499];
  EXPECT_NO_THROW(require_plausible_reference("rec", {estimated_, measured_}));
}

TEST_F(ReferenceCheck, RefusesTheOppositeSign) {
  for (double& value : measured_) value = -value;
  EXPECT_THAT(message(), HasSubstr("rec: torque_Nm: the torque has the opposite sign"));
}

TEST_F(ReferenceCheck, RefusesAnotherUnit) {
  for (double& value : measured_) value *= 1000.0;
  EXPECT_THAT(message(), HasSubstr("of another size than the model's"));
}

}  // namespace
}  // namespace torsio
