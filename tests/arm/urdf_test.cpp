#include "torsio/arm/urdf.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// Each part on a line of its own, so that its number is known.
std::string inertial(const std::string& mass = "2", const std::string& xyz = "0 0 0",
                     const std::string& moments = "ixx='0.1' iyy='0.1' izz='0.1'",
                     const std::string& rpy = "0 0 0") {
  return "<inertial><origin xyz='" + xyz + "' rpy='" + rpy + "'/><mass value='" + mass +
         "'/><inertia " + moments + " ixy='0' ixz='0' iyz='0'/></inertial>";
}
std::string link(const std::string& name, const std::string& inside = inertial()) {
  return "<link name='" + name + "'>" + inside + "</link>\n";
}
std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& type = "revolute",
                  const std::string& more =
                      "<axis xyz='0 0 1'/>"
                      "<limit lower='-1' upper='1' effort='10' velocity='2'/>") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/>" + more + "</joint>\n";
}
std::string robot(const std::string& inside) {
  return "<robot name='r'>\n" + inside + "</robot>\n";
}
ArmModel read(const std::string& text) { return read_urdf(text, "r.urdf"); }

TEST(Urdf, TheArmThatComesWithTorsioIsThatOfTheTable) {
  const ArmModel arm =
      read(test::file_bytes(std::string(TORSIO_SOURCE) + "/share/torsio/arm6.urdf"));
  const ArmModel table = test::arm6();
  EXPECT_EQ(arm.name, "arm6");
  ASSERT_EQ(arm.joints.size(), table.joints.size());
  EXPECT_EQ(arm.flange.position_m, table.flange.position_m);
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const ArmJoint& read_joint = arm.joints[j];
    const ArmJoint& expected = table.joints[j];
    EXPECT_EQ(read_joint.name, expected.name);
    EXPECT_EQ(read_joint.link, expected.link);
    EXPECT_EQ(read_joint.axis, expected.axis);
    EXPECT_EQ(read_joint.origin.position_m, expected.origin.position_m);
    EXPECT_EQ(read_joint.effort_Nm, expected.effort_Nm);
    EXPECT_EQ(read_joint.speed_rad_s, expected.speed_rad_s);
    EXPECT_EQ(read_joint.lowest_rad, expected.lowest_rad);
    EXPECT_DOUBLE_EQ(read_joint.body.mass_kg, expected.body.mass_kg);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(read_joint.body.com_m[i], expected.body.com_m[i], 1e-12);
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(read_joint.body.inertia_kg_m2[i], expected.body.inertia_kg_m2[i], 1e-12);
  }
}

TEST(Urdf, WhatIsFixedToALinkIsAddedToIt) {
  // 2 kg at the joint and 1 kg at 0.3 m along y: the centre at 0.1 m.
  const ArmModel arm = read(robot(link("base") + link("a") +
                                  link("tool", inertial("1", "0 0.1 0")) + joint("j", "base", "a") +
                                  joint("f", "a", "tool", "fixed", "<origin xyz='0 0.2 0'/>")));
  ASSERT_EQ(arm.joints.size(), 1U);
  const BodyInertia& body = arm.joints[0].body;
  EXPECT_DOUBLE_EQ(body.mass_kg, 3.0);
  EXPECT_NEAR(body.com_m[1], 0.1, 1e-12);
  // Parallel axes: 0.2 + 2 * 0.1^2 + 1 * 0.2^2 about x and z.
  EXPECT_NEAR(body.inertia_kg_m2[0], 0.26, 1e-12);
  EXPECT_NEAR(body.inertia_kg_m2[1], 0.2, 1e-12);
  EXPECT_NEAR(body.inertia_kg_m2[2], 0.26, 1e-12);
  EXPECT_NEAR(arm.flange.position_m[1], 0.2, 1e-12);
}

TEST(Urdf, FramesThatAreFixedToTheBaseCount) {
  const ArmModel arm = read(robot(
      link("world", "") + link("base") + link("a") +
      joint("f", "world", "base", "fixed", "<origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/>") +
      joint("j", "base", "a", "revolute",
            "<origin xyz='0.5 0 0'/><axis xyz='0 0 2'/>"
            "<limit lower='-1' upper='1' effort='10' velocity='2'/>")));
  EXPECT_NEAR(arm.joints[0].origin.position_m[0], 1.0, 1e-12);
  EXPECT_NEAR(arm.joints[0].origin.position_m[1], 0.5, 1e-12);
  EXPECT_EQ(arm.joints[0].axis, (Vector3{0, 0, 1}));  // its length is 1
}

