// A servo without a torque sensor: what its goals and a pendulum determine.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "real_data/real_data.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {
namespace {

constexpr DriveTerm kTerms[] = {
    DriveTerm::base,          DriveTerm::delay,           DriveTerm::load_friction,
    DriveTerm::load_stribeck, DriveTerm::resistance_rise, DriveTerm::duty_exponent,
    DriveTerm::stribeck};

DriveTerms servo_terms() {
  DriveTerms terms;
  for (const DriveTerm term : kTerms) terms.set(static_cast<std::size_t>(term));
  return terms;
}

DriveIdentification identified_xl330(const std::string& group_by, const IdentifyOptions& more) {
  const std::vector<Recording> recordings = load_recordings(manifest_path("xl330"));
  const LoadSheet load = parse_load_sheet(
      "load: {pendulum: {mass: mass_kg, length: length_m, arm_mass: arm_mass_kg}}", "load.yaml");
  IdentifyOptions options = more;
  options.terms = servo_terms();
  options.group_by = group_by;
  return identify_drive(recordings, load, assumed_drive_sheet(recordings.front()), options);
}

TEST(Xl330, IsSimulatedFromItsGoalsAtAGainThatWasLeftOut) {
  TORSIO_NEEDS_DATA("xl330");
  const DriveIdentification found = identified_xl330("kp_1", {});
  EXPECT_EQ(found.recordings.size(), 16U);
  EXPECT_EQ(found.groups, 4U);
  EXPECT_LT(found.held_out_mae_rad, 0.035);  // the best of BAM's models has .053
  EXPECT_NEAR(found.error_gain->value_1_rad, 4096.0 / (2.0 * M_PI) / (256.6 * 885.0), 2e-5);
  for (const IdentifiedDriveParameter& parameter : found.parameters)
    EXPECT_TRUE(std::isfinite(parameter.standard_error));
}

TEST(Xl330, IsSimulatedFromItsGoalsOnATrajectoryThatWasLeftOut) {
  TORSIO_NEEDS_DATA("xl330");
  const DriveIdentification found = identified_xl330("trajectory", {.has_standard_errors = false});
  EXPECT_EQ(found.groups, 4U);
  EXPECT_LT(found.held_out_mae_rad, 0.050);  // BAM's best has .066
}

}  // namespace
}  // namespace torsio
