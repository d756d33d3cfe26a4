// Workers in processes of their own that are killed or stopped.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <functional>
#include <thread>

#include "support/postgresql_server.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/search/workers.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// Trials that call a function.
class CalledStudy : public StudyKind {
 public:
  explicit CalledStudy(std::function<double(const Claim&)> run) : run_(std::move(run)) {}
  TrialResult run(const Claim& claim, const Progress& /*progress*/) override {
    return {.value = run_(claim)};
  }
  HalvingDecision decide(const std::string& /*group*/, int /*step*/,
                         std::span<const TrialRecord> /*trials*/) override {
    return {};
  }

 private:
  std::function<double(const Claim&)> run_;
};

class LostWorkers : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "sqlite") {
      address_ = store_address(folder_.path("studies.sqlite"));
      return;
    }
    if (test::PostgresqlServer::programs().empty())
      GTEST_SKIP() << "no PostgreSQL server is installed";
    server_.emplace();
    address_ = store_address(server_->new_database());
  }

  void begin_study(const std::vector<std::string>& keys) const {
    std::vector<Trial> trials;
    for (const std::string& key : keys) trials.push_back({.key = key, .group = "all"});
    StudyStore(address_).create_or_resume(a_study(), trials);
  }

  /// A process that works until the study is complete. Its exit code: the results that were refused.
  [[nodiscard]] pid_t start_worker(const std::function<double(const Claim&)>& run,
                                   std::size_t threads = 1) const {
    const pid_t process = fork();
    if (process == 0) _exit(static_cast<int>(work(run, threads).lost));
    return process;
  }

  [[nodiscard]] WorkersReport work(const std::function<double(const Claim&)>& run,
                                   std::size_t threads = 1) const {
    CalledStudy kind(run);
    StudyStore store(address_);
    const StoredStudy study = *store.find_study("elbow");
    return run_workers(store, study, kind, {.threads = threads, .lease_s = kLease_s});
  }

  [[nodiscard]] std::vector<TrialRecord> trials() const {
    StudyStore store(address_);
    return store.trials(store.find_study("elbow")->id);
  }

  static StoredStudy a_study() {
    return {.name = "elbow", .kind = "test", .spec = "{}", .torsio_version = "1"};
  }

  static constexpr double kLease_s = 0.4;
  TemporaryFolder folder_;
  std::optional<test::PostgresqlServer> server_;
  StoreAddress address_;
};

TEST_P(LostWorkers, ATrialThatKillsThemHasFailedAfterThreeAndTheOthersAreDone) {
  begin_study({"a", "poison", "b", "c"});
  int killed = 0;
  for (int status = SIGKILL; status != 0 && killed < 10;) {
    const pid_t worker = start_worker([](const Claim& claim) {
      if (claim.key == "poison") static_cast<void>(raise(SIGKILL));
      return 1.0;
    });
    ASSERT_EQ(waitpid(worker, &status, 0), worker);
    if (status == 0) break;
    ASSERT_TRUE(WIFSIGNALED(status)) << status;
    ++killed;
  }
  EXPECT_EQ(killed, 3);
  for (const TrialRecord& record : trials()) {
    if (record.trial.key == "poison") {
      EXPECT_EQ(record.state, TrialState::failed);
      EXPECT_EQ(record.attempt, 3);
      EXPECT_THAT(record.result.reason, HasSubstr("its worker was lost 3 times: it crashed"));
      continue;
    }
    EXPECT_EQ(record.state, TrialState::done) << record.trial.key;
    EXPECT_EQ(record.attempt, 1) << record.trial.key;
  }
}

TEST_P(LostWorkers, ATrialThatKillsThemAmongOthersIsFoundOutAndTheOthersAreDone) {
  begin_study({"a", "b", "poison", "c", "d", "e"});
  int killed = 0;
  for (int status = SIGKILL; status != 0 && killed < 10; ++killed) {
    const pid_t worker = start_worker(
        [](const Claim& claim) {
          if (claim.key == "poison") static_cast<void>(raise(SIGKILL));
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
          return 1.0;
        },
        3);
    ASSERT_EQ(waitpid(worker, &status, 0), worker);
    if (status == 0) break;
    ASSERT_TRUE(WIFSIGNALED(status)) << status;
  }
  EXPECT_LE(killed, 5);
  for (const TrialRecord& record : trials())
    EXPECT_EQ(record.state, record.trial.key == "poison" ? TrialState::failed : TrialState::done)
        << record.trial.key;
}

TEST_P(LostWorkers, OneThatWasStoppedForLongerThanItsLeaseDropsItsResult) {
  begin_study({"a"});
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t slow = start_worker([&](const Claim&) {
    // The last thing that it does before it is stopped.
    static_cast<void>(!write(ends[1], "x", 1));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return 1.0;
  });
  char begun = 0;
  ASSERT_EQ(read(ends[0], &begun, 1), 1);
  ASSERT_EQ(kill(slow, SIGSTOP), 0);
  const WorkersReport other = work([](const Claim&) { return 2.0; });  // waits for the lease to end
  EXPECT_EQ(other.finished, 1U);
  ASSERT_EQ(kill(slow, SIGCONT), 0);
  int status = 0;
  ASSERT_EQ(waitpid(slow, &status, 0), slow);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 1);
  const TrialRecord record = trials().front();
  EXPECT_EQ(record.attempt, 2);
  EXPECT_EQ(record.result.value, 2.0);
  close(ends[0]);
  close(ends[1]);
}

INSTANTIATE_TEST_SUITE_P(Kinds, LostWorkers, testing::Values("sqlite", "postgresql"),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace torsio
