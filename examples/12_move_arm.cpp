// An arm of elastic joints from a URDF file: its weight, a move within its limits, and the torques that the move needs:
//   12_move_arm share/torsio/arm6.urdf
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "torsio/arm.hpp"

namespace {

int run(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  torsio::ArmModel arm = torsio::read_urdf(text, file);  // throws: file, line, what to do
  arm.payload = {.mass_kg = 3.0, .com_m = {0.05, 0.0, 0.0}};
  torsio::ArmDynamics dynamics(arm);

  const std::vector<double> start_rad(arm.joints.size(), 0.2);
  std::vector<double> end_rad(arm.joints.size(), -0.3);
  end_rad[0] = 1.0;
  // Real-time code from here on.
  torsio::ArmMove move(std::vector{start_rad, end_rad}, torsio::move_limits(arm), 1000.0);
  torsio::ArmDynamics::PerJoint torque_Nm = {};
  torsio::ArmDynamics::PerJoint largest_Nm = {};
  for (torsio::ArmMove::Output now = move.step(); !now.is_done; now = move.step()) {
    dynamics.inverse(now.position_rad, now.velocity_rad_s, now.acceleration_rad_s2, torque_Nm);
    for (std::size_t j = 0; j < arm.joints.size(); ++j)
      largest_Nm[j] = std::max(largest_Nm[j], std::abs(torque_Nm[j]));
  }
  std::printf("%s: %zu joints, a move of %.2f s\n", arm.name.c_str(), arm.joints.size(),
              move.duration_s());
  for (std::size_t j = 0; j < arm.joints.size(); ++j)
    std::printf("%-8s needs at most %6.1f of %5.1f Nm\n", arm.joints[j].name.c_str(), largest_Nm[j],
                arm.joints[j].effort_Nm);
  const torsio::ArmFrame flange = dynamics.flange(end_rad);
  std::printf("the flange ends at %.3f %.3f %.3f m\n", flange.position_m[0], flange.position_m[1],
              flange.position_m[2]);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? argv[1] : "share/torsio/arm6.urdf");
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
