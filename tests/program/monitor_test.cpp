// A monitor that is calibrated, replayed and refused, as a user calls it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class MonitorVerb : public Program {
 protected:
  /// Two models, a monitor of them, a sound recording and one with a fault at 10 s.
  void calibrate() {
    ASSERT_EQ(
        shell("{torsio} simulate dfki-50 sweep --duration 60s --lever 0.24m -o a.csv").exit_code,
        0);
    ASSERT_EQ(
        torsio("simulate dfki-50 sweep --duration 60s --lever 0.2m --seed 2 -o b.csv").exit_code,
        0);
    ASSERT_EQ(
        torsio("simulate dfki-50 sweep --duration 60s --lever 0.2m --seed 3 -o c.csv").exit_code,
        0);
    ASSERT_EQ(torsio("fit a.csv b.csv --model grey_box --set residual=none -o spring.safetensors")
                  .exit_code,
              0);
    ASSERT_EQ(
        torsio("fit a.csv b.csv --model linear --set rates=true -o current.safetensors --inputs "
               "'lowpass(motor_current_A, 20Hz), tanh(lowpass(rate(motor_angle_rad), 20Hz) / 2), "
               "lowpass(rate(motor_angle_rad), 20Hz)'")
            .exit_code,
        0);
    const Outcome outcome =
        torsio(kCalibrate + "--false-alarms-per-hour 200 --required 60Nm --persistence 8ms");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("spring, current"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("detected in these states Nm"), std::string::npos) << outcome.out;
  }
  void expect_refused(const std::string& call, int exit_code, const std::string& text) {
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, exit_code) << call << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << call << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }

  const std::string kCalibrate =
      "monitor --calibrate b.csv c.csv -o j.monitor.json --source "
      "spring=spring.safetensors:gear_encoder+joint_encoder --source "
      "current=current.safetensors:current_sensor --device-serial J-07 --valid-until 2099-01-01 ";
};

TEST_F(MonitorVerb, FindsAFaultInARecordingAndPassesASoundOne) {
  calibrate();
  const Outcome sound = torsio("monitor j.monitor.json c.csv -o torque.csv --json sound.json");
  ASSERT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_NE(sound.err.find("the monitor is that of device J-07"), std::string::npos) << sound.err;
  const auto file = nlohmann::json::parse(contents("j.monitor.json"));
  EXPECT_EQ(file.at("persistence_s"), 0.008);
  EXPECT_FALSE(file.at("pairs").at(0).at("largest_armed_Nm").is_null());
  EXPECT_NE(sound.out.find("c: no stop from"), std::string::npos) << sound.out;
  EXPECT_TRUE(nlohmann::json::parse(contents("sound.json"))
                  .at("recordings")
                  .at(0)
                  .at("stopped_at_s")
                  .is_null());
  const std::string csv = contents("torque.csv");
  const std::size_t second = csv.find('\n') + 1;
  EXPECT_NE(csv.substr(0, second).find(
                "spring_torque_Nm,spring_fault_1,current_torque_Nm,current_fault_1,"
                "monitor_state_1,fault_1\n"),
            std::string::npos)
      << csv.substr(0, second);
  const std::string first_row = csv.substr(second, csv.find('\n', second) - second);
  EXPECT_TRUE(first_row.ends_with(",nan,3,nan,3,0,3")) << "warming up: " << first_row;
  EXPECT_EQ(torsio("check torque.csv").err.find("expected a number"), std::string::npos);

  ASSERT_EQ(shell("printf 'faults:\n  - {sensor: joint_angle_rad, fault: jump, at: 20s, by: "
                  "2deg}\n' > f.yaml")
                .exit_code,
            0);
  ASSERT_EQ(
      torsio(
          "simulate dfki-50 sweep --duration 30s --lever 0.2m --seed 3 --faults f.yaml -o bad.csv")
          .exit_code,
      0);
  const Outcome bad = torsio("monitor j.monitor.json bad.csv --plot stop.svg --json -");
  ASSERT_EQ(bad.exit_code, 0) << bad.err;
  const auto row = nlohmann::json::parse(bad.out).at("recordings").at(0);
  EXPECT_GE(row.at("stopped_at_s"), 20.0);
  EXPECT_LE(row.at("stopped_at_s"), 20.02);
  EXPECT_FALSE(row.at("events").empty());
  EXPECT_NE(contents("stop.svg").find("<svg"), std::string::npos);
}

TEST_F(MonitorVerb, RefusesWhatDoesNotBelongTogether) {
  calibrate();
  expect_refused(kCalibrate + "--false-alarms-per-hour 1", 1, "support no smaller one");
  expect_refused("monitor j.monitor.json c.csv --device-serial J-08", 1, "'J-07'");
  expect_refused("monitor j.monitor.json", kCallWasWrong, "a monitor file and recordings");
  expect_refused("monitor --calibrate c.csv -o x.json", kCallWasWrong, "--source");
  expect_refused("monitor --calibrate c.csv --source spring=spring.safetensors", kCallWasWrong,
                 "-o FILE");
  expect_refused("monitor --calibrate c.csv --source spring -o x.json", kCallWasWrong,
                 "NAME=MODEL");
  expect_refused(kCalibrate + "--false-alarms-per-hour 200 --signal no_such_channel_rad", 1,
                 "no_such_channel_rad");
  ASSERT_EQ(shell("cut -d, -f1-3 c.csv > short.csv").exit_code, 0);
  expect_refused("monitor j.monitor.json short.csv", 1, "short: there is no channel");
  ASSERT_EQ(shell("cp j.monitor.json keep.json; sed -i s/2099-01-01/2020-01-01/ j.monitor.json")
                .exit_code,
            0);
  expect_refused("monitor j.monitor.json c.csv", 1, "expired on 2020-01-01");
  ASSERT_EQ(
      shell("cp keep.json j.monitor.json; cp current.safetensors spring.safetensors").exit_code, 0);
  expect_refused("monitor j.monitor.json c.csv", 1, "hash");
}

