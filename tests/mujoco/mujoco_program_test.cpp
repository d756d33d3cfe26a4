// torsio export --mjcf and the example, as a user calls them.
#include <gtest/gtest.h>

#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ExportToMujoco : public Program {
 protected:
  void SetUp() override {
    for (const char* const call :
         {"simulate dfki-50 random-walk --duration 60s -o walk.csv",
          "fit walk.csv --model grey_box --set residual=none --inputs 'spring_deflection_rad, "
          "lowpass(rate(spring_deflection_rad), 10Hz)' -o joint.safetensors"}) {
      const Outcome outcome = torsio(call);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    }
  }
  void expect_refused(const std::string& flags, const std::string& text) {
    const Outcome outcome = torsio("export joint.safetensors " + flags);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << flags << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << flags << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(ExportToMujoco, WritesAJointThatTheExampleSteps) {
  const Outcome written = torsio("export joint.safetensors --mjcf -o elbow.xml");
  EXPECT_EQ(written.exit_code, 0) << written.err;
  EXPECT_NE(written.out.find("elbow.xml written: grey_box, 1000 Hz, dfki-50"), std::string::npos);
  const Outcome example =
      shell(TORSIO_EXAMPLES "/example_14_step_mujoco_joint joint.safetensors elbow.xml");
  EXPECT_EQ(example.exit_code, 0) << example.err;
  EXPECT_EQ(example.out.find("fault"), std::string::npos) << example.out;
  EXPECT_NE(example.out.find("t = 1.0 s: gear"), std::string::npos) << example.out;
}

TEST_F(ExportToMujoco, RefusesWrongCallsBeforeItWrites) {
  ASSERT_EQ(torsio("export joint.safetensors --mjcf -o elbow.xml").exit_code, 0);
  const std::string before = contents("elbow.xml");
  expect_refused("--mjcf --linear-spring -o elbow.xml", "the file exists");
  EXPECT_EQ(contents("elbow.xml"), before);
  expect_refused("--mjcf -o 1a.xml", "an identifier");
  expect_refused("--mjcf -o a.txt", "ends in .xml");
  expect_refused("--mjcf --real float -o b.xml", "belongs to --c99");
  expect_refused("--mjcf --c99 b -o b.xml", "one target at a time");
  expect_refused("--mjcf --actuator elbow -o b.xml", "dfki-28, dfki-50");
  expect_refused("--mjcf -o nowhere/b.xml", "there is no folder");
  expect_refused("--c99 b --linear-spring -o b", "belongs to --mjcf");
  EXPECT_EQ(contents("b.xml"), "");
  EXPECT_EQ(
      torsio("export joint.safetensors --mjcf --linear-spring --overwrite -o elbow.xml").exit_code,
      0);
  EXPECT_NE(contents("elbow.xml").find("biastype=\"affine\""), std::string::npos);
}

}  // namespace
}  // namespace torsio::test
