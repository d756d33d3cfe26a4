#include "torsio/sim/bench/sheet_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "parts/torque_table.hpp"
#include "sim/plant/plant_batch.hpp"
#include "support/error_message.hpp"
#include "support/every_actuator.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

DataSheet parsed(const std::string& text) { return parse_data_sheet(text, "joint.yaml"); }
std::string refusal(const std::string& text) {
  return test::error_message([&] { static_cast<void>(parsed(text)); });
}

void expect_same_sheet(const DataSheet& is, const DataSheet& was) {
  EXPECT_EQ(full_name(is), full_name(was));
  EXPECT_EQ(is.title, was.title);
  EXPECT_EQ(sheet_hash(is), sheet_hash(was)) << full_name(was);
  const std::vector<SheetRow> rows = describe(was);
  const std::vector<SheetRow> again = describe(is);
  ASSERT_EQ(again.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(again[i].name, rows[i].name);
    EXPECT_EQ(again[i].value.value, rows[i].value.value) << rows[i].name;
    EXPECT_EQ(again[i].value.origin, rows[i].value.origin) << rows[i].name;
  }
}

void expect_same_recording(const Recording& is, const Recording& was) {
  EXPECT_EQ(is.name(), was.name());
  EXPECT_EQ(is.sample_rate_Hz(), was.sample_rate_Hz());
  ASSERT_EQ(is.channels().size(), was.channels().size());
  for (const Channel& channel : was.channels()) {
    EXPECT_EQ(is.channel(channel.name).values, channel.values) << channel.name;
    EXPECT_EQ(is.channel(channel.name).fresh, channel.fresh) << channel.name;
  }
}

TEST(SheetFile, GivesEverySheetBackBitForBit) {
  for (const std::string& name : test::every_actuator()) {
    expect_same_sheet(parsed(data_sheet_yaml(data_sheet(name))), data_sheet(name));
    const DataSheet worn = aged(data_sheet(name + "#17"), 0.3);
    expect_same_sheet(parsed(data_sheet_yaml(worn)), worn);
  }
}

TEST(SheetFile, SimulatesTheRecordingsOfTheBuiltInSheets) {
  for (const std::string& name : test::every_actuator()) {
    const DataSheet sheet = data_sheet(name);
    const DataSheet read = parsed(data_sheet_yaml(sheet));
    for (const ExperimentInfo& experiment : experiments(sheet)) {
      const ExperimentSpec spec{.experiment = std::string(experiment.name),
                                .seed = 3,
                                .duration_s = 0.4,
                                .with_truth = true};
      SCOPED_TRACE(name + " " + spec.experiment);
      expect_same_recording(simulate(read, spec), simulate(sheet, spec));
    }
  }
}

/// `text` with the line of a value replaced, or removed if `line` is empty.
std::string with_line(std::string text, const std::string& key, const std::string& line) {
  const std::size_t begin = text.find("\n" + key) + 1;
  const std::size_t end = text.find('\n', begin) + 1;
  return text.replace(begin, end - begin, line.empty() ? line : line + "\n");
}
std::string changed(const std::string& value, const std::string& to,
                    const char* actuator = "dfki-120") {
  return with_line(data_sheet_yaml(data_sheet(actuator)), "  " + value + ":",
                   to.empty() ? to : "  " + value + ": " + to);
}

TEST(SheetFile, TakesOtherUnitsOfTheSameQuantity) {
  const DataSheet in_degrees =
      parsed(changed("spring_stiffness", "{value: 20, unit: Nm/deg, origin: P}"));
  EXPECT_NEAR(std::get<SpringSheet>(in_degrees.second).stiffness_Nm_rad.value,
              20.0 * deg_from_rad(1.0), 1e-9);
  EXPECT_EQ(std::get<SpringSheet>(in_degrees.second).stiffness_Nm_rad.origin, Origin::printed);
  EXPECT_NEAR(
      parsed(changed("top_speed", "{value: 30, unit: rpm, origin: D}")).rating.speed_rad_s.value,
      M_PI, 1e-12);
}