TEST(Urdf, RollPitchAndYawAreAboutFixedAxes) {
  // A quarter turn of roll, then one of yaw: x becomes y, y becomes z, z becomes x.
  const ArmModel arm =
      read(robot(link("base") + link("a") +
                 joint("j", "base", "a", "revolute",
                       "<origin rpy='1.5707963267948966 0 1.5707963267948966'/><axis xyz='0 0 1'/>"
                       "<limit lower='-1' upper='1' effort='10' velocity='2'/>")));
  const Matrix3 expected = {0, 0, 1, 1, 0, 0, 0, 1, 0};
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(arm.joints[0].origin.rotation[i], expected[i], 1e-12) << i;
}

TEST(Urdf, ThreeAnglesAreRollThenPitchThenYaw) {
  const ArmModel arm =
      read(robot(link("base") + link("a") + link("tool") + joint("j", "base", "a") +
                 joint("f", "a", "tool", "fixed", "<origin rpy='0.3 0.4 0.5'/>")));
  // Rz(0.5) Ry(0.4) Rx(0.3), multiplied out apart from this code.
  const Matrix3 expected = {0.808307,  -0.357020, 0.468163, 0.441580, 0.893559,
                            -0.080985, -0.389418, 0.272192, 0.879923};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(arm.flange.rotation[i], expected[i], 1e-6) << i;
}

TEST(Urdf, TheAxesOfAnInertiaMayBeTurned) {
  const ArmModel arm = read(robot(link("base") +
                                  link("a", inertial("2", "0 0 0", "ixx='0.1' iyy='0.2' izz='0.25'",
                                                     "0 0 1.5707963267948966")) +
                                  joint("j", "base", "a")));
  EXPECT_NEAR(arm.joints[0].body.inertia_kg_m2[0], 0.2, 1e-12);
  EXPECT_NEAR(arm.joints[0].body.inertia_kg_m2[1], 0.1, 1e-12);
}

TEST(Urdf, PassesOverWhatIsNotMassOrJoint) {
  const ArmModel arm = read(robot(
      "<material name='m'/><gazebo><link/></gazebo><mujoco><compiler/></mujoco>\n" + link("base") +
      link("a", inertial() + "<visual><origin xyz='x'/><geometry/></visual><collision/>") +
      joint("j", "base", "a", "revolute",
            "<axis xyz='0 1 0'/><dynamics damping='no number'/>"
            "<limit lower='-1' upper='+1' effort='10' velocity='2'/>")));
  EXPECT_EQ(arm.joints.size(), 1U);
}

ArmModel with_frames(const std::string& links, const std::string& joints) {
  return read(robot(link("base") + link("a") + joint("j", "base", "a") + links + joints));
}
std::string frame(const std::string& parent, const std::string& child, const std::string& xyz) {
  return joint("to_" + child, parent, child, "fixed", "<origin xyz='" + xyz + "'/>");
}

TEST(Urdf, WhereTheChainForksTheFlangeIsTheLinkOfThatName) {
  const std::string camera = link("camera", "") + link("lens", "");
  const std::string to_camera = frame("a", "camera", "0 0 0.05") + frame("camera", "lens", "0 0 1");
  for (const char* name : {"flange", "tool0"}) {
    const ArmModel arm =
        with_frames(link(name, "") + camera, frame("a", name, "0.1 0 0") + to_camera);
    EXPECT_EQ(arm.flange.position_m, (Vector3{0.1, 0, 0})) << name;
  }
  const ArmModel both =
      with_frames(link("flange", "") + link("tool0", "") + camera,
                  frame("a", "flange", "0.1 0 0") + frame("flange", "tool0", "1 0 0") + to_camera);
  EXPECT_EQ(both.flange.position_m, (Vector3{0.1, 0, 0}));
}

TEST(Urdf, TheFlangeIsTheEndOfTheFirstLongestBranchIfNoneHasItsName) {
  const ArmModel one =
      with_frames(link("flange", "") + link("tool", ""),
                  frame("a", "flange", "0.1 0 0") + frame("flange", "tool", "1 0 0"));
  EXPECT_EQ(one.flange.position_m, (Vector3{1.1, 0, 0}));
  const ArmModel equal = with_frames(link("left", "") + link("right", ""),
                                     frame("a", "left", "0 1 0") + frame("a", "right", "0 -1 0"));
  EXPECT_EQ(equal.flange.position_m, (Vector3{0, 1, 0}));
}

TEST(Urdf, AFixedLinkMayBeAPointMass) {
  const ArmModel arm = with_frames(link("lead", inertial("1", "0 0 0", "ixx='0' iyy='0' izz='0'")),
                                   frame("a", "lead", "0.3 0 0"));
  EXPECT_DOUBLE_EQ(arm.joints[0].body.mass_kg, 3.0);
  EXPECT_NEAR(arm.joints[0].body.inertia_kg_m2[2], 0.1 + 2.0 * 0.01 + 1.0 * 0.04, 1e-12);
}

TEST(Urdf, ElementsAndAttributesOfOtherProgramsArePassedOver) {
  const ArmModel arm = with_frames(
      link("tool", "<drake:x/><contact/><self_collide>1</self_collide>"),
      joint("f", "a", "tool", "fixed", "<origin xyz='0.1 0 0' drake:y='1'/><compliance/>"));
  EXPECT_EQ(arm.flange.position_m, (Vector3{0.1, 0, 0}));
}

TEST(Urdf, AThousandLinksAreReadAndOneMoreIsRefused) {
  const auto chain = [](int count) {
    std::string text = link("l0") + link("l1") + joint("j1", "l0", "l1");
    for (int l = 2; l < count; ++l)
      text += link("l" + std::to_string(l)) +
              frame("l" + std::to_string(l - 1), "l" + std::to_string(l), "0 0 0.001");
    return robot(text);
  };
  EXPECT_DOUBLE_EQ(read(chain(1000)).joints[0].body.mass_kg, 2.0 * 999);
  EXPECT_THAT(test::error_message([&] { (void)read(chain(1001)); }),
              HasSubstr("at most 1000 links"));
}

struct WrongUrdf {
  std::string name;
  std::string text;
  std::vector<std::string> message;
};
class WrongUrdfTest : public testing::TestWithParam<WrongUrdf> {};

TEST_P(WrongUrdfTest, IsRefusedWithPlaceAndReason) {
  const std::string message = test::error_message([&] { (void)read(GetParam().text); });
  for (const std::string& part : GetParam().message) EXPECT_THAT(message, HasSubstr(part));
}

const std::string kMotion =
    "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='10' velocity='2'/>";

