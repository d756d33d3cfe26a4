#include "torsio/link/link_messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <set>
#include <string>
#include <type_traits>

#include "link/message_vectors.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::LinkBytes;

template <class Message>
LinkBytes payload_of(const Message& message, LinkRoute route = test::kVectorRoute) {
  LinkBytes out(kNdlcomMaxPayloadBytes);
  out.resize(encode_payload(message, route, out));
  return out;
}

/// The checksum of a changed command, as whoever changes it can compute it.
void seal_again(LinkBytes& payload) {
  const std::uint32_t crc =
      command_checksum(test::kVectorRoute, std::span(payload).first(payload.size() - 4));
  for (std::size_t k = 0; k < 4; ++k)
    payload[payload.size() - 4 + k] = static_cast<std::uint8_t>(crc >> 8 * k);
}

TEST(LinkMessages, AreEncodedAsTheVectorsThatPythonWrote) {
  std::size_t count = 0;
  test::each_message_vector([&](const auto& message, const LinkBytes& expected) {
    using Message = std::decay_t<decltype(message)>;
    EXPECT_EQ(payload_of(message), expected) << link_message_name(Message::kId);
    EXPECT_EQ(is_link_command(Message::kId), Message::kIsCommand);
    ++count;
  });
  EXPECT_EQ(count, 28U);
}

TEST(LinkMessages, AreDecodedAsTheyWereEncoded) {
  test::each_message_vector([&](const auto& message, const LinkBytes& payload) {
    std::decay_t<decltype(message)> decoded;
    ASSERT_EQ(decode_payload(payload, decoded), LinkRefusal::none);
    EXPECT_EQ(payload_of(decoded), payload) << link_message_name(decoded.kId);
  });
}

TEST(LinkMessages, OfEveryOtherLengthAreRefused) {
  test::each_message_vector([&](const auto& message, const LinkBytes& payload) {
    using Message = std::decay_t<decltype(message)>;
    if constexpr (!std::is_same_v<Message, LinkUploadChunk>) {  // whose last field has any length
      for (std::size_t size = 0; size <= payload.size() + 3; ++size) {
        if (size == payload.size()) continue;
        LinkBytes other = payload;
        other.resize(size);
        Message decoded;
        EXPECT_NE(decode_payload(other, decoded), LinkRefusal::none)
            << link_message_name(Message::kId) << ", " << size;
      }
    }
  });
}

TEST(LinkMessages, OfAnotherVersionOrIdAreRefused) {
  test::each_message_vector([&](const auto& message, const LinkBytes& payload) {
    std::decay_t<decltype(message)> decoded;
    LinkBytes other = payload;
    other[1] = 2;
    EXPECT_EQ(decode_payload(other, decoded), LinkRefusal::wrong_version);
    other = payload;
    other[0] ^= 0x80;
    EXPECT_EQ(decode_payload(other, decoded), LinkRefusal::unknown_message);
    EXPECT_EQ(link_message_name(other[0]), "");
  });
}

TEST(LinkMessages, WithNumbersThatMustBeFiniteAreRefusedWithNaN) {
  LinkReference reference{.torque_Nm = std::numeric_limits<float>::quiet_NaN()};
  LinkReference decoded;
  EXPECT_EQ(decode_payload(payload_of(reference), decoded), LinkRefusal::not_finite);
  reference.torque_Nm = std::numeric_limits<float>::infinity();
  EXPECT_EQ(decode_payload(payload_of(reference), decoded), LinkRefusal::not_finite);
}

TEST(LinkMessages, WithAnUnknownValueAreRefused) {
  LinkBytes payload = payload_of(LinkStateChange{.command = LinkStateCommand::release});
  LinkStateChange decoded;
  EXPECT_EQ(decode_payload(payload, decoded), LinkRefusal::none);
  payload[18] = static_cast<std::uint8_t>(kLinkStateCommands);
  EXPECT_EQ(decode_payload(payload, decoded), LinkRefusal::unknown_value);
  EXPECT_EQ(decoded.command, LinkStateCommand::release);
}

