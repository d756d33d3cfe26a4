// Pages of the verbs as a user asks for them, and the verbs that help a new user.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "program.hpp"

namespace torsio::test {
namespace {

class Report : public Program {
 protected:
  void SetUp() override {
    ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s -o a.csv").exit_code, 0);
    ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s --seed 2 -o b.csv").exit_code, 0);
    ASSERT_EQ(torsio("fit a.csv --model linear -o m.safetensors").exit_code, 0);
  }

  /// The figures of a page as its script reads them.
  nlohmann::json figures(const std::string& file) {
    const std::string page = contents(file);
    const std::string begin = "id=\"report-figures\">";
    const std::size_t from = page.find(begin) + begin.size();
    return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
  }
};

TEST_F(Report, OfEachVerbHasItsCommandAndFigures) {
  for (const char* call :
       {"check a.csv --test b.csv", "fit a.csv --model linear -o m2.safetensors",
        "evaluate m.safetensors b.csv", "estimate m.safetensors b.csv",
        "compare a.csv --test b.csv --models linear,polynomial",
        "crossvalidate a.csv b.csv --models linear --folds 2",
        "attribute m.safetensors b.csv --windows 5 --background 5",
        "transfer m.safetensors b.csv --use 5s", "simulate dfki-50 sweep --duration 5s -o c.csv",
        "track --duration 10s", "track --impedance 2000Nm_rad --duration 10s", "tune-loop"}) {
    const Outcome outcome = torsio(std::string(call) + " --report out.html");
    ASSERT_EQ(outcome.exit_code, 0) << call << "\n" << outcome.err;
    EXPECT_NE(contents("out.html").find(std::string("torsio ") + call), std::string::npos) << call;
    EXPECT_FALSE(figures("out.html").empty()) << call;
    std::filesystem::remove(folder_.path("out.html"));
  }
}

TEST_F(Report, OfAnIdentificationShowsEachMotionAndWhatWasFound) {
  std::string recordings;
  for (const char* seed : {"1", "2"}) {
    const std::string file = std::string("air") + seed + ".csv";
    ASSERT_EQ(torsio(std::string("simulate dfki-50 air-chirp --duration 8s --lever 0.2m --mass 9kg "
                                 "--seed ") +
                     seed + " -o " + file)
                  .exit_code,
              0);
    recordings += " " + file;
  }
  (void)folder_.file("load.yaml", "load: {pendulum: {mass: mass_kg, length: lever_m}}\n");
  const Outcome outcome = torsio("identify" + recordings +
                                 " --load load.yaml --terms load_friction --starts 1 --report "
                                 "out.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> titles;
  for (const auto& figure : figures("out.html")) {
    titles.push_back(figure.at("title"));
    if (figure.at("kind") != "time") continue;
    std::vector<std::string> labels;
    for (const auto& series : figure.at("panels").at(0).at("series"))
      labels.push_back(series.at("label"));
    EXPECT_EQ(labels, (std::vector<std::string>{"measured", "simulated", "held out"}));
  }
  EXPECT_EQ(titles, (std::vector<std::string>{"Mean |error of the angle| of each free run",
                                              "Largest friction over speed and load",
                                              "Angle of air1", "Angle of air2"}));
  const std::string page = contents("out.html");
  for (const char* text : {"WARN", "armature_kg_m2", "Recordings that lower a standard error most",
                           "There are no standard errors here", "torsio identify"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
}

TEST_F(Report, ThatCannotBeWrittenIsRefusedBeforeTheWork) {
  for (const char* place : {"nowhere/out.html", "out.txt", "a.csv"}) {
    const Outcome outcome =
        torsio(std::string("fit a.csv --model linear -o never.safetensors --report ") + place);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << place;
    EXPECT_EQ(contents("never.safetensors"), "") << place;
  }
}

TEST_F(Report, OfAComparisonStatesWhyAModelFailed) {
  const Outcome outcome = torsio(
      "compare a.csv --test b.csv --models linear,dynamic_bouc_wen:iterations=1 --report out.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = contents("out.html");
  const std::size_t others = page.find("Not in the ranking");
  ASSERT_NE(others, std::string::npos) << outcome.out;
  EXPECT_NE(page.find("failed: ", others), std::string::npos);
}

TEST_F(Report, OfACheckMarksTheFindingAtItsPlace) {
  ASSERT_EQ(
      shell("awk -F, 'BEGIN { OFS = \",\" } NR > 5000 && NR < 6002 { $6 = \"nan\" } { print }' "
            "a.csv > broken.csv")
          .exit_code,
      0);
  torsio("check broken.csv --report out.html");
  bool is_marked = false;
  for (const auto& figure : figures("out.html"))
    if (figure.at("kind") == "time")
      for (const auto& mark : figure.at("marks"))
        is_marked = is_marked || (std::abs(mark.at("begin_s").get<double>() - 4.998) < 0.01 &&
                                  std::abs(mark.at("end_s").get<double>() - 5.999) < 0.01);
  EXPECT_TRUE(is_marked) << figures("out.html").dump().substr(0, 2000);
}

TEST_F(Report, OfTheDemoIsWrittenWithoutAskingForIt) {
  const Outcome outcome = torsio("demo a.csv --test b.csv --models linear");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("torsio-demo.html"), std::string::npos);
  EXPECT_FALSE(figures("torsio-demo.html").empty());
}

class FirstMinute : public Program {};

TEST_F(FirstMinute, WithoutArgumentsShowsWhatToDoFirst) {
  const Outcome outcome = torsio("");
  EXPECT_NE(outcome.out.find("torsio demo"), std::string::npos);
}

TEST_F(FirstMinute, DoctorNamesTheMachine) {
  const Outcome outcome = torsio("doctor");
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* what :
       {"processor", "real-time priority", "locked memory", "browser", "MATLAB files", "CalculiX"})
    EXPECT_NE(outcome.out.find(what), std::string::npos) << what;
}

TEST_F(FirstMinute, BenchMeasuresAStepOfEachModel) {
  const Outcome outcome = torsio("bench --models linear,polynomial");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* what : {"linear", "polynomial", "1000 Hz"})
    EXPECT_NE(outcome.out.find(what), std::string::npos) << what;
}

TEST_F(FirstMinute, MachinesReadTheMachineAndTheTimes) {
  const auto machine = nlohmann::json::parse(torsio("doctor --json -").out);
  EXPECT_EQ(machine.at("schema_version"), 1);
  EXPECT_EQ(machine.at("machine").at(0).at("what"), "torsio");
  ASSERT_EQ(torsio("bench --models linear --loop-rate 2kHz --json b.json").exit_code, 0);
  const auto times = nlohmann::json::parse(contents("b.json"));
  EXPECT_EQ(times.at("loop_rate_Hz"), 2000.0);
  EXPECT_EQ(times.at("models").at(0).at("model"), "linear");
  EXPECT_GT(times.at("models").at(0).at("step_p999_ns"), 0.0);
  EXPECT_EQ(torsio("bench --loop-rate 2000").exit_code, kCallWasWrong) << "a rate has its unit";
}

}  // namespace
}  // namespace torsio::test
