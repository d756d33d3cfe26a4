// Springs, clutch and actuator sized as a user types it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class DesignVerb : public Program {
 protected:
  static void expect_error(const Outcome& outcome, int exit_code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(DesignVerb, WritesARubberSpringInAllFormats) {
  const Outcome table = torsio(
      "design rubber-spring --torque 0.5Nm --angle 15deg --json a.json --yaml a.yaml --dxf a.dxf "
      "--report a.html --constraint 'wall <= 5mm'");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_NE(contents("a.html").find("Section of the ring along its axis"), std::string::npos);
  EXPECT_NE(table.out.find("8.23326"), std::string::npos) << table.out;
  const auto json = nlohmann::json::parse(contents("a.json"));
  EXPECT_NEAR(json.at("rounded").at("inner_radius_mm"), 8.2, 1e-9);
  EXPECT_NE(contents("a.yaml").find("  outer_radius_mm: 10"), std::string::npos);
  EXPECT_NE(contents("a.dxf").find("CIRCLE"), std::string::npos);
  // The stiffness in place of the angle is the same demand.
  EXPECT_NE(
      torsio("design rubber-spring --torque 0.5Nm --stiffness 1.9098593Nm/rad").out.find("8.23326"),
      std::string::npos);
}

TEST_F(DesignVerb, SizesASpringThatSimulateMeasures) {
  ASSERT_EQ(
      torsio("design spring --torque 120Nm --angle 6deg --max-diameter 40mm --max-length 120mm "
             "--bore 10mm --sheet joint.yaml")
          .exit_code,
      0);
  EXPECT_EQ(torsio("simulate joint.yaml static-cycle --duration 20s -o a.csv").exit_code, 0);
}

TEST_F(DesignVerb, ComparesTheKindsOfSprings) {
  const Outcome table = torsio(
      "design spring --torque 30Nm --angle 6deg --max-diameter 80mm --max-length 200mm "
      "--load-inertia 0.15kgm2 --json a.json --report a.html");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_EQ(table.out.find("35574"), std::string::npos) << "buckling stress of a thick wall";
  const auto json = nlohmann::json::parse(contents("a.json"));
  ASSERT_EQ(json.at("kinds").size(), 4U);
  for (const auto& kind : json.at("kinds")) {
    EXPECT_NE(table.out.find(kind.at("kind").get<std::string>()), std::string::npos);
    EXPECT_EQ(kind.at("chosen") == true, kind.at("kind") == json.at("spring").at("kind"));
  }
  EXPECT_NE(contents("a.html").find("Alternatives"), std::string::npos);
}

TEST_F(DesignVerb, NamesAllOptionsThatAreMissing) {
  for (const auto& [call, missing] :
       {std::pair{"spring", "--torque, --angle or --stiffness, --max-diameter, --max-length"},
        {"spring --torque 3Nm --angle 3deg", "--max-diameter, --max-length"},
        {"rubber-spring", "--torque, --angle or --stiffness"},
        {"clutch", "--slip or --torque"},
        {"actuator --peak 80Nm", "--continuous, --speed, --deflection"},
        {"coupling", "--angle, --measured-torque or --shear-modulus"},
        {"coupling --search 3", "--shear-modulus"}})
    expect_error(torsio(std::string("design ") + call), kCallWasWrong,
                 std::string("expected ") + missing + ", found a call without");
}

TEST_F(DesignVerb, RefusesAQuantityWithoutItsUnit) {
  const std::string spring =
      "design spring --torque 30Nm --angle 6deg --max-diameter 80mm --max-length 200mm ";
  expect_error(torsio(spring + "--load-inertia 0.15"), kCallWasWrong, "--load-inertia");
  expect_error(torsio("design actuator --continuous 45Nm --peak 90Nm --speed 60deg/s --deflection "
                      "5deg --link-inertia 0.3"),
               kCallWasWrong, "--link-inertia");
  expect_error(torsio("design coupling --angle 6deg --shear-modulus 4MPa --time-limit 100"),
               kCallWasWrong, "--time-limit");
}

TEST_F(DesignVerb, ChoosesAnActuatorThatTheOtherVerbsDrive) {
  const Outcome table = torsio(
      "design actuator --continuous 45Nm --peak 90Nm --speed 60deg/s --deflection 5deg "
      "--link-inertia 0.3kgm2 --sheet joint.yaml --plot pareto.svg");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_NE(contents("pareto.svg").find("Pareto front"), std::string::npos);
  EXPECT_EQ(torsio("tune-loop --actuator joint.yaml --bandwidth 8Hz").exit_code, 0);
  EXPECT_EQ(torsio("track --actuator joint.yaml --duration 5s").exit_code, 0);
}

TEST_F(DesignVerb, WritesNothingButTheAnswerWhereItIsInfeasible) {
  const Outcome none = torsio(
      "design rubber-spring --torque 0.5Nm --angle 15deg --max-radius 8mm --json a.json --dxf "
      "a.dxf");
  expect_error(none, kWorkFailed,
               "the largest outer radius of 8 mm would have to move to 8.574 mm");
  EXPECT_EQ(nlohmann::json::parse(contents("a.json")).at("feasible"), false);
  EXPECT_EQ(contents("a.dxf"), "");
  expect_error(
      torsio("design actuator --continuous 1000Nm --peak 2000Nm --speed 60deg/s "
             "--deflection 5deg --max-diameter 300mm --max-length 300mm --sheet joint.yaml"),
      kWorkFailed, "would have to move to");
  EXPECT_EQ(contents("joint.yaml"), "");
}

TEST_F(DesignVerb, RefusesACallBeforeAnyFileIsWritten) {
  const std::string rubber = "design rubber-spring --json a.json --torque ";
  expect_error(torsio(rubber + "0.5 --angle 15deg"), kCallWasWrong, "a number with its unit");
  expect_error(torsio(rubber + "0.5Nm"), kCallWasWrong,
               "design rubber-spring: expected --angle or --stiffness, found a call without it");
  expect_error(torsio(rubber + "0.5Nm --angle 15mm"), kCallWasWrong, "--angle");
  expect_error(torsio(rubber + "0.5Nm --angle 15deg --hardness 94"), kCallWasWrong,
               "30 to 80 Shore A");
  expect_error(torsio(rubber + "0.5Nm --angle 15deg --min-length 20mm"), kCallWasWrong,
               "contradict each other");
  expect_error(torsio("design clutch --slip 0.5Nm --washer M00620 --json a.json"), kCallWasWrong,
               "one of M00620-0060-01200-C");
  expect_error(torsio("design spring --torque 50Nm --angle 5deg --max-diameter 60mm --json a.json"),
               kCallWasWrong, "--max-length");
  expect_error(torsio("design actuator --continuous 50Nm --peak 20Nm --speed 60deg/s --deflection "
                      "5deg --json a.json"),
               kCallWasWrong, "contradict each other");
  expect_error(torsio("design spring --torqe 3Nm"), kCallWasWrong, "Did you mean '--torque'?");
  expect_error(torsio("design clutsch"), kCallWasWrong, "there is no verb 'clutsch'");
  expect_error(
      torsio("design spring --torque 50Nm --angle 5deg --max-diameter 60mm --max-length 90mm "
             "--json a.json --sheet 'my joint.yaml'"),
      kCallWasWrong, "my joint");
  EXPECT_EQ(contents("a.json"), "");
}

TEST_F(DesignVerb, StatesTheReasonOfAnInfeasibleDesignOnce) {
  const Outcome none = torsio(
      "design spring --torque 120Nm --angle 6deg --max-diameter 20mm --max-length 120mm --safety "
      "2");
  expect_error(none, kWorkFailed, "the safety factor of 2 would have to move to 1.74");
  EXPECT_EQ(none.err.find("  would"), std::string::npos) << none.err;
  EXPECT_EQ(none.err.find(" ;"), std::string::npos) << none.err;
  EXPECT_EQ(none.out.find("would have to move"), std::string::npos) << none.out;
}

}  // namespace
}  // namespace torsio::test