TEST(LinkMessages, CommandsAreIntactOnlyAsTheyWereSent) {
  test::each_message_vector([&](const auto& message, const LinkBytes& payload) {
    using Message = std::decay_t<decltype(message)>;
    if constexpr (Message::kIsCommand) {
      EXPECT_TRUE(is_intact_command(test::kVectorRoute, payload));
      EXPECT_FALSE(is_intact_command({.receiver = 4, .sender = 7}, payload));
      EXPECT_FALSE(is_intact_command({.receiver = 3, .sender = 8}, payload));
      for (std::size_t bit = 0; bit < 8 * payload.size(); ++bit) {
        LinkBytes damaged = payload;
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        EXPECT_FALSE(is_intact_command(test::kVectorRoute, damaged));
        seal_again(damaged);
        EXPECT_EQ(is_intact_command(test::kVectorRoute, damaged), true);
      }
    } else if (payload.size() >= kCommandBytes) {
      EXPECT_FALSE(is_intact_command(test::kVectorRoute, payload));
    }
  });
}

TEST(LinkMessages, ValuesOfEveryTypeReturn) {
  const std::string longest(kLongestLinkText, 'x');
  for (const LinkValue& value :
       {LinkValue::of(true), LinkValue::of(false), LinkValue::of(std::int32_t{-7}),
        LinkValue::of(std::uint32_t{7}), LinkValue::of(-0.0),
        LinkValue::of(std::numeric_limits<double>::quiet_NaN()), LinkValue::of("text"),
        LinkValue::of(longest)}) {
    const LinkBytes payload = payload_of(LinkRegisterValue{.index = 5, .value = value});
    LinkRegisterValue decoded;
    ASSERT_EQ(decode_payload(payload, decoded), LinkRefusal::none);
    EXPECT_EQ(decoded.value, value);
  }
  LinkBytes payload = payload_of(LinkRegisterValue{.value = LinkValue::of(true)});
  payload.back() = 2;
  LinkRegisterValue decoded;
  EXPECT_EQ(decode_payload(payload, decoded), LinkRefusal::unknown_value);
}

TEST(LinkMessages, TextsAreCutOffAndNothingIsWrittenThatDoesNotFit) {
  const std::string text(300, 'x');
  LinkInformation decoded;
  const LinkBytes payload =
      payload_of(LinkInformation{.name = text, .version = text, .serial = text, .actuator = text});
  ASSERT_EQ(decode_payload(payload, decoded), LinkRefusal::none);
  EXPECT_EQ(decoded.name.size(), 48U);
  LinkRegisterDescription description;
  ASSERT_EQ(decode_payload(payload_of(LinkRegisterDescription{
                               .name = text, .unit = text, .description = text}),
                           description),
            LinkRefusal::none);
  EXPECT_EQ(description.description.size(), 150U);
  const LinkBytes large(250);
  LinkBytes out(600);
  std::array<std::uint8_t, 19> brief;
  EXPECT_EQ(encode_payload(LinkInformation{}, {}, brief), 0U);
  EXPECT_EQ(encode_payload(LinkUploadChunk{.data = large}, {}, out), 0U);
}

TEST(LinkMessages, WithATextThatIsTooLongAreRefused) {
  for (const std::uint8_t size : {std::uint8_t{48}, std::uint8_t{49}}) {
    LinkBytes payload{LinkChannelDescription::kId, 1, 0, 1, size};
    payload.resize(payload.size() + size, 'x');
    LinkChannelDescription decoded;
    EXPECT_EQ(decode_payload(payload, decoded),
              size == 48 ? LinkRefusal::none : LinkRefusal::wrong_length);
  }
}

TEST(LinkMessages, WithstandRandomBytes) {
  Random random(8);
  for (int n = 0; n < 200000; ++n) {
    LinkBytes payload(random.below(80));
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random.bits());
    if (payload.size() > 2) payload[1] = 1;
    test::each_message_vector([&](const auto& message, const LinkBytes&) {
      std::decay_t<decltype(message)> decoded;
      if (payload.size() > 2 && n % 28 == 0) payload[0] = decoded.kId;
      EXPECT_TRUE(decode_payload(payload, decoded) != LinkRefusal::none ||
                  payload[0] == decoded.kId);
    });
  }
}

TEST(LinkMessages, EveryRefusalHasItsOwnNameAndMeaning) {
  std::set<std::string_view> names;
  std::set<std::string_view> meanings;
  for (std::size_t k = 0; k < kLinkRefusals; ++k) {
    names.insert(name(static_cast<LinkRefusal>(k)));
    meanings.insert(meaning(static_cast<LinkRefusal>(k)));
  }
  EXPECT_EQ(names.size(), kLinkRefusals);
  EXPECT_EQ(meanings.size(), kLinkRefusals);
  for (std::size_t k = 0; k < CommandGuard::kRefusals; ++k)
    EXPECT_EQ(name(static_cast<LinkRefusal>(k)), name(static_cast<CommandGuard::Refusal>(k)));
}

}  // namespace
}  // namespace torsio
