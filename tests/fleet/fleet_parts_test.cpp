// Lists, texts, traits and outliers of fleets, without recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "fleet/calibration.hpp"
#include "fleet/calibration_text.hpp"
#include "fleet/fleet_text.hpp"
#include "fleet/joint_traits.hpp"
#include "fleet/production_fault.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/recording.hpp"

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
  // A result of an earlier version.
  std::string without = joint_text(joint);
  const std::size_t begin = without.find("\"asymmetry\"");
  ASSERT_NE(begin, std::string::npos);
  without.erase(begin, without.find('}', begin) + 2 - begin);
  EXPECT_TRUE(std::isnan(joint_from_text(without).traits[JointTrait::asymmetry].value));
  EXPECT_EQ(joint_from_text(without).traits[JointTrait::zero].value, -0.2);
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
  // A model that is wrong in one motion, or in all with one sign of the load.
  const ResidualExample wrong_once(
      [](std::size_t n, double) { return 0.004 * static_cast<double>(n) < std::numbers::pi; });
  EXPECT_LT(zero_wander(wrong_once.drift), 0.01);
  const ResidualExample asymmetric([](std::size_t, double angle_rad) { return angle_rad > 0.0; });
  EXPECT_LT(zero_wander(asymmetric.drift), 0.01);
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
    joint.traits[JointTrait::asymmetry].value = random.uniform(-0.03, 0.03);
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
      {180, JointTrait::encoder_error}, {240, JointTrait::loose_sensor}, {270, JointTrait::noise},
      {290, JointTrait::asymmetry}};
  const FleetCalibration fleet = fleet_with(faults);
  std::map<std::size_t, JointTrait> found;
  for (const FleetOutlier& outlier : fleet.outliers) found[outlier.joint] = outlier.trait;
  EXPECT_EQ(found, faults);
  EXPECT_THAT(fleet_text(fleet),
              HasSubstr("300 joints: 300 with a model, 0 without; 7 differ from the others of "
                        "their type"));
}

TEST(FleetOutliersTest, ASoundFleetHasNone) { EXPECT_THAT(fleet_with({}).outliers, IsEmpty()); }

TEST(FleetOutliersTest, AFewJointsGiveNoVerdict) {
  FleetCalibration fleet = fleet_with({});
  fleet.joints.resize(5);
  fleet.joints[2].traits[JointTrait::stiffness].value = 0.5;
  find_fleet_outliers(fleet);
  EXPECT_THAT(fleet.outliers, IsEmpty());
  EXPECT_FALSE(fleet.is_compared(2));
  EXPECT_THAT(
      fleet_text(fleet),
      testing::AllOf(HasSubstr("5 joints: 5 with a model, 0 without; not compared with each other "
                               "(5 joints, 8 of a type are needed)\n"),
                     HasSubstr("no limits: fewer than 8 joints cannot be compared")));

  fleet.joints[2].fault = "stiffness +50 %";
  EXPECT_THAT(fleet_text(fleet),
              HasSubstr("planted faults: 0 of 1 found: fewer than 8 joints cannot be compared"));
}

TEST(FleetOutliersTest, JointsOfATypeWithFewAreCounted) {
  FleetCalibration fleet = fleet_with({});
  fleet.joints.resize(8);
  find_fleet_outliers(fleet);
  EXPECT_TRUE(fleet.is_compared(0)) << "8 are sufficient";
  EXPECT_THAT(fleet_text(fleet), HasSubstr("without; 0 differ from the others of their type\n"));
  fleet.joints.push_back(fleet.joints.front());
  fleet.joints.back().type = "hip";
  find_fleet_outliers(fleet);
  EXPECT_FALSE(fleet.is_compared(8));
  EXPECT_THAT(fleet_text(fleet), HasSubstr("1 not compared (8 of a type are needed)"));
}

FleetChoice specimens(const std::string& range) {
  FleetChoice choice;
  choice.specimens = range;
  return choice;
}

std::string refusal_of(const FleetChoice& choice) {
  return test::error_message([&] { static_cast<void>(calibration_request(choice)); });
}

TEST(FleetListTest, AFamilyThatDoesNotExistIsRefusedBeforeTheStudyBegins) {
  FleetChoice choice = specimens("dfki-50#0001..#0002");
  choice.model = "greybox";
  EXPECT_THAT(refusal_of(choice), testing::AllOf(HasSubstr("greybox"), HasSubstr("grey_box")));
  choice.model = "mlp:epoch=2";
  EXPECT_THAT(refusal_of(choice), HasSubstr("epoch"));
  choice.model = "mlp:epochs=2";
  EXPECT_EQ(calibration_request(choice).model, "mlp:epochs=2");
}

TEST(FleetListTest, FaultsAreOfSpecimensAndAtMostOneOfEach) {
  const TemporaryFolder folder;
  FleetChoice choice;
  choice.list = folder.file("robot.yaml", "joints: [{serial: A, train: a.csv}]\n");
  choice.faults = 1;
  EXPECT_THAT(refusal_of(choice), HasSubstr("only simulated joints"));
  choice = specimens("dfki-50#0001..#0005");
  choice.faults = 7;
  EXPECT_THAT(refusal_of(choice), testing::AllOf(HasSubstr("at most 5"), HasSubstr("found 7")));
}

}  // namespace
}  // namespace torsio
