#include "torsio/store/study_store.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <set>
#include <thread>

#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/postgresql_server.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<Trial> numbered_trials(int count) {
  std::vector<Trial> trials;
  for (int i = 0; i < count; ++i)
    trials.push_back({.key = fmt::format("trial {}", i),
                      .group = i % 2 == 0 ? "even" : "odd",
                      .device = fmt::format("joint {}", i % 3),
                      .priority = static_cast<double>(i)});
  return trials;
}

StoredStudy a_study() {
  return {.name = "elbow", .kind = "test", .spec = "{}", .torsio_version = "1.2.3"};
}

/// The server that all tests of this program share, started by the first that needs it.
test::PostgresqlServer& server() {
  static test::PostgresqlServer shared;
  return shared;
}

/// Another one, for tests that stop and start it; each leaves it running.
test::PostgresqlServer& restarted_server() {
  static test::PostgresqlServer shared;
  return shared;
}

/// A store of each kind.
class EachStore : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "postgresql" && test::PostgresqlServer::programs().empty())
      GTEST_SKIP() << "no PostgreSQL server is installed";
    if (GetParam() == "postgresql")
      address_ = store_address(server().new_database());
    else if (GetParam() == "sqlite")
      address_ = store_address(folder_.path("studies.sqlite"));
  }

  TemporaryFolder folder_;
  StoreAddress address_;
};

TEST_P(EachStore, ClaimsByPriorityAndKeepsResults) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(3));
  const auto first = store.claim(study.id, "worker", 60.0);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->key, "trial 2");
  EXPECT_EQ(first->attempt, 1);
  const double third = 1.0 / 3.0;  // no short decimal number
  EXPECT_TRUE(store.finish(*first, {.value = third,
                                    .result = "{\"a\": 1}",
                                    .samples = std::string("\0bytes\xff", 7),
                                    .seconds = 0.5}));
  const auto second = store.claim(study.id, "worker", 60.0);
  EXPECT_TRUE(store.finish(*second, {.is_failed = true, .reason = "it diverged"}));

  const auto trials = store.trials(study.id);
  ASSERT_THAT(trials, SizeIs(3));
  EXPECT_EQ(trials[2].state, TrialState::done);
  EXPECT_EQ(trials[2].result.value, third);
  EXPECT_EQ(trials[2].result.result, "{\"a\": 1}");
  EXPECT_EQ(store.samples(trials[2].id), std::string("\0bytes\xff", 7));
  EXPECT_EQ(trials[1].state, TrialState::failed);
  EXPECT_EQ(trials[1].result.reason, "it diverged");
  EXPECT_EQ(trials[0].state, TrialState::waiting);

  const StudyCounts counts = store.counts(study.id);
  EXPECT_EQ(counts.waiting, 1U);
  EXPECT_EQ(counts.finished, 2U);
  EXPECT_EQ(counts.finished_priority, 3.0);
  EXPECT_FALSE(counts.is_complete());
}

TEST_P(EachStore, AResultAfterTheLeaseEndedIsRefused) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  const auto slow = store.claim(study.id, "slow", 0.05);
  EXPECT_FALSE(store.claim(study.id, "other", 60.0));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const auto again = store.claim(study.id, "other", 60.0);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->attempt, 2);
  EXPECT_FALSE(store.extend(*slow, 60.0));
  EXPECT_FALSE(store.finish(*slow, {.value = 1.0}));
  EXPECT_TRUE(store.extend(*again, 60.0));
  EXPECT_TRUE(store.finish(*again, {.value = 2.0}));
  EXPECT_FALSE(store.finish(*slow, {.value = 1.0}));
  EXPECT_EQ(store.trials(study.id).front().result.value, 2.0);
}

TEST_P(EachStore, FinishingTwiceIsOneResult) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  const auto claim = store.claim(study.id, "worker", 60.0);
  EXPECT_TRUE(store.finish(*claim, {.value = 1.0}));
  EXPECT_TRUE(store.finish(*claim, {.value = 1.0}));  // the answer to the first was lost
  EXPECT_THAT(store.best(study.id, 10), SizeIs(1));
}

