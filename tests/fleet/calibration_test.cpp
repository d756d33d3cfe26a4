#include "fleet/calibration.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "data/byte_source.hpp"
#include "fleet/fleet_text.hpp"
#include "fleet/registration.hpp"
#include "fleet/watch.hpp"
#include "fleet/watch_text.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/data/write.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/search/workers.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Joints of recordings in files.
class CalibrationStudyTest : public testing::Test {
 protected:
  CalibrationStudyTest() {
    for (const int serial : {3, 4}) {
      FleetJoint joint{.serial = "J0" + std::to_string(serial), .type = "dfki-50"};
      const std::string specimen = "dfki-50#000" + std::to_string(serial);
      joint.train = {recorded(specimen, 1)};
      joint.test = {recorded(specimen, 2)};
      request_.joints.push_back(std::move(joint));
    }
    request_.model = "linear_coulomb";
  }

  std::string recorded(const std::string& specimen, std::uint64_t seed) {
    ExperimentSpec spec{.actuator = specimen, .seed = seed};
    spec.duration_s = 8.0;
    const std::string file = folder_.path(specimen.substr(8) + "-" + std::to_string(seed) + ".csv");
    write_csv(simulate(spec), file);
    return file;
  }

  static StoredStudy study_in(StudyStore& store, const CalibrationStudy& kind) {
    return begin_calibration(store, "robot", kind);
  }

  /// A store with the models of the joints, all of them current.
  std::string calibrated_store(const std::string& name, const std::string& study_name = "robot") {
    const StoreAddress address = store_address(folder_.path(name));
    StudyStore store(address);
    CalibrationStudy kind(request_);
    const StoredStudy study = begin_calibration(store, study_name, kind);
    run_workers(store, study, kind, {.threads = 1});
    Registry registry(address);
    EXPECT_EQ(register_fleet(registry, store, calibration_result(store, study), kind.request(),
                             true, "a test")
                  .promoted,
              request_.joints.size());
    return address.target;
  }

  /// The base is the model of the first joint, in a file.
  void use_base_in_file() {
    Registry registry(store_address(calibrated_store("base.sqlite")));
    const std::string bytes = registry.model_bytes("J03", registry.current("J03")->id);
    request_.base = folder_.file("base.safetensors", bytes);
  }

  TemporaryFolder folder_;
  CalibrationRequest request_;
};

TEST_F(CalibrationStudyTest, EachJointGetsItsOwnModel) {
  const StoreAddress address = store_address(folder_.path("robot.sqlite"));
  StudyStore store(address);
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const FleetCalibration fleet = calibration_result(store, study);
  ASSERT_EQ(fleet.joints.size(), 2U);
  for (const CalibratedJoint& joint : fleet.joints) {
    EXPECT_EQ(joint.failure, "");
    EXPECT_EQ(joint.methods.front().name, "base");
    EXPECT_GT(joint.test_rmse, 0.0);
    EXPECT_LE(joint.test_rmse, 1.05 * joint.methods.front().test_rmse);
    const std::string bytes = store.samples(joint.trial);
    const ModelFile model = parse_model(std::as_bytes(std::span(bytes)), "model", joint.serial);
    EXPECT_EQ(model.card.device_serial, joint.serial);
  }
  EXPECT_EQ(fleet.joints[0].chosen, "base") << "it is the first of its type";
  EXPECT_EQ(fleet.joints[0].methods.size(), 1U);
  EXPECT_EQ(fleet.joints[1].methods.back().name, "own fit");

  Registry registry(address);
  const RegisteredFleet added =
      register_fleet(registry, store, fleet, kind.request(), true, "a test");
  EXPECT_EQ(added.models, 2U);
  EXPECT_EQ(added.promoted, 2U);
  EXPECT_THAT(added.not_compared, testing::ElementsAre("J03", "J04")) << "8 are needed";
  const RegisteredFleet again =
      register_fleet(registry, store, fleet, kind.request(), true, "a test");
  EXPECT_EQ(again.promoted, 0U);
  EXPECT_EQ(again.current_before, 2U);
  EXPECT_THAT(again.not_compared, IsEmpty());
  EXPECT_EQ(registry.models().size(), 2U);
  EXPECT_THAT(registry.verify(), IsEmpty());

  // The test recordings of today are those of the calibration: nothing has drifted.
  for (const FleetJoint& joint : request_.joints)
    watch_joint(registry, {.serial = joint.serial, .train = joint.test}, request_);
  const std::vector<WatchedJoint> ranked = rank_by_drift(registry);
  ASSERT_EQ(ranked.size(), 2U);
  EXPECT_EQ(ranked.front().comparisons, 1U);
  EXPECT_GE(ranked.front().severity, 0.0);
}

/// A comparison of the current model of a joint, without the recordings of one.
void add_comparison(Registry& registry, const std::string& serial, DriftVerdict verdict,
                    double severity, DriftAdvice advice) {
  registry.add_drift({.device = serial,
                      .model = registry.current(serial)->id,
                      .recording = registry.recordings(serial).front().sha256,
                      .verdict = std::string(name(verdict)),
                      .rmse = 0.4,
                      .details = fmt::format(R"({{"advice":"{}","severity":{},"calibration_rmse":)"
                                             R"({},"worst":"nothing"}})",
                                             name(advice), severity, serial == "J03" ? 0.4 : 0.1)});
}

TEST_F(CalibrationStudyTest, TheDriftOfAnEarlierModelIsNotThatOfTheCurrentOne) {
  const StoreAddress address = store_address(calibrated_store("robot.sqlite"));
  Registry registry(address);
  add_comparison(registry, "J03", DriftVerdict::changed, 4.26, DriftAdvice::calibrate);
  EXPECT_EQ(rank_by_drift(registry).front().severity, 4.26);

  request_.model = "linear";
  calibrated_store("robot.sqlite", "again");
  const std::vector<WatchedJoint> ranked = rank_by_drift(registry);
  const WatchedJoint& joint = ranked.front();
  EXPECT_EQ(joint.serial, "J03");
  EXPECT_EQ(joint.model, registry.current("J03")->id);
  EXPECT_FALSE(joint.last.has_value());
  EXPECT_TRUE(std::isnan(joint.severity));
  EXPECT_EQ(joint.comparisons, 0U);
  EXPECT_EQ(joint.earlier_comparisons, 1U);
  EXPECT_THAT(watch_text(ranked),
              HasSubstr(fmt::format("never compared with model {}", *joint.model)));
}

TEST_F(CalibrationStudyTest, WhatThereIsSomethingToDoAboutComesFirst) {
  Registry registry(store_address(calibrated_store("robot.sqlite")));
  const auto first = [&] { return rank_by_drift(registry).front().serial; };
  add_comparison(registry, "J03", DriftVerdict::undetermined, 0.0, DriftAdvice::record_more);
  add_comparison(registry, "J04", DriftVerdict::undetermined, 0.0, DriftAdvice::record_more);
  EXPECT_EQ(first(), "J04") << "its error is 4 times that of the calibration";
  add_comparison(registry, "J03", DriftVerdict::undetermined, 0.3, DriftAdvice::record_more);
  EXPECT_EQ(first(), "J03");
  add_comparison(registry, "J04", DriftVerdict::undetermined, 0.0, DriftAdvice::calibrate);
  EXPECT_EQ(first(), "J04");
  add_comparison(registry, "J03", DriftVerdict::changed, 0.5, DriftAdvice::none);
  EXPECT_EQ(first(), "J03");
  add_comparison(registry, "J03", DriftVerdict::not_changed, 0.5, DriftAdvice::none);
  EXPECT_EQ(first(), "J04");
}

TEST_F(CalibrationStudyTest, AnotherCalibrationOfTheSameNameStatesWhatDiffers) {
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  study_in(store, CalibrationStudy(request_));
  request_.joints.pop_back();
  request_.seed = 2;
  EXPECT_THAT(test::error_message([&] { study_in(store, CalibrationStudy(request_)); }),
              testing::AllOf(HasSubstr("study 'robot'"),
                             HasSubstr("the joints or their recordings, seed (1, now 2)"),
                             HasSubstr("--study NAME")));
}

TEST_F(CalibrationStudyTest, AModelThatWasTransferredHasItsBaseInItsLineage) {
  request_.model = "linear";
  Registry registry(store_address(calibrated_store("robot.sqlite")));
  const RegisteredModel first = registry.models("J03").front();
  const RegisteredModel second = registry.models("J04").front();
  EXPECT_EQ(first.base_sha256, "");
  EXPECT_THAT(second.note, HasSubstr("transfer"));
  EXPECT_EQ(second.base_sha256, first.sha256);
  EXPECT_EQ(registry.model_of_file(second.base_sha256)->device, "J03");
}

TEST_F(CalibrationStudyTest, TheBaseOfAFileIsKnownByItsHash) {
  request_.model = "linear";
  use_base_in_file();
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const FleetCalibration fleet = calibration_result(store, study);
  EXPECT_THAT(fleet.joints[1].chosen, HasSubstr("transfer"));
  EXPECT_EQ(fleet.joints[1].base_sha256, sha256_of_file(request_.base));
}

TEST_F(CalibrationStudyTest, ABaseThatHasChangedIsRefused) {
  use_base_in_file();
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  std::ofstream(request_.base, std::ios::app) << " ";
  EXPECT_THAT(
      test::error_message([&] { run_workers(store, study, kind, {.threads = 1}); }),
      testing::AllOf(HasSubstr("base.safetensors"), HasSubstr("has changed since the study")));
}

TEST_F(CalibrationStudyTest, TheFirstUsableJointIsTheBaseOfItsType) {
  std::ofstream(request_.joints[0].train.front()) << "time_s,torque_Nm\n0,1\n0.001,1\n";
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const FleetCalibration fleet = calibration_result(store, study);
  EXPECT_NE(fleet.joints[0].failure, "");
  EXPECT_EQ(fleet.joints[1].failure, "");
  EXPECT_EQ(fleet.joints[1].chosen, "base");
}

TEST_F(CalibrationStudyTest, AStudyThatIsResumedRefusesARecordingThatHasChanged) {
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  study_in(store, CalibrationStudy(request_));
  EXPECT_EQ(study_in(store, CalibrationStudy(request_)).name, "robot");
  std::ofstream(request_.joints[1].test.front(), std::ios::app) << "\n";
  EXPECT_THAT(test::error_message([&] { study_in(store, CalibrationStudy(request_)); }),
              testing::AllOf(HasSubstr("0004-2.csv"), HasSubstr("has changed since the study")));
}

TEST_F(CalibrationStudyTest, AModelIsRegisteredWithTheRecordingsThatItWasMadeFrom) {
  const StoreAddress address = store_address(folder_.path("robot.sqlite"));
  StudyStore store(address);
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const std::string before = sha256_of_file(request_.joints[1].train.front());
  std::ofstream(request_.joints[1].train.front(), std::ios::app) << "\n";  // too late for the study
  Registry registry(address);
  static_cast<void>(register_fleet(registry, store, calibration_result(store, study),
                                   kind.request(), false, "a test"));
  EXPECT_THAT(registry.models("J04").front().recordings,
              testing::Contains(RecordingUse{before, "train"}));
}

/// What a comparison found, without its times.
std::string history_text(Registry& registry) {
  std::string text;
  for (const RegisteredDevice& device : registry.devices())
    for (const DriftEntry& each : registry.drift_history(device.serial))
      text += fmt::format("{} {} {} {} {} {}\n", each.id, each.device, each.model, each.recording,
                          each.rmse, each.details);
  return text;
}

TEST_F(CalibrationStudyTest, TheHistoryOfDriftDoesNotDependOnTheThreads) {
  const std::string store = calibrated_store("robot.sqlite");
  CalibrationRequest today = request_;
  for (FleetJoint& joint : today.joints) {
    joint.train = joint.test;
    joint.test.clear();
  }
  today.joints.insert(today.joints.begin(), {.serial = "J99", .train = {folder_.path("no.csv")}});
  today.joints.push_back(
      {.serial = "J03", .train = {folder_.file("bad.csv", "time_s,torque_Nm\n")}});
  std::vector<std::string> histories;
  std::vector<std::vector<std::string>> failures;
  for (const std::size_t threads : {1U, 4U}) {
    const std::string copy = folder_.path("copy.sqlite");  // errors name it
    std::filesystem::copy_file(store, copy, std::filesystem::copy_options::overwrite_existing);
    Registry registry(store_address(copy));
    failures.push_back(watch_joints(registry, today, threads));
    histories.push_back(history_text(registry));
  }
  EXPECT_THAT(failures[0], testing::ElementsAre(testing::StartsWith("J99"), HasSubstr("bad.csv")));
  EXPECT_EQ(failures[1], failures[0]);
  EXPECT_THAT(histories[0], testing::AllOf(HasSubstr("J03"), HasSubstr("J04")));
  EXPECT_EQ(histories[1], histories[0]);
}

TEST_F(CalibrationStudyTest, AWatchThatIsStoppedKeepsWhatItCompared) {
  Registry registry(store_address(calibrated_store("robot.sqlite")));
  const auto until_first = [](double share, std::string_view) { return share == 0.0; };
  EXPECT_THROW(static_cast<void>(watch_joints(registry, request_, 1, until_first)), Cancelled);
  EXPECT_EQ(registry.drift_history("J03").size(), 1U);
  EXPECT_THAT(registry.drift_history("J04"), IsEmpty());
}

TEST_F(CalibrationStudyTest, JointsThatAreOnlyComparedGetNoModel) {
  request_.only_compares = true;
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const FleetCalibration fleet = calibration_result(store, study);
  EXPECT_THAT(fleet_text(fleet),
              HasSubstr("2 joints: 2 measured, 0 not; not compared with each other"));
  for (const CalibratedJoint& joint : fleet.joints) {
    EXPECT_EQ(joint.chosen, "");
    EXPECT_TRUE(std::isfinite(joint.traits[JointTrait::stiffness].value));
    EXPECT_EQ(store.samples(joint.trial), "");
  }
}

TEST_F(CalibrationStudyTest, ARecordingThatHasChangedIsRefused) {
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  std::ofstream(request_.joints[1].train.front(), std::ios::app) << "\n";
  EXPECT_THAT(test::error_message([&] { run_workers(store, study, kind, {.threads = 1}); }),
              testing::AllOf(HasSubstr("0004-1.csv"), HasSubstr("has changed since the study")));
}

TEST_F(CalibrationStudyTest, AnUnusableRecordingIsTheFailureOfItsJointAlone) {
  std::ofstream(request_.joints[1].train.front()) << "time_s,torque_Nm\n0,1\n0.001,1\n";
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  CalibrationStudy kind(request_);
  const StoredStudy study = study_in(store, kind);
  run_workers(store, study, kind, {.threads = 1});
  const FleetCalibration fleet = calibration_result(store, study);
  EXPECT_EQ(fleet.joints[0].failure, "");
  EXPECT_NE(fleet.joints[1].failure, "");
  EXPECT_THAT(fleet_text(fleet), HasSubstr("1 with a model, 1 without"));
}

TEST_F(CalibrationStudyTest, AJointWithoutACurrentModelIsNotCompared) {
  Registry registry(store_address(folder_.path("robot.sqlite")));
  registry.add_device({.serial = "J03"});
  EXPECT_THAT(test::error_message([&] { watch_joint(registry, request_.joints[0], request_); }),
              HasSubstr("no model is current"));
  EXPECT_TRUE(std::isnan(rank_by_drift(registry).front().severity));
}

}  // namespace
}  // namespace torsio
