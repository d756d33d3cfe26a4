// One bad schedule for each rule; the message must say place, problem and remedy.
#include "torsio/sim/faults/fault_schedule.hpp"

#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "support/temporary_folder.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

struct BadSchedule {
  std::string rule;
  std::string input;
  std::vector<std::string> says;
};
std::ostream& operator<<(std::ostream& out, const BadSchedule& bad) { return out << bad.rule; }

class BrokenFaultSchedule : public testing::TestWithParam<BadSchedule> {};

/// Of a call with this schedule; only a UsageError makes the program exit with 2.
std::string message_of(const std::string& schedule) {
  const TemporaryFolder folder;
  const std::string path = folder.file("faults.yaml", schedule);
  const std::string in_folder = path.substr(0, path.size() - std::string("faults.yaml").size());
  try {
    const DataSheet sheet = data_sheet("dfki-50");
    static_cast<void>(simulate({.duration_s = 4.0, .faults = read_fault_schedule(path, sheet)}));
  } catch (const UsageError& error) {
    const std::string message = error.what();
    return message.starts_with(in_folder) ? message.substr(in_folder.size()) : message;
  } catch (const Error& error) {
    return std::string("no UsageError: ") + error.what();
  }
  return "no error";
}

TEST_P(BrokenFaultSchedule, IsRefusedWithPlaceAndReason) {
  const std::string message = message_of(GetParam().input);
  for (const std::string& part : GetParam().says)
    EXPECT_NE(message.find(part), std::string::npos)
        << "wanted: " << part << "\n   got: " << message;
}

std::string rule_of(const testing::TestParamInfo<BadSchedule>& info) { return info.param.rule; }

/// A list of one fault, on the second line.
std::string one(const std::string& fault) { return "faults:\n  - {" + fault + "}\n"; }
std::string gear(const std::string& more) { return one("sensor: gear_angle_rad, " + more); }
std::string part(const std::string& more) { return one("part: " + more); }

