// `torsio search` that is killed and continued, and whose trials others run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using Json = nlohmann::json;

/// Without the times, which no two runs share.
Json without_times(const Json& json) {
  Json kept = json;
  if (json.is_object())
    for (const auto& [key, value] : json.items()) {
      const bool is_time =
          key.find("seconds") != std::string::npos || key.find("step_ns") != std::string::npos;
      kept[key] = is_time ? Json() : without_times(value);
    }
  if (json.is_array())
    for (std::size_t i = 0; i < json.size(); ++i) kept[i] = without_times(json[i]);
  return kept;
}

class StoppedSearch : public Program {
 protected:
  void simulate_sweeps() {
    for (const std::string seed : {"1", "2", "3"})
      ASSERT_EQ(
          torsio("simulate dfki-50 sweep --duration 20s --seed " + seed + " -o r" + seed + ".csv")
              .exit_code,
          0);
  }

  /// The number that a query of the store has; none before it has tables.
  std::optional<int> number(const char* sql) const {
    std::optional<int> found;
    sqlite3* database = nullptr;
    if (sqlite3_open_v2(folder_.path("s.sqlite").c_str(), &database, SQLITE_OPEN_READWRITE,
                        nullptr) == SQLITE_OK) {
      sqlite3_busy_timeout(database, 10'000);
      sqlite3_exec(
          database, sql,
          [](void* result, int, char** values, char**) {
            if (values[0] != nullptr)
              *static_cast<std::optional<int>*>(result) = std::stoi(values[0]);
            return 0;
          },
          &found, nullptr);
    }
    sqlite3_close(database);
    return found;
  }

  /// Starts the program and kills it (-9) as soon as so many trials have finished and are running.
  /// @returns false if it ended by itself.
  bool kill_after(int finished, int running, const std::string& arguments) const {
    const std::string line = "cd '" + folder_.path("") + "' && exec " TORSIO_PROGRAM " " +
                             arguments + " >/dev/null 2>&1";
    const pid_t process = fork();
    if (process == 0) {
      execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    while (waitpid(process, nullptr, WNOHANG) == 0) {
      if (number("SELECT count(*) FROM trials WHERE state > 1").value_or(-1) >= finished &&
          number("SELECT count(*) FROM trials WHERE state = 1").value_or(0) >= running) {
        kill(process, SIGKILL);
        waitpid(process, nullptr, 0);
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
};

TEST_F(StoppedSearch, KilledAgainAndAgainItHasTheTableOfOneThatWasNot) {
  simulate_sweeps();
  const std::string search =
      "search r1.csv r2.csv r3.csv --models "
      "linear,linear_coulomb,polynomial:degree=5,maxwell_slip:thresholds=8,mlp:epochs=30 --threads "
      "3";
  const std::string kept = search + " --study elbow --store s.sqlite";
  // The longest trials begin first: they lose each of the first programs.
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(kill_after(0, 3, kept));
  const int trials = number("SELECT count(*) FROM trials").value_or(0);
  ASSERT_EQ(trials, 15);
  EXPECT_TRUE(kill_after(6 * trials / 10, 1, kept));
  EXPECT_TRUE(kill_after(9 * trials / 10, 1, kept));
  const Outcome last = torsio(kept + " --json kept.json");
  EXPECT_EQ(last.exit_code, 0) << last.err;
  EXPECT_THAT(last.err, HasSubstr("run again"));
  EXPECT_EQ(number("SELECT count(*) FROM trials WHERE state = 2"), trials);
  ASSERT_EQ(torsio(search + " --json whole.json").exit_code, 0);
  EXPECT_EQ(without_times(Json::parse(contents("kept.json"))),
            without_times(Json::parse(contents("whole.json"))));
}

constexpr const char* kSpecimens =
    "search --specimens 'dfki-50#0001..#0003' --models linear --duration 4s --study line --store "
    "s.sqlite --threads 1";

TEST_F(StoppedSearch, SubmitOnlyEndsWhenTheJobIsSubmitted) {
  const std::string slurm = std::string(kSpecimens) + " --engine slurm --submit-only";
  const Outcome submitted = shell(
      "printf '#!/bin/sh\\necho 7\\n' > sbatch && chmod +x sbatch && PATH=$PWD:$PATH {torsio} " +
      slurm);
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_THAT(submitted.err,
              AllOf(HasSubstr("job 7: 4 workers"), HasSubstr("shows the table later"),
                    Not(HasSubstr("stopped on request"))));
  EXPECT_THAT(submitted.out, IsEmpty());
  EXPECT_THAT(contents("line.sbatch"), HasSubstr("work --store 's.sqlite' --study 'line'"));
  EXPECT_EQ(number("SELECT count(*) FROM trials WHERE state = 0"), 3);
  const Outcome later = torsio(kSpecimens);
  EXPECT_EQ(later.exit_code, 0);
  EXPECT_THAT(later.out, HasSubstr("3 specimens"));
  // Nothing is left to submit: the table is shown.
  EXPECT_THAT(torsio(slurm).out, HasSubstr("3 specimens"));
}

TEST_F(StoppedSearch, SubmitOnlyIsOfSlurm) {
  const Outcome outcome = torsio(std::string(kSpecimens) + " --submit-only");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_THAT(outcome.err, HasSubstr("Add --engine slurm"));
}

TEST_F(StoppedSearch, AStudyThatCannotBeLoadedIsLeftOutAndOthersAreDone) {
  simulate_sweeps();
  const std::string elbow =
      "search r1.csv r2.csv r3.csv --models linear --study elbow --store s.sqlite";
  for (const std::string& begun : {elbow, std::string(kSpecimens)}) {
    ASSERT_EQ(torsio(begun).exit_code, 0);
    number("UPDATE trials SET state = 0; DELETE FROM samples; DELETE FROM results");
  }
  ASSERT_EQ(shell("mv r2.csv moved.csv").exit_code, 0);
  const Outcome any = torsio("work --store s.sqlite --lease 1s");
  EXPECT_EQ(any.exit_code, 0) << any.err;
  EXPECT_THAT(any.err, AllOf(HasSubstr("study 'elbow' is left out"), HasSubstr("r2.csv"),
                             HasSubstr("study 'line': 3 trials finished here"),
                             HasSubstr("no trial is waiting of the studies that can be run here")));
  EXPECT_EQ(any.err.find("left out"), any.err.rfind("left out"));
  const Outcome named = torsio("work --store s.sqlite --study elbow");
  EXPECT_EQ(named.exit_code, kWorkFailed);
  EXPECT_THAT(named.err, HasSubstr("r2.csv"));
  ASSERT_EQ(shell("mv moved.csv r2.csv").exit_code, 0);
  EXPECT_THAT(torsio("work --store s.sqlite --lease 1s").err,
              HasSubstr("study 'elbow': 3 trials finished here"));
}

}  // namespace
}  // namespace torsio::test
