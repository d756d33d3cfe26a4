// Stores of other versions: version_1.sql is what torsio wrote before it had devices.
#include "store/schema.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "store/each_registry.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

std::string version_1_dump() { return test::file_bytes(TORSIO_VERSION_1_STORE); }

class OldStore : public test::EachRegistry {
 protected:
  void SetUp() override {
    EachRegistry::SetUp();
    if (IsSkipped()) return;
    if (GetParam() == "sqlite")
      restore_file();
    else
      restore_database();
  }

  void restore_file() const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(address_.target.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, version_1_dump().c_str(), nullptr, nullptr, nullptr),
              SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }

  /// Tables by the script of version 1, and the rows of the dump.
  void restore_database() const {
    const auto database = open_database(address_);
    ASSERT_EQ(upgrade_schema(*database, "store", 1), 0);
    for (const std::string table : {"studies", "trials", "results", "steps"}) {
      std::istringstream dump(version_1_dump());
      for (std::string line; std::getline(dump, line);)
        if (line.starts_with("INSERT INTO \"" + table)) database->run(line);
    }
    database->run("INSERT INTO samples VALUES(1, $1)", {Blob{"\x01\x02"}});
  }
};

TEST_P(OldStore, IsRefusedWithTheCommandThatUpgradesIt) {
  const auto refusal = AllOf(HasSubstr("version 1"), HasSubstr("torsio store upgrade --store"));
  EXPECT_THAT(error_message([&] { const StudyStore store(address_); }), refusal);
  EXPECT_THAT(error_message([&] { const Registry registry(address_); }), refusal);
}

TEST_P(OldStore, IsUpgradedWithItsStudies) {
  const StoreUpgrade upgraded = upgrade_store(address_);
  EXPECT_EQ(upgraded.before, 1);
  EXPECT_EQ(upgraded.after, kStoreVersion);
  EXPECT_EQ(upgrade_store(address_).before, kStoreVersion);

  StudyStore store(address_);
  const auto study = store.find_study("line");
  ASSERT_TRUE(study);
  const auto trials = store.trials(study->id);
  ASSERT_THAT(trials, SizeIs(3));
  EXPECT_EQ(trials[0].trial.key, "specimen dfki-50#0001");
  EXPECT_EQ(trials[0].result.value, 0.8571);
  EXPECT_EQ(store.samples(trials[0].id), "\x01\x02");
  EXPECT_EQ(trials[1].state, TrialState::failed);
  EXPECT_EQ(trials[1].result.reason, "it diverged");
  const auto claim = store.claim(study->id, "bench:2", 60.0);
  ASSERT_TRUE(claim);
  EXPECT_EQ(claim->key, "specimen dfki-50#0003");

  Registry registry(address_);
  registry.add_device({.serial = "dfki-50#0001"});
  NewModel model = test::new_model_of("dfki-50#0001");
  model.trial = trials[0].id;
  EXPECT_EQ(registry.model(registry.add_model(model)).trial, trials[0].id);
  model = test::new_model_of("dfki-50#0001", 2);
  model.trial = 4711;
  EXPECT_THROW(registry.add_model(model), Error) << "there is no such trial";
}

TEST_P(OldStore, ProgramsThatUpgradeItAtTheSameTimeDoSoOnce) {
  std::vector<StoreUpgrade> upgraded(6);
  std::vector<std::jthread> threads;
  threads.reserve(upgraded.size());
  for (StoreUpgrade& each : upgraded)
    threads.emplace_back([this, &each] { each = upgrade_store(address_); });
  threads.clear();
  for (const StoreUpgrade& each : upgraded) EXPECT_EQ(each.after, kStoreVersion);
  const auto rows =
      open_database(address_)->run("SELECT count(*), count(DISTINCT version) FROM schema_version");
  EXPECT_EQ(std::get<std::int64_t>(rows.front()[0]), kStoreVersion);
  EXPECT_EQ(std::get<std::int64_t>(rows.front()[1]), kStoreVersion);
  EXPECT_THAT(StudyStore(address_).studies(), SizeIs(1));
}

TEST_P(OldStore, ModelsOfVersion2AreKeptAndThenNotChangedAnyMore) {
  const auto database = open_database(address_);
  upgrade_schema(*database, "store", 2);
  database->run("INSERT INTO devices VALUES('J01', 'knee', '', 0)");
  database->run(
      "INSERT INTO models(device, sha256, family, file, torsio_version, options, seed, metrics, "
      "added_at, added_by, note, size, bytes) VALUES('J01', 'feed', 'linear', 'a', '1', '{}', '1', "
      "'{}', 0, 'robot', '', 1, $1)",
      {Blob{"\x01"}});
  database->run("UPDATE models SET note = 'changed by hand'");
  EXPECT_EQ(upgrade_store(address_).before, 2);
  EXPECT_EQ(Registry(address_).models("J01").front().note, "changed by hand");
  EXPECT_THAT(error_message([&] { database->run("UPDATE models SET note = 'again'"); }),
              HasSubstr("rows of models are kept as they are"));
}

TEST_P(OldStore, ANewerOneIsNotChanged) {
  upgrade_store(address_);
  open_database(address_)->run("INSERT INTO schema_version VALUES(99, 0, '9.9')");
  const auto refusal = AllOf(HasSubstr("version 99"), HasSubstr("or a newer one"));
  EXPECT_THAT(error_message([&] { upgrade_store(address_); }), refusal);
  EXPECT_THAT(error_message([&] { const Registry registry(address_); }), refusal);
}

INSTANTIATE_TEST_SUITE_P(Kinds, OldStore, testing::Values("sqlite", "postgresql"),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace torsio
