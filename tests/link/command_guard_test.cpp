#include "torsio/link/command_guard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {
namespace {

using Refusal = CommandGuard::Refusal;

constexpr std::uint64_t kMs = 1'000'000;
constexpr std::uint64_t kStart_ns = 5'000 * kMs;

CommandGuard::Command young_command(std::uint64_t sequence, std::uint64_t clock_ns,
                                    std::uint8_t host = 7) {
  return {.route = {.receiver = 3, .sender = host},
          .sequence = sequence,
          .clock_ns = clock_ns,
          .is_intact = true};
}

TEST(CommandChecksum, IsThatOfEthernetOverHeaderAndPayload) {
  // "123456789" has CBF43926: receiver '1', sender '2', and a payload of '3' = 51 bytes with its CRC is not that text,
  // so that the header is compared with a payload of 47 bytes whose definition is evaluated bit by bit.
  std::vector<std::uint8_t> before(47);
  for (std::size_t k = 0; k < before.size(); ++k) before[k] = static_cast<std::uint8_t>(3 * k);
  std::vector<std::uint8_t> all{'1', '2', 51};
  all.insert(all.end(), before.begin(), before.end());
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::uint8_t byte : all) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  EXPECT_EQ(command_checksum({.receiver = '1', .sender = '2'}, before), ~crc);
  EXPECT_NE(command_checksum({.receiver = '2', .sender = '1'}, before), ~crc);
}

TEST(CommandGuard, AcceptsEachCommandOnce) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns), Refusal::none);
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns), Refusal::repeated);
  EXPECT_EQ(guard.accept(young_command(9, kStart_ns), kStart_ns + 1), Refusal::none);
  EXPECT_EQ(guard.accept(young_command(5, kStart_ns), kStart_ns + 2), Refusal::repeated);
  EXPECT_EQ(guard.accepted(), 2U);
  EXPECT_EQ(guard.refused(Refusal::repeated), 2U);
}

TEST(CommandGuard, RefusesWhatIsDamagedOldOrFromTheFuture) {
  CommandGuard guard({.watchdog_s = 0.05});
  auto command = young_command(1, kStart_ns);
  command.is_intact = false;
  EXPECT_EQ(guard.accept(command, kStart_ns), Refusal::checksum);
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns + 1), kStart_ns), Refusal::from_future);
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns + 50 * kMs), Refusal::too_old);
  EXPECT_EQ(guard.accept(young_command(1, 0), ~std::uint64_t{0}), Refusal::too_old);
  EXPECT_EQ(guard.accept(young_command(1, ~std::uint64_t{0}), 0), Refusal::from_future);
  command = young_command(1, kStart_ns);
  command.deadline_ns = kStart_ns + kMs;
  EXPECT_EQ(guard.accept(command, kStart_ns + kMs), Refusal::deadline);
  command = young_command(1, kStart_ns);
  command.route.receiver = kNdlcomBroadcast;
  EXPECT_EQ(guard.accept(command, kStart_ns), Refusal::broadcast);
  EXPECT_EQ(guard.controlling_host(), 0);
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns + 50 * kMs - 1), Refusal::none);
}

TEST(CommandGuard, LetsOneHostControlUntilItReleasesOrIsSilent) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns, 7), kStart_ns), Refusal::none);
  EXPECT_EQ(guard.accept(young_command(100, kStart_ns, 8), kStart_ns + 1), Refusal::other_host);
  EXPECT_EQ(guard.controlling_host(), 7);
  guard.release(kStart_ns + 2);
  EXPECT_EQ(guard.accept(young_command(100, kStart_ns, 8), kStart_ns + 3), Refusal::too_old)
      << "from before the release";
  EXPECT_EQ(guard.accept(young_command(100, kStart_ns + 2, 8), kStart_ns + 3), Refusal::none);
  EXPECT_FALSE(guard.step(kStart_ns + 50 * kMs + 1));
  EXPECT_EQ(guard.controlling_host(), 8);
  EXPECT_FALSE(guard.step(kStart_ns + 50 * kMs + 2));
  EXPECT_EQ(guard.controlling_host(), 0);
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns + 51 * kMs, 7), kStart_ns + 51 * kMs),
            Refusal::none);
}

TEST(CommandGuard, ACommandWithAnOlderClockDoesNotShortenTheControl) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns + 40 * kMs), kStart_ns + 40 * kMs),
            Refusal::none);
  EXPECT_EQ(guard.accept(young_command(2, kStart_ns), kStart_ns + 41 * kMs), Refusal::none);
  EXPECT_FALSE(guard.step(kStart_ns + 89 * kMs));
  EXPECT_EQ(guard.controlling_host(), 7);
}

