#include "torsio/actuator/data_sheet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "support/every_actuator.hpp"
#include "support/series_elastic.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// The size of the parts that contain only values.
std::size_t bytes_of_values(const DataSheet& sheet) {
  std::size_t bytes = sizeof(sheet.rating) + sizeof(sheet.motor) + sizeof(sheet.friction) +
                      sizeof(sheet.middle_inertia_kg_m2) + sizeof(sheet.joint) +
                      sizeof(sheet.sensors);
  const auto add = [&]<class Part>(const Part& part) {
    std::size_t size = sizeof(Part);
    if constexpr (requires { part.curve; }) size -= sizeof(part.curve);
    // The variant is stored before the values.
    bytes += size / sizeof(SheetValue) * sizeof(SheetValue);
  };
  std::visit(add, sheet.first);
  std::visit(add, sheet.second);
  return bytes;
}

// Derived from printed torques and stiffnesses; 000 prints 5 to 8 deg as its requirement.
TEST(DataSheet, RatedTorqueTwistsTheSpringByFiveToEightDegrees) {
  const std::map<std::string_view, double> derived_deg = {
      {"dfki-28", 5.0}, {"dfki-50", 5.0}, {"dfki-120", 6.06}, {"dfki-300", 7.63}};
  ASSERT_EQ(test::series_elastic_sheets().size(), derived_deg.size());
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const double deflection_rad =
        sheet.rating.torque_Nm.value / std::get<SpringSheet>(sheet.second).stiffness_Nm_rad.value;
    EXPECT_NEAR(deg_from_rad(deflection_rad), derived_deg.at(sheet.name), 0.005) << sheet.name;
  }
}

TEST(DataSheet, GearModesLieWhereTheSpecificationPutsThem) {
  const std::map<std::string_view, double> expected_Hz = {
      {"dfki-28", 172.5}, {"dfki-50", 201.3}, {"dfki-120", 195.5}, {"dfki-300", 178.1}};
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const double mode_Hz = std::sqrt(std::get<GearSheet>(sheet.first).stiffness_Nm_rad.value /
                                     sheet.middle_inertia_kg_m2.value) /
                           (2.0 * std::numbers::pi);
    EXPECT_NEAR(mode_Hz, expected_Hz.at(sheet.name), 0.1) << sheet.name;
  }
}

TEST(DataSheet, GearEfficiencyAtTheRatingIsThatOfTheSpecification) {
  const std::map<std::string_view, double> ideal_Nm = {
      {"dfki-28", 27.4}, {"dfki-50", 62.4}, {"dfki-120", 151.2}, {"dfki-300", 369.6}};
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    EXPECT_NEAR(sheet.motor.torque_constant_Nm_A.value * sheet.rating.current_A.value *
                    std::get<GearSheet>(sheet.first).ratio.value,
                ideal_Nm.at(sheet.name), 0.05)
        << sheet.name;
  }
}

TEST(DataSheet, RatedSpeedStaysWithinTheSupplyVoltage) {
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const double back_emf_V = sheet.motor.torque_constant_Nm_A.value *
                              std::get<GearSheet>(sheet.first).ratio.value *
                              sheet.rating.speed_rad_s.value;
    EXPECT_LE(back_emf_V, 36.0) << sheet.name;
  }
}

TEST(DataSheet, ListsEveryValueOnceWithAnOrigin) {
  for (const DataSheet& sheet : data_sheets()) {
    std::map<std::string, int> seen;
    for (const SheetRow& row : describe(sheet)) {
      ++seen[std::string(row.name)];
      EXPECT_TRUE(std::isfinite(row.value.value)) << row.name;
    }
    for (const auto& [name, count] : seen) EXPECT_EQ(count, 1) << name;
    EXPECT_EQ(seen.size() * sizeof(SheetValue), bytes_of_values(sheet))
        << "a field of the sheet is not listed";
  }
}

TEST(DataSheet, DistinguishesPrintedDerivedAndAssumed) {
  std::map<std::string, SheetRow> rows;
  for (const SheetRow& row : describe(data_sheet("dfki-120"))) rows[row.name] = row;
  EXPECT_EQ(rows["spring_stiffness"].value.origin, Origin::printed);
  EXPECT_NEAR(rows["spring_stiffness"].value.value, 19.8 * 180.0 / std::numbers::pi, 1e-9);
  EXPECT_EQ(rows["spring_stiffness"].unit, "Nm/rad");
  EXPECT_EQ(rows["gear_stiffness"].value.origin, Origin::derived);
  EXPECT_EQ(rows["rotor_inertia"].value.origin, Origin::assumed);
}

