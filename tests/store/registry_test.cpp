#include "torsio/store/registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <span>
#include <thread>

#include "data/byte_source.hpp"
#include "store/database.hpp"
#include "store/each_registry.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::EachRegistry;
using test::error_message;
using test::model_file_of;
using test::new_model_of;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kElbow = "dfki-50#0001";
constexpr const char* kKnee = "dfki-50#0002";
const std::string kExampleHash = "0123abcd";  // training file of the example model

TEST_P(EachRegistry, KeepsAModelWithWhatItWasMadeFrom) {
  Registry registry(address_);
  EXPECT_TRUE(registry.add_device({.serial = kElbow, .type = "dfki-50", .note = "left arm"}));
  EXPECT_FALSE(registry.add_device({.serial = kElbow}));
  registry.add_recording({.sha256 = "feed",
                          .device = kElbow,
                          .file = "/data/test.csv",
                          .samples = 20'000,
                          .rate_Hz = 1000.0});
  const std::int64_t base = registry.add_model(new_model_of(kElbow, 1));
  NewModel refined = new_model_of(kElbow, 18446744073709551615U);
  refined.parent = base;
  refined.note = "after the new spring";
  refined.base_sha256 = sha256_hex(model_file_of(kElbow, 1));
  refined.recordings = {{"feed", "test"}};
  const std::int64_t id = registry.add_model(refined);
  EXPECT_EQ(registry.add_model(refined), id) << "the same file again is the same model";

  const RegisteredModel model = registry.model(id);
  EXPECT_EQ(model.device, kElbow);
  EXPECT_EQ(model.family, "linear");
  EXPECT_EQ(model.file, "joint.safetensors");
  EXPECT_EQ(model.sha256, sha256_hex(refined.bytes));
  EXPECT_EQ(model.options.at("degree"), "3");
  EXPECT_EQ(model.seed, "18446744073709551615");
  EXPECT_EQ(model.metrics.at("rmse"), 0.1);
  EXPECT_EQ(model.parent, base);
  EXPECT_EQ(model.added_by, "robot@bench");
  EXPECT_EQ(model.note, "after the new spring");
  EXPECT_EQ(model.base_sha256, refined.base_sha256);
  EXPECT_EQ(registry.model_of_file(model.base_sha256)->id, base);
  EXPECT_FALSE(registry.model_of_file("feed"));
  EXPECT_EQ(model.size, refined.bytes.size());
  EXPECT_THAT(model.recordings,
              ElementsAre(RecordingUse{"feed", "test"}, RecordingUse{kExampleHash, "train"}));
  EXPECT_EQ(registry.model_bytes(kElbow, id), refined.bytes);

  const auto lineage = registry.lineage(id);
  ASSERT_THAT(lineage, SizeIs(2));
  EXPECT_EQ(lineage[1].id, base);
  EXPECT_EQ(registry.device(kElbow).note, "left arm");
  for (const auto& models : {registry.models(), registry.models(kElbow)}) {
    ASSERT_THAT(models, SizeIs(2));
    EXPECT_THAT(models[0].recordings, SizeIs(1));
    EXPECT_EQ(models[1].recordings, model.recordings);
  }
  auto recordings = registry.recordings(kElbow);
  ASSERT_THAT(recordings, SizeIs(2));
  std::ranges::sort(recordings, {}, &RegisteredRecording::sha256);
  EXPECT_EQ(recordings[0].device, "") << "a model may be trained on recordings of other devices";
  EXPECT_EQ(recordings[1].samples, 20'000U);
  EXPECT_EQ(recordings[1].rate_Hz, 1000.0);
}

TEST_P(EachRegistry, ARollBackUndoesPromotionsOneByOne) {
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  std::vector<std::int64_t> ids;
  for (const std::uint64_t seed : {1U, 2U, 3U})
    ids.push_back(registry.add_model(new_model_of(kElbow, seed)));
  EXPECT_FALSE(registry.current(kElbow));
  for (const std::int64_t id : ids) EXPECT_TRUE(registry.promote(kElbow, id, "robot", "better"));
  EXPECT_FALSE(registry.promote(kElbow, ids[2], "robot")) << "it is current already";
  EXPECT_EQ(registry.roll_back(kElbow, "robot", "worse"), ids[1]);
  EXPECT_EQ(registry.roll_back(kElbow, "robot"), ids[0]);
  EXPECT_THAT(error_message([&] { registry.roll_back(kElbow, "robot"); }),
              AllOf(HasSubstr("the first one that was promoted"), HasSubstr("none to roll back")));
  EXPECT_EQ(registry.current(kElbow)->id, ids[0]);
  EXPECT_TRUE(registry.promote(kElbow, ids[2], "robot"));
  EXPECT_EQ(registry.roll_back(kElbow, "robot"), ids[0]);

  const auto history = registry.promotions(kElbow);
  ASSERT_THAT(history, SizeIs(7));
  EXPECT_EQ(history[3].is_roll_back, true);
  EXPECT_EQ(history[3].model, ids[1]);
  EXPECT_EQ(history[3].made_by, "robot");
  EXPECT_EQ(history[3].reason, "worse");
  EXPECT_GE(history[3].made_at_s, history[2].made_at_s);
}

TEST_P(EachRegistry, RefusesWhatIsOfAnotherDevice) {
  Registry registry(address_);
  for (const char* serial : {kElbow, kKnee}) registry.add_device({.serial = serial});
  NewModel wrong = new_model_of(kElbow);
  wrong.device = kKnee;
  EXPECT_THAT(error_message([&] { registry.add_model(wrong); }),
              AllOf(HasSubstr("a model of another device"), HasSubstr(kElbow), HasSubstr(kKnee)));
  NewModel without = new_model_of("");
  without.device = kKnee;
  EXPECT_THAT(error_message([&] { registry.add_model(without); }),
              HasSubstr("torsio fit --device-serial"));
  const std::int64_t id = registry.add_model(new_model_of(kElbow));
  EXPECT_THAT(error_message([&] { registry.promote(kKnee, id, "robot"); }),
              AllOf(HasSubstr("one of another device"), HasSubstr("a model of dfki-50#0001")));
  EXPECT_THAT(error_message([&] { (void)registry.model_bytes(kKnee, id); }),
              HasSubstr("one of another device"));
  registry.add_recording({.sha256 = "feed", .device = kElbow, .file = "/data/a.csv"});
  EXPECT_THAT(error_message([&] {
                registry.add_recording({.sha256 = "feed", .device = kKnee, .file = "/data/b.csv"});
              }),
              HasSubstr("this recording is one of another device"));
  EXPECT_THAT(error_message(
                  [&] { registry.add_drift({.device = kKnee, .model = id, .recording = "feed"}); }),
              HasSubstr("one of another device"));
  // The database itself refuses it as well.
  const auto database = open_database(address_);
  if (GetParam() != "memory") {
    EXPECT_THROW(
        database->run("INSERT INTO current_models VALUES($1, $2, 0)", {std::string(kKnee), id}),
        Error);
  }
  EXPECT_THAT(registry.models(kKnee), IsEmpty());
  EXPECT_FALSE(registry.current(kKnee));
}

TEST_P(EachRegistry, NamesTheNearestDevice) {
  Registry registry(address_);
  EXPECT_THAT(error_message([&] { (void)registry.current(kElbow); }),
              AllOf(HasSubstr("there is no device 'dfki-50#0001'"), HasSubstr("torsio store add")));
  registry.add_device({.serial = kElbow});
  EXPECT_THAT(error_message([&] { (void)registry.current("dfki-50#001"); }),
              HasSubstr("Did you mean 'dfki-50#0001'?"));
  EXPECT_THAT(error_message([&] { (void)registry.model(17); }), HasSubstr("there is no model 17"));
  EXPECT_THAT(error_message([&] { registry.add_device({.serial = ""}); }), HasSubstr("nothing"));
  EXPECT_THAT(error_message([&] { registry.add_device({.serial = "a\nb"}); }),
              HasSubstr("without line breaks"));
}

TEST_P(EachRegistry, ADeviceKeepsItsTypeAndItsSerialNumber) {
  Registry registry(address_);
  registry.add_device({.serial = kElbow, .type = "dfki-50"});
  EXPECT_THAT(error_message([&] { registry.add_device({.serial = kElbow, .type = "dfki-28"}); }),
              AllOf(HasSubstr("its type cannot change"), HasSubstr("dfki-28")));
  registry.add_device({.serial = kElbow, .note = "left arm"});
  EXPECT_EQ(registry.device(kElbow).type, "dfki-50");
  EXPECT_EQ(registry.device(kElbow).note, "left arm");
  if (GetParam() == "memory") return;  // has one connection
  const auto database = open_database(address_);
  EXPECT_THAT(
      error_message([&] { database->run("UPDATE devices SET serial = 'other', note = ''"); }),
      HasSubstr("rows of devices are kept"));
  EXPECT_THAT(error_message([&] { database->run("DELETE FROM devices"); }),
              HasSubstr("rows of devices are kept"));
  EXPECT_EQ(registry.device(kElbow).note, "left arm");
}

TEST_P(EachRegistry, KeepsADriftEntryBitForBit) {
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  const std::int64_t id = registry.add_model(new_model_of(kElbow));
  const double third = 1.0 / 3.0;
  DriftEntry entry{.device = kElbow,
                   .model = id,
                   .recording = kExampleHash,
                   .verdict = "changed",
                   .rmse = third,
                   .stiffness = -0.08,
                   .stiffness_error = 0.01,
                   .details = "{\"samples\": 3}"};
  registry.add_drift(entry);
  entry.verdict = "not changed";
  registry.add_drift(entry);
  const auto history = registry.drift_history(kElbow);
  ASSERT_THAT(history, SizeIs(2));
  EXPECT_EQ(history[0].verdict, "changed");
  EXPECT_EQ(history[0].rmse, third);
  EXPECT_EQ(history[0].stiffness, -0.08);
  EXPECT_TRUE(std::isnan(history[0].friction));
  EXPECT_EQ(history[0].details, "{\"samples\": 3}");
  EXPECT_EQ(history[1].model, id);
  const auto summaries = registry.summaries();
  ASSERT_THAT(summaries, SizeIs(1));
  EXPECT_EQ(summaries[0].last_drift->verdict, "not changed");
  EXPECT_EQ(summaries[0].models, 1U);
  EXPECT_EQ(summaries[0].recordings, 1U);
  entry.recording = "absent";
  EXPECT_THAT(error_message([&] { registry.add_drift(entry); }), HasSubstr("not in the registry"));
}

TEST_P(EachRegistry, HistoriesAreOnlyAddedTo) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  const std::int64_t id = registry.add_model(new_model_of(kElbow));
  registry.promote(kElbow, id, "robot", "first");
  registry.add_drift(
      {.device = kElbow, .model = id, .recording = kExampleHash, .verdict = "changed"});
  const auto database = open_database(address_);
  for (const std::string table : {"promotions", "drift"}) {
    const std::string column = table == "drift" ? "verdict" : "reason";
    for (const std::string& sql :
         {"UPDATE " + table + " SET " + column + " = 'x'", "DELETE FROM " + table})
      EXPECT_THAT(error_message([&] { database->run(sql); }), HasSubstr("are kept as they are"))
          << sql;
  }
  const bool is_server = GetParam() == "postgresql";
  EXPECT_THAT(error_message([&] {
                database->run(is_server ? "TRUNCATE drift"
                                        : "INSERT OR REPLACE INTO drift SELECT * FROM drift");
              }),
              HasSubstr("are kept as they are"));
  EXPECT_EQ(registry.promotions(kElbow).front().reason, "first");
  EXPECT_EQ(registry.drift_history(kElbow).front().verdict, "changed");
}

