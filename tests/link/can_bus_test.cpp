// CAN frames in datagrams: what python-can packs, what nlohmann::json packs, and what is not a frame.
#include "torsio/link/can_bus.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "link/can_datagram.hpp"
#include "link/can_node.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::can_frame;
using test::LinkBytes;
using testing::HasSubstr;
using PackedJson = nlohmann::json;

std::optional<CanFrame> decoded_datagram(std::span<const std::uint8_t> bytes) {
  CanFrame frame;
  if (!detail::decode_can_datagram(bytes, frame)) return std::nullopt;
  return frame;
}

LinkBytes encoded_datagram(const CanFrame& frame) {
  std::array<std::uint8_t, detail::kLongestCanDatagram> bytes;
  const std::size_t size = detail::encode_can_datagram(frame, bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

LinkBytes bytes_of(const std::string& hex) {
  LinkBytes bytes;
  for (std::size_t n = 0; n + 1 < hex.size(); n += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(n, 2), nullptr, 16)));
  return bytes;
}

/// The fields of a can.Message with id 0x2C and three bytes.
PackedJson can_message() {
  return {{"timestamp", 1.5},
          {"arbitration_id", 0x2C},
          {"is_extended_id", false},
          {"is_remote_frame", false},
          {"is_error_frame", false},
          {"channel", nullptr},
          {"dlc", 3},
          {"data", PackedJson::binary({1, 2, 3})},
          {"is_fd", false},
          {"bitrate_switch", false},
          {"error_state_indicator", false}};
}
std::optional<CanFrame> decoded_fields(const PackedJson& fields) {
  return decoded_datagram(PackedJson::to_msgpack(fields));
}

const CanFrame kCanFrame{.id = 0x2C, .size = 3, .data = {1, 2, 3}};

// Written by can.interfaces.udp_multicast.utils.pack_message of python-can 4.1.0.
TEST(CanDatagram, IsThatOfPythonCan) {
  const std::string head = "8ba974696d657374616d70cb0000000000000000ae6172626974726174696f6e5f6964";
  const std::string tail =
      "a569735f6664c2ae626974726174655f737769746368c2b56572726f725f73746174655f696e64696361746f72c"
      "2";
  const std::string data_frame =
      "2cae69735f657874656e6465645f6964c2af69735f72656d6f74655f6672616d65c2ae69735f6572726f725f6672"
      "616d"
      "65c2a76368616e6e656cc0a3646c6303a464617461c403010203";
  const std::string remote_frame =
      "29ae69735f657874656e6465645f6964c2af69735f72656d6f74655f6672616d65c3ae69735f6572726f725f6672"
      "616d"
      "65c2a76368616e6e656cc0a3646c6308a464617461c400";
  EXPECT_EQ(decoded_datagram(bytes_of(head + data_frame + tail)), kCanFrame);
  EXPECT_EQ(decoded_datagram(bytes_of(head + remote_frame + tail)),
            (CanFrame{.id = 0x29, .is_remote = true, .size = 8}));
}

TEST(CanDatagram, IsReadByTheLibraryForJson) {
  const PackedJson read = PackedJson::from_msgpack(encoded_datagram(kCanFrame));
  PackedJson expected = can_message();
  expected["timestamp"] = 0.0;
  EXPECT_EQ(read, expected);
}

TEST(CanDatagram, IsTheSameAfterBothWays) {
  Random random(3);
  for (int n = 0; n < 2000; ++n) {
    CanFrame frame{.is_extended = random.uniform() < 0.5,
                   .size = static_cast<std::uint8_t>(random.bits() % 9)};
    frame.id = static_cast<std::uint32_t>(random.bits()) &
               (frame.is_extended ? kCanHighestExtendedId : kCanHighestId);
    frame.is_remote = random.uniform() < 0.3;
    frame.is_error = !frame.is_remote && random.uniform() < 0.2;
    for (std::size_t k = 0; k < frame.bytes().size(); ++k)
      frame.data[k] = static_cast<std::uint8_t>(random.bits());
    ASSERT_EQ(decoded_datagram(encoded_datagram(frame)), frame) << n;
    ASSERT_LE(encoded_datagram(frame).size(), detail::kLongestCanDatagram);
  }
}

