// How often a frame that was changed on the line is accepted as another one, and how often the CRC-16 alone accepts random
// payloads. Each test prints its count: the table in docs/robot/link.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "link/link_bytes.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::LinkBytes;

constexpr std::size_t kFrames = 200'000;
constexpr std::size_t kManyFrames = 10'000'000;
constexpr std::size_t kPayload = 24;

void invert_bit(LinkBytes& frame, std::size_t bit) {
  frame[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
}

/// Inverts `count` bits, none of them twice.
void invert_bits(LinkBytes& frame, std::size_t count, Random& random) {
  std::vector<std::size_t> bits;
  while (bits.size() < count) {
    const std::size_t bit = random.below(8 * frame.size());
    if (std::ranges::find(bits, bit) != bits.end()) continue;
    bits.push_back(bit);
    invert_bit(frame, bit);
  }
}

/// Inverts the first and the last of 2 to 16 bits in a row, and half of those between them.
void invert_burst(LinkBytes& frame, std::size_t /*count*/, Random& random) {
  const std::size_t length = 2 + random.below(15);
  const std::size_t first = random.below(8 * frame.size() - length + 1);
  for (std::size_t k = 0; k < length; ++k)
    if (k == 0 || k + 1 == length || random.uniform() < 0.5) invert_bit(frame, first + k);
}

/// Removes 1 to 3 bytes, flags included.
void lose_bytes(LinkBytes& frame, std::size_t /*count*/, Random& random) {
  for (std::size_t left = 1 + random.below(3); left > 0; --left)
    frame.erase(frame.begin() + static_cast<std::ptrdiff_t>(random.below(frame.size())));
}

struct Damage {
  const char* name;
  void (*apply)(LinkBytes& frame, std::size_t count, Random& random);
  std::size_t count;
  bool is_always_found;  ///< by the strict rules
};

void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }

/// A frame whose payload is `kPayload` random bytes.
LinkBytes random_frame(Random& random, LinkBytes& payload) {
  for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random.bits());
  LinkBytes frame(kNdlcomMaxEncodedBytes);
  frame.resize(encode_ndlcom({.receiver = 1,
                              .sender = 2,
                              .counter = static_cast<std::uint8_t>(random.bits()),
                              .payload = payload},
                             frame));
  return frame;
}

/// Counts in `cases` damaged frames those in which a decoder with these rules finds a frame that was not sent.
std::size_t accepted_wrong_frames(const Damage& damage, NdlcomRules rules, std::uint64_t seed,
                                  std::size_t cases) {
  Random random(seed);
  LinkBytes payload(kPayload);
  NdlcomDecoder decoder(rules);
  std::size_t wrong = 0;
  for (std::size_t n = 0; n < cases; ++n) {
    LinkBytes frame = random_frame(random, payload);
    const std::uint8_t counter = frame[3] == 0x7D ? frame[4] ^ 0x20U : frame[3];
    damage.apply(frame, damage.count, random);
    decoder.reset();
    std::span<const std::uint8_t> bytes = frame;
    while (const auto found = decoder.next(bytes)) {
      const bool is_sent = found->receiver == 1 && found->sender == 2 &&
                           found->counter == counter && std::ranges::equal(found->payload, payload);
      if (!is_sent) ++wrong;
    }
  }
  return wrong;
}

void expect_found(const Damage& damage, std::uint64_t seed, std::size_t cases) {
  const std::size_t strict = accepted_wrong_frames(damage, NdlcomRules::strict, seed, cases);
  const std::size_t lenient = accepted_wrong_frames(damage, NdlcomRules::lenient, seed, cases);
  std::cout << damage.name << ": of " << cases << " frames strict rules accept " << strict
            << " wrong ones, lenient rules " << lenient << '\n';
  if (damage.is_always_found) {
    EXPECT_EQ(strict, 0U) << "seed " << seed;
  }
  EXPECT_LE(std::max(strict, lenient), cases / 10'000) << "seed " << seed;
}

class WrongFrames : public testing::TestWithParam<Damage> {};
class ManyWrongFrames : public testing::TestWithParam<Damage> {};

TEST_P(WrongFrames, AreFound) { expect_found(GetParam(), 5, kFrames); }
TEST_P(ManyWrongFrames, AreFound) { expect_found(GetParam(), 6, kManyFrames); }

const auto kDamages = testing::Values(
    Damage{"OneBit", invert_bits, 1, true}, Damage{"TwoBits", invert_bits, 2, true},
    Damage{"ThreeBits", invert_bits, 3, true}, Damage{"FourBits", invert_bits, 4, false},
    Damage{"Burst", invert_burst, 0, true}, Damage{"LostBytes", lose_bytes, 0, true});
const auto kName = [](const auto& damage) { return std::string(damage.param.name); };
INSTANTIATE_TEST_SUITE_P(Damaged, WrongFrames, kDamages, kName);
INSTANTIATE_TEST_SUITE_P(Damaged, ManyWrongFrames, kDamages, kName);

/// A payload that is replaced on the line by random bytes, header and CRC as they were: with no other check than that of the
/// frame, 2^-16 of them are accepted.
void expect_share_of_random_payloads(std::uint64_t seed, std::size_t cases) {
  Random random(seed);
  LinkBytes payload(kPayload);
  const auto is_special = [](std::uint8_t byte) { return byte == 0x7D || byte == 0x7E; };
  NdlcomDecoder decoder;
  std::size_t accepted = 0;
  for (std::size_t n = 0; n < cases;) {
    LinkBytes frame = random_frame(random, payload);
    // Only frames without an escape, so that bytes of the payload can be replaced where they are.
    if (std::ranges::any_of(frame.begin() + 1, frame.end() - 1, is_special)) continue;
    ++n;
    const auto begin = frame.end() - 1 - 2 - static_cast<std::ptrdiff_t>(kPayload);
    for (std::uint8_t& byte : std::span(begin, kPayload)) {
      do byte = static_cast<std::uint8_t>(random.bits());
      while (is_special(byte));
    }
    std::span<const std::uint8_t> bytes = frame;
    if (decoder.next(bytes)) ++accepted;
  }
  const double expected = static_cast<double>(cases) * 0x1p-16;
  std::cout << "random payloads: of " << cases << " frames the CRC-16 accepts " << accepted
            << ", expected " << expected << '\n';
  EXPECT_EQ(decoder.counts().crc_errors, cases - accepted);
  EXPECT_NEAR(static_cast<double>(accepted), expected, 4.0 * std::sqrt(expected))
      << "seed " << seed;
}

TEST(RandomPayloads, AreAcceptedByTheCrc16AtItsShare) {
  expect_share_of_random_payloads(7, 10 * kFrames);
}
TEST(ManyRandomPayloads, AreAcceptedByTheCrc16AtItsShare) {
  expect_share_of_random_payloads(8, kManyFrames);
}

}  // namespace
}  // namespace torsio
