// torsio export --fmi, as a user calls it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ExportFmu : public Program {
 protected:
  void SetUp() override {
    for (const char* const call : {"simulate dfki-50 chirp --duration 20s -o a.csv",
                                   "fit a.csv --model maxwell_slip -o joint.safetensors",
                                   "fit a.csv --model dgmm -o m.safetensors"})
      ASSERT_EQ(torsio(call).exit_code, 0) << call;
  }
  void expect_refused(const std::string& command, int exit_code, const std::string& text) {
    const Outcome outcome = shell(command);
    EXPECT_EQ(outcome.exit_code, exit_code) << command << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << command << "\n" << outcome.err;
    EXPECT_EQ(contents("elbow.fmu"), "") << command;
  }
};

TEST_F(ExportFmu, WritesAnArchive) {
  for (const char* const version : {"2", "3"}) {
    const std::string file = std::string("joint_") + version + ".fmu";
    const std::string call =
        std::string("export joint.safetensors --fmi ") + version + " -o " + file;
    const Outcome outcome = torsio(call + " --json j.json");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("sources only"), std::string::npos) << outcome.out;
    const auto json = nlohmann::json::parse(contents("j.json"));
    EXPECT_EQ(json.at("format"), "torsio.export");
    EXPECT_EQ(std::to_string(json.at("fmi").get<int>()), version);
    EXPECT_EQ(json.at("bytes"), contents(file).size());
    EXPECT_EQ(json.at("files").at(0), "modelDescription.xml");
    EXPECT_TRUE(json.at("platform").is_null());
    EXPECT_NE(contents(file).find(json.at("token").get<std::string>()), std::string::npos);

    const std::string before = contents(file);
    EXPECT_EQ(torsio(call).exit_code, kCallWasWrong);
    EXPECT_EQ(torsio(call + " --real float").exit_code, kCallWasWrong);
    EXPECT_EQ(contents(file), before);
    EXPECT_EQ(torsio(call + " --overwrite").exit_code, 0);
    EXPECT_EQ(contents(file), before);
  }
}

TEST_F(ExportFmu, RefusesBeforeItWrites) {
  const std::string call = "{torsio} export joint.safetensors -o elbow.fmu ";
  expect_refused(call + "--fmi 4", kCallWasWrong, "2 or 3");
  expect_refused(call + "--fmi 3 --real half", kCallWasWrong, "float or double");
  expect_refused(call + "--fmi 3 --c99 joint", kCallWasWrong, "one target");
  expect_refused(call + "--fmi 3 --counts gear_angle_rad=4096", kCallWasWrong, "--counts");
  expect_refused(call + "--c99 joint --compile", kCallWasWrong, "it belongs to --fmi");
  expect_refused(call + "--c99 joint --fmi 2 --compile", kCallWasWrong, "one target");
  expect_refused("{torsio} export joint.safetensors --fmi 3 -o a-b.fmu", kCallWasWrong,
                 "C identifier");
  expect_refused("{torsio} export joint.safetensors --fmi 3 -o elbow.zip", kCallWasWrong, ".fmu");
  expect_refused("{torsio} export m.safetensors --fmi 3 -o elbow.fmu", kCallWasWrong,
                 "maxwell_slip");
  expect_refused("{torsio} export joint.safetensors --fmi 3 -o no/elbow.fmu", kCallWasWrong,
                 "no folder no");
  expect_refused("CC='no-such-compiler -O1' " + call + "--fmi 3 --compile", kWorkFailed,
                 "no-such-compiler");
  expect_refused("CC=false " + call + "--fmi 3 --compile", kWorkFailed, "failed");
}

}  // namespace
}  // namespace torsio::test
