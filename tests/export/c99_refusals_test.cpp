#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "support/error_message.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "support/grey_box_examples.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/export/c_cost.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

std::string refused(const AnyModel& model, const C99Options& options) {
  const ModelFile file = example_model_file(model);
  return error_message([&] { (void)c99_program(file, options, "x.safetensors"); });
}

TEST(C99Refusals, NamesThatAreNoIdentifiers) {
  const AnyModel model(example<Linear>());
  for (const char* name : {"", "1joint", "a-b", "a b", "_x", "float", "class", "gelenk\xC3\xBC"})
    EXPECT_THAT(refused(model, {.name = name}), HasSubstr("C identifier")) << name;
  EXPECT_EQ(refused(model, {.name = "joint_2"}), "");
}

TEST(C99Refusals, FamiliesThatAreNotExported) {
  EXPECT_THAT(refused(AnyModel(example<Dgmm>()), {}),
              HasSubstr("linear, linear_coulomb, polynomial"));
  EXPECT_THAT(refused(AnyModel(AnyModel::Parameters(example<GreyBoxWithDgmm>().parameters())), {}),
              HasSubstr("a mixture as its residual"));
}

TEST(C99Refusals, CountsOfWhatIsNoAngleOfTheModel) {
  const AnyModel model(example<Linear>());
  EXPECT_THAT(refused(model, {.counts = {{"elbow_angle_rad", 4096.0}}}),
              HasSubstr("gear_angle_rad"));
  EXPECT_THAT(refused(model, {.counts = {{"gear_angle_rad", 0.5}}}), HasSubstr("counts of a turn"));
  EXPECT_THAT(
      refused(model, {.counts = {{"gear_angle_rad", std::numeric_limits<double>::quiet_NaN()}}}),
      HasSubstr("counts of a turn"));
  EXPECT_THAT(refused(model, {.counts = {{"gear_angle_rad", 4096.0}, {"gear_angle_rad", 4096.0}}}),
              HasSubstr("twice"));
}

TEST(C99Refusals, NumbersThatAFloatDoesNotHold) {
  ModelFile file = example_model_file(AnyModel(example<Linear>()));
  file.settings.fallback.slope[0] = 1e60;
  EXPECT_THAT(error_message([&] { (void)c99_program(file, {.real = CReal::single}, "x"); }),
              HasSubstr("--real double"));
  EXPECT_EQ(error_message([&] { (void)c99_program(file, {.real = CReal::twofold}, "x"); }), "");
}

TEST(C99Refusals, CommentsOfACardCannotEndTheComment) {
  ModelFile file = example_model_file(AnyModel(example<Linear>()));
  file.card.held_out = "*/ int main(void) { return 1; } /*";
  file.card.options["degree"] = "/* \n \\";
  const C99Program program = c99_program(file, {}, "a*/b");
  EXPECT_EQ(program.header.find("*/ int main"), std::string::npos);
  EXPECT_EQ(program.header.find("a*/b"), std::string::npos);
}

TEST(CTargets, AreFoundByNameAndCostMoreForMore) {
  EXPECT_THAT(error_message([] { (void)find_c_target("cortex-m4"); }), HasSubstr("cortex-m4f"));
  const CTarget& target = find_c_target("cortex-m4f");
  const C99Options options{.real = CReal::single};
  const C99Program line =
      c99_program(example_model_file(AnyModel(example<Linear>())), options, "x");
  const C99Program network =
      c99_program(example_model_file(AnyModel(example<Mlp>())), options, "x");
  const CCost of_line = c_cost(line, target, CReal::single);
  const CCost of_network = c_cost(network, target, CReal::single);
  EXPECT_GT(of_line.step.instructions, 100.0);
  EXPECT_GT(of_network.step.instructions, of_line.step.instructions);
  EXPECT_GT(of_network.flash, of_line.flash);
  EXPECT_EQ(of_line.ram, static_cast<double>(line.state_bytes));
}

}  // namespace
}  // namespace torsio::test
