#include "torsio/sim/contacts/learn_contacts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>

#include "numerics/event_bounds.hpp"
#include "sim/contacts/arm_free_motion.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kLearnedHours = 0.1;

/// Learned once for all tests of this file.
const LearnedContacts& learned() {
  static const LearnedContacts of =
      learn_contacts(arm6_setup(), {.hours = kLearnedHours, .seed = 5});
  return of;
}

ArmController::Settings with_contacts() {
  ArmController::Settings settings = arm_controller_settings(arm6_setup());
  settings.contacts = learned().file.settings();
  return settings;
}

TEST(LearnContacts, ItsErrorBarsAreRightOnOtherMotion) {
  ASSERT_EQ(learned().joints.size(), 6U);
  for (const LearnedContacts::Joint& joint : learned().joints) {
    EXPECT_GT(joint.mean_variance_ratio, 0.6);
    EXPECT_LT(joint.mean_variance_ratio, 1.7);
  }
  EXPECT_EQ(learned().file.upper_bound_per_hour, 3.0 / kLearnedHours);
  for (const ContactsFile::Joint& joint : learned().file.joints)
    EXPECT_GE(joint.detector.factor, 1.5);
}

// 30 per hour were wanted: in 6 minutes of other motion 3 are expected. 10 or more would have a probability of 0.1 %.
TEST(LearnContacts, ItsRateOfFalseAlarmsHoldsOnOtherMotion) {
  const ArmSetup setup = arm6_setup();
  ArmFreeMotion motion(setup, with_contacts(), FirstStageForm::rigid, 91);
  std::size_t alarms = 0;
  bool was_found = false;
  for (int tick = 0; tick < 360'000; ++tick) {
    const ArmController::Output& output = motion.control();
    if (output.contact.is_found && !was_found) ++alarms;
    was_found = output.contact.is_found;
    motion.act({});
  }
  RecordProperty("false_alarms", std::to_string(alarms));
  EXPECT_LT(alarms, 10U);
}

TEST(LearnContacts, FindsAPushOnTheFlange) {
  const ArmSetup setup = arm6_setup();
  ArmFreeMotion motion(setup, with_contacts(), FirstStageForm::rigid, 17);
  for (int tick = 0; tick < 1500; ++tick) {
    EXPECT_FALSE(motion.control().contact.is_found) << tick;
    motion.act({});
  }
  int latency = 0;
  while (latency < 200 && !motion.control().contact.is_found) {
    motion.act({.force_N = {0.0, 60.0, 60.0}});
    ++latency;
  }
  RecordProperty("latency_ms", std::to_string(latency));
  EXPECT_LT(latency, 60);
}

TEST(LearnContacts, RefusesARateThatTheHoursDoNotSupport) {
  const auto message = [](double hours, double rate) {
    return test::error_message([&] {
      (void)learn_contacts(arm6_setup(), {.hours = hours, .false_alarms_per_hour = rate});
    });
  };
  EXPECT_THAT(message(1.0, 0.5), AllOf(HasSubstr("at least 3 per hour"), HasSubstr("found 0.5"),
                                       HasSubstr("Move for 6 hours or more")));
  EXPECT_THAT(message(0.0, 0.0), HasSubstr("hours"));
  EXPECT_THAT(message(1e6, 0.0), HasSubstr("hours"));
  EXPECT_THAT(message(std::nan(""), 0.0), HasSubstr("hours"));
  EXPECT_THAT(message(1.0, -1.0), HasSubstr("a rate above 0"));
  EXPECT_THAT(message(1.0, std::nan("")), HasSubstr("a rate above 0"));
  // The rule is the 95 % bound of a Poisson count of which none occurred.
  EXPECT_NEAR(supported_rate_per_hour(1.0), poisson_upper_95(0), 0.005);
}

}  // namespace
}  // namespace torsio