TEST_P(EachStore, ATrialThatLosesItsWorkerThreeTimesHasFailed) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(2));
  ASSERT_TRUE(store.claim(study.id, "lost 0", 0.01));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  // The other trial is done first.
  const auto other = store.claim(study.id, "worker", 60.0);
  EXPECT_EQ(other->key, "trial 0");
  EXPECT_TRUE(store.finish(*other, {.value = 1.0}));
  for (int k = 1; k < 3; ++k) {
    EXPECT_FALSE(store.claim(study.id, "busy", 60.0, false)) << "it runs another trial";
    const auto claim = store.claim(study.id, fmt::format("lost {}", k), 0.01);
    ASSERT_TRUE(claim);
    EXPECT_EQ(claim->key, "trial 1");
    EXPECT_TRUE(claim->runs_alone);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_FALSE(store.claim(study.id, "worker", 60.0));
  const TrialRecord lost = store.trials(study.id)[1];
  EXPECT_EQ(lost.state, TrialState::failed);
  EXPECT_THAT(lost.result.reason, HasSubstr("lost 3 times"));
}

TEST_P(EachStore, TrialsThatLoseTheirWorkerTogetherDoNotFail) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(2));
  constexpr int kLosses = 6;
  for (int k = 0; k < kLosses; ++k) {
    const std::string name = fmt::format("lost {}", k);
    const auto first = store.claim(study.id, name, 0.01);
    ASSERT_TRUE(first);
    // After two losses they run alone: there is no loss together with another one any more.
    EXPECT_EQ(first->runs_alone, k >= 2);
    if (k >= 2) {
      store.give_back(*first);
      continue;
    }
    ASSERT_TRUE(store.claim(study.id, name, 60.0, false));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    // Both are taken back although the lease of one has not ended.
    const auto again = store.claim(study.id, "other", 60.0);
    ASSERT_TRUE(again);
    store.give_back(*again);
    EXPECT_EQ(store.counts(study.id).running, 0U);
  }
  EXPECT_EQ(store.counts(study.id).waiting, 2U);
}

TEST_P(EachStore, LossesOfWorkersThatRunDoNotCount) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  for (int k = 0; k < 5; ++k) {
    const auto slow = store.claim(study.id, fmt::format("slow {}", k), 0.01);
    ASSERT_TRUE(slow) << k;
    EXPECT_FALSE(slow->runs_alone);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto other = store.claim(study.id, "other", 60.0);
    ASSERT_TRUE(other);
    EXPECT_FALSE(store.extend(*slow, 60.0));
    store.withdraw_loss(*slow);
    store.give_back(*other);
  }
  EXPECT_EQ(store.counts(study.id).waiting, 1U);
}

TEST_P(EachStore, AWorkerDoesNotTakeBackItsOwnTrials) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  const auto claim = store.claim(study.id, "a machine that was suspended", 0.01);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(store.claim(study.id, "a machine that was suspended", 60.0));
  EXPECT_TRUE(store.finish(*claim, {.value = 1.0}));
}

TEST_P(EachStore, GivingBackIsNoLoss) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  for (int k = 0; k < 5; ++k) store.give_back(*store.claim(study.id, "worker", 60.0));
  EXPECT_EQ(store.claim(study.id, "worker", 60.0)->attempt, 6);
}

TEST_P(EachStore, ATrialIsTakenBackFromADeadWorkerTwiceAndThenHasFailed) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  for (int k = 0; k < 3; ++k) {
    const auto claim = store.claim(study.id, "dead", 60.0);
    ASSERT_TRUE(claim);
    EXPECT_THAT(store.take_back(study.id, [](const std::string& name) { return name == "x"; }),
                IsEmpty());
    EXPECT_THAT(store.take_back(study.id, [](const std::string& name) { return name == "dead"; }),
                ElementsAre("trial 0"));
    EXPECT_FALSE(store.finish(*claim, {.value = 1.0}));
  }
  EXPECT_FALSE(store.claim(study.id, "worker", 60.0));
  EXPECT_EQ(store.trials(study.id).front().state, TrialState::failed);
}

TEST_P(EachStore, ResumesTheSameStudyAndRefusesAnother) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(3));
  EXPECT_EQ(store.create_or_resume(a_study(), numbered_trials(3)).id, study.id);
  EXPECT_EQ(store.counts(study.id).total(), 3U);
  StoredStudy other = a_study();
  other.spec = "{\"seed\": 2}";
  EXPECT_THAT(test::error_message([&] { store.create_or_resume(other, {}); }),
              HasSubstr("other recordings, models or options"));
  StoredStudy newer = a_study();
  newer.torsio_version = "1.2.4";
  EXPECT_THAT(test::error_message([&] { store.create_or_resume(newer, {}); }),
              HasSubstr("another version of torsio"));
}

