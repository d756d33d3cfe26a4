#include "torsio/core/units.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(Units, PoundsAndOuncesAreKnown) {
  EXPECT_NEAR(find_unit("lbft")->si(1.0), 1.3558179483314004, 1e-12);
  EXPECT_NEAR(find_unit("lbin")->si(12.0), find_unit("lbft")->si(1.0), 1e-12);
  EXPECT_NEAR(find_unit("ozin")->si(16.0), find_unit("lbin")->si(1.0), 1e-12);
}

TEST(Units, TakeTheLongestSuffixThatIsKnown) {
  const auto rate = split_channel_name("spring_deflection_rate_deg_s");
  ASSERT_TRUE(rate);
  EXPECT_EQ(rate->quantity, "spring_deflection_rate");
  EXPECT_EQ(rate->si(), "spring_deflection_rate_rad_s");
  const auto time = split_channel_name("t_ms");
  ASSERT_TRUE(time);
  EXPECT_EQ(time->si(), "t_s");
  EXPECT_DOUBLE_EQ(time->unit->si(250.0), 0.25);
}

TEST(Units, RefuseNamesWithoutUnitOrQuantity) {
  EXPECT_FALSE(split_channel_name("torque"));
  EXPECT_FALSE(split_channel_name("_Nm"));
  EXPECT_FALSE(split_channel_name("test_nr"));
  EXPECT_FALSE(split_channel_name(""));
}

TEST(Units, ConvertToSi) {
  EXPECT_DOUBLE_EQ(find_unit("rpm")->si(60.0), 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(find_unit("degC")->si(20.0), 293.15);
  EXPECT_DOUBLE_EQ(find_unit("Nm_deg")->si(1.0), 180.0 / std::numbers::pi);
  EXPECT_EQ(find_unit("furlong"), nullptr);
}

TEST(Units, EverySiSuffixIsItselfKnownAndNeutral) {
  for (const Unit& unit : known_units()) {
    const Unit* si = find_unit(unit.si_suffix);
    ASSERT_NE(si, nullptr) << unit.suffix;
    EXPECT_EQ(si->si(3.0), 3.0) << unit.suffix;
  }
}

TEST(Units, ReadQuantities) {
  EXPECT_DOUBLE_EQ(si_quantity("50 ms", "s", "embargo"), 0.05);
  EXPECT_DOUBLE_EQ(si_quantity("10Hz", "Hz", "cut-off"), 10.0);
  EXPECT_DOUBLE_EQ(si_quantity("0.5", "s", "embargo"), 0.5);
  EXPECT_THROW((void)si_quantity("5 Nm", "s", "embargo"), UsageError);
  EXPECT_THROW((void)si_quantity("soon", "s", "embargo"), UsageError);
  EXPECT_THROW((void)si_quantity("nan", "s", "embargo"), UsageError);
  EXPECT_THROW((void)si_quantity("1e308min", "s", "embargo"), UsageError);
}

TEST(Units, HaveLabelsForPeople) {
  EXPECT_EQ(unit_label("torque_Nm"), "Nm");
  EXPECT_EQ(unit_label("joint_speed_rad_s"), "rad/s");
  EXPECT_EQ(unit_label("gain_1"), "");
}

}  // namespace
}  // namespace torsio
