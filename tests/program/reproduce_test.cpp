#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "program.hpp"

namespace torsio {
namespace {

using test::kCallWasWrong;
using test::kWorkFailed;
using test::Outcome;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Reproduce : public test::Program {
 protected:
  [[nodiscard]] std::filesystem::path kept() const {
    return folder_.path("cache/torsio/studies/002-design-seed1-repeats3.cbor");
  }
};

TEST_F(Reproduce, ShowsAgainWhatThisProgramHasRun) {
  const Outcome first = torsio("reproduce 002-design --json first.json");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.err, AllOf(HasSubstr("1 item(s); about 6 s"), HasSubstr("002-design took ")));
  EXPECT_TRUE(std::filesystem::exists(kept()));
  const Outcome second = torsio("reproduce 002-design --json second.json");
  EXPECT_THAT(second.err, AllOf(HasSubstr("of which this program has run 1 before (--fresh"),
                                Not(HasSubstr("took"))));
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(contents("second.json"), contents("first.json"));
  EXPECT_THAT(torsio("reproduce 002-design --fresh").err, HasSubstr("took"));
  // Other options are another experiment.
  EXPECT_THAT(torsio("reproduce 002-design --seed 2").err, HasSubstr("took"));
}

TEST_F(Reproduce, RunsAnItemAgainWhoseFileIsDamagedAndNamesIt) {
  ASSERT_EQ(torsio("reproduce 002-design").exit_code, 0);
  std::ofstream(kept()) << "damaged";
  const Outcome outcome = torsio("reproduce 002-design");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("002-design runs again: "), HasSubstr(".cbor"), HasSubstr("took")));
}

TEST_F(Reproduce, NamesAnItemThatDoesNotExistAndRunsTheOthers) {
  const Outcome outcome = torsio("reproduce 002-desing 002-design");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("no study is called \"002-desing\""), HasSubstr("002-design"),
                    HasSubstr("1 of 2 items failed: 002-desing")));
  EXPECT_THAT(outcome.out, HasSubstr("002-design (002"));
  EXPECT_EQ(torsio("reproduce 002-desing").exit_code, kCallWasWrong);
}

TEST_F(Reproduce, WorksWithoutAFolderForItsOutcomes) {
  folder_.file("file", "x");
  const Outcome outcome = shell("XDG_CACHE_HOME=$PWD/file {torsio} reproduce 002-design");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("Outcomes are not kept: "));
  EXPECT_THAT(outcome.out, HasSubstr("002-design (002"));
}

TEST_F(Reproduce, ListsEveryItemOfThePapersAndWritesTheirPage) {
  const Outcome outcome = torsio("reproduce --list --page page.md --json list.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("001-models"), HasSubstr("Table 3"),
                                 HasSubstr("planned"), HasSubstr("nothing to run")));
  EXPECT_THAT(contents("page.md"),
              AllOf(HasSubstr("## Paper 004"), HasSubstr("137 printed results")));
  EXPECT_THAT(contents("list.json"), HasSubstr("\"verdict\""));
  EXPECT_EQ(torsio("reproduce 002-design --page page.md").exit_code, kCallWasWrong);
}

}  // namespace
}  // namespace torsio