TEST_P(EachRegistry, ModelsAndTheirLineageAreOnlyAddedTo) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  NewModel model = new_model_of(kElbow);
  model.base_sha256 = "feed";
  const std::int64_t id = registry.add_model(model);
  const auto database = open_database(address_);
  std::vector<std::string> statements{"UPDATE models SET note = 'x'",
                                      "UPDATE models SET parent = id",
                                      "DELETE FROM models",
                                      "UPDATE model_bases SET sha256 = 'x'",
                                      "DELETE FROM model_bases",
                                      "UPDATE model_recordings SET role = 'test'",
                                      "DELETE FROM model_recordings",
                                      GetParam() == "postgresql"
                                          ? "TRUNCATE models CASCADE"
                                          : "INSERT OR REPLACE INTO models SELECT * FROM models"};
  for (const std::string& sql : statements)
    EXPECT_THAT(error_message([&] { database->run(sql); }), HasSubstr("are kept as they are"))
        << sql;
  EXPECT_EQ(registry.model_bytes(kElbow, id), model.bytes);
  EXPECT_EQ(registry.model(id).base_sha256, "feed");
  EXPECT_THAT(registry.model(id).recordings, SizeIs(1));
}

/// What a damaged disk does: triggers of the registry do not keep it from that.
void damage_model(const StoreAddress& address, std::int64_t id) {
  const auto database = open_database(address);
  database->run(address.kind == StoreAddress::Kind::postgresql
                    ? "DROP TRIGGER models_change ON models"
                    : "DROP TRIGGER models_change");
  auto rows = database->run("SELECT bytes FROM models WHERE id = $1", {id});
  Blob blob = std::get<Blob>(rows.front().front());
  blob.bytes.back() = static_cast<char>(blob.bytes.back() ^ 1);
  database->run("UPDATE models SET bytes = $2 WHERE id = $1", {id, blob});
}

