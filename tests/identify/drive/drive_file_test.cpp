#include "torsio/identify/drive/drive_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "identify/drive/drive_friction.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using ::testing::HasSubstr;
using testing::servo_recordings;

DriveIdentification filed_servo(const std::vector<Recording>& recordings) {
  const LoadSheet load = parse_load_sheet(
      "load: {pendulum: {mass: 0.5kg, length: 0.1m}}\nload_uncertainty: {mass: 1.5%, length: 2mm}",
      "load.yaml");
  return identify_drive(recordings, load, assumed_drive_sheet(recordings.front()),
                        {.terms = drive_terms({DriveTerm::delay}), .starts = 1});
}

const DriveIdentification& one_servo() {
  static const DriveIdentification identified = filed_servo(servo_recordings({}));
  return identified;
}

std::string refusal_of(const std::function<void(nlohmann::json&)>& change) {
  nlohmann::json document = nlohmann::json::parse(identified_drive_text(one_servo()));
  change(document);
  try {
    (void)parse_identified_drive(document.dump(), "servo.json");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(DriveFile, GivesTheSameFreeRunsWithoutAFit) {
  const std::vector<Recording> recordings = servo_recordings({});
  const TemporaryFolder folder;
  save_identified_drive(folder.path("servo.json"), one_servo());
  const DriveIdentification read = read_identified_drive(folder.path("servo.json"));
  EXPECT_EQ(read.values, one_servo().values);
  EXPECT_EQ(read.terms, one_servo().terms);
  EXPECT_EQ(simulate_drive(read, recordings[2]).angle_rad,
            simulate_drive(one_servo(), recordings[2]).angle_rad);
  const DriveIdentification evaluated = evaluate_drive(read, {recordings[2], recordings[0]});
  ASSERT_EQ(evaluated.recordings.size(), 2U);
  EXPECT_EQ(evaluated.recordings[0].recording, recordings[2].name());
  EXPECT_NEAR(evaluated.recordings[0].mae_rad, one_servo().recordings[2].mae_rad, 1e-12);
  EXPECT_NEAR(evaluated.recordings[1].mae_rad, one_servo().recordings[0].mae_rad, 1e-12);
  EXPECT_EQ(evaluated.groups, 0U);
}

TEST(DriveFile, KeepsStandardErrorsScoresAndFindings) {
  const DriveIdentification read =
      parse_identified_drive(identified_drive_text(one_servo()), "servo.json");
  ASSERT_EQ(read.parameters.size(), one_servo().parameters.size());
  for (std::size_t k = 0; k < read.parameters.size(); ++k) {
    EXPECT_EQ(read.parameters[k].parameter, one_servo().parameters[k].parameter);
    EXPECT_EQ(read.parameters[k].standard_error, one_servo().parameters[k].standard_error);
    EXPECT_EQ(read.parameters[k].highest, one_servo().parameters[k].highest);
  }
  EXPECT_EQ(read.held_out_mae_rad, one_servo().held_out_mae_rad);
  EXPECT_TRUE(std::isnan(read.nested_mae_rad));
  EXPECT_EQ(read.findings.size(), one_servo().findings.size());
  EXPECT_EQ(read.error_gain->samples, one_servo().error_gain->samples);
  EXPECT_EQ(identified_drive_text(read), identified_drive_text(one_servo()));
}

TEST(DriveFile, KeepsTheLoadWithItsErrors) {
  const DriveIdentification read =
      parse_identified_drive(identified_drive_text(one_servo()), "servo.json");
  const auto& facts = std::get<PendulumFacts>(read.load.facts);
  EXPECT_EQ(facts.mass_kg.value, 0.5);
  EXPECT_NEAR(facts.mass_kg.relative_error, 0.015, 1e-15);
  EXPECT_NEAR(facts.length_m.standard_error, 0.002, 1e-15);

  DriveIdentification fitted = one_servo();
  fitted.load = parse_load_sheet(
      "load: {urdf: arms/two.urdf, joint: elbow, payload: {link: hand, mass: load_kg, at: [0, 0.1, "
      "0]}, pose: {wrist: 30deg}, joint_inertia: fit, zero: fit}\n"
      "load_uncertainty: {payload_mass: 10g}",
      "/bench/load.yaml");
  const DriveIdentification again =
      parse_identified_drive(identified_drive_text(fitted), "elsewhere/servo.json");
  const auto& urdf = std::get<UrdfFacts>(again.load.facts);
  EXPECT_EQ(urdf.file, "/bench/arms/two.urdf");
  EXPECT_EQ(urdf.payload_mass_kg.condition, "load_kg");
  EXPECT_NEAR(urdf.payload_mass_kg.standard_error, 0.01, 1e-15);
  EXPECT_EQ(urdf.payload_at_m, (std::vector<double>{0.0, 0.1, 0.0}));
  EXPECT_NEAR(urdf.pose_rad.at(0).second, M_PI / 6.0, 1e-12);
  EXPECT_TRUE(again.load.fits_joint_inertia);
  EXPECT_TRUE(again.load.fits_zero);
}

TEST(DriveFile, KeepsEachLaw) {
  for (const char* const text :
       {"drive: {law: pd, kp: 300Nm_rad, kd: kd_Nms_rad, filter: 40Hz, torque_limit: 28Nm, "
        "gear_ratio: 50}",
        "drive: {law: voltage, supply: supply_V, off: short, angle: gear_angle_rad}",
        "drive: {law: current, between_samples: held}",
        "drive: {law: torque, command: wanted_Nm}"}) {
    DriveIdentification other = one_servo();
    other.drive = parse_drive_sheet(text, "drive.yaml");
    const DriveSheet read =
        parse_identified_drive(identified_drive_text(other), "servo.json").drive;
    EXPECT_EQ(read.law, other.drive.law) << text;
    EXPECT_EQ(read.command, other.drive.command) << text;
    EXPECT_EQ(read.angle, other.drive.angle) << text;
    EXPECT_EQ(read.is_command_held, other.drive.is_command_held) << text;
    EXPECT_EQ(read.gear_ratio, other.drive.gear_ratio) << text;
    EXPECT_EQ(read.kp_Nm_rad.value, other.drive.kp_Nm_rad.value) << text;
    EXPECT_EQ(read.kd_Nms_rad.condition, other.drive.kd_Nms_rad.condition) << text;
    EXPECT_EQ(read.torque_limit_Nm.value, other.drive.torque_limit_Nm.value) << text;
    EXPECT_EQ(read.speed_filter_Hz, other.drive.speed_filter_Hz) << text;
    EXPECT_EQ(read.supply_V.condition, other.drive.supply_V.condition) << text;
    EXPECT_EQ(read.brakes_when_off, other.drive.brakes_when_off) << text;
  }
}

TEST(DriveFile, NamesWhatIsWrongInIt) {
  EXPECT_EQ(refusal_of([](nlohmann::json&) {}), "no error");
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["drive_format"] = 2; }),
              HasSubstr("servo.json/drive_format: expected 1"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["terms"] = "delai"; }),
              HasSubstr("Did you mean 'delay'"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["values"]["delai_s"] = 0.0; }),
              HasSubstr("Did you mean 'delay_s'"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["values"]["armature_kg_m2"] = -0.1; }),
              HasSubstr("servo.json/values/armature_kg_m2: expected a finite number, at least 0"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["values"]["zero_rad"] = nullptr; }),
              HasSubstr("values/zero_rad: expected a finite number"));
  for (const double step_s : {0.0, 1e-300, 1.0})
    EXPECT_THAT(refusal_of([&](nlohmann::json& d) { d["step_s"] = step_s; }),
                HasSubstr("step_s: expected a step from 1e-06 to 0.1 s"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d.erase("load_file"); }), HasSubstr("load_file"));
  EXPECT_THAT(
      refusal_of([](nlohmann::json& d) { d["load_file"]["load"]["pendulum"]["mass"] = "0.5m"; }),
      HasSubstr("mass"));
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["drive_file"]["law"] = "speed"; }),
              HasSubstr("position, pd"));
  EXPECT_THROW((void)parse_identified_drive("not JSON", "servo.json"), Error);
  EXPECT_THROW((void)evaluate_drive(one_servo(), {}), UsageError);
}