TEST(CommandGuard, NothingIsExecutedAgainAfterARelease) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(5, kStart_ns), kStart_ns), Refusal::none);
  guard.release(kStart_ns + kMs);
  EXPECT_EQ(guard.accept(young_command(5, kStart_ns), kStart_ns + 2 * kMs), Refusal::too_old);
  EXPECT_EQ(guard.controlling_host(), 0);
}

TEST(CommandGuard, AWatchedJointStopsWhenMotionCommandsRunOut) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns), Refusal::none);
  guard.extend(young_command(1, kStart_ns));
  guard.watch(true);
  // A write of a register does not keep a joint in motion.
  EXPECT_EQ(guard.accept(young_command(2, kStart_ns + 40 * kMs), kStart_ns + 41 * kMs),
            Refusal::none);
  EXPECT_FALSE(guard.step(kStart_ns + 50 * kMs - 1));
  EXPECT_TRUE(guard.step(kStart_ns + 50 * kMs));
  EXPECT_FALSE(guard.step(kStart_ns + 51 * kMs)) << "once";
  EXPECT_EQ(guard.controlling_host(), 7) << "it still may write";
}

TEST(CommandGuard, TheDeadlineOfTheLastReferenceHolds) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns), Refusal::none);
  guard.extend(young_command(1, kStart_ns));
  guard.watch(true);
  auto brief = young_command(2, kStart_ns + kMs);
  brief.deadline_ns = kStart_ns + 3 * kMs;
  EXPECT_EQ(guard.accept(brief, kStart_ns + kMs), Refusal::none);
  guard.extend(brief);
  EXPECT_FALSE(guard.step(kStart_ns + 3 * kMs - 1));
  EXPECT_TRUE(guard.step(kStart_ns + 3 * kMs));
}

TEST(CommandGuard, StopsWhereTheClockRunsBackwards) {
  CommandGuard guard({.watchdog_s = 0.05});
  EXPECT_FALSE(guard.step(kStart_ns));
  EXPECT_EQ(guard.accept(young_command(1, kStart_ns), kStart_ns), Refusal::none);
  guard.extend(young_command(1, kStart_ns));
  guard.watch(true);
  EXPECT_TRUE(guard.step(kStart_ns - 1));
  EXPECT_EQ(guard.controlling_host(), 0);
}

TEST(CommandGuard, ExecutesNothingTwiceLateOrOutOfOrderOverAnyLine) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    CommandGuard guard({.watchdog_s = 0.02});
    std::multimap<std::uint64_t, CommandGuard::Command> line;
    std::set<std::pair<std::uint8_t, std::uint64_t>> executed;
    std::map<std::uint8_t, std::uint64_t> last;
    std::array<std::uint64_t, 3> sequence{};
    std::uint64_t heard_ns = kStart_ns;
    for (std::uint64_t tick = 0; tick < 5000; ++tick) {
      const std::uint64_t now_ns = kStart_ns + tick * kMs;
      if (random.uniform() < 0.8) heard_ns = now_ns;
      const auto host = static_cast<std::uint8_t>(1 + random.below(3));
      for (std::size_t copy = 1 + random.below(3); copy > 0; --copy)
        line.emplace(now_ns + random.below(60) * kMs,
                     young_command(sequence[host - 1U] + 1, heard_ns, host));
      ++sequence[host - 1U];
      static_cast<void>(guard.step(now_ns));
      if (random.uniform() < 0.01) guard.release(now_ns);
      for (; !line.empty() && line.begin()->first <= now_ns; line.erase(line.begin())) {
        const CommandGuard::Command& command = line.begin()->second;
        if (guard.accept(command, now_ns) != Refusal::none) continue;
        const std::uint8_t sender = command.route.sender;
        ASSERT_LT(now_ns - command.clock_ns, 20 * kMs) << "seed " << seed << ", tick " << tick;
        ASSERT_TRUE(executed.emplace(sender, command.sequence).second)
            << "seed " << seed << ", tick " << tick;
        ASSERT_GT(command.sequence, last[sender]) << "seed " << seed << ", tick " << tick;
        last[sender] = command.sequence;
      }
    }
    EXPECT_GT(guard.accepted(), 100U);
  }
}

TEST(CommandGuard, NamesEveryRefusal) {
  std::set<std::string_view> names;
  for (std::size_t k = 0; k < CommandGuard::kRefusals; ++k)
    names.insert(name(static_cast<Refusal>(k)));
  EXPECT_EQ(names.size(), CommandGuard::kRefusals);
}

TEST(CommandGuard, RefusesAWatchdogOutOfItsRange) {
  for (const double watchdog_s : {0.0, 9e-4, 11.0, -1.0})
    EXPECT_THAT(test::error_message([&] { CommandGuard guard({.watchdog_s = watchdog_s}); }),
                testing::HasSubstr("command guard: watchdog_s: expected 0.001 to 10"));
}

}  // namespace
}  // namespace torsio