TEST_P(EachStore, DecidesAHalvingStepOnceItsTrialsHaveFinished) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(4));
  int calls = 0;
  const auto decide = [&](const std::string& group, int step, std::span<const TrialRecord> trials) {
    ++calls;
    HalvingDecision decision;
    if (group != "even" || step != 0) return decision;
    EXPECT_THAT(trials, SizeIs(2));
    decision.pruned = {{trials[0].id, "the worse one"}};
    decision.next = {{.key = trials[1].trial.key, .group = group, .step = 1}};
    return decision;
  };
  EXPECT_FALSE(store.advance(study.id, decide));
  while (const auto claim = store.claim(study.id, "worker", 60.0)) {
    store.finish(*claim, {.value = 1.0});
    store.advance(study.id, decide);
  }
  EXPECT_FALSE(store.advance(study.id, decide));
  EXPECT_EQ(calls, 3);  // even, odd, and the second step of even
  const auto trials = store.trials(study.id);
  ASSERT_THAT(trials, SizeIs(5));
  EXPECT_EQ(trials[0].state, TrialState::pruned);
  EXPECT_EQ(trials[0].result.reason, "the worse one");
  EXPECT_EQ(trials[0].result.value, 1.0);
  EXPECT_EQ(trials[4].trial.step, 1);
  EXPECT_TRUE(store.counts(study.id).is_complete());
}

TEST_P(EachStore, ManyThreadsFinishEachTrialOnce) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  constexpr int kTrials = 200;
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(kTrials));
  std::atomic<int> finished = 0;
  {
    std::vector<std::jthread> threads;
    for (int k = 0; k < 8; ++k)
      threads.emplace_back([&] {
        StudyStore own(address_);
        while (const auto claim = own.claim(study.id, "worker", 60.0))
          finished += own.finish(*claim, {.value = 1.0}) ? 1 : 0;
      });
  }
  EXPECT_EQ(finished, kTrials);
  std::set<std::int64_t> trials;
  for (const TrialRecord& record : store.best(study.id, 2 * kTrials)) {
    EXPECT_EQ(record.attempt, 1);
    trials.insert(record.id);
  }
  EXPECT_THAT(trials, SizeIs(kTrials));
}

TEST_P(EachStore, BestSkipsWhatHasNoValueAndHistoryIsOfOneDevice) {
  StudyStore store(address_);
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(6));
  while (const auto claim = store.claim(study.id, "worker", 60.0))
    store.finish(*claim, {.value = claim->key == "trial 3" ? kNotMeasured
                                                           : static_cast<double>(claim->trial)});
  const auto lowest = store.best(study.id, 1);
  ASSERT_THAT(lowest, SizeIs(1));
  EXPECT_EQ(lowest[0].trial.key, "trial 0");
  const auto best = store.best(study.id, 2, &lowest[0]);
  ASSERT_THAT(best, SizeIs(2));
  EXPECT_EQ(best[0].trial.key, "trial 1");
  EXPECT_EQ(best[1].trial.key, "trial 2");
  const auto history = store.history("joint 1");
  ASSERT_THAT(history, SizeIs(2));
  EXPECT_EQ(history[0].trial.key, "trial 1");
  EXPECT_EQ(history[1].trial.key, "trial 4");
  EXPECT_THAT(store.history(""), IsEmpty());
}

TEST_P(EachStore, ProgramsThatCreateItAtTheSameTimeAgree) {
  if (GetParam() == "memory") GTEST_SKIP() << "is for one program";
  std::vector<std::jthread> threads;
  for (int k = 0; k < 6; ++k)
    threads.emplace_back(
        [&] { StudyStore(address_).create_or_resume(a_study(), numbered_trials(10)); });
  threads.clear();
  StudyStore store(address_);
  EXPECT_THAT(store.studies(), SizeIs(1));
  EXPECT_EQ(store.counts(store.find_study("elbow")->id).total(), 10U);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachStore, testing::Values("memory", "sqlite", "postgresql"),
                         [](const auto& kind) { return kind.param; });