TEST_F(MonitorVerb, RefusesWhatCannotMonitorBeforeAnyWork) {
  calibrate();
  const std::string start =
      "monitor --calibrate b.csv c.csv -o x.json --source spring=spring.safetensors:a ";
  expect_refused(start, kCallWasWrong, "at least two --source");
  expect_refused(start + "--source again=spring.safetensors:b", kCallWasWrong,
                 "the same model for spring and again");
  const std::string both = start + "--source current=current.safetensors:a ";
  for (const char* const date :
       {"2027-13-22", "2099-02-30", "2099-00-00", "2020-01-01", "tomorrow"})
    expect_refused(both + "--valid-until " + date, kCallWasWrong, "--valid-until");
  expect_refused(both + "--signal 'motor_current_A moves with gear_angle_rad'", kCallWasWrong,
                 "add --signal 'gear_angle_rad'");
  EXPECT_EQ(contents("x.json"), "");
  expect_refused("monitor c.csv j.monitor.json", kCallWasWrong, "the monitor file first");
  expect_refused("monitor j.monitor.json c.csv --plot stop.gif", kCallWasWrong, ".svg");
  ASSERT_EQ(shell("touch simm").exit_code, 0);
  expect_refused("monitor --actuator dfki-50 --monitors simm/x", kCallWasWrong, "--monitors");
}

// Only the mapping of the first source was once used.
TEST_F(MonitorVerb, RefusesSourcesWithDifferentMappings) {
  calibrate();
  for (const char* const offset : {"30", "33"})
    ASSERT_EQ(shell(std::string("printf 'channels:\n  joint_angle_rad: {from: joint_angle_rad, "
                                "offset: ") +
                    offset + "deg}\n' > m" + offset + ".yaml")
                  .exit_code,
              0);
  ASSERT_EQ(torsio("fit a.csv b.csv --model linear --mapping m30.yaml -o m30.safetensors "
                   "--inputs motor_current_A")
                .exit_code,
            0);
  ASSERT_EQ(torsio("fit a.csv b.csv --model linear --mapping m33.yaml -o m33.safetensors "
                   "--inputs motor_angle_rad")
                .exit_code,
            0);
  const std::string call =
      "monitor --calibrate b.csv c.csv -o x.json --source one=m30.safetensors:a --source "
      "two=m33.safetensors:b --false-alarms-per-hour 200 ";
  expect_refused(call, kWorkFailed, "m33.safetensors: mapping");
  expect_refused(call, kWorkFailed, "with which m30.safetensors was trained");
  EXPECT_EQ(torsio(call + "--mapping m30.yaml").err.find("m33.safetensors: mapping"),
            std::string::npos);
}

// Options that a call does not use were once ignored: a fault that was not injected read as one
// that was missed.
TEST_F(MonitorVerb, RefusesOptionsThatACallDoesNotUse) {
  for (const char* const call :
       {"monitor j.json log.csv --inject kt=-20%@3s", "monitor j.json log.csv --faults f.yaml",
        "monitor j.json log.csv --extrapolate",
        "monitor --calibrate --actuator dfki-50 -o x.json --extrapolate",
        "monitor --calibrate --actuator dfki-50 -o x.json --valid-until 2027-01-01",
        "monitor --calibrate --actuator dfki-50 -o x.json log.csv",
        "monitor --calibrate log.csv -o x.json --source a=b --plot x.svg",
        "monitor --campaign --plot x.svg", "monitor --campaign log.csv",
        "monitor --campaign -o x.csv", "monitor --accuracy 1 --inject kt=-20%@3s",
        "monitor --actuator dfki-50 --device-serial J-07"})
    expect_refused(call, kCallWasWrong, "only what it uses");
}

TEST_F(MonitorVerb, RefusesFaultsThatASimulatedJointCannotHave) {
  expect_refused("monitor --actuator no-such-joint", kCallWasWrong, "dfki-50");
  expect_refused("monitor --actuator elastomer --inject joint_angle=1deg@2s", kCallWasWrong,
                 "joint_angle");
  expect_refused("monitor --actuator dfki-50 --inject kt=-20%", kCallWasWrong, "kt");
  expect_refused("monitor --actuator dfki-50 --inject kt=-20%@3s --duration 1parsec", kCallWasWrong,
                 "--duration");
  expect_refused("monitor x.json y.json --actuator dfki-50", kCallWasWrong,
                 "at most a monitor file");
}

}  // namespace
}  // namespace torsio::test
