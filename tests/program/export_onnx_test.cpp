// torsio export --onnx and the choice of a target, as a user calls them.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ExportOnnx : public Program {
 protected:
  void SetUp() override {
    for (const char* const call : {"simulate dfki-50 chirp --duration 20s -o a.csv",
                                   "fit a.csv --model maxwell_slip -o joint.safetensors",
                                   "fit a.csv --model dgmm -o m.safetensors"})
      ASSERT_EQ(torsio(call).exit_code, 0) << call;
    has_onnx_ = torsio("export joint.safetensors --onnx -o probe.onnx").exit_code == 0;
  }
  void expect_no_file(const std::string& arguments, const std::string& text) {
    const Outcome outcome = torsio("export " + arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_EQ(contents("elbow.onnx"), "") << arguments;
  }
  bool has_onnx_ = false;
};

TEST_F(ExportOnnx, WritesAGraphAndWhatAProgramHasToKnow) {
  if (!has_onnx_) GTEST_SKIP() << "this torsio was built without ONNX";
  const std::string call = "export joint.safetensors --onnx -o elbow.onnx";
  const Outcome outcome = torsio(call + " --json j.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(contents("j.json"));
  EXPECT_EQ(json.at("real"), "double");
  EXPECT_EQ(json.at("layout"), "estimator");
  EXPECT_EQ(json.at("sample_rate_Hz"), 1000.0);
  EXPECT_GT(json.at("state_width"), 0);
  EXPECT_EQ(json.at("faults").at(0), "none");
  const std::string before = contents("elbow.onnx");
  EXPECT_EQ(json.at("bytes"), before.size());
  EXPECT_EQ(torsio(call).exit_code, kCallWasWrong);
  EXPECT_EQ(contents("elbow.onnx"), before);
  EXPECT_EQ(torsio(call + " --real mixed --overwrite").exit_code, 0);
  EXPECT_NE(contents("elbow.onnx"), before);
}

TEST_F(ExportOnnx, RefusesBeforeItWrites) {
  const std::string call = "joint.safetensors --onnx -o elbow.onnx ";
  expect_no_file("joint.safetensors -o elbow.onnx", "a target: --c99, --onnx");
  expect_no_file(call + "--warp", "one target");
  expect_no_file(call + "--counts gear_angle_rad=4096", "it belongs to --c99");
  expect_no_file(call + "--compile", "it belongs to --fmi");
  expect_no_file("joint.safetensors --torchscript --layout isaaclab -o elbow.onnx",
                 "python3 -m torsio.torch joint.safetensors --layout isaaclab -o elbow.onnx");
  if (!has_onnx_) return;
  expect_no_file(call + "--real half", "float, mixed or double");
  expect_no_file(call + "--layout other", "estimator, network, newton or isaaclab");
  expect_no_file(call + "--layout isaaclab", "python3 -m torsio.torch");
  expect_no_file(call + "--layout network", "mlp, gru or lstm");
  expect_no_file(call + "--layout newton --real double", "computes in float");
  expect_no_file("m.safetensors --onnx -o elbow.onnx", "maxwell_slip");
  expect_no_file("joint.safetensors --onnx -o elbow.txt", ".onnx");
  expect_no_file("joint.safetensors --onnx -o no/elbow.onnx", "no folder no");
  expect_no_file("a.csv --onnx -o elbow.onnx", "a.csv");
}

}  // namespace
}  // namespace torsio::test
