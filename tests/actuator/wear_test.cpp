#include "torsio/actuator/wear.hpp"

#include <gtest/gtest.h>

#include <variant>

#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kNaN;

TEST(Wear, ChangesNothingByDefault) {
  const OperatingConditions conditions;
  check(conditions);
  EXPECT_EQ(friction_factor(temperature(conditions, 0.0)), 1.0);
  EXPECT_EQ(friction_factor(temperature(conditions, 1e4)), 1.0);
  for (const DataSheet& sheet : data_sheets()) {
    const auto before = describe(sheet);
    const auto after = describe(aged(sheet, 0.0));
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(after[i].value.value, before[i].value.value) << before[i].name;
      EXPECT_EQ(after[i].value.origin, before[i].value.origin) << before[i].name;
    }
  }
}

TEST(Wear, TakesTheLimitsAsTheyAreTyped) {
  for (const char* text : {"-40degC", "85degC"})
    check({.temperature_K = si_quantity(text, "K", "test")});
  EXPECT_EQ(friction_factor(si_quantity("25degC", "K", "test")), 1.0);
}

TEST(Wear, FrictionFallsWithTheTemperature) {
  EXPECT_NEAR(friction_factor(273.15), 1.517, 1e-3);
  EXPECT_NEAR(friction_factor(323.15), 0.659, 1e-3);
}

TEST(Wear, WarmsUpWithItsTimeConstant) {
  const OperatingConditions conditions{
      .temperature_K = 283.15, .warm_up_K = 20.0, .warm_up_time_s = 600.0};
  EXPECT_EQ(temperature(conditions, 0.0), 283.15);
  EXPECT_NEAR(temperature(conditions, 600.0), 283.15 + 20.0 * 0.632, 0.01);
  EXPECT_NEAR(temperature(conditions, 1e5), 303.15, 1e-6);
}

TEST(Wear, AnAgedSpringIsSofterAndRubsAndPlaysMore) {
  const DataSheet sheet = data_sheet("dfki-50");
  const auto& fresh = std::get<SpringSheet>(sheet.second);
  const DataSheet worn_sheet = aged(sheet, 0.5);
  const auto& worn = std::get<SpringSheet>(worn_sheet.second);
  EXPECT_NEAR(worn.stiffness_Nm_rad.value, 0.95 * fresh.stiffness_Nm_rad.value, 1e-9);
  EXPECT_NEAR(worn.friction_Nm.value, 1.5 * fresh.friction_Nm.value, 1e-12);
  EXPECT_NEAR(worn.half_gap_rad.value, 2.0 * fresh.half_gap_rad.value, 1e-12);
  EXPECT_EQ(worn.stiffness_Nm_rad.origin, Origin::assumed);
  EXPECT_EQ(worn_sheet.motor.torque_constant_Nm_A.origin, Origin::derived);
}

TEST(Wear, EveryActuatorCanAge) {
  for (const DataSheet& sheet : data_sheets()) {
    const auto before = describe(sheet);
    const auto after = describe(aged(sheet, 1.0));
    std::size_t changed = 0;
    for (std::size_t i = 0; i < before.size(); ++i)
      changed += after[i].value.value != before[i].value.value ? 1U : 0U;
    EXPECT_GT(changed, 3U) << sheet.name;
  }
}

TEST(Wear, RefusesWhatNoBenchReaches) {
  const auto message = [](const OperatingConditions& conditions) {
    return error_message([&] { check(conditions); });
  };
  EXPECT_EQ(message({.temperature_K = 40.0}),
            "temperature: expected 233.15 to 358.15 K (-40 to 85 degC), found 40");
  EXPECT_NE(message({.temperature_K = kNaN}).find("temperature: expected"), std::string::npos);
  EXPECT_NE(message({.warm_up_K = 80.0}).find("temperature after the warm-up"), std::string::npos);
  EXPECT_NE(message({.warm_up_time_s = 0.0}).find("at least 1 s"), std::string::npos);
  EXPECT_NE(message({.age = 1.1}).find("age: expected 0 to 1, found 1.1"), std::string::npos);
  EXPECT_NE(message({.age = kNaN}).find("age: expected 0 to 1"), std::string::npos);
}

}  // namespace
}  // namespace torsio
