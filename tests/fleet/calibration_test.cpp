#include "fleet/calibration.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "data/byte_source.hpp"
#include "fleet/calibration_text.hpp"
#include "fleet/fleet_text.hpp"
#include "fleet/joint_traits.hpp"
#include "fleet/production_fault.hpp"
#include "fleet/registration.hpp"
#include "fleet/watch.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
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

TEST(FleetListTest, PathsAreRelativeToTheList) {
  const TemporaryFolder folder;
  const std::string list = folder.file("robot.yaml", R"(
base: base.safetensors
joints:
  - {serial: J01, type: dfki-50, train: [a.csv, b.csv], test: /data/c.csv}
  - {serial: J02, type: dfki-50, train: d.csv}
)");
  const CalibrationRequest request = read_fleet_list(list);
  ASSERT_EQ(request.joints.size(), 2U);
  EXPECT_EQ(request.joints[0].train[1], folder.path("b.csv"));
  EXPECT_EQ(request.joints[0].test.front(), "/data/c.csv");
  EXPECT_THAT(request.joints[1].test, IsEmpty());
  EXPECT_EQ(request.base, folder.path("base.safetensors"));
}

TEST(FleetListTest, ErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    const std::string list = folder.file("robot.yaml", text);
    return test::error_message([&] { static_cast<void>(read_fleet_list(list)); });
  };
  EXPECT_THAT(message("joints:\n  - {serial: A, train: a.csv}\n  - {serial: A, train: b.csv}\n"),
              testing::AllOf(HasSubstr("robot.yaml: line 3"), HasSubstr("another serial number")));
  EXPECT_THAT(message("joints:\n  - {serial: A, trian: a.csv}\n"),
              HasSubstr("Did you mean 'train'"));
  EXPECT_THAT(message("joints:\n  - {serial: A}\n"), HasSubstr("train"));
  EXPECT_THAT(
      message(
          "joints:\n  - {serial: A, train: a.csv}\n  - {serial: B, train: b.csv, test: a.csv}\n"),
      testing::AllOf(HasSubstr("listed twice"), HasSubstr("listed for A")));
  EXPECT_THAT(message("joints: []\n"), HasSubstr("at least one joint"));
  EXPECT_THAT(message(""), HasSubstr("found nothing"));
}

TEST(CalibrationTextTest, AJointIsReadAsItWasWritten) {
  CalibratedJoint joint{.serial = "J\"01", .type = "knee", .chosen = "own fit", .test_rmse = 0.1};
  joint.warnings = {"clock: uneven"};
  joint.traits[JointTrait::stiffness] = {.value = 1.0 / 3.0, .std_error = 0.01};
  joint.traits[JointTrait::zero] = {.value = -0.2, .unit = "Nm"};
  joint.methods = {{.name = "base", .test_rmse = 0.3}};
  const CalibratedJoint read = joint_from_text(joint_text(joint));
  EXPECT_EQ(read.serial, joint.serial);
  EXPECT_EQ(read.traits[JointTrait::stiffness].value, 1.0 / 3.0);
  EXPECT_TRUE(std::isnan(read.traits[JointTrait::noise].value));
  EXPECT_TRUE(std::isnan(read.methods.front().held_out_rmse));
  EXPECT_EQ(joint_text(read), joint_text(joint));
  EXPECT_THROW(static_cast<void>(joint_from_text("{")), Error);
  FileHashes sha256;
  EXPECT_THROW(static_cast<void>(task_from_text("[]", sha256)), Error);
  EXPECT_THROW(static_cast<void>(calibration_from_text("{}")), Error);
}

TEST(ProductionFaultTest, AsManyAreSpreadAsWereAskedFor) {
  const SimulatedFleet fleet{.first = 1, .last = 200, .faults = 12};
  const auto faults = planted_faults(fleet, 5);
  EXPECT_EQ(planted_faults(fleet, 5), faults);
  EXPECT_NE(planted_faults(fleet, 6), faults);
  std::map<ProductionFault, int> kinds;
  for (const auto& [serial, fault] : faults) {
    EXPECT_GE(serial, fleet.first);
    EXPECT_LE(serial, fleet.last);
    ++kinds[fault];
  }
  EXPECT_EQ(kinds.size(), 6U);
  for (const auto& [fault, count] : kinds) EXPECT_EQ(count, 2) << name(fault);
}

/// A recording of an angle that moves to and fro, and a residual over it.
struct ResidualExample {
  Dataset dataset;
  Drift drift;

  template <class Value>
  explicit ResidualExample(const Value& value) {
    constexpr std::size_t kSamples = 6000;
    Recording recording("sweep", 200.0, 0.0);
    std::vector<double> angle_rad(kSamples);
    for (std::size_t n = 0; n < kSamples; ++n)
      angle_rad[n] = 0.9 * std::sin(0.004 * static_cast<double>(n));
    Random random(3);
    for (std::size_t n = 0; n < kSamples; ++n)
      drift.residual.push_back({.record = 0,
                                .sample = n,
                                .value = value(n, angle_rad[n]) + 0.02 * random.normal(),
                                .elastic = 20.0 * angle_rad[n],
                                .stiffness = 300.0});
    recording.add({.name = "gear_angle_rad", .values = std::move(angle_rad)});
    dataset.records.push_back({std::move(recording), whole_record(kSamples, Role::test)});
  }
};