TEST(DataSheet, OriginsAreThoseOfThePapers) {
  const auto value_of = [](const char* actuator, std::string_view name) {
    for (const SheetRow& row : describe(data_sheet(actuator)))
      if (row.name == name) return row.value;
    return SheetValue{.value = std::nan("")};
  };
  const auto expect = [&](const char* actuator, std::string_view name, SheetValue value) {
    EXPECT_EQ(value_of(actuator, name).value, value.value) << actuator << " " << name;
    EXPECT_EQ(value_of(actuator, name).origin, value.origin) << actuator << " " << name;
  };
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"})
    expect(actuator, "supply", printed(48.0));
  expect("dfki-50", "torque_sensor_rate", printed(125.0));
  for (const char* actuator : {"dfki-28", "dfki-120", "dfki-300"})
    expect(actuator, "torque_sensor_rate", assumed(125.0));
  expect("elastomer", "supply", printed(24.0));
  expect("rubber-clutch", "supply", assumed(24.0));
  expect("harmonic-drive", "supply", assumed(48.0));
  expect("elastomer", "rated_torque", assumed(6.0));
  expect("elastomer", "twist_sensor_bits", printed(12.0));
  expect("rubber-clutch", "motor_encoder_bits", derived(12.0));
  expect("harmonic-drive", "rated_torque", printed(292.0));
  expect("harmonic-drive", "motor_encoder_bits", printed(24.0));
  expect("harmonic-drive", "middle_encoder_bits", assumed(19.0));
  expect("harmonic-drive", "joint_encoder_bits", assumed(17.0));
}

TEST(DataSheet, EveryActuatorVariantAndPieceHasAHashOfItsOwn) {
  std::map<std::string, std::string> names;  // by hash
  for (const std::string& actuator : test::every_actuator()) {
    for (const char* specimen : {"", "#01", "#02"}) {
      const std::string name = actuator + specimen;
      const auto [at, is_new] = names.emplace(sheet_hash(data_sheet(name)), name);
      EXPECT_TRUE(is_new) << name << " and " << at->second;
    }
  }
}

TEST(DataSheet, TwoNamesOfTheSameSheetHaveTheSameHash) {
  EXPECT_EQ(sheet_hash(data_sheet("harmonic-drive")),
            sheet_hash(data_sheet("harmonic-drive:stiff")));
  EXPECT_EQ(sheet_hash(data_sheet("dfki-50#3")), sheet_hash(data_sheet("dfki-50:maxwell-slip#03")));
  DataSheet changed = data_sheet("dfki-50");
  changed.motor.supply_V.value = 24.0;
  EXPECT_NE(sheet_hash(changed), sheet_hash(data_sheet("dfki-50")));
}

double fact_of(const char* actuator, std::string_view name) {
  for (const SheetRow& row : printed_facts(data_sheet(actuator)))
    if (row.name == name) return row.value.value;
  return kNotMeasured;
}

TEST(DataSheet, FactsOfThePapersAreNoValuesOfThePlant) {
  EXPECT_DOUBLE_EQ(fact_of("dfki-300", "mass"), 4.6);
  EXPECT_NEAR(deg_from_rad(fact_of("dfki-28#03", "rated_speed")), 190.0, 1e-9);
  EXPECT_DOUBLE_EQ(fact_of("harmonic-drive:soft", "gear_efficiency"), 0.5);
  for (const DataSheet& sheet : data_sheets()) {
    const std::vector<SheetRow> facts = printed_facts(sheet);
    EXPECT_FALSE(facts.empty()) << sheet.name;
    for (const SheetRow& row : describe(sheet))
      EXPECT_EQ(std::ranges::count(facts, row.name, &SheetRow::name), 0) << row.name;
  }
  DataSheet own = data_sheet("dfki-28");
  own.name = "mine";
  EXPECT_TRUE(printed_facts(own).empty());
}

TEST(DataSheet, UnknownNameListsTheKnownOnes) {
  try {
    static_cast<void>(data_sheet("dfki-500"));
    FAIL() << "an unknown actuator was accepted";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.report().expected,
              "one of dfki-28, dfki-50, dfki-120, dfki-300, elastomer, rubber-clutch, "
              "harmonic-drive");
    EXPECT_EQ(error.report().found, "\"dfki-500\"");
  }
}

TEST(DataSheet, TakesAVariantAndASerialNumber) {
  const DataSheet specimen = data_sheet("dfki-300:lugre#03");
  EXPECT_EQ(std::get<SpringSheet>(specimen.second).variant, SpringVariant::lugre);
  EXPECT_EQ(specimen.serial, 3U);
  EXPECT_EQ(full_name(specimen), "dfki-300:lugre#03");
  EXPECT_EQ(full_name(data_sheet("dfki-300:maxwell-slip")), "dfki-300");
  const auto tube_Nm_rad = [](const char* name) {
    return std::get<TubeSheet>(data_sheet(name).first).stiffness_Nm_rad.value;
  };
  EXPECT_EQ(tube_Nm_rad("harmonic-drive"), 40.95);
  EXPECT_EQ(tube_Nm_rad("harmonic-drive:soft"), 14.3);
  EXPECT_FALSE(std::get<ElastomerSheet>(data_sheet("elastomer:unbonded").second).bonded);
}

std::string message_of(const char* name) {
  try {
    static_cast<void>(data_sheet(name));
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(DataSheet, RefusesVariantsAndSerialNumbersThatItDoesNotHave) {
  EXPECT_NE(message_of("dfki-50:bouc").find("maxwell-slip, bouc-wen, lugre"), std::string::npos);
  EXPECT_NE(message_of("rubber-clutch:soft").find("measured, designed, no-clutch"),
            std::string::npos);
  EXPECT_NE(message_of("dfki-50:").find("after the colon"), std::string::npos);
  for (const char* name : {"dfki-50#", "dfki-50#x", "dfki-50#-1", "dfki-50#10000", "dfki-50#3#4"})
    EXPECT_NE(message_of(name).find("0 to 9999"), std::string::npos) << name;
}

}  // namespace
}  // namespace torsio
