// Torque loops on each actuator: margins, passivity, and the stiffest passive impedance.
//   05_choose_loop_gains [BANDWIDTH_RAD_S]
#include <cstdio>
#include <cstdlib>

#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/error.hpp"

namespace {

constexpr double kRate_Hz = 1000.0;
constexpr double kPassiveTo_rad_s = 60.0;

void print(const torsio::Margins& margins) {
  std::printf(" %6.1f %6.1f", torsio::deg_from_rad(margins.phase_rad), margins.gain);
}

void deflection_loop(const torsio::DataSheet& sheet, double bandwidth_rad_s) {
  using torsio::JointOutput;
  const torsio::SeriesElasticJoint joint = torsio::series_elastic_joint(sheet);
  const torsio::DeflectionController loop({.joint = joint, .bandwidth_rad_s = bandwidth_rad_s},
                                          kRate_Hz);
  std::printf("%-13s %8.4g", sheet.name.data(), joint.stiffness_Nm_rad);
  print(loop.margins_of(loop.gains(), JointOutput::locked));
  print(loop.margins_of(loop.gains(), JointOutput::free));
  std::printf(" %8.0f", torsio::passivity(joint, loop.feedback()).passive_to_rad_s);
  for (const double damping_s : {0.0, 0.01})
    std::printf(" %8.1f", torsio::passive_stiffness(loop, damping_s * joint.stiffness_Nm_rad,
                                                    kPassiveTo_rad_s, 40.0));
  std::puts("");
}

void tube_loop(const char* actuator, double torque_Nm_rad) {
  const auto settings =
      torsio::tube_impedance_settings(torsio::data_sheet(actuator), {0.0, 0.0, torque_Nm_rad});
  std::printf("%-21s %5.1f", actuator, torque_Nm_rad);
  for (const double damping_Nms_rad : {0.0, 10.0, 30.0})
    std::printf(" %8.0f",
                torsio::passive_stiffness(settings, damping_Nms_rad, kPassiveTo_rad_s, kRate_Hz));
  std::puts("");
}

int run(double bandwidth_rad_s) {
  std::puts(
      "              spring    locked: deg, gain   free   passive to   stiffest at D = 0, 0.01 s "
      "K");
  for (const torsio::DataSheet& sheet : torsio::data_sheets()) {
    if (sheet.family != torsio::ActuatorFamily::harmonic_drive)
      deflection_loop(sheet, bandwidth_rad_s);
  }
  std::puts("\ntube                  K_tp   stiffest at D = 0, 10, 30 Nms/rad");
  for (const char* actuator : {"harmonic-drive", "harmonic-drive:soft"}) {
    for (const double torque_Nm_rad : {0.5, 1.0, 2.0, 5.0}) tube_loop(actuator, torque_Nm_rad);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const double bandwidth_rad_s = argc > 1 ? std::atof(argv[1]) : 50.0;
  if (!(bandwidth_rad_s > 0.0)) {
    std::fprintf(stderr, "usage: %s [BANDWIDTH_RAD_S] (a number above 0)\n", argv[0]);
    return 2;
  }
  try {
    return run(bandwidth_rad_s);
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
