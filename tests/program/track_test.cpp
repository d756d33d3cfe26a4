// A torque loop as a user types it: tune-loop, track, with a model of one's own.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class TrackVerb : public Program {
 protected:
  static void expect_error(const Outcome& outcome, int exit_code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(TrackVerb, ComparesAModelWithTheLineAndRecordsTheLoop) {
  ASSERT_EQ(torsio("simulate dfki-50 chirp --duration 30s -o a.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit a.csv --model linear_coulomb -o m.safetensors").exit_code, 0);
  const std::string call =
      "track --actuator dfki-50 --duration 8s --model m.safetensors --seeds 2 ";
  const Outcome table = torsio(call + "-o loop.csv --json rows.json");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  for (const char* word : {"chirp of 13 Nm", "linear", "m.safetensors", "-3 dB Hz", "2 runs"})
    EXPECT_NE(table.out.find(word), std::string::npos) << table.out;
  EXPECT_EQ(table.err.find("another actuator"), std::string::npos) << table.err;
  const auto json = nlohmann::json::parse(contents("rows.json"));
  ASSERT_EQ(json.at("results").size(), 4U);
  EXPECT_EQ(json.at("results").at(3).at("seed"), 2);
  EXPECT_EQ(json.at("results").at(3).at("status"), "ok");
  EXPECT_GT(json.at("results").at(3).at("bandwidth_Hz"), 2.0);
  EXPECT_EQ(torsio(call + "--json -").out, contents("rows.json"));
  const std::string record = contents("loop.csv");
  for (const char* column : {"t_s,motor_angle_rad", "truth_torque_Nm", "proportional_current_A",
                             "rest_current_A", "command_current_A", "inverse_fault_1"})
    EXPECT_NE(record.find(column), std::string::npos) << column;
  // What a loop did is a recording like any other, and can be asked for again.
  EXPECT_EQ(torsio("check loop.csv").exit_code, 0);
  EXPECT_EQ(
      torsio("track --actuator dfki-50 --reference replay --replay a.csv --duration 5s").exit_code,
      0);
}

TEST_F(TrackVerb, ReportsWhenAModelDetectedTheInjectedFaults) {
  ASSERT_EQ(torsio("simulate dfki-50 chirp --duration 30s -o a.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit a.csv --model linear_coulomb -o m.safetensors").exit_code, 0);
  folder_.file("faults.yaml",
               "faults:\n  - {sensor: gear_angle_rad, fault: jump, by: 2deg, at: 3s, for: 1s}\n"
               "  - {sensor: gear_angle_rad, fault: nan, at: 6s, for: 10ms}\n");
  const Outcome table = torsio(
      "track --actuator dfki-50 --duration 8s --model m.safetensors --faults faults.yaml --json "
      "rows.json");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_NE(table.out.find("gear_angle_rad nan"), std::string::npos) << table.out;
  EXPECT_EQ(table.out.find("runs with gear_angle_rad nan"), std::string::npos) << table.out;
  const auto rows = nlohmann::json::parse(contents("rows.json")).at("results");
  EXPECT_EQ(rows.at(1).at("faults").at(0).at("detected"), true) << "it is a jump";
  EXPECT_EQ(rows.at(1).at("faults").at(1).at("detected"), true);
}

TEST_F(TrackVerb, WarnsOfAModelOfAnotherActuator) {
  ASSERT_EQ(torsio("simulate dfki-120 sweep --duration 40s -o stiff.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit stiff.csv --model linear -o stiff.safetensors").exit_code, 0);
  const Outcome table = torsio("track --actuator dfki-50 --duration 5s --model stiff.safetensors");
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_NE(table.err.find("stiff.safetensors deflects the spring 0."), std::string::npos)
      << table.err;
  EXPECT_NE(table.err.find("was it trained on another actuator?"), std::string::npos) << table.err;
}

TEST_F(TrackVerb, RefusesBeforeTheFirstStep) {
  expect_error(torsio("track --joint-output out.csv"), kCallWasWrong,
               "expected locked or free, found 'out.csv'");
  expect_error(torsio("track -o run.tsr"), kCallWasWrong, "a file that ends in .csv or .gz");
  expect_error(torsio("track --model a.safetensors --model a.safetensors"), kCallWasWrong,
               "a.safetensors is given twice");
  expect_error(torsio("track --bandwidth 50Nm"), kCallWasWrong, "--bandwidth");
  expect_error(torsio("track --actuator elastomer"), kCallWasWrong, "series-elastic");
  expect_error(torsio("track --amplitude 130Nm"), kCallWasWrong, "the 120 Nm that dfki-120 is");
  expect_error(torsio("track --joint-output free --amplitude 70Nm"), kCallWasWrong,
               "tip the lever over");
  expect_error(torsio("track --lever 0.5m"), kCallWasWrong, "the output is locked");
  expect_error(torsio("track --reference replay"), kCallWasWrong, "--replay");
  expect_error(torsio("track --bandwidth 300Hz"), kWorkFailed, "phase margin");
  expect_error(torsio("track --bandwidth -5Hz"), kCallWasWrong,
               "--bandwidth: expected a finite number above 0, found -5");
  expect_error(torsio("track --damping -1"), kCallWasWrong, "--damping: expected");
  expect_error(torsio("track --friction nan"), kCallWasWrong, "--friction: expected a share");
  expect_error(torsio("track --observer 0Hz"), kCallWasWrong, "--observer: expected");
  expect_error(torsio("track --observer 400Hz"), kWorkFailed, "phase margin, found -");
  expect_error(torsio("track --limits position=1rad..2rad"), kCallWasWrong,
               "not between the limits");
  expect_error(torsio("track --limits speed=1rad_s,speed=2rad_s"), kCallWasWrong,
               "speed is given twice");
  expect_error(torsio("track --limits torque=5Nm"), kCallWasWrong, "unknown limit 'torque=5Nm'");
  expect_error(torsio("track --limits position=0.0001rad"), kWorkFailed, "no room between");
  expect_error(torsio("track --velocity-bandwidth 50rad_s"), kCallWasWrong, "--acts-on velocity");
  expect_error(torsio("track --acts-on velocity --observer 8Hz"), kCallWasWrong,
               "--observer: it belongs to a loop on the current");
  expect_error(torsio("track --acts-on velocity --damping 0.5"), kCallWasWrong, "--damping");
  expect_error(torsio("track --acts-on velocity --velocity-bandwidth 300rad_s"), kCallWasWrong,
               "up to 200 rad/s");
  expect_error(torsio("track --limits speed=100rad_s"), kCallWasWrong,
               "up to the rated 1.658 rad/s");
  expect_error(torsio("track --limits position=0.3rad..-0.1rad"), kCallWasWrong,
               "lower limit comes first");
  expect_error(torsio("track --limits ''"), kCallWasWrong, "expected a value, found an empty text");
  expect_error(torsio("track -o ''"), kCallWasWrong, "--output");
  expect_error(torsio("track --acts-on torque"), kCallWasWrong, "expected current or velocity");
  expect_error(torsio("track --seeds 0"), kCallWasWrong, "1 to 100");
  expect_error(torsio("track --model none.safetensors"), kWorkFailed, "none.safetensors");
  ASSERT_EQ(torsio("simulate dfki-50 chirp --duration 30s -o a.csv").exit_code, 0);
  const Outcome gap = shell(
      "awk -F, -v OFS=, 'NR == 5000 { $6 = \"nan\" } 1' a.csv >gap.csv; "
      "{torsio} track --reference replay --replay gap.csv");
  expect_error(gap, kCallWasWrong, "gap.csv: torque_Nm 4.998 s from its start: expected a number");
  ASSERT_EQ(torsio("fit a.csv --model mlp --set epochs=1 -o m.safetensors").exit_code, 0);
  expect_error(torsio("track --model m.safetensors"), kCallWasWrong,
               "m.safetensors: spring inverse: expected a family with an inverse");
  expect_error(torsio("track --model m.safetensors --json m.safetensors"), kCallWasWrong,
               "would replace a file that is read");
}

TEST_F(TrackVerb, TuneLoopProposesGainsWithTheirMarginsOrRefuses) {
  const Outcome table = torsio("tune-loop --actuator dfki-50 --json gains.json");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_EQ(torsio("tune-loop --bandwidth 50rad_s").out,
            torsio("tune-loop --bandwidth 50rad/s").out);
  EXPECT_NE(torsio("tune-loop --bandwidth 50rad_s").out.find("bandwidth 7.958 Hz"),
            std::string::npos);
  for (const char* word : {"proportional", "locked", "free", "phase margin", "passive up to"})
    EXPECT_NE(table.out.find(word), std::string::npos) << table.out;
  const auto json = nlohmann::json::parse(contents("gains.json"));
  // (J N² ω² − K) / (N k_t) of specification 3.11
  EXPECT_NEAR(json.at("gains").at("proportional_A_rad"), 127.3, 0.1);
  EXPECT_GT(json.at("margins").at(0).at("phase_deg"), 45.0);
  EXPECT_GT(json.at("margins").at(1).at("gain"), 2.0);
  expect_error(torsio("tune-loop --bandwidth 200Hz"), kWorkFailed, "phase margin, found -");
  expect_error(torsio("tune-loop --bandwidth 1Hz"), kWorkFailed, "faster than the loop");
  expect_error(torsio("tune-loop --bandwidth 8Nm"), kCallWasWrong, "--bandwidth");
  expect_error(torsio("tune-loop --damping 0"), kCallWasWrong, "--damping");
  expect_error(torsio("tune-loop --load-inertia -1"), kCallWasWrong, "--load-inertia");
  expect_error(torsio("tune-loop --observer 400Hz"), kWorkFailed, "phase margin, found -");
  const auto observed =
      nlohmann::json::parse(torsio("tune-loop --actuator dfki-50 --observer 8Hz --json -").out);
  EXPECT_LT(observed.at("margins").at(0).at("phase_deg"), json.at("margins").at(0).at("phase_deg"));
}

TEST_F(TrackVerb, RendersAnImpedance) {
  const std::string call = "track --impedance 2000Nm_rad --impedance-damping 30Nms_rad ";
  const Outcome table = torsio(call + "--duration 10s --json run.json -o run.csv");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  for (const char* word : {"harmonic-drive (stiff), impedance of 2000 Nm/rad and 30 Nms/rad",
                           "passive up to", "rendered / linear", "force at 0.5 m"})
    EXPECT_NE(table.out.find(word), std::string::npos) << word << " in: " << table.out;
  const auto json = nlohmann::json::parse(contents("run.json"));
  EXPECT_EQ(json.at("schema_version"), 1);
  EXPECT_EQ(json.at("impedance"), "wanted");
  EXPECT_NEAR(json.at("stiffness_Nm_rad"), 2000.0, 1e-9);
  EXPECT_EQ(json.at("frequencies").at(0).at("frequency_Hz"), 0.1);
  EXPECT_NEAR(json.at("frequencies").at(0).at("rendered").at("magnitude_Nm_rad"), 2000.0, 700.0);
  EXPECT_NE(contents("run.csv").find("truth_joint_angle_rad"), std::string::npos);
  EXPECT_EQ(torsio(call + "--duration 10s --json -").out, contents("run.json"));
  EXPECT_EQ(
      torsio("track --actuator harmonic-drive:soft --impedance zero --duration 10s").exit_code, 0);
}

TEST_F(TrackVerb, RendersAnImpedanceWithALearnedSpring) {
  ASSERT_EQ(torsio("simulate dfki-50 chirp --duration 30s -o chirp.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit chirp.csv --model dgmm -o spring.safetensors").exit_code, 0);
  const Outcome table = torsio(
      "track --actuator dfki-50 --impedance 100Nm_rad --impedance-damping 5Nms_rad "
      "--duration 10s --model spring.safetensors --json runs.json --report page.html");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  for (const char* word : {"inverse of the spring: linear",
                           "inverse of the spring: spring.safetensors", "error up to 1 Hz"})
    EXPECT_NE(table.out.find(word), std::string::npos) << word << " in: " << table.out;
  const auto json = nlohmann::json::parse(contents("runs.json"));
  ASSERT_EQ(json.at("runs").size(), 2U);
  EXPECT_EQ(json.at("runs").at(1).at("model"), "spring.safetensors");
  EXPECT_NE(contents("page.html").find("rendered with spring.safetensors"), std::string::npos);
}

TEST_F(TrackVerb, RefusesContradictionsOfTheImpedance) {
  const auto refused = [this](const std::string& flags, const std::string& text) {
    expect_error(torsio("track " + flags), kCallWasWrong, text);
  };
  refused("--impedance high --actuator dfki-120", "gains are those of paper 004");
  refused("--impedance 900Nm_rad --actuator dfki-120", "expected a damping from");
  refused("--impedance zero --actuator dfki-50 --impedance-damping 500Nms_rad",
          "the gains of --impedance zero");
  refused("--impedance 0Nm_rad --actuator dfki-50 --impedance-damping 500Nms_rad",
          "expected a damping of at most");
  refused("--impedance 100Nm_rad --actuator dfki-120 --torque-gain 1Nm_rad",
          "a torsion tube before its gear");
  refused("--impedance 100Nm_rad --bandwidth 8Hz", "a torque loop through a spring");
  refused("--correction 1Hz", "no impedance is controlled");
  refused("--impedance 100Nm_rad --correction 1Hz",
          "there is no estimate that corrects the torque");
  refused("--impedance 100Nm_rad --model linear --correction 1Hz", "it has no effect");
  refused("--impedance 100Nm_rad --model linear --correction 0rad_s", "--correction");
  refused("--impedance 100Nm_rad --model nothing.safetensors", "nothing.safetensors: cannot open");
  refused("--impedance 1e6Nm_rad", "not passive up to 10 Hz");
  refused("--impedance stiff", "--impedance: expected high, zero or a stiffness");
  refused("--impedance 100Nm", "--impedance: expected high, zero or a stiffness");
  refused("--impedance high --impedance-damping 1Nms_rad", "the gains of --impedance high");
  refused("--impedance zero --torque-gain 1Nm_rad", "the gains of --impedance zero");
  refused("--impedance-damping 1Nms_rad", "no impedance is controlled");
  refused("--torque-gain 1Nm_rad", "no impedance is controlled");
  for (const std::string flag : {"--reference chirp", "--joint-output free", "--lever 0.5m",
                                 "--friction 0.5", "--observer 8Hz", "--feed-forward", "--seeds 2"})
    refused("--impedance high " + flag,
            flag.substr(0, flag.find(' ')) + ": it belongs to the torque loop");
}

TEST_F(TrackVerb, WarnsOfAModelOfAnotherSpringInAnImpedanceToo) {
  ASSERT_EQ(torsio("simulate dfki-120 static-cycle --duration 20s -o other.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit other.csv --model linear -o other.safetensors").exit_code, 0);
  ASSERT_EQ(torsio("simulate dfki-50 static-cycle --duration 20s -o own.csv").exit_code, 0);
  ASSERT_EQ(torsio("fit own.csv --model linear -o own.safetensors").exit_code, 0);
  // With another zero of an encoder the same spring has a deflection at 0 Nm.
  ASSERT_EQ(shell("awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "
                  "\"joint_angle_rad\") c = i } NR > 1 { $c += 0.05 } 1' own.csv > moved.csv")
                .exit_code,
            0);
  ASSERT_EQ(torsio("fit moved.csv --model linear -o moved.safetensors").exit_code, 0);
  const std::string call =
      "track --actuator dfki-50 --impedance 50Nm_rad --impedance-damping 1Nms_rad --duration 10s "
      "--model ";
  EXPECT_EQ(torsio(call + "own.safetensors").err.find("warning"), std::string::npos);
  const Outcome other = torsio(call + "other.safetensors");
  EXPECT_NE(other.err.find("was it trained on another actuator"), std::string::npos) << other.err;
  const Outcome moved = torsio(call + "moved.safetensors");
  EXPECT_NE(moved.err.find("warning: at 0 Nm moved.safetensors deflects the spring by"),
            std::string::npos)
      << moved.err;
}

TEST_F(TrackVerb, TakesZerosOfAModelAsThoseOfSimulatedEncoders) {
  folder_.file("zero.yaml",
               "zero: [{channel: gear_angle_rad, first: 0.02s}, {channel: joint_angle_rad, first: "
               "0.02s}]\n");
  ASSERT_EQ(torsio("simulate dfki-50 chirp --duration 30s -o a.csv").exit_code, 0);
  ASSERT_EQ(
      torsio("fit a.csv --mapping zero.yaml --model linear_coulomb -o z.safetensors").exit_code, 0);
  for (const char* loop : {"", "--impedance 50Nm_rad --impedance-damping 1Nms_rad "}) {
    const Outcome outcome = torsio(std::string("track --actuator dfki-50 --duration 10s ") + loop +
                                   "--model z.safetensors");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace torsio::test