TEST(SheetFile, RefusesWrongValuesWithTheirPlace) {
  const auto expect = [](const std::string& text, const std::vector<std::string>& words) {
    const std::string message = refusal(text);
    for (const std::string& word : words)
      EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
  };
  expect(changed("gear_ratio", ""),
         {"joint.yaml: line ", "(values)", "'gear_ratio' is missing", "found nothing",
          "torsio simulate --describe dfki-28 --yaml FILE"});
  expect(changed("gear_ratio", "{value: -120, origin: P}"),
         {"joint.yaml: line ", "(values.gear_ratio.value)", "0 or more", "'-120'"});
  expect(changed("gear_ratio", "{value: 0, origin: P}"), {"above 0", "'0'"});
  expect(changed("gear_ratio", "{value: .nan, origin: P}"), {"a number", "'.nan'"});
  expect(changed("gear_ratio", "{value: nan, origin: P}"), {"a number", "'nan'"});
  expect(changed("gear_ratio", "{value: inf, origin: P}"), {"a number", "'inf'"});
  expect(changed("gear_ratio", "{value: 1e13, origin: P}"), {"at most 1e+12", "'1e13'"});
  expect(changed("gear_ratio", "{origin: P}"), {"'value' is missing"});
  expect(changed("gear_ratio", "{value: 120}"), {"'origin' is missing", "P printed"});
  expect(changed("gear_ratio", "{value: 120, origin: X}"), {"one of P, D, A", "'X'"});
  expect(changed("gear_ratio", "120"), {"(values.gear_ratio)", "value: 1"});
  expect(changed("gear_ratio", "{value: 120, unit: Nm, origin: P}"), {"no unit", "'Nm'"});
  expect(changed("rated_torque", "{value: 120, unit: A, origin: P}"),
         {"(values.rated_torque.unit)", "Nm or another unit of the same quantity", "'A'"});
  expect(changed("rated_torque", "{value: 120, origin: P}"), {"a unit"});
  expect(changed("rated_torque", "{value: 120Nm, unit: Nm, origin: P}"), {"without its unit"});
  expect(changed("rotor_inertia", "{value: 1, unit: kg, origin: P}"), {"the unit kg m^2", "'kg'"});
  expect(changed("rated_torque", "{value: 120, unit: Nm, origin: P, note: x}"),
         {"unknown key 'note'"});
  const std::string sheet = data_sheet_yaml(data_sheet("dfki-120"));
  expect(with_line(sheet, "  gear_ratio:", "  gear_ration: {value: 1, origin: P}"),
         {"unknown key 'gear_ration'", "gear_ratio"});
  expect(sheet + "colour: red\n", {"unknown key 'colour'"});
  expect(with_line(sheet, "family:", "family: rotary"), {"one of series-elastic", "'rotary'"});
  expect(with_line(sheet, "family:", ""), {"'family' is missing"});
  expect(with_line(sheet, "name:", "name: a#b"), {"letters, digits", "'a#b'"});
  expect(with_line(sheet, "variant:", ""), {"'variant' is missing", "bouc-wen"});
  expect(with_line(sheet, "variant:", "variant: maxwell"), {"maxwell-slip"});
  expect(with_line(sheet, "title:", "title: \"a\\nb\""), {"in one line"});
  expect(sheet + "serial: 10000\n", {"0 to 9999"});
  expect(with_line(data_sheet_yaml(data_sheet("rubber-clutch")), "variant:", "variant: stiff"),
         {"measured", "designed", "no-clutch"});
  expect("name: x\n", {"'family' is missing"});
  expect("- 1\n", {"keys with values"});
}