TEST(CanDatagram, MayHaveItsFieldsInAnyOrderAndOthers) {
  EXPECT_EQ(decoded_fields(can_message()), kCanFrame);  // in alphabetical order
  PackedJson fields = can_message();
  fields["timestamp"] = -70000;
  fields["channel"] = std::string(300, 'x');
  fields["another"] = 1.0;
  EXPECT_EQ(decoded_fields(fields), kCanFrame);
  for (const char* name : {"timestamp", "channel", "is_fd", "dlc", "is_remote_frame"}) {
    fields = can_message();
    fields.erase(name);
    EXPECT_EQ(decoded_fields(fields), kCanFrame) << name;
  }
  fields = can_message();
  fields.erase("is_extended_id");  // as in can.Message
  EXPECT_TRUE(decoded_fields(fields)->is_extended);
}

TEST(CanDatagram, IsRefusedIfAFieldIsNotAsInAFrame) {
  const auto is_refused = [](const char* name, const PackedJson& value) {
    PackedJson fields = can_message();
    fields[name] = value;
    return !decoded_fields(fields).has_value();
  };
  EXPECT_TRUE(is_refused("arbitration_id", 0x800));
  EXPECT_TRUE(is_refused("arbitration_id", -1));
  EXPECT_TRUE(is_refused("arbitration_id", 1.0));
  EXPECT_TRUE(is_refused("arbitration_id", "44"));
  EXPECT_TRUE(is_refused("arbitration_id", nullptr));
  EXPECT_TRUE(is_refused("arbitration_id", std::uint64_t{1} << 40U));
  EXPECT_TRUE(is_refused("arbitration_id", PackedJson::array({1})));
  EXPECT_TRUE(is_refused("dlc", 4));
  EXPECT_TRUE(is_refused("dlc", 2));
  EXPECT_TRUE(is_refused("dlc", -3));
  EXPECT_TRUE(is_refused("dlc", 9));
  EXPECT_TRUE(is_refused("data", PackedJson::array({1, 2, 3})));
  EXPECT_TRUE(is_refused("data", "abc"));
  EXPECT_TRUE(is_refused("data", nullptr));
  EXPECT_TRUE(is_refused("is_fd", true));
  EXPECT_TRUE(is_refused("is_fd", 0));
  EXPECT_TRUE(is_refused("bitrate_switch", true));
  EXPECT_TRUE(is_refused("is_extended_id", "no"));
  EXPECT_TRUE(is_refused("is_remote_frame", true)) << "with data";
  EXPECT_TRUE(is_refused("channel", PackedJson::object())) << "no part has parts";
  PackedJson fields = can_message();
  fields.erase("arbitration_id");
  EXPECT_FALSE(decoded_fields(fields));
  fields = can_message();
  fields["data"] = PackedJson::binary({});
  fields["dlc"] = 0;
  fields["is_remote_frame"] = true;
  EXPECT_TRUE(decoded_fields(fields));
  fields["is_error_frame"] = true;
  EXPECT_FALSE(decoded_fields(fields));
}

TEST(CanDatagram, IsRefusedIfItIsNotOneMap) {
  EXPECT_FALSE(decoded_datagram(LinkBytes{}));
  for (const PackedJson& other : {PackedJson(1), PackedJson("text"), PackedJson(nullptr),
                                  PackedJson::array({1, 2}), PackedJson::object()})
    EXPECT_FALSE(decoded_fields(other)) << other;
  LinkBytes bytes = encoded_datagram(kCanFrame);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decoded_datagram(std::span(bytes).first(size))) << size;
  bytes.push_back(0);
  EXPECT_FALSE(decoded_datagram(bytes)) << "bytes after the map";
  // Four thousand million fields, and a text of as many bytes.
  EXPECT_FALSE(decoded_datagram(bytes_of("dfffffffff")));
  EXPECT_FALSE(decoded_datagram(bytes_of("81dbffffffff41")));
  EXPECT_FALSE(decoded_datagram(bytes_of("8101c0"))) << "a key that is not a text";
}

TEST(CanDatagram, IsTakenOrRefusedWhateverBytesAreWrong) {
  Random random(5);
  for (int n = 0; n < 50'000; ++n) {
    LinkBytes bytes = encoded_datagram(kCanFrame);
    for (int k = 0; k < 3; ++k)
      bytes[random.bits() % bytes.size()] = static_cast<std::uint8_t>(random.bits());
    const auto frame = decoded_datagram(bytes);
    if (!frame) continue;
    ASSERT_LE(frame->size, kCanDataBytes);
    ASSERT_LE(frame->id, frame->is_extended ? kCanHighestExtendedId : kCanHighestId);
  }
}

