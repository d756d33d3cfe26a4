// `torsio fleet` as a person calls it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class FleetVerb : public Program {
 protected:
  /// Recordings of two joints, and lists of both, of the first, and with a third whose recording cannot be read.
  void SetUp() override {
    for (const std::string serial : {"3", "4"})
      ASSERT_EQ(
          torsio("simulate 'dfki-50#000" + serial + "' sweep --duration 8s -o " + serial + ".csv")
              .exit_code,
          0);
    const std::string one = "joints:\n  - {serial: J03, type: dfki-50, train: 3.csv}\n";
    const std::string two = one + "  - {serial: J04, type: dfki-50, train: 4.csv}\n";
    folder_.file("one.yaml", one);
    folder_.file("two.yaml", two);
    folder_.file("bad.csv", "time_s,torque_Nm\n0,1\n0.001,1\n");
    folder_.file("three.yaml", two + "  - {serial: J05, type: dfki-50, train: bad.csv}\n");
  }
};

TEST_F(FleetVerb, JointsAreMadeCurrentWithARemarkIfTheyAreTooFewToCompare) {
  const std::string call = "fleet calibrate two.yaml --model linear --store s.sqlite --promote";
  const Outcome first = torsio(call);
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("2 joints: 2 with a model, 0 without; not compared with each "
                                   "other (2 joints, 8 of a type are needed)"));
  EXPECT_THAT(first.err,
              AllOf(HasSubstr("2 models are in the registry of s.sqlite, 2 became current"),
                    HasSubstr("made current without a comparison with other joints"),
                    HasSubstr("J03, J04"), Not(HasSubstr("nothing is kept"))));
  const Outcome again = torsio(call);
  EXPECT_THAT(again.err, AllOf(HasSubstr("2 models are in the registry of s.sqlite, 2 were current "
                                         "before"),
                               Not(HasSubstr("without a comparison"))));

  const Outcome other = torsio("fleet calibrate one.yaml --model linear --store s.sqlite");
  EXPECT_EQ(other.exit_code, kCallWasWrong);
  EXPECT_THAT(other.err, AllOf(HasSubstr("it differs in the joints or their recordings"),
                               HasSubstr("--study NAME")));
  const Outcome named =
      torsio("fleet calibrate one.yaml --model linear --store s.sqlite --study again");
  EXPECT_EQ(named.exit_code, 0) << named.err;
  EXPECT_THAT(named.err, HasSubstr("1 model is in the registry of s.sqlite; --promote makes it "
                                   "current"));
}

TEST_F(FleetVerb, AJointWithoutAModelIsAnErrorAfterTheResults) {
  const Outcome outcome = torsio("fleet calibrate three.yaml --model linear --report pages");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.out, HasSubstr("3 joints: 2 with a model, 1 without"));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("nothing is kept if this is stopped"),
                                 HasSubstr("three.yaml: 1 of 3 joints has no model")));
  EXPECT_THAT(contents("pages/index.html"),
              AllOf(HasSubstr("2 with a model, 1 without"),
                    HasSubstr(R"(<td><a href="J03.html">J03</a></td>)"),
                    HasSubstr(R"(<td><a href="J05.html">J05</a></td>)")));
  EXPECT_THAT(contents("pages/J03.html"), HasSubstr("<h1>Joint J03</h1>"));
}

TEST_F(FleetVerb, OutputsThatCannotBeWrittenAreRefusedBeforeTheWork) {
  folder_.file("pages", "not a folder");
  for (const char* output : {"--report pages", "--report one.yaml/pages", "--json absent/r.json"}) {
    const Outcome outcome = torsio(
        std::string("fleet calibrate two.yaml --model linear --store absent.sqlite ") + output);
    EXPECT_NE(outcome.exit_code, 0) << output;
    EXPECT_NE(shell("ls absent.sqlite").exit_code, 0) << output << ": the study has begun";
  }
}

TEST_F(FleetVerb, AFamilyThatDoesNotExistLeavesTheStoreAsItWas) {
  const Outcome outcome =
      torsio("fleet calibrate two.yaml --model greybox --store absent.sqlite --promote");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("greybox"), HasSubstr("Did you mean 'grey_box'?")));
  EXPECT_NE(shell("ls absent.sqlite").exit_code, 0) << "it was created";
}

TEST_F(FleetVerb, ASettingThatDoesNotExistIsRefusedOnce) {
  const Outcome outcome =
      torsio("fleet calibrate two.yaml --model polynomial:degre=3 --store absent.sqlite");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_THAT(outcome.err, HasSubstr("degre"));
  EXPECT_NE(shell("ls absent.sqlite").exit_code, 0) << "it was created";
}

TEST_F(FleetVerb, ASearchOfSpecimensRefusesAFamilyThatDoesNotExistBeforeItsTrials) {
  const Outcome outcome = torsio(
      "search --specimens 'dfki-50#0001..#0002' --models greybox --study s --store "
      "absent.sqlite");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_THAT(outcome.err, HasSubstr("Did you mean 'grey_box'?"));
  EXPECT_NE(shell("ls absent.sqlite").exit_code, 0) << "it was created";
}

}  // namespace
}  // namespace torsio::test