TEST(SqliteStore, RefusesWhatItCannotUse) {
  const TemporaryFolder folder;
  const auto message_of = [](const std::string& path) {
    return test::error_message([&] { const StudyStore store(store_address(path)); });
  };
  EXPECT_THAT(message_of(folder.path("absent/studies.sqlite")), HasSubstr("no folder"));
  EXPECT_THAT(message_of(folder.file("text.sqlite", std::string(5000, 'x'))),
              HasSubstr("not a store of torsio"));
  EXPECT_THAT(message_of(folder.path(".")), HasSubstr("cannot be opened"));
  { const StudyStore store(store_address(folder.path("whole.sqlite"))); }
  const std::string whole = test::file_bytes(folder.path("whole.sqlite"));
  const std::string part = folder.file("part.sqlite", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(message_of(part), HasSubstr("it is damaged"));
}

TEST(SqliteStore, WritesNothingIntoAFileOfAnotherProgram) {
  const TemporaryFolder folder;
  const std::string path = folder.path("rosbag.db3");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "CREATE TABLE topics(id)", nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  const std::string before = test::file_bytes(path);
  EXPECT_THAT(test::error_message([&] { const StudyStore store(store_address(path)); }),
              HasSubstr("of another program"));
  EXPECT_EQ(test::file_bytes(path), before);
  EXPECT_EQ(folder.files(), 1U);
}

/// Runs `work` in a process without the rights of root.
int exit_code_of(const std::function<int()>& work) {
  const pid_t process = fork();
  if (process == 0) {
    if (geteuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(99);
    _exit(work());
  }
  int status = 0;
  waitpid(process, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 98;
}

TEST(SqliteStore, OneThatMayNotBeWrittenIsLeftAsItIs) {
  const TemporaryFolder folder;
  const std::string path = folder.path("studies.sqlite");
  { const StudyStore store(store_address(path)); }
  std::filesystem::permissions(path, std::filesystem::perms(0444));
  std::filesystem::permissions(folder.path("."), std::filesystem::perms(0777));
  const auto opens = [](const std::string& file, std::string_view sentence) {
    const std::string message =
        test::error_message([&] { const StudyStore store(store_address(file)); });
    return message.find(sentence) == std::string::npos ? 1 : 0;
  };
  EXPECT_EQ(exit_code_of([&] { return opens(path, "the store may not be written"); }), 0);
  EXPECT_EQ(folder.files(), 1U) << "files of another user lock out the owner";
  std::filesystem::permissions(folder.path("."), std::filesystem::perms(0555));
  EXPECT_EQ(
      exit_code_of([&] { return opens(folder.path("new.sqlite"), "cannot be opened or created"); }),
      0);
  std::filesystem::permissions(folder.path("."), std::filesystem::perms(0755));
}

TEST(SqliteStore, WhereNothingCanBeWrittenNothingIsHalfWritten) {
  const TemporaryFolder folder;
  const std::string path = folder.path("studies.sqlite");
  StoredStudy study;
  {
    StudyStore store(store_address(path));
    study = store.create_or_resume(a_study(), numbered_trials(1));
  }
  std::filesystem::permissions(path, std::filesystem::perms(0666));
  std::filesystem::permissions(folder.path("."), std::filesystem::perms(0777));
  const int code = exit_code_of([&] {
    static_cast<void>(std::signal(SIGXFSZ, SIG_IGN));
    const rlimit limit{400'000, 400'000};  // bytes of a file: as a quota
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return 2;
    StudyStore store(store_address(path));
    const auto claim = store.claim(study.id, "worker", 60.0);
    const std::string message = test::error_message(
        [&] { store.finish(*claim, {.value = 1.0, .samples = std::string(1'000'000, 'x')}); });
    store.give_back(*claim);
    return message.find("Nothing of this step was written") == std::string::npos ? 1 : 0;
  });
  EXPECT_EQ(code, 0);
  StudyStore store(store_address(path));
  EXPECT_EQ(store.counts(study.id).waiting, 1U);
  EXPECT_THAT(store.best(study.id, 1), IsEmpty());
}

TEST(SqliteStore, RefusesANewerVersion) {
  const TemporaryFolder folder;
  const std::string path = folder.path("studies.sqlite");
  { const StudyStore store(store_address(path)); }
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "INSERT INTO schema_version VALUES(99, 0, '9.9')", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  EXPECT_THAT(test::error_message([&] { const StudyStore store(store_address(path)); }),
              HasSubstr("version 99"));
}

class PostgresqlStore : public testing::Test {
 protected:
  void SetUp() override {
    if (test::PostgresqlServer::programs().empty())
      GTEST_SKIP() << "no PostgreSQL server is installed";
  }
};

TEST_F(PostgresqlStore, WrongAddressesAreErrorsWithoutThePassword) {
  const auto message_of = [](const std::string& url) {
    return test::error_message([&] { const StudyStore store(store_address(url)); });
  };
  const std::string wrong = message_of(server().url("wrong-word"));
  EXPECT_THAT(wrong, HasSubstr("refuses the user or the password"));
  EXPECT_THAT(wrong, Not(HasSubstr("wrong-word")));
  EXPECT_THAT(message_of(server().url("secret", "absent")), HasSubstr("no such database"));
  EXPECT_THAT(message_of("postgresql://fleet@127.0.0.1:1/x"), HasSubstr("does not answer"));
  EXPECT_THAT(message_of("postgresql://fleet@no-host.invalid/x"),
              HasSubstr("no host of this name"));
  const std::string unreadable = message_of("postgresql://fleet:secret@127.0.0.1:port/x");
  EXPECT_THAT(unreadable, HasSubstr("this URL cannot be read"));
  EXPECT_THAT(unreadable, Not(HasSubstr("secret")));
  // Wrong from the first contact: waiting does not help.
  EXPECT_THAT(test::error_message([&] {
                const StudyStore store(store_address(server().url("wrong-word")), {}, 60.0);
              }),
              HasSubstr("refuses the user or the password"));
}

TEST_F(PostgresqlStore, WaitsForAServerThatRestarts) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  std::vector<std::string> reasons;
  StudyStore store(address, [&](const std::string& reason) {
    if (reasons.empty() || (reasons.back() != reason && (reason.empty() || reasons.back().empty())))
      reasons.push_back(reason);
    return true;
  });
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(3));
  for (const std::string mode : {"fast", "immediate"}) {
    const auto claim = store.claim(study.id, "worker", 60.0);
    ASSERT_TRUE(claim);
    own.stop(mode);
    std::jthread later([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      own.start();
    });
    EXPECT_TRUE(store.finish(*claim, {.value = 1.0}));
  }
  EXPECT_EQ(store.counts(study.id).finished, 2U);
  ASSERT_GE(reasons.size(), 2U);
  EXPECT_THAT(reasons[0], HasSubstr("lost"));
  EXPECT_EQ(reasons[1], "");
}

TEST_F(PostgresqlStore, LeasesThatEndedInAnOutageAreNotTakenBackAtOnce) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  StudyStore store(address, [](const std::string&) { return true; });
  constexpr double kLease_s = 1.0;
  const StoredStudy study = store.create_or_resume(a_study(), numbered_trials(1));
  const auto claim = store.claim(study.id, "worker", kLease_s);
  ASSERT_TRUE(claim);
  own.stop("fast");
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::duration<double>(1.5 * kLease_s));
    own.start();
  });
  EXPECT_FALSE(store.claim(study.id, "other", kLease_s));
  EXPECT_TRUE(store.extend(*claim, kLease_s));
  // Had the worker been lost, its trial would be given to another one now.
  std::this_thread::sleep_for(std::chrono::duration<double>(1.5 * kLease_s));
  EXPECT_TRUE(store.claim(study.id, "other", kLease_s));
}

