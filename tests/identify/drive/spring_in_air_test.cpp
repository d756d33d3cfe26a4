#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/identify/drive/write_drive.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using ::testing::HasSubstr;

Recording in_air(const std::string& experiment, std::uint64_t seed) {
  ExperimentSpec spec{.actuator = "dfki-120:bouc-wen",
                      .experiment = experiment,
                      .seed = seed,
                      .duration_s = 15.0,
                      .lever_m = 0.35,
                      .with_truth = true};
  spec.angle_amplitude_rad = rad_from_deg(20.0);
  return simulate(spec);
}

LoadSheet load() {
  return parse_load_sheet(
      fmt::format("load: {{pendulum: {{mass: mass_kg, length: lever_m}}, joint_inertia: {}kg_m2}}",
                  data_sheet("dfki-120").joint.inertia_kg_m2.value),
      "load.yaml");
}

struct InTheAir {
  std::vector<Recording> recordings;
  DriveIdentification drive;
};

/// Its steps reach the speed at which the supply leaves no torque.
const InTheAir& identified() {
  using enum DriveTerm;
  static const InTheAir once = [] {
    InTheAir made{.recordings = {in_air("air-chirp", 1), in_air("air-steps", 2)}, .drive = {}};
    made.drive =
        identify_drive(made.recordings, load(), assumed_drive_sheet(made.recordings.front()),
                       {.terms = drive_terms({base, delay, load_friction, speed_limit, spring,
                                              hysteresis, bearing, presliding}),
                        .starts = 2,
                        .has_standard_errors = false});
    return made;
  }();
  return once;
}

TEST(SpringInTheAir, IsIdentifiedFromTheEncoderOfTheMotorAndTheCommand) {
  const DriveIdentification& found = identified().drive;
  EXPECT_NEAR(at(found.values, DriveParameter::armature), 120.0 * 120.0 * 1.2e-4, 0.05 * 1.73);
  EXPECT_NEAR(at(found.values, DriveParameter::coulomb), 14.0, 1.0);
  EXPECT_NEAR(at(found.values, DriveParameter::no_load_speed), 48.0 / (120.0 * 0.18), 0.05 * 2.22);
  EXPECT_NEAR(at(found.values, DriveParameter::stiffness), 1134.0, 0.05 * 1134.0);

  const Recording test = in_air("air-multisine", 3);
  const std::vector<double>& torque_Nm = test.channel("truth_spring_torque_Nm").values;
  const DriveTrace trace = simulate_drive(found, test);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t n = 0; n < torque_Nm.size(); ++n) {
    error += std::pow(trace.joint_torque_Nm[n] - torque_Nm[n], 2);
    size += torque_Nm[n] * torque_Nm[n];
  }
  EXPECT_LT(std::sqrt(error / size), 0.1);
}

TEST(SpringInTheAir, GivesIsaacLabTheLimitOfTheSupply) {
  const WrittenDrive lab = write_drive(DriveTarget::isaaclab, identified().drive,
                                       identified().recordings, "elbow", {.starts = 1});
  EXPECT_THAT(lab.text, HasSubstr("DCMotorCfg("));
  const std::size_t at = lab.text.find("velocity_limit=");
  ASSERT_NE(at, std::string::npos) << lab.text;
  EXPECT_NEAR(std::stod(lab.text.substr(at + 15)), 48.0 / (120.0 * 0.18), 0.5) << lab.text;
  EXPECT_THAT(lab.not_expressed, ::testing::Contains("delay"));
}

}  // namespace
}  // namespace torsio