TEST_P(EachRegistry, ADamagedModelIsNeitherReadNorPromoted) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  const std::int64_t id = registry.add_model(new_model_of(kElbow));
  registry.promote(kElbow, id, "robot");
  const std::int64_t second = registry.add_model(new_model_of(kElbow, 2));
  EXPECT_THAT(registry.verify(), SizeIs(1));  // the remark about the recording
  damage_model(address_, second);
  EXPECT_THAT(error_message([&] { (void)registry.model_bytes(kElbow, second); }),
              HasSubstr("its bytes have changed"));
  EXPECT_THAT(error_message([&] { registry.promote(kElbow, second, "robot"); }),
              HasSubstr("its bytes have changed"));
  EXPECT_EQ(registry.current(kElbow)->id, id);
  const auto findings = registry.verify();
  ASSERT_THAT(findings, SizeIs(2));
  EXPECT_TRUE(findings[0].is_error);
  EXPECT_EQ(findings[0].place, "model 2 of dfki-50#0001");
  EXPECT_THAT(findings[0].text, HasSubstr("its bytes have changed"));
}

TEST_P(EachRegistry, VerifyComparesTheCurrentModelWithItsHistory) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  Registry registry(address_);
  std::vector<std::int64_t> ids;
  for (const char* serial : {kElbow, kKnee}) {
    registry.add_device({.serial = serial});
    for (const std::uint64_t seed : {1U, 2U})
      ids.push_back(registry.add_model(new_model_of(serial, seed)));
  }
  registry.promote(kElbow, ids[0], "robot");
  registry.promote(kKnee, ids[2], "robot");
  const auto database = open_database(address_);
  database->run("UPDATE current_models SET model = $1 WHERE device = $2",
                {ids[3], std::string(kKnee)});
  database->run("DELETE FROM current_models WHERE device = $1", {std::string(kElbow)});
  std::vector<std::string> errors;
  for (const RegistryFinding& each : registry.verify())
    if (each.is_error) errors.push_back(each.place + ": " + each.text);
  EXPECT_THAT(errors,
              ElementsAre("device dfki-50#0001: no model is current, but its history leads to "
                          "model 1",
                          "device dfki-50#0002: model 4 is current, but its history leads to model "
                          "3"));
}

