// `torsio store` as a person calls it.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "program/program.hpp"
#include "support/file_bytes.hpp"

namespace torsio::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class StoreVerb : public Program {
 protected:
  /// A recording, and models of two joints that were fitted to it.
  void SetUp() override {
    for (const char* call :
         {"simulate dfki-50 sweep --duration 20s --seed 1 -o a.csv",
          "fit a.csv --model linear --device-serial elbow -o linear.safetensors",
          "fit a.csv --model polynomial --device-serial elbow -o polynomial.safetensors",
          "fit a.csv --model linear --device-serial knee -o knee.safetensors"})
      done(call);
  }

  /// What a call printed that has to succeed.
  std::string done(const std::string& call) {
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, 0) << call << '\n' << outcome.err;
    return outcome.out;
  }
  nlohmann::json json_of(const std::string& call) {
    return nlohmann::json::parse(done(call + " --json -"));
  }
  void expect_refusal(const std::string& call, int exit_code, const std::string& sentence) {
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, exit_code) << call;
    EXPECT_THAT(outcome.err, HasSubstr(sentence)) << call;
  }
  [[nodiscard]] bool has_file(const std::string& name) const {
    return std::filesystem::exists(folder_.path(name));
  }

  /// Runs the program and kills it after a time. @returns whether it was still running
  bool killed(const std::vector<std::string>& arguments, std::chrono::microseconds after) {
    const pid_t child = fork();
    if (child == 0) {
      std::vector<char*> words;
      std::string program = TORSIO_PROGRAM;
      words.push_back(program.data());
      std::vector<std::string> copies = arguments;
      for (std::string& each : copies) words.push_back(each.data());
      words.push_back(nullptr);
      const int nowhere = open("/dev/null", O_RDWR);
      dup2(nowhere, STDOUT_FILENO);
      dup2(nowhere, STDERR_FILENO);
      if (chdir(folder_.path("").c_str()) == 0) execv(words.front(), words.data());
      _exit(127);
    }
    std::this_thread::sleep_for(after);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFSIGNALED(status);
  }
};

TEST_F(StoreVerb, KeepsTheRecordOfADevice) {
  expect_refusal("store list", kCallWasWrong, "there is no store");
  EXPECT_FALSE(has_file("torsio-studies.sqlite"));
  const Outcome added =
      torsio("store add elbow linear.safetensors --recordings a.csv --type dfki-50 --note 'left'");
  EXPECT_EQ(added.exit_code, 0) << added.err;
  EXPECT_THAT(added.out, AllOf(HasSubstr("device elbow is new"), HasSubstr("model 1")));
  EXPECT_THAT(added.err, HasSubstr("torsio store promote 'elbow' 1"));
  expect_refusal("store export elbow -o out.safetensors", kWorkFailed, "no model is current");
  done("store promote elbow 1 --by robot@bench --reason first");
  done("store add elbow polynomial.safetensors --parent 1");
  EXPECT_THAT(done("store promote elbow 2"),
              HasSubstr("model 2 is the current one of elbow; before: 1"));
  EXPECT_THAT(done("store promote elbow 2"), HasSubstr("already"));
  const std::string shown = done("store show elbow");
  EXPECT_THAT(shown, AllOf(HasSubstr("device elbow, type dfki-50"), HasSubstr("left"),
                           HasSubstr("model 2 (polynomial), made from model 1 (linear)"),
                           HasSubstr("robot@bench"), HasSubstr("first"), HasSubstr("a.csv")));
  EXPECT_THAT(done("store roll-back elbow"), HasSubstr("model 1 is the current one of elbow"));
  expect_refusal("store roll-back elbow", kWorkFailed, "there is none to roll back to");

  done("store export elbow -o out.safetensors");
  EXPECT_EQ(contents("out.safetensors"), contents("linear.safetensors"));
  done("store export elbow --model 2 -o out.safetensors");
  EXPECT_EQ(contents("out.safetensors"), contents("polynomial.safetensors"));
  expect_refusal("store export elbow -o torsio-studies.sqlite", kCallWasWrong,
                 "torsio-studies.sqlite");

  const auto devices = json_of("store list");
  EXPECT_EQ(devices.at("schema_version"), 1);
  EXPECT_EQ(devices.at("devices").at(0).at("current").at("id"), 1);
  EXPECT_EQ(devices.at("devices").at(0).at("recordings"), 1);
  const auto device = json_of("store show elbow");
  EXPECT_EQ(device.at("promotions").size(), 3U);
  EXPECT_EQ(device.at("promotions").at(2).at("action"), "roll back");
  EXPECT_EQ(device.at("recordings").at(0).at("samples"), 20'000);
  EXPECT_EQ(device.at("models").at(1).at("parent"), 1);
  EXPECT_EQ(json_of("store list --models").at("models").size(), 2U);
  EXPECT_EQ(json_of("store list --recordings").at("recordings").at(0).at("device"), "elbow");
  EXPECT_EQ(json_of("store list --studies").at("studies").size(), 0U);
}

TEST_F(StoreVerb, ShowsFromWhichModelOneWasTransferred) {
  done(
      "fleet calibrate --specimens 'dfki-50#0001..#0002' --model linear --store line.sqlite "
      "--promote");
  const auto first = json_of("store show 'dfki-50#0001' --store line.sqlite");
  const auto second = json_of("store show 'dfki-50#0002' --store line.sqlite");
  const std::string sha256 = first.at("models").at(0).at("sha256");
  EXPECT_TRUE(first.at("models").at(0).at("base_sha256").is_null());
  EXPECT_EQ(second.at("models").at(0).at("base_sha256"), sha256);
  EXPECT_THAT(done("store show 'dfki-50#0002' --store line.sqlite"),
              HasSubstr("base of model 2: model 1 (linear) of dfki-50#0001, SHA-256 " +
                        sha256.substr(0, 12)));

  // A base that is a file alone.
  done("store export 'dfki-50#0001' --store line.sqlite -o base.safetensors");
  done(
      "fleet calibrate --specimens 'dfki-50#0002..#0002' --model linear --base base.safetensors "
      "--store other.sqlite --promote");
  EXPECT_THAT(done("store show 'dfki-50#0002' --store other.sqlite"),
              HasSubstr("base of model 1: a file that is not in this store, SHA-256 " + sha256));

  // Also where no model is current.
  done(
      "fleet calibrate --specimens 'dfki-50#0002..#0002' --model linear --base base.safetensors "
      "--store third.sqlite");
  EXPECT_THAT(done("store show 'dfki-50#0002' --store third.sqlite"),
              AllOf(HasSubstr("no model is current"), HasSubstr("base of model 1: a file")));
}

TEST_F(StoreVerb, RefusesFilesOfOtherDevices) {
  done("store add elbow linear.safetensors --recordings a.csv");
  expect_refusal("store add elbow polynomial.safetensors knee.safetensors", kWorkFailed,
                 "knee.safetensors: this is a model of another device");
  EXPECT_EQ(json_of("store list --models").at("models").size(), 1U) << "all or none";
  expect_refusal("store add shoulder linear.safetensors", kWorkFailed,
                 "A serial number is the identity of a device");
  EXPECT_EQ(json_of("store list").at("devices").size(), 1U) << "no device without its model";
  done("fit a.csv --model linear -o any.safetensors");
  expect_refusal("store add elbow any.safetensors", kWorkFailed,
                 "torsio fit --device-serial 'elbow'");
  expect_refusal("store add elbow a.csv", kWorkFailed, "a.csv");
  done("store add knee knee.safetensors");
  expect_refusal("store add knee --recordings a.csv", kWorkFailed,
                 "this recording is one of another device");
  expect_refusal("store promote knee 1", kCallWasWrong, "model 1 is one of another device");
  expect_refusal("store export knee --model 1 -o out.safetensors", kCallWasWrong,
                 "model 1 is one of another device");
  EXPECT_FALSE(has_file("out.safetensors"));
  expect_refusal("store show elbwo", kCallWasWrong, "Did you mean 'elbow'?");
  expect_refusal("store promot elbow 1", kCallWasWrong, "Did you mean 'promote'?");
}

TEST_F(StoreVerb, VerifyNamesWhatHasChanged) {
  done("store add elbow linear.safetensors --recordings a.csv");
  EXPECT_THAT(done("store verify"), AllOf(HasSubstr("no error"), Not(HasSubstr("remark"))));
  done("simulate dfki-50 sweep --duration 20s --seed 2 -o a.csv");
  const Outcome changed = torsio("store verify");
  EXPECT_EQ(changed.exit_code, kWorkFailed);
  EXPECT_THAT(changed.out, AllOf(HasSubstr("error: "), HasSubstr("a.csv: the recording has "
                                                                 "changed: expected SHA-256")));
  std::filesystem::remove(folder_.path("a.csv"));
  EXPECT_THAT(done("store verify"), AllOf(HasSubstr("remark: "), HasSubstr("is not there")));
}

TEST_F(StoreVerb, UpgradesAnOldStoreOnlyWhenAsked) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(folder_.path("old.sqlite").c_str(), &database), SQLITE_OK);
  EXPECT_EQ(
      sqlite3_exec(database, file_bytes(TORSIO_VERSION_1_STORE).c_str(), nullptr, nullptr, nullptr),
      SQLITE_OK);
  sqlite3_close(database);
  for (const char* call : {"store list", "work", "store add elbow linear.safetensors"})
    expect_refusal(std::string(call) + " --store old.sqlite", kWorkFailed,
                   "torsio store upgrade --store 'old.sqlite'");
  EXPECT_THAT(done("store upgrade --store old.sqlite"), HasSubstr("from version 1 to 3"));
  EXPECT_THAT(done("store upgrade --store old.sqlite"), HasSubstr("of version 3 already"));
  EXPECT_EQ(json_of("store list --studies --store old.sqlite").at("studies").at(0).at("finished"),
            2);
}

