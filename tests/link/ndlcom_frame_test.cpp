#include "torsio/link/ndlcom_frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <string_view>
#include <vector>

#include "link/copy_plain.hpp"
#include "link/frame_crc.hpp"
#include "link/link_bytes.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using test::StoredFrame;
using testing::ElementsAre;
using testing::IsEmpty;

LinkBytes counted(std::size_t size) {
  LinkBytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

LinkBytes joined(std::initializer_list<LinkBytes> parts) {
  LinkBytes all;
  for (const LinkBytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// Source: test/encodedPackets_crc16.dat and decodedPackets.dat of github.com/t0beers/ndlcom at 3b5becc3.
struct GoldenFrame {
  StoredFrame frame;
  LinkBytes encoded;
};
const std::vector<GoldenFrame>& golden_frames() {
  static const std::vector<GoldenFrame> frames{
      {{0, 0, 0, {}}, {0x7E, 0, 0, 0, 0, 0x21, 0x03, 0x7E}},
      {{0, 0, 0, LinkBytes(6)}, {0x7E, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 74, 196, 0x7E}},
      {{1, 0, 0, {}}, {0x7E, 1, 0, 0, 0, 0x9A, 0x1F, 0x7E}},
      {{126, 1, 0, {126}}, {0x7E, 0x7D, 0x5E, 1, 0, 1, 0x7D, 0x5E, 0x59, 0xDB, 0x7E}},
      {{93, 121, 252, {47, 98, 168}},
       {0x7E, 0x5D, 0x79, 0xFC, 0x03, 0x2F, 0x62, 0xA8, 0x7D, 0x5D, 0x34, 0x7E}},
      {{129, 1, 1, counted(16)},
       {126, 129, 1, 1, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 154, 208, 126}},
      {{129, 1, 2, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 11, 12, 1, 14, 15, 16, 17, 19, 19, 20}},
       {126, 129, 1,  2, 21, 0,  1,  2,  3,  4,  5,  6,   7,  8,  9,
        12,  11,  12, 1, 14, 15, 16, 17, 19, 19, 20, 102, 34, 126}}};
  return frames;
}

TEST(NdlcomCrc, HasTheCheckValueOfMcrf4xx) {
  constexpr std::string_view kText = "123456789";
  const LinkBytes text(kText.begin(), kText.end());
  EXPECT_EQ(ndlcom_crc(text), 0x6F91);
  EXPECT_EQ(ndlcom_crc(LinkBytes{}), 0xFFFF);
}

TEST(NdlcomCrc, IsThatOfItsDefinitionForEverySizeInTwoParts) {
  Random random(1);
  for (std::size_t size = 0; size <= kNdlcomMaxDecodedBytes; ++size) {
    LinkBytes bytes(15 + size);
    for (std::size_t k = 0; k < size; ++k) bytes[15 + k] = static_cast<std::uint8_t>(random.bits());
    const std::span<const std::uint8_t> frame = std::span(bytes).subspan(15);
    std::uint16_t crc = 0xFFFF;
    for (const std::uint8_t byte : frame) {
      crc ^= byte;
      for (int bit = 0; bit < 8; ++bit)
        crc = static_cast<std::uint16_t>((crc >> 1U) ^ ((crc & 1U) != 0 ? 0x8408U : 0U));
    }
    const std::size_t first = random.below(size + 1);
    EXPECT_EQ(ndlcom_crc(frame), crc) << size;
    EXPECT_EQ(ndlcom_crc(frame.subspan(first), ndlcom_crc(frame.first(first))), crc) << size;
    EXPECT_EQ(detail::frame_crc(frame.data(), size), crc) << size;
  }
}

TEST(NdlcomBlocks, FindTheSameBytesWithAndWithoutVectors) {
  Random random(2);
  constexpr std::array<std::uint8_t, 8> kNear{0x7C, 0x7D, 0x7E, 0x7F, 0xFD, 0xFE, 0x00, 0x80};
  for (int n = 0; n < 20000; ++n) {
    std::array<std::uint8_t, 16> block;
    for (std::uint8_t& byte : block)
      byte = n % 2 == 0 ? kNear[random.below(8)] : static_cast<std::uint8_t>(random.bits());
    unsigned expected = 0;
    for (unsigned k = 0; k < 16; ++k)
      expected |= (block[k] == 0x7D || block[k] == 0x7E ? 1U : 0U) << k;
    std::array<std::uint8_t, 16> copy{};
    ASSERT_EQ(detail::copy_block(block.data(), copy.data()), expected);
    ASSERT_EQ(copy, block);
    copy = {};
    ASSERT_EQ(detail::copy_block_portable(block.data(), copy.data()), expected);
    ASSERT_EQ(copy, block);
  }
}

TEST(NdlcomFrame, IsEncodedAndDecodedAsTheSevenPublicOnes) {
  for (const GoldenFrame& golden : golden_frames()) {
    EXPECT_EQ(test::encoded(golden.frame), golden.encoded);
    for (const NdlcomRules rules : {NdlcomRules::strict, NdlcomRules::lenient}) {
      NdlcomDecoder decoder(rules);
      EXPECT_THAT(test::decoded(decoder, golden.encoded), ElementsAre(golden.frame));
    }
  }
}

TEST(NdlcomFrame, HasAtMost524Bytes) {
  static_assert(kNdlcomMaxDecodedBytes == 261 && kNdlcomMaxEncodedBytes == 524);
  std::size_t longest = 0;
  for (unsigned counter = 0; counter < 256; ++counter) {
    const StoredFrame frame{0x7E, 0x7D, static_cast<std::uint8_t>(counter), LinkBytes(255, 0x7E)};
    const LinkBytes bytes = test::encoded(frame);
    longest = std::max(longest, bytes.size());
    NdlcomDecoder decoder;
    EXPECT_THAT(test::decoded(decoder, bytes), ElementsAre(frame));
  }
  EXPECT_GE(longest, 521U);  // the length FF needs no escape, nor do most counters and CRCs
}

TEST(NdlcomFrame, OfEverySizeIsDecodedAsItWasEncoded) {
  Random random(3);
  NdlcomDecoder decoder;
  for (int round = 0; round < 8; ++round)
    for (std::size_t size = 0; size <= 255; ++size) {
      StoredFrame frame{static_cast<std::uint8_t>(random.bits()),
                        static_cast<std::uint8_t>(random.bits()),
                        static_cast<std::uint8_t>(random.bits()), LinkBytes(size)};
      for (std::uint8_t& byte : frame.payload) {
        byte = static_cast<std::uint8_t>(random.bits());
        if (random.uniform() < 0.1 * round) byte = random.uniform() < 0.5 ? 0x7E : 0x7D;
      }
      ASSERT_THAT(test::decoded(decoder, test::encoded(frame)), ElementsAre(frame)) << size;
    }
  EXPECT_EQ(decoder.counts().frames, 8U * 256U);
  EXPECT_EQ(decoder.counts().malformed + decoder.counts().crc_errors +
                decoder.counts().resynchronisations,
            0U);
}

TEST(NdlcomFrame, IsNotWrittenWhereItDoesNotFit) {
  const LinkBytes payload(40, 0x7E);
  const LinkBytes whole = test::encoded({1, 2, 3, payload});
  for (std::size_t size = 0; size < 200; ++size) {
    LinkBytes out(size + 8, 0xAA);
    const std::size_t written = encode_ndlcom(
        {.receiver = 1, .sender = 2, .counter = 3, .payload = payload}, std::span(out).first(size));
    ASSERT_EQ(written, size < whole.size() ? 0U : whole.size()) << size;
    for (std::size_t k = size; k < out.size(); ++k) ASSERT_EQ(out[k], 0xAA);
  }
  LinkBytes out(2 * kNdlcomMaxEncodedBytes);
  EXPECT_EQ(encode_ndlcom({.payload = LinkBytes(256)}, out), 0U);
}

TEST(NdlcomDecoder, TakesFramesThatAreSplitAnywhere) {
  const LinkBytes payload{1, 0x7E, 2,  0x7D, 0x7D, 3,  4,  5,  6,   7,
                          8, 9,    10, 11,   12,   13, 14, 15, 0x7E};
  const StoredFrame first{1, 2, 0x7E, payload};
  const StoredFrame second{3, 4, 5, {}};
  const LinkBytes stream =
      joined({test::encoded(first), test::encoded(second), test::encoded(first)});
  for (const NdlcomRules rules : {NdlcomRules::strict, NdlcomRules::lenient}) {
    for (std::size_t one = 0; one <= stream.size(); ++one)
      for (std::size_t two = one; two <= stream.size(); ++two) {
        NdlcomDecoder decoder(rules);
        std::vector<StoredFrame> frames;
        const std::span<const std::uint8_t> all = stream;
        for (const auto part : {all.first(one), all.subspan(one, two - one), all.subspan(two)})
          for (StoredFrame& frame : test::decoded(decoder, part))
            frames.push_back(std::move(frame));
        ASSERT_THAT(frames, ElementsAre(first, second, first)) << one << ", " << two;
      }
  }
}

TEST(NdlcomDecoder, AcceptsAFlagThatTwoFramesShare) {
  LinkBytes stream = test::encoded({1, 2, 3, {4}});
  const LinkBytes other = test::encoded({1, 2, 4, {5}});
  stream.insert(stream.end(), other.begin() + 1, other.end());
  NdlcomDecoder decoder;
  EXPECT_EQ(test::decoded(decoder, stream).size(), 2U);
}

/// What the public parser accepts and the strict rules refuse, or both accept.
TEST(NdlcomDecoder, IsStrictOrAsThePublicParser) {
  const LinkBytes frame = golden_frames()[4].encoded;
  const LinkBytes no_start(frame.begin() + 1, frame.end());
  const LinkBytes no_end(frame.begin(), frame.end() - 1);
  const LinkBytes needless = {0x7E, 0x7D, 0x21, 0, 0, 0, 0x9A, 0x1F, 0x7E};  // receiver 1
  const LinkBytes wrong_crc = {0x7E, 1, 0, 0, 0, 0x9B, 0x1F};
  LinkBytes junk_in_frame = frame;
  junk_in_frame.insert(junk_in_frame.end() - 1, {1, 2, 3});
  LinkBytes aborted = {0x7E, 1, 2, 3, 0x7D};
  struct Case {
    const char* what;
    LinkBytes bytes;
    std::size_t strict;
    std::size_t lenient;
  };
  const std::vector<Case> cases{
      {"as written", frame, 1, 1},
      {"no flag at the start", no_start, 0, 1},
      {"no flag at the end", no_end, 0, 1},
      {"no flag between two", joined({no_end, no_start}), 0, 2},
      {"a needless escape", needless, 0, 1},
      {"other bytes before the end flag", junk_in_frame, 0, 1},
      {"other bytes after a frame", joined({frame, {9, 9, 9}, frame}), 2, 2},
      {"a wrong CRC, then a frame without a flag", joined({wrong_crc, no_start}), 0, 1},
      {"a wrong CRC, then a frame", joined({wrong_crc, frame}), 1, 1},
      {"a frame that another one aborts", joined({aborted, frame}), 1, 1},
      {"many flags", joined({{0x7E, 0x7E, 0x7E}, frame, {0x7E, 0x7E}}), 1, 1}};
  for (const Case& each : cases) {
    NdlcomDecoder strict;
    NdlcomDecoder lenient(NdlcomRules::lenient);
    EXPECT_EQ(test::decoded(strict, each.bytes).size(), each.strict) << each.what;
    EXPECT_EQ(test::decoded(lenient, each.bytes).size(), each.lenient) << each.what;
  }
}

TEST(NdlcomDecoder, CountsWhatIsNotAFrame) {
  NdlcomDecoder decoder;
  const LinkBytes frame = test::encoded({1, 2, 3, {4}});
  LinkBytes wrong_crc = frame;
  wrong_crc[5] ^= 1;
  LinkBytes wrong_length = frame;
  wrong_length[4] ^= 2;
  test::decoded(decoder, joined({{1, 2},
                                 frame,
                                 wrong_crc,
                                 frame,
                                 wrong_length,
                                 frame,
                                 {0x7D, 0x11, 5},
                                 frame,
                                 LinkBytes(1000, 7),
                                 frame}));
  EXPECT_EQ(decoder.counts().frames, 5U);
  EXPECT_EQ(decoder.counts().crc_errors, 1U);
  EXPECT_EQ(decoder.counts().malformed, 3U);
  EXPECT_EQ(decoder.counts().resynchronisations, 3U);  // the start, the escape, the 1000 bytes
  decoder.reset();
  EXPECT_THAT(test::decoded(decoder, LinkBytes(frame.begin() + 1, frame.end())), IsEmpty());
  EXPECT_EQ(decoder.counts().frames, 5U);
}

/// Frames with these bits inverted that are accepted as another frame.
int accepted_with(const LinkBytes& good, std::span<const std::size_t> bits) {
  LinkBytes bad = good;
  for (const std::size_t bit : bits) bad[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
  NdlcomDecoder decoder;
  return static_cast<int>(test::decoded(decoder, bad).size());
}

TEST(NdlcomDecoder, NeverAcceptsOneWrongBit) {
  Random random(4);
  for (int n = 0; n < 60; ++n) {
    StoredFrame frame{1, 2, static_cast<std::uint8_t>(n), LinkBytes(random.below(60))};
    for (std::uint8_t& byte : frame.payload)
      byte = n % 3 == 0 ? 0x7E : static_cast<std::uint8_t>(random.bits());
    const LinkBytes good = test::encoded(frame);
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit)
      ASSERT_EQ(accepted_with(good, std::array{bit}), 0) << n << ", " << bit;
  }
}

TEST(NdlcomDecoder, WithstandsRandomBytes) {
  Random random(6);
  for (const NdlcomRules rules : {NdlcomRules::strict, NdlcomRules::lenient}) {
    NdlcomDecoder decoder(rules);
    for (int n = 0; n < 20000; ++n) {
      LinkBytes bytes(random.below(600));
      for (std::uint8_t& byte : bytes)
        byte = random.uniform() < 0.02 ? 0x7E : static_cast<std::uint8_t>(random.bits());
      for (const StoredFrame& frame : test::decoded(decoder, bytes))
        ASSERT_LE(frame.payload.size(), 255U);
    }
    EXPECT_GT(decoder.counts().malformed, 1000U);
  }
}

}  // namespace
}  // namespace torsio
