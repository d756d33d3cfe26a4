#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/closed_loop/spring_sheet.hpp"
#include "sim/closed_loop/tracking_parts.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kSheet;

std::string message(const TorqueReference& reference) {
  return error_message([&] { (void)reference_torque(reference, kSheet, 1); });
}

TEST(TorqueReference, HasANameThatFindsIt) {
  for (const std::string_view text : reference_names()) EXPECT_EQ(name(find_reference(text)), text);
  EXPECT_NE(error_message([] { (void)find_reference("chrip"); }).find("random-walk"),
            std::string::npos);
}

TEST(TorqueReference, LastsAsLongAndReachesAsFarAsItSays) {
  for (const TorqueReference::Kind kind :
       {TorqueReference::Kind::chirp, TorqueReference::Kind::steps, TorqueReference::Kind::sweep}) {
    const auto torque =
        reference_torque({.kind = kind, .amplitude_Nm = 7.0, .duration_s = 60.0}, kSheet, 1);
    ASSERT_EQ(torque.size(), 60000U);
    EXPECT_NEAR(std::ranges::max(torque), 7.0, 0.02) << name(kind);
  }
  EXPECT_EQ(amplitude_of({}, kSheet), 13.0);
  EXPECT_EQ(amplitude_of({}, data_sheet("dfki-120")), 20.0);
}

TEST(TorqueReference, ReplaysARecordedTorqueBetweenItsSamples) {
  const TorqueReference replay{.kind = TorqueReference::Kind::replay,
                               .recorded_Nm = std::vector<double>(400, 3.0),
                               .recorded_Hz = 100.0};
  TorqueReference ramp = replay;
  for (std::size_t i = 0; i < ramp.recorded_Nm.size(); ++i)
    ramp.recorded_Nm[i] = 0.01 * static_cast<double>(i);
  const auto torque = reference_torque(ramp, kSheet, 1);
  ASSERT_EQ(torque.size(), 4000U);
  EXPECT_NEAR(torque[1234], 1.234, 1e-9);
  EXPECT_EQ(amplitude_of(replay, kSheet), 3.0);
}

TEST(TorqueReference, BeyondTheRatingOrWithoutNumbersIsRefused) {
  EXPECT_NE(message({.amplitude_Nm = 51.0}).find("rated for"), std::string::npos);
  // A walk's standard deviations reach further than its chirp.
  EXPECT_NE(
      message({.kind = TorqueReference::Kind::random_walk, .amplitude_Nm = 40.0}).find("rated for"),
      std::string::npos);
  EXPECT_NE(message({.amplitude_Nm = -1.0}).find("above 0"), std::string::npos);
  EXPECT_NE(message({.duration_s = 1.0}).find("3 to 3600 s"), std::string::npos);
  EXPECT_NE(message({.kind = TorqueReference::Kind::replay}).find("a recording"),
            std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message({.kind = TorqueReference::Kind::replay,
                     .recorded_Nm = std::vector<double>(4000, nan)})
                .find("above 0"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio
