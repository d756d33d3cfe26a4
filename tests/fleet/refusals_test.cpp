// What `torsio work` and `torsio search` refuse to run trials of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class WorkRefuses : public Program {
 protected:
  /// Changes the store as another program would.
  void change(const char* sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(folder_.path("s.sqlite").c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
};

using SearchStates = Program;

constexpr const char* kSpecimens =
    "search --specimens 'dfki-50#0001..#0003' --models linear --duration 4s --study line --store "
    "s.sqlite --threads 1";

TEST_F(WorkRefuses, AStudyOfAnotherVersion) {
  ASSERT_EQ(torsio(kSpecimens).exit_code, 0);
  change("UPDATE studies SET torsio_version = '9.9.9'");
  change("UPDATE trials SET state = 0; DELETE FROM results");
  const auto sentence =
      AllOf(HasSubstr("study 'line' was begun by another version of torsio"), HasSubstr("9.9.9"));
  const Outcome named = torsio("work --store s.sqlite --study line");
  EXPECT_EQ(named.exit_code, kWorkFailed);
  EXPECT_THAT(named.err, sentence);
  // A worker of all studies leaves this one to others.
  const Outcome any = torsio("work --store s.sqlite");
  EXPECT_EQ(any.exit_code, 0);
  EXPECT_THAT(any.err, sentence);
  const Outcome resumed = torsio(kSpecimens);
  EXPECT_NE(resumed.exit_code, 0);
  EXPECT_THAT(resumed.err, sentence);
}

TEST_F(WorkRefuses, ARecordingThatHasChanged) {
  for (const char* seed : {"1", "2", "3"})
    ASSERT_EQ(torsio(std::string("simulate dfki-50 sweep --duration 20s --seed ") + seed + " -o r" +
                     seed + ".csv")
                  .exit_code,
              0);
  const std::string search =
      "search r1.csv r2.csv r3.csv --models linear,linear_coulomb --study elbow --store s.sqlite";
  const Outcome first = torsio(search);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  change("UPDATE trials SET state = 0; DELETE FROM results");
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s --seed 4 -o r2.csv").exit_code, 0);
  const auto sentence = AllOf(HasSubstr("r2.csv"), HasSubstr("has changed"), Not(HasSubstr("r1.")));
  const Outcome worker = torsio("work --store s.sqlite --study elbow");
  EXPECT_EQ(worker.exit_code, kWorkFailed);
  EXPECT_THAT(worker.err, sentence);
  // A worker of all studies leaves this one to others.
  const Outcome any = torsio("work --store s.sqlite");
  EXPECT_EQ(any.exit_code, 0);
  EXPECT_THAT(any.err, sentence);
  const Outcome resumed = torsio(search);
  EXPECT_EQ(resumed.exit_code, kWorkFailed);
  EXPECT_THAT(resumed.err, sentence);
}

TEST_F(WorkRefuses, AStoreThatDoesNotExist) {
  const Outcome outcome = torsio("work --store absent.sqlite");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, HasSubstr("absent.sqlite: there is no such store"));
  EXPECT_EQ(shell("ls absent.sqlite").exit_code, 2) << "it was created";
}

TEST_F(WorkRefuses, AStudyThatDoesNotExist) {
  ASSERT_EQ(torsio(kSpecimens).exit_code, 0);
  const Outcome outcome = torsio("work --store s.sqlite --study absent");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, HasSubstr("there is no study 'absent'"));
}

TEST_F(WorkRefuses, AStoreIsWaitedForAndNotCreated) {
  ASSERT_EQ(torsio(kSpecimens).exit_code, 0);
  change("UPDATE trials SET state = 0; DELETE FROM results");
  const Outcome outcome = shell(
      "{torsio} work --store later.sqlite --wait --threads 1 & worker=$!; sleep 1; "
      "test -e later.sqlite && echo created; mv s.sqlite later.sqlite; "
      "for k in $(seq 300); do grep -q 'finished here' err.txt && break; sleep 0.1; done; "
      "kill $worker; wait");
  EXPECT_THAT(outcome.out, Not(HasSubstr("created")));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("later.sqlite: there is no such store yet"),
                                 HasSubstr("study 'line': 3 trials finished here")));
}

TEST_F(WorkRefuses, ACallWithoutAStore) {
  EXPECT_THAT(torsio("work --help").out, HasSubstr("--store TEXT REQUIRED"));
  EXPECT_EQ(torsio("work").exit_code, kCallWasWrong);
}

TEST_F(WorkRefuses, OptionsThatSpecimensDoNotUse) {
  for (const std::string unused :
       {"--folds 5", "--output m.safetensors", "--halving off", "--validation r.csv",
        "--inputs spring_deflection_rad", "--target torque_Nm", "--allow-leak", "--rate 1kHz"}) {
    const Outcome outcome = torsio(kSpecimens + (" " + unused));
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << unused;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(unused.substr(0, unused.find(' '))),
                                   HasSubstr("--specimens does not use this option")));
  }
  for (const char* several : {"linear,mlp", "search"})
    EXPECT_THAT(
        torsio("search --specimens 'dfki-50#0001..#0003' --models " + std::string(several)).err,
        HasSubstr("--models: expected one model"));
  EXPECT_EQ(torsio("search r.csv --duration 4s").exit_code, kCallWasWrong);
}

TEST_F(SearchStates, OneStructureInTheSingular) {
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s -o r.csv").exit_code, 0);
  EXPECT_THAT(torsio("search r.csv --models linear").err,
              HasSubstr("search: 1 structure, 3 folds, 3 trials to run"));
}

}  // namespace
}  // namespace torsio::test
