#include "torsio/realtime/mailbox.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <thread>
#include <vector>

namespace torsio {
namespace {

TEST(Mailbox, AnInitialValueIsReadAndIsNoCommand) {
  Mailbox<double> mailbox(2.5);
  EXPECT_EQ(mailbox.read().value, 2.5);
  EXPECT_EQ(mailbox.read().sequence, 0U);
  EXPECT_EQ(mailbox.read().age_ns(5), std::numeric_limits<std::int64_t>::max());
  mailbox.write(3.0, 100);
  EXPECT_EQ(mailbox.read().age_ns(140), 40);
}

// docs/simulation/faults.md 12, 27: the source's clock may be wrong, and what it sends must not stay fresh for
// that.
TEST(Mailbox, ALetterFromTheFutureIsNotFresh) {
  constexpr auto kEarliest = std::numeric_limits<std::int64_t>::min();
  constexpr auto kLatest = std::numeric_limits<std::int64_t>::max();
  Mailbox<double> mailbox;
  mailbox.write(1.0, 1'000'000'000'000);
  EXPECT_EQ(mailbox.read().age_ns(5), 999'999'999'995);
  EXPECT_EQ(mailbox.read().age_ns(1'000'000'000'005), 5);
  mailbox.write(1.0, kEarliest);
  EXPECT_EQ(mailbox.read().age_ns(kLatest), kLatest);
  EXPECT_EQ(mailbox.read().age_ns(kEarliest), 0);
  mailbox.write(1.0, kLatest);
  EXPECT_EQ(mailbox.read().age_ns(kEarliest), kLatest);
  EXPECT_EQ(mailbox.read().age_ns(-1), kLatest);
}

TEST(Mailbox, AReaderHasTheLatestValueWhateverTheOrderOfWritesAndReads) {
  EXPECT_TRUE(rc::check([](const std::vector<bool>& writes) {
    Mailbox<std::uint64_t> mailbox(0);
    std::uint64_t latest = 0;
    for (const bool is_write : writes) {
      if (is_write) {
        ++latest;
        mailbox.write(latest, static_cast<std::int64_t>(latest));
      }
      if (is_write) continue;
      RC_ASSERT(mailbox.read().value == latest);
      RC_ASSERT(mailbox.read().sequence == latest);
    }
  }));
}

/// Larger than any machine writes at once, so that a torn one shows.
using Wide = std::array<std::uint64_t, 24>;

TEST(Mailbox, AReaderGetsWholeValuesOnlyAndNeverAnOlderOneAfterANewerOne) {
  constexpr std::uint64_t kDifferent = 3000;
  Mailbox<Wide> mailbox;
  std::atomic<bool> stops{false};
  std::uint64_t written = 0;
  std::thread writer([&] {
    while (!stops) {
      Wide value;
      value.fill(++written);
      mailbox.write(value, static_cast<std::int64_t>(written));
      if (written % 64 == 0) std::this_thread::yield();  // there may be one core for both
    }
  });
  std::uint64_t seen = 0;
  std::uint64_t torn = 0;
  std::uint64_t older = 0;
  for (std::uint64_t different = 0; different < kDifferent;) {
    const auto& letter = mailbox.read();
    const auto is_whole = [&](std::uint64_t word) { return word == letter.sequence; };
    if (!std::ranges::all_of(letter.value, is_whole)) ++torn;
    if (letter.sequence < seen) ++older;
    if (letter.sequence > seen) ++different;
    if (letter.sequence == seen) std::this_thread::yield();
    seen = letter.sequence;
  }
  stops = true;
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(older, 0U);
  EXPECT_EQ(mailbox.read().sequence, written);
  EXPECT_EQ(mailbox.read().value.back(), written);
}

}  // namespace
}  // namespace torsio