TEST_F(PostgresqlStore, AServerThatStartsIsWaitedFor) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  { const StudyStore store(address); }
  own.stop("fast");
  const auto opened = [&](double patience_s) {
    const StudyStore store(
        address, [](const std::string&) { return true; }, patience_s);
  };
  EXPECT_THAT(test::error_message([&] { opened(0.0); }), HasSubstr("does not answer"));
  EXPECT_THAT(test::error_message([&] { opened(0.5); }), HasSubstr("does not answer"));
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    own.start();
  });
  EXPECT_NO_THROW(opened(60.0));
  later.join();
}

TEST_F(PostgresqlStore, AServerThatRecoversIsWaitedForWithoutPatience) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  own.stop("fast");
  own.start_in_recovery();
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    own.end_recovery();
  });
  std::set<std::string> reasons;
  const StudyStore store(address, [&](const std::string& reason) {
    reasons.insert(reason);
    return true;
  });
  EXPECT_THAT(reasons, Contains(HasSubstr("takes no connection at the moment")));
}

TEST_F(PostgresqlStore, AServerWithoutAFreeConnectionIsWaitedFor) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  own.stop("fast");
  constexpr std::size_t kConnections = 4;
  own.start(fmt::format("-c max_connections={} -c max_wal_senders=0", kConnections));
  std::vector<std::unique_ptr<StudyStore>> others;
  for (std::size_t k = 0; k < kConnections; ++k)
    others.push_back(std::make_unique<StudyStore>(address));
  std::set<std::string> reasons;
  const StudyStore store(address, [&](const std::string& reason) {
    reasons.insert(reason);
    others.clear();
    return true;
  });
  EXPECT_THAT(reasons, Contains(HasSubstr("takes no connection at the moment")));
  own.stop("immediate");
  own.start();
}

TEST_F(PostgresqlStore, TheUserEndsTheWaiting) {
  test::PostgresqlServer& own = restarted_server();
  const StoreAddress address = store_address(own.new_database());
  StudyStore store(address, [](const std::string&) { return false; });
  own.stop("fast");
  EXPECT_THROW((void)store.studies(), Cancelled);
  own.start();
}

}  // namespace
}  // namespace torsio
