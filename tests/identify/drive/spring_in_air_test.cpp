#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

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

// Its steps reach the speed at which the supply leaves no torque.
TEST(SpringInTheAir, IsIdentifiedFromTheEncoderOfTheMotorAndTheCommand) {
  using enum DriveTerm;
  const std::vector<Recording> recordings{in_air("air-chirp", 1), in_air("air-steps", 2)};
  const DriveIdentification found =
      identify_drive(recordings, load(), assumed_drive_sheet(recordings.front()),
                     {.terms = drive_terms({base, delay, load_friction, speed_limit, spring,
                                            hysteresis, bearing, presliding}),
                      .starts = 2,
                      .has_standard_errors = false});
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

}  // namespace
}  // namespace torsio