INSTANTIATE_TEST_SUITE_P(
    All, BrokenFaultSchedule,
    testing::Values(
        BadSchedule{"NoYaml", "faults: [", {"faults.yaml: line", "this is not YAML"}},
        BadSchedule{"Empty", "", {"faults.yaml", "keys with values", "found nothing"}},
        BadSchedule{"TooLong", std::string(1100000, ' '), {"at most 1048576 bytes"}},
        BadSchedule{"OtherKey", "fault: []", {"line 1 (fault): unknown key 'fault'", "faults"}},
        BadSchedule{"NoList", "faults: freeze", {"line 1 (faults): expected a list of faults"}},
        BadSchedule{"NoFault", "faults: []", {"expected 1 to 256 faults"}},
        BadSchedule{"NoMap", "faults: [freeze]", {"(faults[0])", "found 'freeze'"}},
        BadSchedule{"TooMany",
                    [] {
                      std::string text = "faults:\n";
                      for (int i = 0; i < 257; ++i)
                        text += "  - {sensor: torque_Nm, fault: nan, at: 0s}\n";
                      return text;
                    }(),
                    {"expected 1 to 256 faults"}},
        BadSchedule{"NobodyFails", one("fault: freeze, at: 1s"), {"either a sensor or a part"}},
        BadSchedule{"BothFail",
                    one("sensor: torque_Nm, part: spring, fault: drift, at: 1s"),
                    {"either a sensor or a part"}},
        BadSchedule{"MisspeltSensor",
                    one("sensor: gear_angel_rad, fault: freeze, at: 1s"),
                    {"faults.yaml: line 2 (faults[0].sensor): expected one of motor_angle_rad, "
                     "gear_angle_rad, joint_angle_rad, motor_current_A, torque_Nm, found "
                     "'gear_angel_rad'",
                     "Did you mean 'gear_angle_rad'?"}},
        BadSchedule{"AnotherActuatorsSensor",
                    one("sensor: spring_deflection_rad, fault: freeze, at: 1s"),
                    {"(faults[0].sensor): expected one of motor_angle_rad"}},
        BadSchedule{"MisspeltPart",
                    part("sprong, fault: break, at: 1s"),
                    {"line 2 (faults[0].part): expected one of spring, friction, torque-constant",
                     "Did you mean 'spring'?"}},
        BadSchedule{
            "MisspeltFault",
            gear("fault: freze, at: 1s"),
            {"line 2 (faults[0].fault): expected one of freeze, jump, drift, sign_flip, quantised, "
             "dropout, nan, "
             "gain, spike, wrap, zero, found 'freze'",
             "Did you mean 'freeze'?"}},
        BadSchedule{"ASensorCannotBreak", gear("fault: break, at: 1s"), {"expected one of freeze"}},
        BadSchedule{"APartCannotFreeze",
                    part("spring, fault: freeze, at: 1s"),
                    {"expected one of break, bottom, found 'freeze'"}},
        BadSchedule{"MisspeltKey",
                    gear("fault: jump, at: 1s, bye: 2deg"),
                    {"line 2 (faults[0].bye): unknown key 'bye'",
                     "one of sensor, fault, at, for, by", "Did you mean 'by'?"}},
        BadSchedule{"KeyOfAnotherFault",
                    gear("fault: freeze, at: 1s, by: 2deg"),
                    {"unknown key 'by'", "one of sensor, fault, at, for"}},
        BadSchedule{"KeyTwice", gear("fault: sign_flip, at: 1s, at: 2s"), {"'at' is given twice"}},
        BadSchedule{
            "NoFaultKind", gear("at: 1s"), {"line 2 (faults[0]): the key 'fault' is missing"}},
        BadSchedule{"NoTime", gear("fault: freeze"), {"the key 'at' is missing"}},
        BadSchedule{"NoAmount", gear("fault: jump, at: 1s"), {"the key 'by' is missing"}},
        BadSchedule{"OtherUnit",
                    gear("fault: jump, at: 1s, by: 2Nm"),
                    {"line 2 (faults[0].by): expected a number in rad", "found '2Nm'"}},
        BadSchedule{"MisspeltUnit",
                    gear("fault: jump, at: 1s, by: 2dge"),
                    {"(faults[0].by): expected a number in rad", "found '2dge'"}},
        BadSchedule{"NaNAmount",
                    gear("fault: jump, at: 1s, by: nan"),
                    {"(faults[0].by): expected a number in rad", "found 'nan'"}},
        BadSchedule{"InfiniteAmount", gear("fault: jump, at: 1s, by: inf"), {"found 'inf'"}},
        BadSchedule{"HugeAmount",
                    gear("fault: jump, at: 1s, by: 1e300"),
                    {"line 2 (faults[0]): by: expected 1e-09 rad to 1e+06 rad, found 1e+300 rad"}},
        BadSchedule{
            "JumpByNothing", gear("fault: jump, at: 1s, by: 0"), {"by: expected 1e-09 rad"}},
        BadSchedule{"NegativeResolution",
                    gear("fault: quantised, at: 1s, to: -1deg"),
                    {"to: expected 1e-09 rad"}},
        BadSchedule{"TimeInMetres",
                    gear("fault: freeze, at: 1m"),
                    {"(faults[0].at): expected a number in s"}},
        BadSchedule{"NegativeTime",
                    gear("fault: freeze, at: -1s"),
                    {"line 2 (faults[0]): at: expected 0 s to"}},
        BadSchedule{
            "BeyondTheRun",
            gear("fault: freeze, at: 4s"),
            {"faults.yaml: line 2 (faults[0]): at: expected a time within the run, before 4 "
             "s, found 4 s",
             "--duration"}},
        BadSchedule{
            "LastsNoTime", gear("fault: freeze, at: 1s, for: 0s"), {"for: expected 1e-06 s"}},
        BadSchedule{"NegativeFactor",
                    part("friction, fault: drift, at: 1s, to: -1, over: 1s"),
                    {"to: expected 0 to 10, found -1"}},
        BadSchedule{"DriftInNoTime",
                    part("friction, fault: drift, at: 1s, to: 1.3"),
                    {"the key 'over' is missing"}},
        BadSchedule{"DriftBackInTime",
                    part("friction, fault: drift, at: 1s, to: 1.3, over: -1s"),
                    {"over: expected 0 s"}},
        BadSchedule{"BreaksToMore",
                    part("spring, fault: break, at: 1s, to: 1.5"),
                    {"to: expected 0 to 1, found 1.5"}},
        BadSchedule{"StopWithoutStiffness",
                    part("spring, fault: bottom, at: 1s, beyond: 3deg"),
                    {"either 'stiffness: 5000Nm_rad' of the stop or 'times: 10'"}},
        BadSchedule{"StopWithTwoStiffnesses",
                    part("spring, fault: bottom, at: 1s, beyond: 3deg, stiffness: 5000, times: 5"),
                    {"either 'stiffness: 5000Nm_rad'"}},
        BadSchedule{"StopTooStiffForTheStep",
                    part("spring, fault: bottom, at: 1s, beyond: 3deg, times: 100000"),
                    {"stiffness: expected 0.001 Nm/rad to", "found"}},
        BadSchedule{"StopAtTheMiddle",
                    part("spring, fault: bottom, at: 1s, beyond: 0, times: 10"),
                    {"beyond: expected 0.0001 rad to 3.2 rad"}}),
    rule_of);

TEST(BrokenFaultScheduleFile, ThatIsMissingIsNamed) {
  try {
    static_cast<void>(read_fault_schedule("/nowhere/faults.yaml", data_sheet("dfki-50")));
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/faults.yaml: cannot be opened"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace torsio
