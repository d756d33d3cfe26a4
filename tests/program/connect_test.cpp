// `torsio connect` with a joint on a socket of the file system, which this process serves.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "link/served_joint.hpp"
#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Json = nlohmann::json;

class Connect : public Program {
 protected:
  Outcome connect(const std::string& arguments) {
    return torsio("connect " + arguments + " --unix joint");
  }
  Json json_of(const std::string& arguments) {
    const Outcome outcome = connect(arguments + " --json -");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false);
  }
  /// A watchdog of 2 s, since the machine may be busy.
  ServedJoint joint_ =
      ServedJoint(open_unix({.path = folder_.path("joint"), .peer = folder_.path("joint.host")}),
                  {.watchdog_s = 2.0});
};

TEST_F(Connect, ListsAndDescribesJoints) {
  EXPECT_THAT(connect("list").out, AllOf(HasSubstr("elbow"), HasSubstr("dfki-50")));
  EXPECT_EQ(json_of("list")["joints"][0]["id"], 1);
  EXPECT_THAT(connect("describe").out,
              AllOf(HasSubstr("gain"), HasSubstr("0 to 9"), HasSubstr("1/s"),
                    HasSubstr("telemetry: angle_rad, torque_Nm, current_A")));
  const Json described = json_of("describe");
  EXPECT_EQ(described["registers"].size(), 2U);
  EXPECT_EQ(described["registers"][0]["value"], 2.0);
  EXPECT_EQ(described["state"], "ready");
}

TEST_F(Connect, ReadsAndWritesRegisters) {
  EXPECT_EQ(json_of("get gain ratio")["values"]["ratio"], 100);
  EXPECT_THAT(connect("set gain 2.5").out, HasSubstr("gain = 2.5 1/s (before: 2)"));
  EXPECT_EQ(connect("get gain").out, "gain = 2.5 1/s\n");
}

TEST_F(Connect, ShowsRefusalsWithTheirReason) {
  const auto refuses = [&](const std::string& arguments, const std::string& reason) {
    const Outcome outcome = connect(arguments);
    EXPECT_EQ(outcome.exit_code, kWorkFailed) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(reason)) << arguments;
  };
  refuses("set gain 12", "expected 0 to 9");
  refuses("set gain many", "a value of type float64");
  refuses("set gian 1", "Did you mean 'gain'?");
  refuses("get gain --joint 7 --timeout 10ms", "no reply");
  refuses("reset", "not_in_this_state");
  refuses("fault freeze", "this joint does not offer it");
  refuses("watch --channels torque", "torque_Nm");
  EXPECT_EQ(connect("record -o missing/run.csv --for 0.1s").exit_code, kCallWasWrong);
  EXPECT_EQ(connect("get gain --joint 300").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("connect").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("connect list --unix a --serial-line b").exit_code, kCallWasWrong);
  EXPECT_THAT(torsio("connect list --serial-line missing").err, HasSubstr("cannot open"));
}

TEST_F(Connect, WatchesAndRecordsTelemetry) {
  const Outcome watched = connect("watch --channels torque_Nm --rate 100Hz --for 0.2s");
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  EXPECT_THAT(watched.out, AllOf(HasSubstr("torque_Nm"), HasSubstr("0.100          1.5")));
  EXPECT_GT(json_of("watch --rate 100Hz --for 0.2s")["rows"].size(), 15U);
  for (const std::string file : {"run.csv", "run.mcap", "run.tsr"}) {
    const Outcome recorded = connect("record --rate 500Hz --for 0.5s -o " + file);
    EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
    EXPECT_THAT(recorded.err, HasSubstr("3 channels at 500 Hz"));
    const Outcome read = torsio("convert " + file + " -o again.csv --json -");
    EXPECT_EQ(read.exit_code, 0) << read.err;
    const Json document = Json::parse(read.out, nullptr, false);
    EXPECT_EQ(document["channels"], (Json{"angle_rad", "torque_Nm", "current_A"})) << file;
    EXPECT_GE(document["samples"], 200) << file;
  }
}

TEST_F(Connect, EndsARecordingInOrderOnCtrlC) {
  const std::string line = "cd '" + folder_.path("") + "' && exec " + TORSIO_PROGRAM +
                           " connect record -o run.csv --unix joint 2>err.txt";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  while (!std::filesystem::exists(folder_.path("run.csv.tsr")))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ::kill(child, SIGINT);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << contents("err.txt");
  EXPECT_THAT(contents("run.csv"), HasSubstr("t_s,angle_rad,torque_Nm,current_A"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("run.csv.tsr")));
}

TEST_F(Connect, EndsARecordingWhenTheDiskIsFull) {
  const Outcome full =
      shell("ulimit -f 40; {torsio} connect record -o run.tsr --for 60s --unix joint");
  EXPECT_EQ(full.exit_code, kWorkFailed);
  EXPECT_THAT(full.err, AllOf(HasSubstr("run.tsr"), HasSubstr("could not be written"),
                              HasSubstr("The file has the ")));
  EXPECT_EQ(torsio("unpack run.tsr -o run.csv").exit_code, 0);
}

TEST_F(Connect, PlaysReferencesAndReportsThoseThatAreRefused) {
  folder_.file("torque.csv", "t_s,torque_Nm\n0,0\n0.1,20\n0.2,40\n0.3,60\n");
  const Json played = json_of("play torque.csv --valid 1s -o measured.csv");
  EXPECT_EQ(played["mode"], "torque");
  EXPECT_GT(played["references"], 30);
  EXPECT_GT(played["refused"]["out_of_range"], 1);  // above 50 Nm
  joint_.with([](LinkedJoint& joint) {
    EXPECT_EQ(joint.endpoint.drive().state(), LinkDriveState::ready);
    EXPECT_EQ(joint.joint.enables, 1);
    ASSERT_FALSE(joint.joint.references.empty());
    for (std::size_t n = 1; n < joint.joint.references.size(); ++n)
      EXPECT_GE(joint.joint.references[n].torque_Nm, joint.joint.references[n - 1].torque_Nm);
    EXPECT_EQ(joint.joint.references.back().mode, JointMode::torque);
  });
  EXPECT_THAT(contents("measured.csv"), HasSubstr("angle_rad"));
}

TEST_F(Connect, PlaysNothingWithoutAReference) {
  folder_.file("angle.csv", "t_s,joint_angle_rad\n0,0\n0.1,20\n0.2,40\n");
  const Outcome none = connect("play angle.csv");
  EXPECT_EQ(none.exit_code, kCallWasWrong);
  EXPECT_THAT(none.err, HasSubstr("torque_Nm (torque)"));
  folder_.file("gap.csv", "t_s,torque_Nm\n0,0\n0.1,nan\n0.2,40\n");
  EXPECT_THAT(connect("play gap.csv").err, HasSubstr("torque_Nm at 0.1 s"));
  joint_.with([](LinkedJoint& joint) { EXPECT_EQ(joint.joint.enables, 0); });
}

TEST_F(Connect, StopsAJointThatAnotherHostControls) {
  const Outcome stopped = connect("stop --category 0");
  EXPECT_THAT(stopped.out, HasSubstr("stop, "));
  EXPECT_THAT(connect("disable").out, HasSubstr("ready, "));
  joint_.with([](LinkedJoint& joint) {
    EXPECT_EQ(joint.joint.stops, std::vector{StopCategory::power_off});
  });
}

TEST_F(Connect, UploadsAFileAndZerosAChannel) {
  folder_.file("model.safetensors", std::string(500, 'm'));
  EXPECT_EQ(connect("upload model.safetensors").exit_code, 0);
  folder_.file("wrong.safetensors", "X");
  EXPECT_THAT(connect("upload wrong.safetensors").err, HasSubstr("upload_rejected"));
  EXPECT_EQ(connect("zero current_A --value 0.25").exit_code, 0);
  joint_.with([](LinkedJoint& joint) {
    EXPECT_EQ(joint.joint.model.size(), 500U);
    EXPECT_EQ(joint.joint.zeros.at(2), 0.25);
  });
}

TEST_F(Connect, ReachesAJointThroughAHostileProxy) {
  const std::string proxied =
      "{torsio} connect proxy --unix joint --listen-unix hostile --for 60s "
      "--longest-delay 50ms >proxy.txt & trap \"kill $!\" EXIT; "
      "until [ -S hostile ]; do sleep 0.02; done; ";
  // Each of the five tries of a request fails with a probability of a third.
  const std::string host = "for n in 1 2 3 4; do " + std::string(TORSIO_PROGRAM) +
                           " connect set gain 4 --unix hostile && break; done";
  const Outcome outcome = shell(proxied + host);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("gain = 4 1/s"));
}

