#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "program.hpp"

namespace torsio {
namespace {

using test::kCallWasWrong;
using test::kWorkFailed;
using test::Outcome;
using testing::AllOf;
using testing::HasSubstr;

class BoardCalls : public test::Program {};

TEST_F(BoardCalls, ShowTheRecordedTablesWithoutRecordings) {
  const Outcome outcome =
      shell("TORSIO_DATA=/nowhere {torsio} reproduce board --recorded --json x.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("emps: EMPS"), HasSubstr("dynoNet"),
                                 HasSubstr("measured here"), HasSubstr("published")));
  EXPECT_THAT(contents("x.json"), AllOf(HasSubstr("\"set\": \"xl330_gain\""),
                                        HasSubstr("\"measure\": \"mean |error|\"")));
}

TEST_F(BoardCalls, StateWhereMissingRecordingsBelong) {
  std::ofstream(folder_.path("mine.csv"))
      << "set,recording,sample,prediction_m\nemps,emps_val,20,0\n";
  std::filesystem::create_directory(folder_.path("data"));
  const Outcome outcome =
      shell("TORSIO_DATA=$PWD/data {torsio} reproduce board --predictions mine.csv --name mine");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("emps/emps_est.csv.gz is missing"),
                                 HasSubstr("helonayala/narmax"), HasSubstr("data/emps")));
}

TEST_F(BoardCalls, WithOptionsThatDoNotBelongTogetherAreRefused) {
  const auto refused = [&](const std::string& call, const std::string& text) {
    const Outcome outcome = torsio("reproduce " + call);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << call;
    EXPECT_THAT(outcome.err, HasSubstr(text)) << call;
  };
  refused("001-models --recorded", "are for the item board alone");
  refused("--predictions a.csv --name mine", "are for the item board alone");
  refused("board --predictions a.csv", "it needs --name");
  refused("board --name mine", "it needs --name");
  refused("board --template a.csv", "they need it");
  refused("board --set emps", "it belongs to --template");
  refused("board --set empz --template a.csv", "no set \"empz\"");
  refused("board --predictions a.csv --name mine --rows r.csv", "exclude each other");
  refused("board --predictions a.csv --name a,b", "without comma");
  std::ofstream(folder_.path("mine.csv"))
      << "set,recording,sample,prediction_m\nemps,emps_val,20,0\n";
  refused("board --predictions mine.csv --name dynoNet",
          "the set emps has a row of this name, which is published");
  refused("board --predictions a.csv --name mine --page p.md", "--recorded");
  refused("board --quick --page p.md", "a page needs the full run");
  refused("board --recorded --report p.html", "they show the run of an experiment");
  refused("001-models --page p.md", "--list, or the item board alone");
}

TEST_F(BoardCalls, WriteTheRecordedRowsAndThePage) {
  const Outcome outcome = torsio("reproduce board --recorded --rows r.csv --page p.md");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto repository_file = [](const char* name) {
    std::ostringstream text;
    text << std::ifstream(std::string(TORSIO_SOURCE "/") + name).rdbuf();
    return text.str();
  };
  EXPECT_EQ(contents("r.csv"), repository_file("studies/board_rows.csv"));
  EXPECT_EQ(contents("p.md"), repository_file("docs/board.md"));
}

TEST_F(BoardCalls, KeepRowsThatWereAddedSinceTheProgramWasBuilt) {
  ASSERT_EQ(torsio("reproduce board --recorded --rows r.csv").exit_code, 0);
  const std::string with_row =
      contents("r.csv") + "emps,mine,joined,0.001,,1,https://example.org\n";
  std::ofstream(folder_.path("r.csv")) << with_row;
  const Outcome outcome = torsio("reproduce board --recorded --rows r.csv --page p.md");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("r.csv:"), HasSubstr("found emps,mine,joined"),
                                 HasSubstr("Build the program again")));
  EXPECT_EQ(contents("r.csv"), with_row);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("p.md")));
}

TEST_F(BoardCalls, WithUnusablePredictionsNameTheLine) {
  std::ofstream(folder_.path("bad.csv")) << "set,recording,prediction_m\nemps,emps_val,0\n";
  const Outcome outcome = torsio("reproduce board --predictions bad.csv --name mine");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("bad.csv: line 1"), HasSubstr("the column sample is missing")));
}

}  // namespace
}  // namespace torsio
