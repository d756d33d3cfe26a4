// Our margins against those of Octave's control package (make_control_oracles.m).
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <string>

#include "control/design/loop_design.hpp"
#include "golden_file.hpp"
#include "torsio/control/deflection_controller.hpp"

namespace torsio {
namespace {

using test::golden;
using test::Json;

SeriesElasticJoint joint_of(const Json& each) {
  return {.drive = {.ratio = each["ratio"],
                    .torque_constant_Nm_A = each["torque_constant_Nm_A"],
                    .rotor_inertia_kg_m2 = each["rotor_inertia_kg_m2"],
                    .viscous_Nms_rad = each["viscous_Nms_rad"],
                    .rated_current_A = 5.0,
                    .peak_current_A = 10.0,
                    .current_time_constant_s = each["current_time_constant_s"],
                    .supply_V = 48.0,
                    .resistance_Ohm = 0.5},
          .stiffness_Nm_rad = each["stiffness_Nm_rad"],
          .joint_inertia_kg_m2 = each["joint_inertia_kg_m2"],
          .joint_viscous_Nms_rad = each["joint_viscous_Nms_rad"]};
}

LinearSystem loop_of(const Json& each) {
  const DeflectionController controller({.joint = joint_of(each),
                                         .gains = Pid::Gains{.proportional = each["proportional"],
                                                             .integral = each["integral"],
                                                             .derivative = each["derivative"]},
                                         .rate_cutoff_Hz = each["cutoff_Hz"]},
                                        each["sample_rate_Hz"]);
  return open_loop(joint_of(each), controller.feedback(),
                   each["is_free"].get<bool>() ? JointOutput::free : JointOutput::locked);
}

TEST(Golden, ADeflectionLoopHasTheFrequencyResponseOfOctave) {
  for (const Json& each : golden("control.json")) {
    const LinearSystem loop = loop_of(each);
    for (std::size_t i = 0; i < each["real"].size(); ++i) {
      const std::complex<double> expected(each["real"][i], each["imag"][i]);
      const auto found = loop.response(each["frequencies_rad_s"][i]);
      EXPECT_LT(std::abs(found - expected), 2e-5 * std::abs(expected)) << each.dump();
    }
  }
}

TEST(Golden, ADeflectionLoopHasTheMarginsOfOctave) {
  for (const Json& each : golden("control.json")) {
    const Margins found = margins(loop_of(each));
    EXPECT_TRUE(found.is_stable);
    // Ours has the angle of the joint besides, which stays where it is.
    const double radius = each["is_free"].get<bool>() ? 1.0 : each["radius"].get<double>();
    EXPECT_NEAR(loop_of(each).closed().spectral_radius(), radius, 2e-6) << each.dump();
    EXPECT_NEAR(found.gain, each["gain"], 1e-4 * found.gain) << each.dump();
    EXPECT_NEAR(found.gain_rad_s, each["gain_rad_s"], 1e-4 * found.gain_rad_s);
    EXPECT_NEAR(deg_from_rad(found.phase_rad), each["phase_deg"], 1e-3);
    EXPECT_NEAR(found.crossover_rad_s, each["crossover_rad_s"], 1e-4 * found.crossover_rad_s);
  }
}

}  // namespace
}  // namespace torsio
