// The estimates of what an exported program costs: their parts, names and refusals. `./run long export` compares them with
// what is measured.

#include "torsio/export/c_cost.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include "model/network/mlp.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {
namespace {

double count_of(const CCodeCounts& counts, CCode kind) {
  return counts[static_cast<std::size_t>(kind)];
}
double count_of(const CWorkCounts& counts, CWork kind) {
  return counts[static_cast<std::size_t>(kind)];
}

TEST(CCost, KindsHaveDifferentNames) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kCWorkCount; ++i) names.insert(name(static_cast<CWork>(i)));
  EXPECT_EQ(names.size(), kCWorkCount);
  EXPECT_EQ(names.count(""), 0U);
  EXPECT_EQ(name(CWork::step), "step");
  EXPECT_EQ(name(CWork::kernel_unit), "kernel_unit");
  names.clear();
  for (std::size_t i = 0; i < kCCodeCount; ++i) names.insert(name(static_cast<CCode>(i)));
  EXPECT_EQ(names.size(), kCCodeCount);
  EXPECT_EQ(name(CCode::program), "program");
  EXPECT_EQ(name(CCode::assignment), "assignment");
}

TEST(CCost, CountsWhatACodeConsistsOf) {
  const CCodeCounts counts = c_code(R"c(
/* if (a[0]) call(b) + 1.0F; */
static float joint_sum(const joint_state *s, const float *x) {
  float sum = 1.5e-3F;
  if (s->count >= 3U && x[0] < 2.0F) sum += joint_other(x[1]) * 4;
  return sum;
}
)c");
  EXPECT_EQ(count_of(counts, CCode::program), 1.0);
  EXPECT_EQ(count_of(counts, CCode::function), 1.0);
  EXPECT_EQ(count_of(counts, CCode::call), 2.0);  // with the definition
  EXPECT_EQ(count_of(counts, CCode::branch), 2.0);
  EXPECT_EQ(count_of(counts, CCode::member), 1.0);
  EXPECT_EQ(count_of(counts, CCode::element), 2.0);
  EXPECT_EQ(count_of(counts, CCode::number), 2.0);
  EXPECT_EQ(count_of(counts, CCode::arithmetic), 2.0);
  EXPECT_EQ(count_of(counts, CCode::comparison), 2.0);
  EXPECT_EQ(count_of(counts, CCode::assignment), 1.0);
}

TEST(CCost, AnUnfinishedCommentEndsTheCode) {
  EXPECT_EQ(count_of(c_code("a[0] /* b[1]"), CCode::element), 1.0);
  EXPECT_EQ(count_of(c_code(""), CCode::element), 0.0);
  EXPECT_EQ(count_of(c_code("/"), CCode::arithmetic), 1.0);
}

TEST(CCost, CountsTheWorkOfANetwork) {
  const Mlp model = example<Mlp>();
  const C99Program program =
      c99_program(example_model_file(AnyModel(model)), {}, "test.safetensors");
  double weights = 0.0;
  double units = 0.0;
  for (const DenseLayer& layer : model.parameters().layers) {
    weights += static_cast<double>(layer.weights.values.size());
    units += static_cast<double>(layer.weights.rows);
  }
  EXPECT_EQ(count_of(program.work, CWork::step), 1.0);
  EXPECT_EQ(count_of(program.work, CWork::weight), weights);
  EXPECT_EQ(count_of(program.work, CWork::unit), units);
  EXPECT_EQ(count_of(program.work, CWork::kernel), 0.0);
}

TEST(CCost, IsTheSumOfItsParts) {
  C99Program program;
  const CTarget& target = c_targets().front();
  const CCost none = c_cost(program, target, CReal::single);
  EXPECT_EQ(none.flash, 0.0);
  EXPECT_EQ(none.ram, 0.0);
  EXPECT_EQ(none.step.instructions, 0.0);
  program.table_bytes = 400;
  program.state_bytes = 64;
  program.work[static_cast<std::size_t>(CWork::weight)] = 1000.0;
  const CCost cost = c_cost(program, target, CReal::single);
  EXPECT_EQ(cost.flash, 400.0);
  EXPECT_EQ(cost.ram, 64.0);
  EXPECT_EQ(cost.step.instructions,
            1000.0 * target.single->instructions[static_cast<std::size_t>(CWork::weight)]);
  EXPECT_GT(cost.step.instructions, 3000.0);  // a load each, a product and the loop
  EXPECT_LT(cost.step.instructions, 10000.0);
}

TEST(CCost, EachTargetHasANameAndAPriceOfAFloat) {
  for (const CTarget& target : c_targets()) {
    EXPECT_FALSE(target.name.empty());
    EXPECT_FALSE(target.description.empty());
    EXPECT_EQ(&find_c_target(target.name), &target);
    ASSERT_NE(target.single, nullptr) << target.name;
    EXPECT_GT(target.single->instructions[static_cast<std::size_t>(CWork::step)], 0.0);
    if (target.twofold != nullptr) {
      EXPECT_GT(target.twofold->instructions[static_cast<std::size_t>(CWork::step)], 0.0);
    }
  }
}

TEST(CCost, AnUnknownTargetIsRefusedWithTheKnownOnes) {
  try {
    (void)find_c_target("z80");
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("z80"));
    EXPECT_THAT(error.what(), testing::HasSubstr("cortex-m4f"));
    EXPECT_THAT(error.what(), testing::HasSubstr("cortex-m7"));
  }
}

TEST(CCost, DoublesAreRefusedWhereAProcessorComputesThemInSoftware) {
  try {
    (void)c_cost({}, find_c_target("cortex-m4f"), CReal::twofold);
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("cortex-m4f"));
    EXPECT_THAT(error.what(), testing::HasSubstr("software"));
  }
  EXPECT_NO_THROW((void)c_cost({}, find_c_target("cortex-m7"), CReal::twofold));
}

}  // namespace
}  // namespace torsio::test