/// A program on the group.
class GroupSocket {
 public:
  explicit GroupSocket(std::uint16_t port) : number_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    group_.sin_family = AF_INET;
    group_.sin_port = htons(port);
    ::inet_pton(AF_INET, "239.74.163.2", &group_.sin_addr);
    const int hops = 0;
    ::setsockopt(number_, IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof(hops));
  }
  ~GroupSocket() { ::close(number_); }
  GroupSocket(const GroupSocket&) = delete;
  GroupSocket& operator=(const GroupSocket&) = delete;
  void send(const LinkBytes& bytes) const {
    EXPECT_EQ(::sendto(number_, bytes.data(), bytes.size(), 0,
                       reinterpret_cast<const sockaddr*>(&group_), sizeof(group_)),
              static_cast<ssize_t>(bytes.size()));
  }

 private:
  int number_;
  sockaddr_in group_ = {};
};

class AMulticastBus : public testing::Test {
 protected:
  void SetUp() override {
    try {
      bus_ = open_can_multicast({.port = kPort});
      other_ = open_can_multicast({.port = kPort});
    } catch (const Error& error) {
      GTEST_SKIP() << "no multicast here: " << error.what();
    }
  }
  /// Other programs may use python-can's own port now.
  static constexpr std::uint16_t kPort = 43217;
  static std::optional<CanFrame> received_by(CanBus& bus) {
    CanFrame frame;
    const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (!bus.receive(frame)) {
      if (std::chrono::steady_clock::now() > latest) return std::nullopt;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return frame;
  }
  std::unique_ptr<CanBus> bus_;
  std::unique_ptr<CanBus> other_;
};

TEST_F(AMulticastBus, CarriesFramesToTheOthersOnly) {
  EXPECT_TRUE(bus_->send(kCanFrame));
  EXPECT_EQ(received_by(*other_), kCanFrame);
  const CanFrame reply = can_frame(0x29, 0.5F, 1.5F);
  EXPECT_TRUE(other_->send(reply));
  EXPECT_EQ(received_by(*bus_), reply) << "not its own frame, which came first";
  EXPECT_EQ(bus_->place(), "udp_multicast:239.74.163.2:43217");
  EXPECT_GE(bus_->descriptor(), 0);
}

TEST_F(AMulticastBus, CountsDatagramsThatAreNotAFrame) {
  const GroupSocket program(kPort);
  program.send({});
  program.send({0xFF});
  program.send(LinkBytes(60'000, 0x80));  // longer than any frame
  LinkBytes longer = encoded_datagram(kCanFrame);
  longer.resize(1025);
  program.send(longer);
  program.send(encoded_datagram(kCanFrame));
  EXPECT_EQ(received_by(*bus_), kCanFrame);
  EXPECT_EQ(bus_->counts().malformed, 4U);
}

TEST(CanBus, RefusesPlacesThatThereAreNotWithAdvice) {
  const auto multicast = [](const CanMulticastSettings& settings) {
    return test::error_message([&] { static_cast<void>(open_can_multicast(settings)); });
  };
  EXPECT_THAT(multicast({.group = "127.0.0.1"}),
              HasSubstr("expected a group, 224.0.0.0 to 239.255.255.255 in numbers, found "
                        "'127.0.0.1'"));
  EXPECT_THAT(multicast({.group = "ff15::1"}), HasSubstr("found 'ff15::1'"));
  EXPECT_THAT(multicast({.port = 0}), HasSubstr("expected a port of 1 to 65535, found 0"));
  EXPECT_THAT(multicast({.allowed = {"robot"}}),
              HasSubstr("expected an IPv4 address in numbers, found 'robot'"));
  const auto socketcan = [](const std::string& interface) {
    return test::error_message([&] { static_cast<void>(open_socketcan(interface)); });
  };
  EXPECT_THAT(socketcan("nocan7"), HasSubstr("socketcan:nocan7: there is no such interface"));
  EXPECT_THAT(socketcan("nocan7"), HasSubstr("`ip -brief link` lists the interfaces"));
  EXPECT_THAT(socketcan(""), HasSubstr("expected the name of an interface"));
  EXPECT_THAT(socketcan(std::string(40, 'c')), HasSubstr("expected the name of an interface"));
}

}  // namespace
}  // namespace torsio