TEST(JointTraitsTest, AnErrorThatRepeatsWithTheAngleIsMeasured) {
  const double amplitude_rad = rad_from_deg(0.05);
  const ResidualExample example([&](std::size_t, double angle_rad) {
    return 300.0 * amplitude_rad * std::sin(8.0 * angle_rad + 0.7);
  });
  const PeriodicError found = periodic_error(example.drift, example.dataset);
  EXPECT_EQ(found.channel, "gear_angle_rad");
  EXPECT_EQ(found.periods, 8U);
  EXPECT_NEAR(found.amplitude_rad, amplitude_rad, 0.05 * amplitude_rad);
  EXPECT_GT(found.share, 0.9);
}

TEST(JointTraitsTest, NoiseHasNoPeriod) {
  const ResidualExample example([](std::size_t, double) { return 0.0; });
  EXPECT_LT(periodic_error(example.drift, example.dataset).amplitude_rad, rad_from_deg(0.002));
}

TEST(JointTraitsTest, AZeroThatMovesWithTheSignOfTheLoadIsWander) {
  // Another zero in each half-wave.
  const ResidualExample loose([](std::size_t n, double) {
    const auto half_wave =
        static_cast<std::size_t>(0.004 * static_cast<double>(n) / std::numbers::pi);
    return half_wave % 3 == 0 ? 0.5 : -0.3;
  });
  const ResidualExample sound([](std::size_t, double) { return 0.0; });
  EXPECT_GT(zero_wander(loose.drift), 0.3);
  EXPECT_LT(zero_wander(sound.drift), 0.01);
  Drift still;
  EXPECT_TRUE(std::isnan(zero_wander(still)));
}

/// 300 joints with spread traits, some with a fault.
FleetCalibration fleet_with(const std::map<std::size_t, JointTrait>& faults) {
  FleetCalibration fleet;
  Random random(17);
  for (std::size_t i = 0; i < 300; ++i) {
    CalibratedJoint joint{.serial = "J" + std::to_string(i), .type = "knee", .chosen = "own fit"};
    joint.traits.rmse = 0.1;
    joint.traits[JointTrait::stiffness].value = random.uniform(-0.03, 0.03);
    joint.traits[JointTrait::friction].value = random.uniform(-0.25, 0.25);
    joint.traits[JointTrait::zero] = {.value = 0.1 * random.normal(), .unit = "Nm"};
    joint.traits[JointTrait::backlash] = {.value = 1e-4 * random.normal(), .unit = "rad"};
    joint.traits[JointTrait::encoder_error] = {.value = 1e-4 * std::exp(0.2 * random.normal()),
                                               .unit = "rad"};
    joint.traits[JointTrait::loose_sensor] = {.value = 0.02 * std::exp(0.2 * random.normal()),
                                              .unit = "Nm"};
    joint.traits[JointTrait::noise] = {.value = 0.1 * std::exp(0.05 * random.normal()),
                                       .unit = "Nm"};
    if (const auto fault = faults.find(i); fault != faults.end()) {
      const bool is_relative = joint.traits[fault->second].unit.empty();
      double& value = joint.traits[fault->second].value;
      value = is_relative ? value + 0.6 : 12.0 * std::abs(value) + 0.001;
      if (fault->second == JointTrait::zero) value += 3.0;
      joint.traits[JointTrait::noise].value *= 2.0;  // any fault adds to what remains
    }
    fleet.joints.push_back(std::move(joint));
  }
  find_fleet_outliers(fleet);
  return fleet;
}

TEST(FleetOutliersTest, EachKindIsNamed) {
  const std::map<std::size_t, JointTrait> faults{
      {4, JointTrait::stiffness},       {50, JointTrait::friction},      {99, JointTrait::zero},
      {180, JointTrait::encoder_error}, {240, JointTrait::loose_sensor}, {270, JointTrait::noise}};
  const FleetCalibration fleet = fleet_with(faults);
  std::map<std::size_t, JointTrait> found;
  for (const FleetOutlier& outlier : fleet.outliers) found[outlier.joint] = outlier.trait;
  EXPECT_EQ(found, faults);
  EXPECT_THAT(fleet_text(fleet), HasSubstr("300 joints: 300 with a model, 0 without; 6 differ"));
}

TEST(FleetOutliersTest, ASoundFleetHasNone) { EXPECT_THAT(fleet_with({}).outliers, IsEmpty()); }

TEST(FleetOutliersTest, AFewJointsGiveNoVerdict) {
  FleetCalibration fleet = fleet_with({});
  fleet.joints.resize(5);
  fleet.joints[2].traits[JointTrait::stiffness].value = 0.5;
  find_fleet_outliers(fleet);
  EXPECT_THAT(fleet.outliers, IsEmpty());
  EXPECT_THAT(fleet_text(fleet), HasSubstr("fewer than 8 joints cannot be compared"));
}

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
  std::string calibrated_store(const std::string& name) {
    const StoreAddress address = store_address(folder_.path(name));
    StudyStore store(address);
    CalibrationStudy kind(request_);
    const StoredStudy study = study_in(store, kind);
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
  const RegisteredFleet again =
      register_fleet(registry, store, fleet, kind.request(), true, "a test");
  EXPECT_EQ(again.promoted, 0U);
  EXPECT_EQ(registry.models().size(), 2U);
  EXPECT_THAT(registry.verify(), IsEmpty());

  // The test recordings of today are those of the calibration: nothing has drifted.
  for (const FleetJoint& joint : request_.joints)
    watch_joint(registry, {.serial = joint.serial, .train = joint.test}, request_);
  const std::vector<WatchedJoint> ranked = rank_by_drift(registry);
  ASSERT_EQ(ranked.size(), 2U);
  EXPECT_EQ(ranked.front().comparisons, 1U);
  EXPECT_GE(ranked.front().severity, ranked.back().severity);
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
  EXPECT_THAT(fleet_text(fleet), HasSubstr("2 joints: 2 compared, 0 not"));
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
