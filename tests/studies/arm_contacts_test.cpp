#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "sim/contacts/contact_trials.hpp"
#include "studies/arm_springs.hpp"
#include "torsio/sim/contacts/learn_contacts.hpp"

namespace torsio {
namespace {

// One case of `torsio reproduce arm-contacts` with an hour of motion, 60 pushes above the error bars and another hour.
TEST(ArmContacts, OfAnHourAreFoundAtTheWantedRateOfFalseAlarms) {
  constexpr double kHours = 1.0;
  const ArmSetup setup = arm_of_specimens(0, 8.0);
  ArmController::Settings settings = settings_with(setup, bench_models(setup, "grey_box", 1, {}));
  settings.contacts = learn_contacts(setup, settings, {.hours = kHours, .seed = 1}).file.settings();

  std::size_t above = 0;
  std::size_t found = 0;
  for (const PushTrial& trial : push_trials(setup, settings, {.count = 90, .seed = 3})) {
    if (!trial.is_above) continue;
    ++above;
    if (trial.latency_s.value_or(1.0) <= 0.02) ++found;
  }
  RecordProperty("above", std::to_string(above));
  RecordProperty("found", std::to_string(found));
  EXPECT_GE(above, 60U);
  EXPECT_GE(static_cast<double>(found), 0.95 * static_cast<double>(above));

  const std::size_t alarms = count_false_alarms(setup, settings, kHours, 2);
  RecordProperty("false_alarms", std::to_string(alarms));
  // 3 in an hour are wanted: more than 9 would have a probability of 0.1 %.
  EXPECT_LT(alarms, 10U);
}

}  // namespace
}  // namespace torsio
