#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <torsio/arm.hpp>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  std::ifstream file(argv[1]);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const torsio::ArmDynamics dynamics(torsio::read_urdf(text, argv[1]));
  const std::vector<double> angle_rad(dynamics.size(), 0.0);
  std::vector<double> torque_Nm(dynamics.size());
  dynamics.gravity_torque(angle_rad, torque_Nm);
  std::printf("%zu joints, weight at joint 2: %.1f Nm\n", dynamics.size(), torque_Nm.at(1));
  return 0;
}