TEST_P(EachRegistry, VerifyNamesARecordingThatChanged) {
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  const std::string changed = folder_.file("changed.csv", "t_s\n0\n");
  const std::string same = folder_.file("same.csv", "t_s\n1\n");
  for (const std::string& path : {changed, same, folder_.path("absent.csv")})
    registry.add_recording(
        {.sha256 = std::filesystem::exists(path) ? sha256_of_file(path) : std::string("feed"),
         .device = kElbow,
         .file = path});
  const auto error_count = [&] {
    const auto findings = registry.verify();
    return std::ranges::count_if(findings, &RegistryFinding::is_error);
  };
  EXPECT_EQ(error_count(), 0);
  folder_.file("changed.csv", "t_s\n2\n");
  EXPECT_EQ(error_count(), 1);
  for (const RegistryFinding& each : registry.verify()) {
    if (each.is_error)
      EXPECT_EQ(each.place, changed);
    else
      EXPECT_EQ(each.place, folder_.path("absent.csv"));
  }
}

TEST_P(EachRegistry, ATrainingFileThatIsThereIsKnownByItsAbsolutePath) {
  Registry registry(address_);
  registry.add_device({.serial = kElbow});
  const std::string path = folder_.file("sweep.csv", "t_s\n0\n");
  ModelFile file = test::example_model_file(AnyModel(test::example<Linear>()));
  file.card.device_serial = kElbow;
  file.card.training_files = {{std::filesystem::relative(path).string(), sha256_of_file(path)},
                              {"made in memory", ""}};
  const auto bytes = model_bytes(file);
  registry.add_model({.device = kElbow,
                      .bytes = {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                      .file = "m.safetensors"});
  const auto recordings = registry.recordings(kElbow);
  ASSERT_THAT(recordings, SizeIs(1));
  EXPECT_EQ(recordings.front().file, path);
}

TEST_P(EachRegistry, ProgramsThatPromoteAtTheSameTimeLeaveOneCurrentModel) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  constexpr int kThreads = 4;
  constexpr int kTimes = 10;
  std::vector<std::int64_t> ids;
  {
    Registry registry(address_);
    registry.add_device({.serial = kElbow});
    for (std::uint64_t seed = 0; seed < kThreads; ++seed)
      ids.push_back(registry.add_model(new_model_of(kElbow, seed)));
  }
  std::vector<std::jthread> threads;
  for (int k = 0; k < kThreads; ++k)
    threads.emplace_back([&, k] {
      Registry registry(address_);
      for (int i = 0; i < kTimes; ++i)
        registry.promote(kElbow, ids[static_cast<std::size_t>(k)], "robot");
    });
  threads.clear();
  Registry registry(address_);
  const auto history = registry.promotions(kElbow);
  EXPECT_EQ(registry.current(kElbow)->id, history.back().model);
  for (std::size_t i = 1; i < history.size(); ++i)
    EXPECT_NE(history[i].model, history[i - 1].model);
}