TEST(DriveFile, RefusesAZeroByWhichTheEquationsDivide) {
  const auto zero_of = [](const char* parameter, const char* terms) {
    return refusal_of([&](nlohmann::json& d) {
      d["terms"] = terms;
      d["values"][parameter] = 0.0;
    });
  };
  for (const char* const parameter : {"resistance_ohm", "load_speed_rad_s", "stribeck_speed_rad_s",
                                      "hysteresis_width_rad", "no_load_speed_rad_s"})
    EXPECT_THAT(zero_of(parameter, "none"), HasSubstr("expected a finite number above 0"))
        << parameter;
  for (const char* const parameter : {"stiffness_Nm_rad", "armature_kg_m2"}) {
    EXPECT_EQ(zero_of(parameter, "none"), "no error") << parameter;
    const std::string refusal = refusal_of([&](nlohmann::json& d) {
      d["terms"] = "spring";
      d["values"]["stiffness_Nm_rad"] = 100.0;
      d["values"][parameter] = 0.0;
    });
    EXPECT_THAT(refusal, HasSubstr(std::string(parameter) + ": expected a finite number above 0"));
  }
  EXPECT_THAT(zero_of("presliding_rad", "presliding"), HasSubstr("presliding_rad"));
  // A value that is not in the file is neutral.
  EXPECT_THAT(refusal_of([](nlohmann::json& d) { d["terms"] = "spring"; }),
              HasSubstr("stiffness_Nm_rad"));
}

