// The example of a real-time loop, and its recording through `torsio unpack`.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class RealtimeExample : public Program {
 protected:
  void record() {
    const Outcome outcome = shell(std::string(TORSIO_EXAMPLES) + "/example_08_run_realtime_loop");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    ASSERT_NE(outcome.out.find("ended by stop_requested"), std::string::npos) << outcome.out;
    ASSERT_NE(outcome.out.find("lateness"), std::string::npos) << outcome.out;
  }
};

TEST_F(RealtimeExample, RecordsWhatUnpackTurnsIntoCsv) {
  record();
  const Outcome unpacked = torsio("unpack run.tsr -o run.csv --json -");
  ASSERT_EQ(unpacked.exit_code, 0) << unpacked.err;
  const auto estimate = nlohmann::json::parse(unpacked.out);
  EXPECT_GT(estimate.at("frames"), 10);
  EXPECT_EQ(estimate.at("dropped"), 0);
  EXPECT_EQ(estimate.at("was_closed"), true);
  EXPECT_EQ(estimate.at("sample_rate_Hz"), 1000.0);
  EXPECT_TRUE(contents("run.csv").starts_with("t_s,wanted_torque_Nm,torque_Nm\n"));
}

TEST_F(RealtimeExample, BadCallsOfUnpackLeaveTheirOutputAlone) {
  record();
  folder_.file("old.csv", "old");
  EXPECT_EQ(torsio("unpack run.tsr").exit_code, 2);
  EXPECT_EQ(torsio("unpack run.tsr -o run.tsr").exit_code, 2);
  const Outcome no_recording = torsio("unpack old.csv -o new.csv");
  EXPECT_EQ(no_recording.exit_code, 1);
  EXPECT_NE(no_recording.err.find("old.csv"), std::string::npos) << no_recording.err;
  const Outcome torn = shell("head -c 90 run.tsr >torn.tsr; {torsio} unpack torn.tsr -o old.csv");
  EXPECT_EQ(torn.exit_code, 1);
  EXPECT_NE(torn.err.find("torn.tsr"), std::string::npos) << torn.err;
  EXPECT_EQ(contents("old.csv"), "old");
  const Outcome read_as_csv = torsio("check run.tsr");
  EXPECT_EQ(read_as_csv.exit_code, 1);
  EXPECT_NE(read_as_csv.err.find("torsio unpack"), std::string::npos) << read_as_csv.err;
}

}  // namespace
}  // namespace torsio::test
