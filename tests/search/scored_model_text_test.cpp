#include "search/scored_model_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ScoredModelText, RowsKeepEveryBit) {
  ResultRow row;
  row.split = Role::validation;
  row.recording = "sweep \"a\"";
  row.status = "diverged";
  row.reason = "it left the range";
  row.leak = true;
  row.score.metrics = {.samples = 7,
                       .rmse = 0.1 + 0.2,
                       .mad = 1e-310,
                       .std_abs = kNotMeasured,
                       .max_abs = kInfinity,
                       .fit_percent = -kInfinity};
  row.score.guarded_samples = 3;
  row.score.within_std_dev = 1.0 / 3.0;
  row.parameter_count = 12;
  row.fit_seconds = 0.25;
  const auto read = rows_from_text(rows_text({row, {}}));
  ASSERT_THAT(read, SizeIs(2));
  EXPECT_EQ(read[0].split, row.split);
  EXPECT_EQ(read[0].recording, row.recording);
  EXPECT_EQ(read[0].status, row.status);
  EXPECT_EQ(read[0].reason, row.reason);
  EXPECT_TRUE(read[0].leak);
  EXPECT_EQ(read[0].score.metrics.samples, 7U);
  EXPECT_EQ(read[0].score.metrics.rmse, row.score.metrics.rmse);
  EXPECT_EQ(read[0].score.metrics.mad, row.score.metrics.mad);
  EXPECT_TRUE(std::isnan(read[0].score.metrics.std_abs));
  EXPECT_EQ(read[0].score.metrics.max_abs, kInfinity);
  EXPECT_EQ(read[0].score.metrics.fit_percent, -kInfinity);
  EXPECT_EQ(read[0].score.guarded_samples, 3U);
  EXPECT_EQ(read[0].score.within_std_dev, 1.0 / 3.0);
  EXPECT_EQ(read[0].parameter_count, 12U);
  EXPECT_EQ(read[0].fit_seconds, 0.25);
  EXPECT_FALSE(read[1].recording);
}

TEST(ScoredModelText, EstimatesKeepEveryBit) {
  const std::vector<MeasuredEstimates> estimates{
      {.values = {0.1 + 0.2, kNotMeasured, -kInfinity}, .guarded = {false, true, false}},
      {.values = {}, .guarded = {}}};
  const auto read = unpack_estimates(pack_estimates(estimates));
  ASSERT_THAT(read, SizeIs(2));
  for (std::size_t n = 0; n < 3; ++n)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(read[0].values[n]),
              std::bit_cast<std::uint64_t>(estimates[0].values[n]));
  EXPECT_EQ(read[0].guarded, estimates[0].guarded);
  EXPECT_TRUE(read[1].values.empty());
}

TEST(ScoredModelText, RefusesDamagedBytes) {
  const auto is_refused = [](const std::string& message) {
    EXPECT_THAT(message, HasSubstr("damaged"));
  };
  is_refused(test::error_message([] { (void)rows_from_text("[{\"split\": 1"); }));
  is_refused(test::error_message([] { (void)rows_from_text("[{}]"); }));
  std::string bytes = pack_estimates({{.values = {1.0, 2.0}, .guarded = {false, false}}});
  is_refused(test::error_message([&] { (void)unpack_estimates(bytes.substr(0, 5)); }));
  bytes.resize(bytes.size() - 4);
  is_refused(test::error_message([&] { (void)unpack_estimates(bytes); }));
  is_refused(test::error_message([] { (void)unpack_estimates(""); }));
}

}  // namespace
}  // namespace torsio