TEST(DriveFile, RefusesAPositionLawWithoutItsGain) {
  for (const char* const gain : {"measured", ""}) {
    const std::string refusal = refusal_of([&](nlohmann::json& d) {
      d["drive_file"]["error_gain"] = gain;
      if (*gain == '\0') d["drive_file"].erase("error_gain");
    });
    EXPECT_THAT(refusal, HasSubstr("drive_file/error_gain"));
  }
  DriveIdentification without = one_servo();
  without.drive.error_gain_1_rad.reset();
  EXPECT_THROW((void)evaluate_drive(without, servo_recordings({})), Error);
}

TEST(DriveFile, HasNoValueOfAWindingForALawOfTorque) {
  const std::vector<Recording> recordings = servo_recordings({});
  const LoadSheet load =
      parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}", "load.yaml");
  const DriveSheet law =
      parse_drive_sheet("drive: {law: pd, kp: 1Nm_rad, kd: 0.1Nms_rad}", "drive.yaml");
  const DriveIdentification found = identify_drive(
      {recordings[0]}, load, law,
      {.terms = drive_terms({DriveTerm::base}), .starts = 1, .has_standard_errors = false});
  const nlohmann::json document = nlohmann::json::parse(identified_drive_text(found));
  EXPECT_TRUE(document["values"].contains("coulomb_Nm"));
  EXPECT_FALSE(document["values"].contains("torque_constant_Nm_A"));
  EXPECT_FALSE(document["values"].contains("resistance_ohm"));
}

TEST(DriveFriction, FallsFromRestAndGrowsWithLoadAndSpeed) {
  DriveValues values = neutral_drive_values();
  at(values, DriveParameter::coulomb) = 0.5;
  at(values, DriveParameter::viscous) = 0.1;
  at(values, DriveParameter::load_friction) = 0.2;
  at(values, DriveParameter::load_stribeck) = 0.3;
  at(values, DriveParameter::load_speed) = 0.5;
  at(values, DriveParameter::stribeck) = 0.25;
  at(values, DriveParameter::stribeck_speed) = 0.1;
  EXPECT_NEAR(drive_friction_Nm(values, 0.0, 2.0), 0.5 + 2.0 * 0.5 + 0.25, 1e-12);
  EXPECT_NEAR(drive_friction_Nm(values, -100.0, 2.0), 0.5 + 2.0 * 0.2 + 10.0, 1e-12);
  EXPECT_NEAR(drive_friction_Nm(values, 0.5, 0.0), 0.5 + 0.25 * std::exp(-5.0) + 0.05, 1e-12);
  EXPECT_NEAR(drive_friction_Nm(neutral_drive_values(), 3.0, 5.0), 0.0, 1e-12);
}

}  // namespace
}  // namespace torsio