TEST_F(Connect, AndTheExampleStepsTheTorqueOfARemoteJoint) {
  const Outcome outcome =
      shell(std::string(TORSIO_EXAMPLES) + "/example_13_step_torque_of_remote_joint 5 " +
            folder_.path("joint"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("1.500 Nm at the end"));
  joint_.with([](LinkedJoint& joint) {
    ASSERT_GT(joint.joint.references.size(), 100U);
    EXPECT_EQ(joint.joint.references.front().torque_Nm, 0.0);
    EXPECT_EQ(joint.joint.references.back().torque_Nm, 5.0);
  });
}

TEST_F(Connect, IsCompletedInAShell) {
  const std::string complete =
      "{torsio} completion bash > c && bash -c '. ./c; COMP_WORDS=(torsio connect \"$1\" "
      "\"$2\"); COMP_CWORD=$3; _torsio; echo ${COMPREPLY[@]}' x ";
  EXPECT_EQ(shell(complete + "re '' 2").out, "record reset\n");
  EXPECT_EQ(shell(complete + "play --va 3").out, "--valid\n");
}

/// `torsio connect` with `torsio joint`. Its watchdog is long, since the machine may be busy.
class ConnectToDaemon : public Program {
 protected:
  /// Runs shell commands while a joint is served on the socket `joint`; in them T is the program.
  Outcome with_joint(const std::string& commands, const std::string& options = "") {
    const std::string start =
        "; $T joint dfki-50 --watchdog 1s --unix joint " + options +
        " >joint.txt 2>&1 & DAEMON=$!; "
        "trap \"kill $DAEMON\" EXIT; until [ -S joint ]; do sleep 0.05; done; "
        "until $T connect describe --unix joint --json - | grep -q '\"ready\"'; do sleep 0.05; "
        "done; ";
    return shell("T=" + std::string(TORSIO_PROGRAM) + start + commands);
  }
  Json document(const std::string& file) { return Json::parse(contents(file), nullptr, false); }
};

constexpr const char* kMove = "t_s,position_rad\n0,0\n0.5,0.05\n1,0.1\n1.5,0.1\n";

TEST_F(ConnectToDaemon, MovesAJointAndRecordsIt) {
  folder_.file("move.csv", kMove);
  const Outcome outcome = with_joint(
      "$T connect describe --unix joint --json described.json && "
      "$T connect set largest_torque_Nm 30 --unix joint && "
      "$T connect play move.csv --valid 1s -o run.csv --unix joint --json played.json && "
      "$T convert run.csv -o run.mcap");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err << contents("joint.txt");
  EXPECT_EQ(document("described.json")["actuator"], "dfki-50");
  EXPECT_EQ(document("played.json")["mode"], "position");
  EXPECT_TRUE(document("played.json")["refused"].empty()) << contents("played.json");
  EXPECT_THAT(contents("run.csv"), HasSubstr("gear_angle_rad"));
}

TEST_F(ConnectToDaemon, AJointWhoseHostIsKilledStops) {
  folder_.file("move.csv", "t_s,position_rad\n0,0\n60,0.1\n");
  const Outcome outcome = with_joint(
      "$T connect play move.csv --valid 1s --unix joint & PLAY=$!; sleep 1; kill -9 $PLAY; sleep "
      "2; "
      "$T connect describe --unix joint --json described.json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err << contents("joint.txt");
  EXPECT_EQ(document("described.json")["state"], "stop");
  EXPECT_THAT(contents("joint.txt"), HasSubstr("host_lost"));
}

// With a frozen angle the joint seems to be moved by a torque that nothing measures. It comes to rest while the reset waits.
TEST_F(ConnectToDaemon, AFaultInAMotionIsNamedAndTheResetThatIsAdvisedEndsIt) {
  folder_.file("move.csv", "t_s,velocity_rad_s\n0,0\n1,1\n2,1\n3,1\n4,1\n5,1\n6,1\n");
  const Outcome outcome = with_joint(
      "$T connect play move.csv --valid 1s --unix joint; "
      "$T connect reset --unix joint --json reset.json",
      "--fault 1:joint_angle=freeze@2s");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err << contents("joint.txt");
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("the joint ended the motion"),
                                 HasSubstr("its stop_cause is overload"),
                                 HasSubstr("`torsio connect reset` makes it ready again")));
  EXPECT_EQ(document("reset.json")["state"], "ready");
}

TEST_F(ConnectToDaemon, ThroughAHostileProxyItMovesOrStops) {
  folder_.file("move.csv", kMove);
  const Outcome outcome = with_joint(
      "$T connect proxy --unix joint --listen-unix hostile >proxy.txt 2>&1 & PROXY=$!; "
      "until [ -S hostile ]; do sleep 0.05; done; "
      "$T connect play move.csv --valid 0.1s --unix hostile --json played.json; kill -INT $PROXY; "
      "wait $PROXY; cat proxy.txt");
  EXPECT_THAT(outcome.out, HasSubstr("to the joints: ")) << outcome.err;
  const Json played = document("played.json");
  if (!played.is_discarded()) {
    EXPECT_GT(played["references"], 100);
  }
}

}  // namespace
}  // namespace torsio::test