TEST_F(StoreVerb, AFullDiskLeavesNothingHalfDone) {
  done(
      "fit a.csv --model mlp --set layers=128-128 --set epochs=1 --device-serial elbow -o "
      "large.safetensors");
  ASSERT_GT(std::filesystem::file_size(folder_.path("large.safetensors")), 65'000U);
  done("store add elbow linear.safetensors");
  // A file may grow to this many blocks of 512 bytes: its writes fail as on a full disk, midway.
  const Outcome full = shell("ulimit -f 120; {torsio} store add elbow large.safetensors");
  EXPECT_EQ(full.exit_code, kWorkFailed) << full.out;
  EXPECT_THAT(full.err, HasSubstr("torsio-studies.sqlite"));
  done("store verify");
  EXPECT_EQ(json_of("store list --models").at("models").size(), 1U);
  done("store add elbow large.safetensors");
  const Outcome exported =
      shell("ulimit -f 120; {torsio} store export elbow --model 2 -o out.safetensors");
  EXPECT_EQ(exported.exit_code, kWorkFailed);
  EXPECT_THAT(exported.err, HasSubstr("out.safetensors"));
  EXPECT_FALSE(has_file("out.safetensors"));
}

TEST_F(StoreVerb, AKilledExportWritesTheWholeModelOrNone) {
  done("store add elbow linear.safetensors polynomial.safetensors");
  done("store promote elbow 1");
  const std::string model = contents("linear.safetensors");
  const auto begin = std::chrono::steady_clock::now();
  done("store export elbow -o out.safetensors");
  const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now() - begin);
  int killed_exports = 0;
  int whole_exports = 0;
  constexpr int kKills = 60;
  for (int k = 0; k < kKills; ++k) {
    std::filesystem::remove(folder_.path("out.safetensors"));
    const bool was_killed =
        killed({"store", "export", "elbow", "-o", "out.safetensors"}, whole * (k + 1) / 45);
    killed_exports += was_killed ? 1 : 0;
    if (!has_file("out.safetensors")) continue;
    ++whole_exports;
    ASSERT_EQ(contents("out.safetensors"), model) << "kill " << k;
  }
  EXPECT_GT(killed_exports, 0);
  EXPECT_GT(whole_exports, 0);
}

TEST_F(StoreVerb, AKilledPromotionLeavesOneCurrentModel) {
  done("store add elbow linear.safetensors polynomial.safetensors");
  done("store promote elbow 1");
  const auto begin = std::chrono::steady_clock::now();
  done("store promote elbow 2");
  const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now() - begin);
  constexpr int kKills = 40;
  for (int k = 0; k < kKills; ++k) {
    const auto after = whole * (k + 1) / 30;
    if (k % 2 == 0)
      killed({"store", "roll-back", "elbow"}, after);
    else
      killed({"store", "promote", "elbow", "2"}, after);
    if (k % 8 != 7) continue;
    done("store verify");
    const auto current = json_of("store list").at("devices").at(0).at("current").at("id");
    EXPECT_TRUE(current == 1 || current == 2) << current;
  }
}

}  // namespace
}  // namespace torsio::test