/// Changes the current models of two devices until it is killed.
/// @param begun a byte is written to it after the first change
[[noreturn]] void change_until_killed(const StoreAddress& address, int begun) {
  try {
    Registry registry(address);
    for (;;)
      for (const char* serial : {kElbow, kKnee}) {
        for (const RegisteredModel& model : registry.models(serial))
          registry.promote(serial, model.id, "robot");
        registry.roll_back(serial, "robot");
        if (write(begun, "", 1) != 1) _exit(1);
      }
  } catch (const std::exception&) {
  }
  _exit(1);
}

/// Kills such a process some time after its first change.
void kill_while_changing(const StoreAddress& address, std::chrono::milliseconds after) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) change_until_killed(address, pipe_ends[1]);
  close(pipe_ends[1]);
  char byte = 0;
  EXPECT_EQ(read(pipe_ends[0], &byte, 1), 1);
  std::this_thread::sleep_for(after);
  EXPECT_EQ(kill(child, SIGKILL), 0);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status)) << "it ended before it was killed";
  close(pipe_ends[0]);
}

TEST_P(EachRegistry, AProgramThatIsKilledLeavesOneCurrentModelPerDevice) {
  if (GetParam() == "memory") GTEST_SKIP() << "has one connection";
  constexpr int kKills = 25;
  {
    Registry registry(address_);
    for (const char* serial : {kElbow, kKnee}) {
      registry.add_device({.serial = serial});
      for (const std::uint64_t seed : {1U, 2U, 3U}) registry.add_model(new_model_of(serial, seed));
      registry.promote(serial, registry.models(serial).front().id, "robot");
    }
  }
  for (int k = 0; k < kKills; ++k) {
    ASSERT_NO_FATAL_FAILURE(kill_while_changing(address_, std::chrono::milliseconds(37 * k % 40)));
    Registry registry(address_);
    for (const char* serial : {kElbow, kKnee}) {
      ASSERT_TRUE(registry.current(serial));
      EXPECT_EQ(registry.current(serial)->device, serial);
    }
    for (const RegistryFinding& each : registry.verify())
      EXPECT_FALSE(each.is_error) << "kill " << k << ": " << each.place << ": " << each.text;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachRegistry, testing::Values("memory", "sqlite", "postgresql"),
                         [](const auto& kind) { return kind.param; });

TEST(RegistryOnServer, WaitsForAServerThatRestartsAndCountsAPromotionOnce) {
  if (test::PostgresqlServer::programs().empty())
    GTEST_SKIP() << "no PostgreSQL server is installed";
  test::PostgresqlServer own;
  Registry registry(store_address(own.url()), [](const std::string&) { return true; });
  registry.add_device({.serial = kElbow});
  const std::int64_t first = registry.add_model(new_model_of(kElbow, 1));
  const std::int64_t second = registry.add_model(new_model_of(kElbow, 2));
  registry.promote(kElbow, first, "robot");
  own.stop("immediate");
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    own.start();
  });
  EXPECT_TRUE(registry.promote(kElbow, second, "robot"));
  later.join();
  EXPECT_EQ(registry.roll_back(kElbow, "robot"), first);
  EXPECT_THAT(registry.promotions(kElbow), SizeIs(3));
}

}  // namespace
}  // namespace torsio
