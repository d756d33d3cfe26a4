// Data sheets as files, as a user types it: --describe --yaml, simulate, track, tune-loop.
#include "program/program.hpp"

namespace torsio::test {
namespace {

class SheetFiles : public Program {
 protected:
  static void expect_refusal(const Outcome& outcome, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(SheetFiles, GiveTheRecordingOfTheBuiltInActuators) {
  for (const std::string actuator : {"dfki-28", "dfki-50:bouc-wen#03", "dfki-120:lugre", "dfki-300",
                                     "elastomer", "rubber-clutch", "harmonic-drive:soft"}) {
    SCOPED_TRACE(actuator);
    const Outcome written = torsio("simulate --describe " + actuator + " --yaml sheet.yaml");
    ASSERT_EQ(written.exit_code, 0) << written.err;
    EXPECT_NE(written.out.find("rated_torque"), std::string::npos);
    ASSERT_EQ(torsio("simulate sheet.yaml static-cycle --duration 2s -o file.csv").exit_code, 0);
    ASSERT_EQ(torsio("simulate " + actuator + " static-cycle --duration 2s -o name.csv").exit_code,
              0);
    EXPECT_EQ(contents("file.csv"), contents("name.csv"));
    EXPECT_EQ(torsio("simulate --describe sheet.yaml").out,
              torsio("simulate --describe " + actuator).out);
    EXPECT_EQ(torsio("simulate --describe sheet.yaml --yaml -").out, contents("sheet.yaml"));
  }
}

TEST_F(SheetFiles, AreTakenByTrackAndTuneLoop) {
  ASSERT_EQ(torsio("simulate --describe dfki-50 --yaml sheet.yaml").exit_code, 0);
  const std::string call = " --reference steps --duration 8s";
  EXPECT_EQ(torsio("track --actuator sheet.yaml" + call).out,
            torsio("track --actuator dfki-50" + call).out);
  const std::string file = torsio("tune-loop --actuator sheet.yaml").out;
  const std::string name = torsio("tune-loop --actuator dfki-50").out;
  EXPECT_EQ(file.substr(file.find('\n')), name.substr(name.find('\n')));
  ASSERT_EQ(
      shell("sed -i 's/^  spring_stiffness:.*/  spring_stiffness: {value: 700, unit: Nm\\/rad, "
            "origin: A}/; s/^name:.*/name: my-joint/' sheet.yaml; {torsio} tune-loop "
            "--actuator sheet.yaml")
              .out.find("spring 700 Nm/rad") == std::string::npos,
      false);
  EXPECT_NE(torsio("track --actuator sheet.yaml" + call).out.find("my-joint"), std::string::npos);
}

TEST_F(SheetFiles, AreNotReplacedAndNotGuessed) {
  ASSERT_EQ(torsio("simulate --describe dfki-50 --yaml sheet.yaml").exit_code, 0);
  const std::string before = contents("sheet.yaml");
  expect_refusal(torsio("simulate sheet.yaml static-cycle --duration 1s -o sheet.yaml"),
                 "would replace a file that is read");
  expect_refusal(torsio("simulate --describe sheet.yaml --yaml sheet.yaml"),
                 "would replace a file that is read");
  EXPECT_EQ(contents("sheet.yaml"), before);
  expect_refusal(torsio("simulate dfki-50 sweep -o a.csv --yaml b.yaml"), "--describe NAME");
  expect_refusal(torsio("simulate --describe dfki-50 --yaml b.txt"), ".yaml or .yml");
  ASSERT_EQ(
      shell("sed -i 's/gear_ratio: {value: 120/gear_ratio: {value: -120/' sheet.yaml").exit_code,
      0);
  for (const char* call : {"simulate sheet.yaml sweep -o a.csv", "simulate --describe sheet.yaml",
                           "track --actuator sheet.yaml", "tune-loop --actuator sheet.yaml"})
    expect_refusal(torsio(call), "(values.gear_ratio.value): expected 0 or more, found '-120'");
  EXPECT_EQ(contents("a.csv"), "");
}

}  // namespace
}  // namespace torsio::test