std::string nine_joints() {
  std::string text = link("l0");
  for (int j = 1; j <= 9; ++j)
    text += link("l" + std::to_string(j)) +
            joint("j" + std::to_string(j), "l" + std::to_string(j - 1), "l" + std::to_string(j));
  return robot(text);
}
std::string nested(int depth) {
  std::string text = "<robot name='r'>";
  for (int i = 0; i < depth; ++i) text += "<a>";
  for (int i = 0; i < depth; ++i) text += "</a>";
  return text + "</robot>";
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, WrongUrdfTest,
    testing::Values(
        WrongUrdf{"empty", "", {"r.urdf: line 1", "not XML", "empty"}},
        WrongUrdf{"text", "hello", {"r.urdf: line 1", "not XML"}},
        WrongUrdf{"cut", "<robot name='r'>\n<link name='a'>", {"r.urdf: line 2", "not XML"}},
        WrongUrdf{"sdf", "<sdf/>", {"r.urdf: line 1", "<robot>", "another format"}},
        WrongUrdf{"doctype",
                  "<!DOCTYPE robot [<!ENTITY a 'aaaa'>]>\n<robot name='&a;'/>",
                  {"r.urdf: line 1", "DOCTYPE"}},
        WrongUrdf{"deep", nested(100), {"64 deep"}},
        WrongUrdf{"huge", std::string((std::size_t{4} << 20U) + 1, ' '), {"4 MiB"}},
        WrongUrdf{"no_link", robot(""), {"r.urdf: line 1", "the base", "no link"}},
        WrongUrdf{"fixed_only",
                  robot(link("a") + link("b") + joint("f", "a", "b", "fixed", "")),
                  {"r.urdf: line 1", "at least one revolute joint"}},
        WrongUrdf{"unnamed_joint",
                  robot(link("a") + link("b") + joint("", "a", "b")),
                  {"r.urdf: line 4: <joint>", "a name"}},
        WrongUrdf{"unnamed_link", robot(link("")), {"r.urdf: line 2: <link>", "a name"}},
        WrongUrdf{
            "two_links", robot(link("a") + link("a")), {"r.urdf: line 3", "'a', as in line 2"}},
        WrongUrdf{
            "two_joints",
            robot(link("a") + link("b") + link("c") + joint("j", "a", "b") + joint("j", "b", "c")),
            {"r.urdf: line 6", "as in line 5"}},
        WrongUrdf{"prismatic",
                  robot(link("a") + link("b") + joint("j", "a", "b", "prismatic")),
                  {"r.urdf: line 4", "joint 'j' is neither revolute nor fixed", "'prismatic'"}},
        WrongUrdf{"continuous",
                  robot(link("a") + link("b") + joint("j", "a", "b", "continuous")),
                  {"'continuous'", "limits of its motion"}},
        WrongUrdf{"floating",
                  robot(link("a") + link("b") + joint("j", "a", "b", "floating")),
                  {"'floating'"}},
        WrongUrdf{"mimic",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute", kMotion + "<mimic joint='k'/>")),
                  {"follows another joint"}},
        WrongUrdf{"no_parent",
                  robot(link("b") + "<joint name='j' type='fixed'><child link='b'/></joint>\n"),
                  {"r.urdf: line 3", "<parent link=...>"}},
        WrongUrdf{"unknown_link",
                  robot(link("a") + joint("j", "a", "b")),
                  {"r.urdf: line 3", "the child of joint 'j' does not exist", "'b'"}},
        WrongUrdf{"loop",
                  robot(link("a") + link("b") + link("c") + joint("j", "a", "b") +
                        joint("k", "b", "c") + joint("l", "a", "c")),
                  {"r.urdf: line 7", "link 'c' has two parents: a loop"}},
        WrongUrdf{"circle",
                  robot(link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a")),
                  {"r.urdf: line 5", "a loop of joints, of which 'k'"}},
        WrongUrdf{"circle_beside",
                  robot(link("base") + link("x") + joint("i", "base", "x") + link("a") + link("b") +
                        joint("j", "a", "b") + joint("k", "b", "a")),
                  {"r.urdf: line 7", "joint 'j'", "not connected to the base 'base'"}},
        WrongUrdf{"two_roots", robot(link("a") + link("b")), {"r.urdf: line 3", "'a' and 'b'"}},
        WrongUrdf{
            "branch",
            robot(link("a") + link("b") + link("c") + joint("j", "a", "b") + joint("k", "a", "c")),
            {"r.urdf: line 6", "the robot branches"}},
        WrongUrdf{"no_mass",
                  robot(link("a") + link("b", "") + joint("j", "a", "b")),
                  {"r.urdf: line 3", "link 'b' moves and has no <inertial>"}},
        WrongUrdf{"zero_mass",
                  robot(link("a") + link("b", inertial("0")) + joint("j", "a", "b")),
                  {"r.urdf: line 3", "the mass of link 'b'", "positive"}},
        WrongUrdf{"negative_mass",
                  robot(link("a") + link("b", inertial("-1")) + joint("j", "a", "b")),
                  {"r.urdf: line 3", "found -1"}},
        WrongUrdf{"zero_inertia",
                  robot(link("a") + link("b", inertial("1", "0 0 0", "ixx='0' iyy='0' izz='0'")) +
                        joint("j", "a", "b")),
                  {"r.urdf: line 3", "link 'b'", "positive principal moments"}},
        WrongUrdf{"impossible_inertia",
                  robot(link("a") + link("b", inertial("1", "0 0 0", "ixx='1' iyy='1' izz='3'")) +
                        joint("j", "a", "b")),
                  {"r.urdf: line 3", "above the sum of the others"}},
        WrongUrdf{"no_limit",
                  robot(link("a") + link("b") + joint("j", "a", "b", "revolute", "")),
                  {"r.urdf: line 4", "joint 'j' has no <limit>"}},
        WrongUrdf{"empty_limits",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute",
                              "<limit lower='1' upper='1' effort='1' velocity='1'/>")),
                  {"r.urdf: line 4", "contain no angle"}},
        WrongUrdf{"turned_limits",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute",
                              "<limit lower='2' upper='1' effort='1' velocity='1'/>")),
                  {"r.urdf: line 4", "contain no angle", "found 2 and 1"}},
        WrongUrdf{"planet",
                  robot(link("a") + link("b", inertial("1e308")) + joint("j", "a", "b")),
                  {"r.urdf: line 3", "joint 'j': mass", "at most 1e6"}},
        WrongUrdf{"far_centre",
                  robot(link("a") + link("b") + link("c", inertial("1", "1e200 0 0")) +
                        joint("j", "a", "b") + joint("f", "b", "c", "fixed", "")),
                  {"r.urdf: line 3", "link 'b'", "not finite"}},
        WrongUrdf{"no_effort",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute",
                              "<limit lower='0' upper='1' effort='0' velocity='1'/>")),
                  {"r.urdf: line 4", "cannot move"}},
        WrongUrdf{
            "no_lower",
            robot(link("a") + link("b") +
                  joint("j", "a", "b", "revolute", "<limit upper='1' effort='1' velocity='1'/>")),
            {"r.urdf: line 4: <limit>", "an attribute 'lower'"}},
        WrongUrdf{"comma",
                  robot(link("a", inertial("1,5"))),
                  {"r.urdf: line 2: <mass>: value", "'1,5'", "a point before the decimals"}},
        WrongUrdf{"nan", robot(link("a", inertial("nan"))), {"'nan'"}},
        WrongUrdf{
            "two_numbers", robot(link("a", inertial("1", "0 0"))), {"three numbers", "'0 0'"}},
        WrongUrdf{"four_numbers", robot(link("a", inertial("1", "0 0 0 0"))), {"three numbers"}},
        WrongUrdf{
            "zero_axis",
            robot(link("a") + link("b") + joint("j", "a", "b", "revolute", "<axis xyz='0 0 0'/>")),
            {"r.urdf: line 4: <axis>", "a length above 0"}},
        WrongUrdf{"blank", " \n\t\n", {"r.urdf: line 1", "an empty text"}},
        WrongUrdf{"xacro",
                  robot("<xacro:arm prefix='left'/>\n"),
                  {"r.urdf: line 2", "a macro of xacro", "xacro robot.urdf.xacro"}},
        WrongUrdf{"xacro_value", robot(link("a", inertial("${m}"))), {"'${m}'", "xacro"}},
        WrongUrdf{"misspelt_element",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute", "<orgin xyz='0 0 1'/>" + kMotion)),
                  {"r.urdf: line 4: <orgin>", "Did you mean 'origin'?"}},
        WrongUrdf{"misspelt_attribute",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute", "<origin xzy='0 0 1'/>" + kMotion)),
                  {"r.urdf: line 4: <origin>", "no attribute but xyz, rpy", "'xzy'"}},
        WrongUrdf{
            "quaternion",
            robot(link("a") + link("b") +
                  joint("j", "a", "b", "revolute", "<origin quat_xyzw='0 0 1 0'/>" + kMotion)),
            {"r.urdf: line 4: <origin>", "'quat_xyzw'"}},
        WrongUrdf{"two_origins",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute", "<origin/>\n<origin/>" + kMotion)),
                  {"r.urdf: line 5: <origin>", "a second one"}},
        WrongUrdf{"two_inertials",
                  robot(link("a", inertial() + "\n" + inertial())),
                  {"r.urdf: line 3: <inertial>", "a second one"}},
        WrongUrdf{"two_signs", robot(link("a", inertial("1", "+-1 0 0"))), {"three numbers"}},
        WrongUrdf{"overflow", robot(link("a", inertial("1e999"))), {"'1e999'"}},
        WrongUrdf{"limit_line",
                  robot(link("a") + link("b") +
                        joint("j", "a", "b", "revolute",
                              "\n<limit lower='1' upper='0' effort='1' velocity='1'/>")),
                  {"r.urdf: line 5", "contain no angle"}},
        WrongUrdf{"tool_of_negative_inertia",
                  robot(link("a") + link("b") +
                        link("c", inertial("1", "0 0 0", "ixx='-0.05' iyy='0.01' izz='0.01'")) +
                        joint("j", "a", "b") + frame("b", "c", "0 0 0")),
                  {"r.urdf: line 4: link 'c'", "positive principal moments"}},
        WrongUrdf{"frame_without_mass",
                  robot(link("a") + link("b") + link("c", inertial("0")) + joint("j", "a", "b") +
                        frame("b", "c", "0 0 0")),
                  {"r.urdf: line 4", "the mass of link 'c'", "only a frame"}},
        WrongUrdf{"nine", nine_joints(), {"at most 8 revolute joints"}}),
    [](const auto& parameter) { return parameter.param.name; });

TEST(Urdf, RandomChangesNeverGiveAnImpossibleArm) {
  const std::string text = test::file_bytes(std::string(TORSIO_SOURCE) + "/share/torsio/arm6.urdf");
  Random random(8);
  std::size_t refused = 0;
  constexpr int kTrials = 3000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string changed = text;
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(text.size()));
      if (random.uniform() < 0.5)
        changed[at % changed.size()] = static_cast<char>(random.bits() & 0x7fU);
      else
        changed.erase(at % changed.size(), 1);
    }
    try {
      require_possible(read(changed));
    } catch (const Error& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr("r.urdf"));
    }
  }
  EXPECT_GT(refused, 100U);
  EXPECT_LT(refused, static_cast<std::size_t>(kTrials));
}

}  // namespace
}  // namespace torsio
