#include "torsio/data/dataset.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <string>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(Splits, InterleavedBlocksKeepTheTestWholeAndCutTheTrainingSide) {
  const auto segments = interleaved_blocks(100, 10, 5, 3);
  ASSERT_EQ(segments.size(), 4U);
  const auto expect = [&](std::size_t i, std::size_t begin, std::size_t end, Role role) {
    EXPECT_EQ(segments[i].begin, begin);
    EXPECT_EQ(segments[i].end, end);
    EXPECT_EQ(segments[i].role, role);
  };
  expect(0, 0, 37, Role::train);
  expect(1, 40, 50, Role::test);
  expect(2, 53, 87, Role::train);
  expect(3, 90, 100, Role::test);
}

TEST(Splits, ContiguousBlocksTrainFirst) {
  const auto segments = contiguous_blocks(100, 0.8, 5);
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_EQ(segments[0].end, 75U);
  EXPECT_EQ(segments[1].begin, 80U);
  EXPECT_EQ(segments[1].end, 100U);
  EXPECT_EQ(segments[1].role, Role::test);
}

TEST(Splits, RefuseAnEmbargoThatEatsATrainingBlock) {
  EXPECT_THROW(static_cast<void>(interleaved_blocks(100, 50, 2, 2)), Error);
  EXPECT_THROW(static_cast<void>(interleaved_blocks(10, 20, 5, 0)), Error);
  EXPECT_THROW(static_cast<void>(interleaved_blocks(100, 10, 1, 0)), Error);
  EXPECT_THROW(static_cast<void>(interleaved_blocks(100, 0, 2, 0)), Error);
  EXPECT_THROW(static_cast<void>(contiguous_blocks(100, 0.05, 5)), Error);
  EXPECT_THROW(static_cast<void>(contiguous_blocks(100, 1.0, 0)), Error);
  EXPECT_THROW(static_cast<void>(contiguous_blocks(1, 0.5, 0)), Error);
}

TEST(Splits, NoTrainingSampleIsNearerToATestThanTheEmbargo) {
  EXPECT_TRUE(rc::check([] {
    const auto samples = *rc::gen::inRange<std::size_t>(200, 5000);
    const auto blocks = *rc::gen::inRange<std::size_t>(4, 60);
    const auto every = *rc::gen::inRange<std::size_t>(2, 5);
    const auto embargo = *rc::gen::inRange<std::size_t>(0, 20);
    std::vector<Segment> segments;
    try {
      segments = interleaved_blocks(samples, blocks, every, embargo);
    } catch (const Error&) {
      RC_DISCARD("the embargo is too long for these blocks");
    }
    std::size_t tested = 0;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      RC_ASSERT(segments[i].begin < segments[i].end);
      if (segments[i].role == Role::test) tested += segments[i].end - segments[i].begin;
      if (i == 0) continue;
      RC_ASSERT(segments[i].role != segments[i - 1].role);
      RC_ASSERT(segments[i].begin == segments[i - 1].end + embargo);
    }
    const auto share = static_cast<double>(tested) / static_cast<double>(samples);
    const auto wanted = static_cast<double>(blocks / every) / static_cast<double>(blocks);
    RC_ASSERT(std::abs(share - wanted) < 0.05);
  }));
}

Dataset two_records(double second_rate_Hz) {
  Dataset dataset;
  for (const double rate : {100.0, second_rate_Hz}) {
    Recording recording("at " + std::to_string(static_cast<int>(rate)), rate);
    recording.add({.name = "torque_Nm", .values = {1.0, 2.0}});
    dataset.records.push_back({recording, whole_record(2, Role::train)});
  }
  return dataset;
}

TEST(Dataset, RefusesRecordsOnDifferentClocksOrWithoutTheTarget) {
  EXPECT_NO_THROW(two_records(100.0).check());
  EXPECT_THROW(two_records(200.0).check(), Error);
  Dataset other = two_records(100.0);
  other.target = "force_N";
  EXPECT_THROW(other.check(), Error);
  EXPECT_THROW(Dataset{}.check(), Error);
  other = two_records(100.0);
  other.records[0].segments.push_back({.begin = 1, .end = 2, .role = Role::test});
  EXPECT_THROW(other.check(), Error);
}

TEST(Dataset, KnowsWhichRolesItHas) {
  EXPECT_TRUE(two_records(100.0).has_role(Role::train));
  EXPECT_FALSE(two_records(100.0).has_role(Role::test));
  EXPECT_EQ(name(Role::validation), "validation");
}

}  // namespace
}  // namespace torsio
