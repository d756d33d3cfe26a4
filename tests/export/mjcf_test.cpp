#include "torsio/export/mjcf.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/error_message.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string exported_mjcf(const ModelFile& file, MjcfOptions options = {}) {
  if (options.actuator.name.empty()) options.actuator = data_sheet("dfki-50");
  return mjcf_text(file, options, "joint.safetensors");
}

std::string refusal_of_mjcf(const ModelFile& file, const MjcfOptions& options = {}) {
  return error_message([&] { (void)exported_mjcf(file, options); });
}

ModelFile linear_file() { return example_model_file(AnyModel(example<Linear>())); }

TEST(Mjcf, HasTheNumbersOfTheActuatorAndTheModel) {
  const std::string text = exported_mjcf(linear_file(), {.name = "elbow"});
  EXPECT_THAT(text, HasSubstr(R"(<mujoco model="elbow">)"));
  EXPECT_THAT(text, HasSubstr(R"(timestep="0.001")"));
  EXPECT_THAT(text, HasSubstr(R"(armature="0.864" damping="10" frictionloss="6")"));
  EXPECT_THAT(text, HasSubstr(R"(<general name="elbow_spring" tendon="elbow_deflection" gear="-1" )"
                              R"(gaintype="fixed" gainprm="0" biastype="user"/>)"));
  EXPECT_THAT(text, HasSubstr("<size nuserdata="));
  EXPECT_THAT(text, HasSubstr("Not expressed: the supply"));
}

TEST(Mjcf, HasTheFallbackAsALinearSpring) {
  const std::string text = exported_mjcf(linear_file(), {.is_linear = true});
  EXPECT_THAT(text, HasSubstr(R"(biastype="affine" biasprm="0.5 -)"));
  EXPECT_THAT(text, Not(HasSubstr("nuserdata")));
  ModelFile falling = linear_file();
  falling.settings.fallback.slope = {-1.0, 0.0};
  EXPECT_THAT(refusal_of_mjcf(falling, {.is_linear = true}), HasSubstr("-1 Nm/rad"));
  EXPECT_EQ(refusal_of_mjcf(falling), "");
}

TEST(Mjcf, HasSmallerStepsForAModelOfALowRate) {
  ModelFile slow = linear_file();
  slow.settings.sample_rate_Hz = 101.0;
  const std::string text = exported_mjcf(slow, {.actuator = data_sheet("dfki-300")});
  EXPECT_THAT(text, HasSubstr("A tick of the model is 5 steps."));
  EXPECT_THAT(text, HasSubstr(R"(timestep="0.00198)"));
}

TEST(Mjcf, RefusesNamesThatAreNoIdentifiers) {
  for (const char* name : {"", "1joint", "a b", "a\"b", "a<b", "_x", "gelenk\xC3\xBC"})
    EXPECT_THAT(refusal_of_mjcf(linear_file(), {.name = name}), HasSubstr("an identifier")) << name;
}

TEST(Mjcf, RefusesModelsThatMujocoHasNoInputsFor) {
  ModelFile file = linear_file();
  file.settings.features = {.inputs = {"motor_current_A", "gear_angle_rad"}, .definitions = {}};
  file.settings.zeroed_channels.clear();
  EXPECT_THAT(refusal_of_mjcf(file), HasSubstr("the channel motor_current_A"));
  file.settings.features.inputs = {"motor_angle_rad / 120", "joint_speed_rad_s"};
  EXPECT_THAT(exported_mjcf(file), HasSubstr(".gear_ratio = 120"));
  file.settings.target = "joint_angle_rad";
  EXPECT_THAT(refusal_of_mjcf(file), HasSubstr("a torque in Nm"));
}

TEST(Mjcf, ANameOfAFileCannotEndTheComment) {
  const std::string text =
      mjcf_text(linear_file(), {.actuator = data_sheet("dfki-50")}, "a--> <b/>\n--");
  const std::size_t end = text.find("-->");
  EXPECT_EQ(text.substr(end + 4, 7), "<mujoco");
  EXPECT_EQ(text.substr(0, end).find("--", 4), std::string::npos);
}

}  // namespace
}  // namespace torsio::test
