#include "torsio/link/frame_counters.hpp"

#include <gtest/gtest.h>

namespace torsio {
namespace {

TEST(SentFrames, AreCountedPerReceiver) {
  SentFrames sent;
  EXPECT_EQ(sent.next(1), 0);
  EXPECT_EQ(sent.next(1), 1);
  EXPECT_EQ(sent.next(0xFF), 0);
  for (int n = 2; n < 256; ++n) EXPECT_EQ(sent.next(1), n);
  EXPECT_EQ(sent.next(1), 0);
}

TEST(ReceivedFrames, CountsWhatIsMissingPerPair) {
  ReceivedFrames received;
  for (int n = 0; n < 1000; ++n)
    if (n % 10 != 3) received.add(1, 2, static_cast<std::uint8_t>(n));
  received.add(2, 1, 200);
  EXPECT_EQ(received.pair(1, 2).lost, 100U);
  EXPECT_EQ(received.pair(1, 2).received, 900U);
  EXPECT_EQ(received.pair(2, 1).lost, 0U);
  EXPECT_EQ(received.pair(7, 7).received, 0U);
  EXPECT_EQ(received.total().received, 901U);
}

TEST(ReceivedFrames, DistinguishesRepeatedAndLateFramesFromARestart) {
  ReceivedFrames received;
  for (const int counter : {10, 11, 11, 13, 12, 14, 15})
    received.add(1, 2, static_cast<std::uint8_t>(counter));
  EXPECT_EQ(received.pair(1, 2).repeated, 1U);
  EXPECT_EQ(received.pair(1, 2).lost, 1U);
  EXPECT_EQ(received.pair(1, 2).late, 1U);
  for (const int counter : {0, 1, 2, 4}) received.add(1, 2, static_cast<std::uint8_t>(counter));
  EXPECT_EQ(received.pair(1, 2).restarts, 1U);
  EXPECT_EQ(received.pair(1, 2).lost, 2U);
}

TEST(ReceivedFrames, CountsFramesOfPairsForWhichThereIsNoSpace) {
  ReceivedFrames received;
  for (int sender = 0; sender < 70; ++sender) received.add(static_cast<std::uint8_t>(sender), 1, 0);
  EXPECT_EQ(received.untracked(), 70U - ReceivedFrames::kPairs);
  EXPECT_EQ(received.total().received, ReceivedFrames::kPairs);
}

}  // namespace
}  // namespace torsio
