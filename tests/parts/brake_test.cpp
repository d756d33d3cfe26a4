#include "parts/brake.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/error_message.hpp"
#include "torsio/actuator/electrical_sheet.hpp"

namespace torsio {
namespace {

Brake::Parameters parameters() {
  return {.static_Nm = 1.0,
          .sliding_Nm = 0.8,
          .bristle_rad = 0.02,
          .stribeck_rad_s = 3.0,
          .activation_V = 24.0,
          .engage_s = 0.02,
          .release_s = 0.04};
}

/// @returns how long until it has changed, with this voltage
double time_to_change(Brake& brake, double coil_V) {
  const bool was_closed = brake.is_closed();
  double time_s = 0.0;
  for (; brake.is_closed() == was_closed && time_s < 1.0; time_s += 1e-4)
    (void)brake.step(coil_V, 0.0, 1e-4);
  return time_s;
}

TEST(Brake, OpensAndClosesAfterItsDelays) {
  Brake brake(parameters());
  EXPECT_TRUE(brake.is_closed()) << "without power it holds";
  EXPECT_NEAR(time_to_change(brake, 24.0), 0.04, 2e-4);
  EXPECT_NEAR(time_to_change(brake, 0.0), 0.02, 2e-4);
  EXPECT_GE(time_to_change(brake, 23.9), 1.0 - 1e-3) << "below the activation voltage";
  (void)time_to_change(brake, 24.0);
  EXPECT_NEAR(time_to_change(brake, std::numeric_limits<double>::quiet_NaN()), 0.02, 2e-4);
}

TEST(Brake, HoldsUpToItsStaticTorqueAndSlidesWithTheSlidingOne) {
  Brake brake(parameters());
  double max_Nm = 0.0;
  for (int n = 0; n < 100'000; ++n) max_Nm = std::max(max_Nm, brake.step(0.0, 0.05, 1e-4));
  EXPECT_NEAR(max_Nm, 1.0, 1e-3);
  for (int n = 0; n < 10'000; ++n) max_Nm = brake.step(0.0, 100.0, 1e-4);
  EXPECT_NEAR(max_Nm, 0.8, 1e-6);
  brake.reset(false);
  EXPECT_EQ(brake.step(24.0, 100.0, 1e-4), 0.0);
  EXPECT_EQ(brake.energy(), 0.0);
}

TEST(Brake, RefusesImpossibleParameters) {
  const auto refusal = [](auto change) {
    Brake::Parameters changed = parameters();
    change(changed);
    return test::error_message([&] { return Brake(changed); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& p) { p.static_Nm = 0.7; }).find("at least the sliding"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& p) { p.engage_s = -1.0; }), "");
  EXPECT_NE(refusal([](auto& p) { p.activation_V = 0.0; }), "");
}

TEST(Brake, HasTheVoltagesOfThePaper) {
  for (const char* actuator : {"dfki-28", "dfki-120", "dfki-300"}) {
    EXPECT_EQ(brake_sheet(data_sheet(actuator)).activation_V.value, 12.0) << actuator;
    EXPECT_EQ(brake_sheet(data_sheet(actuator)).activation_V.origin, Origin::printed) << actuator;
  }
  EXPECT_EQ(brake_sheet(data_sheet("dfki-50")).activation_V.value, 24.0);
  for (const DataSheet& sheet : data_sheets())
    for (const SheetRow& row : describe(brake_sheet(sheet))) EXPECT_GT(row.value.value, 0.0);
}

}  // namespace
}  // namespace torsio
