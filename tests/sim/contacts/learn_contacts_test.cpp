#include "torsio/sim/contacts/learn_contacts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "numerics/event_bounds.hpp"
#include "sim/contacts/contact_trials.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kLearnedHours = 0.2;
constexpr double kCountedHours = 0.1;
constexpr double kFalseAlarmsPerHour = 30.0;  // twice what the learned hours support

/// Learned once for all tests of this file.
const LearnedContacts& learned() {
  static const LearnedContacts of = learn_contacts(
      arm6_setup(),
      {.hours = kLearnedHours, .false_alarms_per_hour = kFalseAlarmsPerHour, .seed = 5});
  return of;
}

ArmController::Settings with_contacts() {
  ArmController::Settings settings = arm_controller_settings(arm6_setup());
  settings.contacts = learned().file.settings();
  return settings;
}

TEST(LearnContacts, ItsErrorBarsAndItsRateOfFalseAlarmsHoldOnOtherMotion) {
  ASSERT_EQ(learned().joints.size(), 6U);
  for (const LearnedContacts::Joint& joint : learned().joints) {
    EXPECT_GT(joint.mean_variance_ratio, 0.6);
    EXPECT_LT(joint.mean_variance_ratio, 1.7);
  }
  EXPECT_EQ(learned().file.upper_bound_per_hour, 3.0 / kLearnedHours);
  for (const ContactsFile::Joint& joint : learned().file.joints)
    EXPECT_GE(joint.detector.factor, 1.5);
  // 3 alarms are the wanted rate; with that mean, 10 or more would have a probability of 0.1 %.
  const std::size_t alarms = count_false_alarms(arm6_setup(), with_contacts(), kCountedHours, 91);
  RecordProperty("false_alarms", std::to_string(alarms));
  EXPECT_LT(alarms, 10U);
}

TEST(PushTrials, AreFoundAndCorrespondForASeed) {
  const ArmSetup setup = arm6_setup();
  const PushTrials trials{.count = 10, .force_N = 100.0, .seed = 17};
  const std::vector<PushTrial> done = push_trials(setup, with_contacts(), trials);
  ASSERT_EQ(done.size(), 10U);
  std::size_t above = 0;
  std::size_t found = 0;
  for (const PushTrial& trial : done) {
    if (!trial.is_above) continue;
    ++above;
    if (trial.latency_s.value_or(1.0) <= 0.05) ++found;
  }
  RecordProperty("above", std::to_string(above));
  EXPECT_GE(above, 5U);
  EXPECT_GE(found + 1, above);
  const std::vector<PushTrial> again = push_trials(setup, with_contacts(), trials);
  for (std::size_t k = 0; k < done.size(); ++k)
    EXPECT_EQ(done[k].latency_s, again[k].latency_s) << k;
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
