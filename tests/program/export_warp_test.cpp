// torsio export --warp, as a user calls it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ExportWarp : public Program {
 protected:
  void SetUp() override {
    for (const char* const call : {"simulate dfki-50 chirp --duration 20s -o a.csv",
                                   "fit a.csv --model maxwell_slip -o joint.safetensors",
                                   "fit a.csv --model dgmm -o m.safetensors"})
      ASSERT_EQ(torsio(call).exit_code, 0) << call;
  }
  void expect_no_kernel(const std::string& arguments, const std::string& text) {
    const Outcome outcome = torsio("export " + arguments);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_EQ(contents("elbow.py"), "") << arguments;
  }
};

TEST_F(ExportWarp, WritesAModule) {
  const std::string call = "export joint.safetensors --warp -o joint_warp.py";
  const Outcome outcome = torsio(call + " --json j.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("not tested with Warp"), std::string::npos) << outcome.out;
  const auto json = nlohmann::json::parse(contents("j.json"));
  EXPECT_EQ(json.at("format"), "torsio.export");
  EXPECT_EQ(json.at("real"), "mixed");
  const std::string before = contents("joint_warp.py");
  EXPECT_EQ(json.at("bytes"), before.size());
  EXPECT_NE(before.find("import joint_warp\n"), std::string::npos);
  EXPECT_NE(before.find("RATE_HZ = float(1000"), std::string::npos);
  EXPECT_EQ(torsio(call).exit_code, kCallWasWrong);
  EXPECT_EQ(torsio(call + " --real float").exit_code, kCallWasWrong);
  EXPECT_EQ(contents("joint_warp.py"), before);
  EXPECT_EQ(torsio(call + " --real double --overwrite").exit_code, 0);
  EXPECT_NE(contents("joint_warp.py"), before);
}

TEST_F(ExportWarp, RefusesBeforeItWrites) {
  const std::string call = "joint.safetensors --warp -o ";
  expect_no_kernel(call + "elbow.py --real half", "float, mixed or double");
  expect_no_kernel(call + "elbow.py --layout newton", "--layout");
  expect_no_kernel(call + "elbow.py --counts gear_angle_rad=4096", "--counts");
  expect_no_kernel(call + "elbow.py --onnx", "one target");
  expect_no_kernel(call + "elbow.py --linear-spring", "it belongs to --mjcf");
  expect_no_kernel(call + "elbow.txt", ".py");
  expect_no_kernel(call + "a-b.py", "Python can import");
  expect_no_kernel(call + "lambda.py", "Python can import");
  expect_no_kernel(call + "warp.py", "hide another module");
  expect_no_kernel(call + "no/elbow.py", "no folder no");
  expect_no_kernel("m.safetensors --warp -o elbow.py", "maxwell_slip");
}

}  // namespace
}  // namespace torsio::test