TEST(SheetFile, RefusesWhatNoPlantCanBeBuiltFrom) {
  const auto expect = [](const std::string& text, const std::string& words) {
    const std::string message = refusal(text);
    EXPECT_NE(message.find("joint.yaml"), std::string::npos) << message;
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  expect(changed("motor_encoder_bits", "{value: 60, origin: A}"), "1..40 bits");
  expect(changed("torque_sensor_rate", "{value: 300, unit: Hz, origin: A}"), "whole number");
  expect(changed("torque_sensor_rate", "{value: 1e-300, unit: Hz, origin: A}"), "0.01 to 1000 Hz");
  expect(changed("log_rate", "{value: 300, unit: Hz, origin: A}"), "divided by a whole number");
  expect(changed("spring_asymmetry", "{value: -1.5, origin: A}"), "asymmetry");
  expect(changed("output_inertia", "{value: 1e-12, unit: kg m^2, origin: A}"),
         "too fast to simulate");
  std::string text = data_sheet_yaml(data_sheet("elastomer"));
  for (const char* slip : {"coupling_slip_1", "coupling_slip_2", "coupling_slip_3"})
    text = with_line(text, std::string("  ") + slip + ":",
                     std::string("  ") + slip + ": {value: 0, unit: Nm, origin: A}");
  expect(text, "share >= 0 and finite");
}

// ---------------------------------------------------------------------------- the torque curve

/// The 120 Nm joint with a hardening spring.
std::string with_curve(const std::string& points,
                       const std::string& columns = "[deflection_deg, torque_Nm]") {
  std::string text = data_sheet_yaml(data_sheet("dfki-120"));
  for (const char* key :
       {"spring_stage", "spring_stage_stiffness", "spring_half_gap", "spring_asymmetry"})
    text = with_line(text, std::string("  ") + key + ":", "");
  return with_line(text, "name:", "name: hardening") + "torque_curve:\n  columns: " + columns +
         "\n  origin: D\n  points: " + points + "\n";
}
constexpr auto kHardening =
    "[[-8, -180], [-4, -60], [-0.02, -0.1], [0.02, 0.1], [4, 60], [8, 180]]";

TEST(TorqueCurve, IsThePlantsSpring) {
  const DataSheet sheet = parsed(with_curve(kHardening));
  const auto& spring = std::get<SpringSheet>(sheet.second);
  ASSERT_EQ(spring.curve.size(), 6U);
  EXPECT_NEAR(spring.curve[4].deflection_rad.value, rad_from_deg(4.0), 1e-15);
  EXPECT_EQ(spring.curve[4].torque_Nm.origin, Origin::derived);
  const Recording cycle =
      simulate(sheet, {.experiment = "static-cycle", .duration_s = 20.0, .with_truth = true});
  const auto& twist_rad = cycle.channel("truth_spring_deflection_rad").values;
  const auto& torque_Nm = cycle.channel("truth_spring_torque_Nm").values;
  const auto& friction_Nm = cycle.channel("truth_spring_friction_Nm").values;
  const TorqueTable table(std::get<Spring::Parameters>(plant_parameters(sheet).second).table);
  double largest_deg = 0.0;
  for (std::size_t i = 0; i < twist_rad.size(); ++i) {
    EXPECT_NEAR(torque_Nm[i] - friction_Nm[i], table.torque(twist_rad[i]), 0.05) << i;
    largest_deg = std::max(largest_deg, deg_from_rad(std::abs(twist_rad[i])));
  }
  EXPECT_NEAR(largest_deg, 6.0, 0.2) << "120 Nm are half way between 60 and 180 Nm";
}

TEST(TorqueCurve, SurvivesTheFileWearAndTolerances) {
  const DataSheet sheet = parsed(with_curve(kHardening));
  expect_same_sheet(parsed(data_sheet_yaml(sheet)), sheet);
  const DataSheet worn = aged(sheet, 1.0);
  const auto& fresh_curve = std::get<SpringSheet>(sheet.second).curve;
  const auto& worn_curve = std::get<SpringSheet>(worn.second).curve;
  EXPECT_NEAR(worn_curve[5].torque_Nm.value, 0.9 * fresh_curve[5].torque_Nm.value, 1e-12);
  EXPECT_EQ(worn_curve[5].deflection_rad.value, fresh_curve[5].deflection_rad.value);
  expect_same_sheet(parsed(data_sheet_yaml(worn)), worn);
}

TEST(TorqueCurve, OfAStraightSpringIsTheBuiltInOne) {
  std::string text = with_curve("[[-0.1, -200], [0.1, 200]]", "[deflection_rad, torque_Nm]");
  text = with_line(
      text, "  spring_stiffness:", "  spring_stiffness: {value: 2000, unit: Nm/rad, origin: A}");
  std::string built_in = data_sheet_yaml(data_sheet("dfki-120"));
  built_in = with_line(built_in, "name:", "name: hardening");
  built_in = with_line(built_in, "  spring_stiffness:",
                       "  spring_stiffness: {value: 2000, unit: Nm/rad, origin: A}");
  built_in = with_line(built_in,
                       "  spring_half_gap:", "  spring_half_gap: {value: 0, unit: rad, origin: A}");
  const ExperimentSpec spec{.experiment = "chirp", .duration_s = 10.0, .with_truth = true};
  const Recording table = simulate(parsed(text), spec);
  const Recording formula = simulate(parsed(built_in), spec);
  const auto& is = table.channel("truth_spring_torque_Nm").values;
  const auto& was = formula.channel("truth_spring_torque_Nm").values;
  for (std::size_t i = 0; i < was.size(); ++i)
    ASSERT_NEAR(is[i], was[i], 0.02) << i << ": rounding, which friction amplifies";
}

TEST(TorqueCurve, IsRefusedUnlessItIncreasesThroughZero) {
  const auto expect = [](const std::string& text, const std::vector<std::string>& words) {
    const std::string message = refusal(text);
    for (const std::string& word : words)
      EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
  };
  expect(with_curve("[[-8, -180]]"), {"(torque_curve.points)", "2 to 10000 points, found 1"});
  expect(with_curve("[[-8, -180], [0, 0], [4, 60], [8, 50]]"),
         {"joint.yaml: line ", "(torque_curve.points)", "increase", "as point 4"});
  expect(with_curve("[[-8, -180], [8, 180], [4, 200]]"), {"as point 3"});
  expect(with_curve("[[0.1, 1], [8, 180]]"), {"both sides of zero"});
  expect(with_curve("[[-8, nan], [8, 180]]"), {"(torque_curve.points[0][1])", "'nan'"});
  expect(with_curve("[[-8, -180, 3], [8, 180]]"), {"two numbers"});
  expect(with_curve("[-8, -180]"), {"[deflection, torque]"});
  expect(with_curve("3"), {"a list of [deflection, torque]"});
  expect(with_curve(kHardening, "[deflection_Nm, torque_Nm]"), {"deflection_rad"});
  expect(with_curve(kHardening, "[torque_Nm, deflection_deg]"), {"deflection_rad"});
  expect(with_curve(kHardening, "[deflection_deg]"), {"two columns"});
  expect(with_curve("[[-8, -18], [8, 18]]"),
         {"(values.spring_stiffness.value)", "between the slopes of the torque_curve"});
  const std::string both = with_line(with_curve(kHardening), "  spring_friction:",
                                     "  spring_friction: {value: 1, unit: Nm, origin: A}\n"
                                     "  spring_half_gap: {value: 0, unit: rad, origin: A}");
  expect(both, {"(values.spring_half_gap)", "torque_curve, which replaces it"});
  expect(data_sheet_yaml(data_sheet("elastomer")) +
             "torque_curve: {columns: [deflection_rad, torque_Nm], origin: A, points: []}\n",
         {"only a series-elastic actuator"});
}

TEST(PlantBatch, RefusesATorqueCurve) {
  const std::vector<PlantParameters> plants(2, plant_parameters(parsed(with_curve(kHardening))));
  const std::string message = test::error_message([&] { PlantBatch batch(plants); });
  EXPECT_NE(message.find("a table of 6 points at plant 0"), std::string::npos) << message;
}

TEST(FindDataSheet, TakesANameOrAFile) {
  EXPECT_TRUE(is_sheet_file("a/b.yaml"));
  EXPECT_TRUE(is_sheet_file("b.yml"));
  EXPECT_FALSE(is_sheet_file("dfki-50:bouc-wen#03"));
  EXPECT_EQ(sheet_hash(find_data_sheet("dfki-50:lugre")), sheet_hash(data_sheet("dfki-50:lugre")));
  EXPECT_NE(test::error_message([] {
              static_cast<void>(find_data_sheet("/nowhere/a.yaml"));
            }).find("/nowhere/a.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio
