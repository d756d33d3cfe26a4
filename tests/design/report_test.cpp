#include "torsio/design/report.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>

#include "core/quantity.hpp"
#include "design/outline.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {
namespace {

TEST(DesignReport, HasTheSameKeysAndValuesInYamlAndJson) {
  const DesignReport report{.design = "spring",
                            .sections = {{"ring",
                                          {{"length", 57.25, "mm", "a # remark"},
                                           {"steel", kNotMeasured, "", "", "50CrV4"},
                                           {"bore", kNotMeasured, "mm"}}}},
                            .tables = {{"kinds",
                                        "kind",
                                        {{"rod", true, "", {{"mass", 12.5, "g"}}},
                                         {"coils", false, "coils: no room", {}}}}},
                            .notes = {"a note"}};
  const auto json = nlohmann::json::parse(design_json(report));
  const YAML::Node yaml = YAML::Load(design_yaml(report));
  EXPECT_EQ(json.at("design"), "spring");
  EXPECT_EQ(json.at("ring").at("length_mm"), 57.25);
  EXPECT_EQ(yaml["ring"]["length_mm"].as<double>(), 57.25);
  EXPECT_EQ(json.at("ring").at("steel"), "50CrV4");
  EXPECT_EQ(yaml["ring"]["steel"].as<std::string>(), "50CrV4");
  EXPECT_TRUE(json.at("ring").at("bore_mm").is_null());
  EXPECT_TRUE(yaml["ring"]["bore_mm"].IsNull());
  EXPECT_EQ(json.at("kinds").at(0).at("kind"), "rod");
  EXPECT_EQ(json.at("kinds").at(0).at("chosen"), true);
  EXPECT_EQ(json.at("kinds").at(0).at("mass_g"), 12.5);
  EXPECT_TRUE(json.at("kinds").at(0).at("infeasible").is_null());
  EXPECT_EQ(json.at("kinds").at(1).at("infeasible"), "coils: no room");
  EXPECT_EQ(yaml["kinds"][0]["mass_g"].as<double>(), 12.5);
  EXPECT_EQ(yaml["kinds"][1]["infeasible"].as<std::string>(), "coils: no room");
  EXPECT_FALSE(yaml["kinds"][1]["feasible"].as<bool>());
  EXPECT_EQ(design_page(report).sections.front().tables.front().rows.size(), 2U);
  const std::string text = design_text(report);
  EXPECT_NE(text.find("rod    chosen"), std::string::npos) << text;
  EXPECT_NE(text.find("coils: no room"), std::string::npos) << text;
}

TEST(DesignQuantity, IsRefusedWithoutItsUnit) {
  EXPECT_DOUBLE_EQ(quantity_with_unit("12 mm", "m", "test"), 0.012);
  EXPECT_DOUBLE_EQ(quantity_with_unit("0.7MPa", "Pa", "test"), 0.7e6);
  for (const char* text : {"12", "12Nm", "-3mm", "nanmm", "", "mm"})
    EXPECT_THROW((void)quantity_with_unit(text, "m", "test"), UsageError) << text;
}

TEST(DesignTables, ShippedOnesHaveASourceForEveryEntry) {
  for (const auto& each : read_materials({})) EXPECT_FALSE(each.source.empty());
  const DriveTable drives = read_drives({});
  EXPECT_GE(drives.gears.size(), 5U);
  EXPECT_GE(drives.motors.size(), 5U);
}

TEST(DesignTables, RefuseAnEntryWithoutUnitOrSource) {
  const TemporaryFolder folder;
  const auto refuse = [&](const std::string& row) {
    const std::string file = folder.file("washers.yaml", "washers:\n  - " + row + "\n");
    EXPECT_THROW((void)read_washers(file), Error) << row;
  };
  const std::string rest = "cone_height: 0.3mm, elastic_modulus: 206GPa, poisson: 0.3}";
  refuse("{name: a, source: assumed, inner_diameter: 6, outer_diameter: 12mm, thickness: 1mm, " +
         rest);
  refuse("{name: a, source: mine, inner_diameter: 6mm, outer_diameter: 12mm, thickness: 1mm, " +
         rest);
  refuse("{name: a, source: assumed, inner_diameter: 6mm, outer_diameter: 5mm, thickness: 1mm, " +
         rest);
  refuse("{name: a, source: assumed, inner_diameter: 6mm, outer_diameter: 12mm, " + rest);
}

TEST(Outline, IsADxfOfCirclesAndLinesInMillimetres) {
  const std::string ring = dxf_of_ring({0.010, 0.0082, 0.004});
  EXPECT_TRUE(ring.starts_with("0\nSECTION\n"));
  EXPECT_TRUE(ring.ends_with("0\nEOF\n"));
  EXPECT_NE(ring.find("40\n10.000000\n"), std::string::npos);
  EXPECT_NE(ring.find("40\n8.200000\n"), std::string::npos);
  const std::string rod = dxf_of_rod(0.010, 0.0, 0.057);
  EXPECT_EQ(rod.find("CIRCLE"), rod.rfind("CIRCLE")) << "a solid rod has one";
}

}  // namespace
}  // namespace torsio
