// `check` of recordings of a drive, which `identify` would use.
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class CheckDriveProgram : public Program {
 protected:
  void SetUp() override {
    for (const char* const seed : {"1", "2"})
      ASSERT_EQ(torsio(std::string("simulate dfki-50 air-chirp --duration 8s --lever 0.2m --mass "
                                   "9kg --seed ") +
                       seed + " -o air" + seed + ".csv")
                    .exit_code,
                0);
    (void)folder_.file("load.yaml", "load: {pendulum: {mass: mass_kg, length: lever_m}}\n");
    (void)folder_.file("drive.yaml",
                       "mapping: {drop: [gear_angle_rad, joint_angle_rad, torque_Nm, "
                       "torque_fresh_1]}\ntarget: motor_angle_rad\nfiles: [air1.csv, air2.csv]\n");
  }
};

TEST_F(CheckDriveProgram, NamesTheAdviceWhereTheRecordingsAreThoseOfADrive) {
  EXPECT_NE(torsio("check air1.csv --load load.yaml").err.find("--advise checks them for torsio"),
            std::string::npos);
  EXPECT_EQ(torsio("check air1.csv").err.find("--advise checks them"), std::string::npos);
}

TEST_F(CheckDriveProgram, GivesTheSameAdviceByEveryNumberOfThreads) {
  const std::string call = "check drive.yaml --load load.yaml --advise";
  const Outcome one = torsio(call + " --threads 1");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(one.out, torsio(call + " --threads 3").out);
}

}  // namespace
}  // namespace torsio::test
