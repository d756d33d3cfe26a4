#include "torsio/link/line_budget.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "link/link_bytes.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"
#include "torsio/link/link_messages.hpp"

namespace torsio {
namespace {

TEST(LineBudget, HasTheMeanLengthOfTelemetryFrames) {
  Random random(1);
  for (const std::size_t channels : {0U, 1U, 10U, 32U}) {
    double sum = 0.0;
    constexpr int kFrames = 4000;
    for (int n = 0; n < kFrames; ++n) {
      LinkTelemetry telemetry{.time_ns = random.bits(),
                              .sequence = static_cast<std::uint32_t>(random.bits())};
      telemetry.values.count = static_cast<std::uint8_t>(channels);
      for (float& value : telemetry.values.values) value = static_cast<float>(random.normal());
      test::LinkBytes payload(kNdlcomMaxPayloadBytes);
      payload.resize(encode_payload(telemetry, {}, payload));
      sum +=
          static_cast<double>(test::encoded({1, 2, static_cast<std::uint8_t>(n), payload}).size());
    }
    EXPECT_NEAR(sum / kFrames, telemetry_frame_bytes(channels),
                0.02 * telemetry_frame_bytes(channels))
        << channels;
  }
}

TEST(LineBudget, RefusesWhatTheLineDoesNotCarry) {
  const LineBudget line(serial_B_s(921600));  // 92160 bytes per second
  const auto fits = line.check(0.0, 10, 1000.0);
  EXPECT_TRUE(fits.fits);
  EXPECT_NEAR(fits.asked_B_s, 67500.0, 100.0);
  EXPECT_DOUBLE_EQ(fits.available_B_s, 82944.0);
  EXPECT_FALSE(line.check(fits.asked_B_s, 10, 1000.0).fits);
  EXPECT_FALSE(line.check(0.0, 10, std::numeric_limits<double>::quiet_NaN()).fits);
  EXPECT_TRUE(LineBudget().check(1e9, 32, 1e6).fits);
}

TEST(TokenBucket, LetsThroughItsRateAndABurst) {
  TokenBucket bucket(1000.0, 50.0);
  std::size_t sent = 0;
  for (std::uint64_t now_ns = 1'000'000; now_ns <= 1'001'000'000; now_ns += 100'000)
    while (bucket.take(10, now_ns)) sent += 10;
  EXPECT_GE(sent, 1040U);
  EXPECT_LE(sent, 1050U);
}

TEST(TokenBucket, HasTheTimeToWait) {
  TokenBucket bucket(1000.0, 50.0);
  EXPECT_EQ(bucket.wait_ns(50, 1), 0U);
  EXPECT_TRUE(bucket.take(50, 1));
  const std::uint64_t wait_ns = bucket.wait_ns(20, 1);
  EXPECT_EQ(wait_ns, 20'000'000U);
  EXPECT_FALSE(bucket.take(20, wait_ns));
  EXPECT_TRUE(bucket.take(20, wait_ns + 2));
  EXPECT_EQ(bucket.wait_ns(51, 1), std::numeric_limits<std::uint64_t>::max());
  EXPECT_THAT(test::error_message([] { TokenBucket never(0.0, 1.0); }),
              testing::HasSubstr("token bucket"));
}

}  // namespace
}  // namespace torsio
