// `torsio check --advise` as a user calls it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class CheckAdvise : public Program {
 protected:
  void SetUp() override {
    const std::string simulate = "simulate elastomer triangles --duration 40s --amplitude ";
    ASSERT_EQ(torsio(simulate + "2Nm --frequency 0.5Hz -o slow.csv").exit_code, 0);
    ASSERT_EQ(torsio(simulate + "1Nm --frequency 2Hz --seed 2 -o fast.csv").exit_code, 0);
  }
};

TEST_F(CheckAdvise, WritesProposalsAsTextAndJson) {
  const Outcome outcome =
      torsio("check slow.csv fast.csv --advise --want input=-10deg:10deg --json out.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("what to record next, the most useful first"), std::string::npos);
  EXPECT_NE(outcome.out.find("1. "), std::string::npos) << outcome.out;
  const auto advice = nlohmann::json::parse(contents("out.json")).at("advice");
  EXPECT_NEAR(advice.at("intended_use").at("highest").get<double>(), 0.17453, 1e-4);
  EXPECT_FALSE(advice.at("proposals").empty());
  EXPECT_EQ(outcome.out.find("nan"), std::string::npos) << outcome.out;
}

TEST_F(CheckAdvise, GivesNoAdviceOnRecordingsThatDoNotPass) {
  // The torque, before its freshness and the goal.
  ASSERT_EQ(shell("awk -F, -v OFS=, 'NR > 1 {$(NF-2) = 1} {print}' slow.csv > dead.csv").exit_code,
            0);
  const Outcome outcome = torsio("check dead.csv --advise");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out.find("what to record next"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("There is no advice"), std::string::npos) << outcome.err;
}

TEST_F(CheckAdvise, RefusesAWrongIntendedUseBeforeAnyWork) {
  for (const char* wrong :
       {"check slow.csv --want input=-1:1", "check slow.csv --advise --want x=1:2",
        "check slow.csv --advise --want input=2:1"})
    EXPECT_EQ(torsio(wrong).exit_code, kCallWasWrong) << wrong;
}

}  // namespace
}  // namespace torsio::test
