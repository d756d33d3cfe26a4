#include "torsio/live/telemetry_publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "live/foxglove_messages.hpp"
#include "live/raw_web_client.hpp"
#include "live/telemetry_json.hpp"
#include "live/wall_time.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::RawWebClient;
using test::wait_until;
using testing::HasSubstr;
using Json = nlohmann::json;

TEST(TelemetryJson, EveryNumberComesBackToTheLastBit) {
  constexpr std::uint64_t kSeed = 20261128;
  Random random(kSeed);
  const TelemetryJson json({"a"});
  for (int n = 0; n < 200'000; ++n) {
    const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
    if (!std::isfinite(value)) continue;
    const double read = Json::parse(json.text_of(std::array{value}))["a"].get<double>();
    ASSERT_EQ(std::bit_cast<std::uint64_t>(read), std::bit_cast<std::uint64_t>(double{value}))
        << "seed " << kSeed << ", case " << n;
  }
}

TEST(TelemetryJson, ValuesThatAreNotFiniteAreLeftOut) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const TelemetryJson json({"torque_Nm", "angle \"x\"_rad", "current_A"});
  EXPECT_EQ(json.text_of(std::array{0.5F, -0.0F, 1e-7F}),
            R"({"torque_Nm":0.5,"angle \"x\"_rad":-0,"current_A":1.0000000116860974e-07})");
  EXPECT_EQ(json.text_of(std::array{kNan, 2.0F, -kInfinity}), R"({"angle \"x\"_rad":2})");
  EXPECT_EQ(json.text_of(std::array{kNan, kInfinity, kNan}), "{}");
  const Json schema = Json::parse(json.schema());
  EXPECT_EQ(schema["type"], "object");
  EXPECT_EQ(schema["properties"]["current_A"]["type"], "number");
  EXPECT_EQ(Json::parse(TelemetryJson({"\xFF"}).text_of(std::array{1.0F})).size(), 1U);
}

TEST(TelemetryJson, PlotJugglerHasTheTimeInSeconds) {
  const std::string text = plotjuggler_text("elbow", 1'764'349'382'000'500, R"({"torque_Nm":0.5})");
  EXPECT_EQ(text, R"({"timestamp":1764349382.000500,"elbow":{"torque_Nm":0.5}})");
  // A double has the microseconds of this century.
  for (const std::uint64_t time_us : {1'764'349'382'000'501ULL, 4'000'000'000'999'999ULL})
    EXPECT_EQ(
        std::llround(1e6 *
                     Json::parse(plotjuggler_text("a", time_us, "{}"))["timestamp"].get<double>()),
        static_cast<long long>(time_us));
}

TEST(FoxgloveMessages, AreThoseOfTheProtocol) {
  const Json info = Json::parse(foxglove::server_info("torsio", "17"));
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_EQ(info["capabilities"], Json::array());
  EXPECT_EQ(info["sessionId"], "17");
  const std::vector<foxglove::Channel> channels = {
      {.id = 1, .topic = "/elbow", .schema_name = "torsio.elbow", .schema = "{}"}};
  EXPECT_EQ(Json::parse(foxglove::advertise(channels)),
            Json::parse(R"({"op":"advertise","channels":[{"id":1,"topic":"/elbow",
              "encoding":"json","schemaName":"torsio.elbow","schemaEncoding":"jsonschema",
              "schema":"{}"}]})"));
  EXPECT_EQ(foxglove::status(foxglove::Level::warning, "x"),
            R"({"op":"status","level":1,"message":"x"})");
  EXPECT_THAT(foxglove::message_data(0x04030201, 0x0C0B0A0908070605, "{}"),
              testing::ElementsAre(1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, '{', '}'));
}

TEST(FoxgloveMessages, WhatAClientSendsIsReadOrNamed) {
  using foxglove::client_message;
  const auto wanted = client_message(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":8,"channelId":2}]})");
  ASSERT_TRUE(std::holds_alternative<foxglove::Subscribe>(wanted));
  EXPECT_EQ(std::get<foxglove::Subscribe>(wanted).entries.at(1).channel, 2U);
  const auto ended = client_message(R"({"op":"unsubscribe","subscriptionIds":[7,4294967295]})");
  EXPECT_EQ(std::get<foxglove::Unsubscribe>(ended).ids.at(1), 4294967295U);
  for (const char* text :
       {"", "{", "[]", "null", "7", "\"op\"", "{}", R"({"op":7})", R"({"op":"getParameters"})",
        R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":{"id":1}})",
        R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["7"]})", "{\"op\":\"\xFF\"}"})
    EXPECT_TRUE(std::holds_alternative<foxglove::Mistake>(client_message(text))) << text;
  EXPECT_TRUE(std::holds_alternative<foxglove::Mistake>(client_message(std::string(60'000, '['))));
  EXPECT_THAT(std::get<foxglove::Mistake>(client_message(R"({"op":"fetchAsset"})")).text,
              HasSubstr("fetchAsset: not offered"));
}

TEST(WallTimes, HaveTheStepsOfTheJointAndTheLeastDelay) {
  constexpr std::uint64_t kWall_ns = 1'764'349'382'000'000'000;
  WallTime time;
  time.learn(1'000'000, kWall_ns + 5'000'000);
  time.learn(2'000'000, kWall_ns + 2'000'000);
  time.learn(3'000'000, kWall_ns + 9'000'000);
  EXPECT_EQ(time.time_us(1'000'000, kWall_ns + 9'000'000), kWall_ns / 1000 + 1000);
  EXPECT_EQ(time.time_us(4'000'000, kWall_ns + 400'000'000), kWall_ns / 1000 + 4000);
  // The joint was started again, with another clock.
  EXPECT_EQ(time.time_us(77, kWall_ns + 600'000'000), kWall_ns / 1000 + 600'000);
  EXPECT_EQ(time.time_us(1'000'077, kWall_ns + 601'500'000), kWall_ns / 1000 + 601'000);
  // The machine's clock was set back by an hour.
  EXPECT_EQ(time.time_us(2'000'077, kWall_ns - 3'600'000'000'000), kWall_ns / 1000 - 3'600'000'000);
}

/// Receives datagrams from any port, as PlotJuggler does.
class UdpReader {
 public:
  UdpReader() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  UdpReader(const UdpReader&) = delete;
  UdpReader& operator=(const UdpReader&) = delete;
  ~UdpReader() { ::close(socket_); }

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// The next datagram; empty: none.
  std::string next() const {
    std::string text(65536, '\0');
    const ssize_t size = ::recv(socket_, text.data(), text.size(), 0);
    text.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return text;
  }

 private:
  int socket_;
  std::uint16_t port_ = 0;
};

/// Two joints, PlotJuggler on a port of this test, and Foxglove.
class TelemetryPublishers : public testing::Test {
 protected:
  TelemetryPublisher::Settings settings() {
    return {.joints = {{.name = "elbow", .channels = {"torque_Nm", "current_A"}},
                       {.name = "wrist", .channels = {"torque_Nm"}}},
            .plotjuggler = TelemetryPublisher::PlotJuggler{.port = plotjuggler_.port()},
            .foxglove = TelemetryPublisher::Foxglove{.port = 0}};
  }
  /// The next message, as JSON.
  static Json text(RawWebClient& client) {
    const auto frame = client.frame();
    return frame ? Json::parse(frame->payload, nullptr, false) : Json();
  }
  static void subscribe(RawWebClient& client, int id, int channel) {
    client.send_frame(
        1, Json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}}
               .dump());
  }
  UdpReader plotjuggler_;
};

TEST_F(TelemetryPublishers, BothProgramsGetTheSameNumbersAndTimes) {
  TelemetryPublisher publisher(settings());
  RawWebClient old_client(publisher.foxglove_port());
  ASSERT_EQ(old_client.open({.subprotocol = "foxglove.websocket.v1"}), 101);
  RawWebClient client(publisher.foxglove_port());
  ASSERT_EQ(client.open({.subprotocol = "foxglove.sdk.v1, foxglove.websocket.v1"}), 101);
  EXPECT_THAT(client.response(), HasSubstr("foxglove.sdk.v1\r\n"));
  for (RawWebClient* each : {&old_client, &client}) {
    EXPECT_EQ(text(*each)["op"], "serverInfo");
    const Json advertised = text(*each);
    EXPECT_EQ(advertised["channels"][1]["topic"], "/wrist");
    EXPECT_EQ(advertised["channels"][1]["id"], 2);
  }
  subscribe(old_client, 5, 1);
  subscribe(client, 9, 1);
  constexpr std::uint64_t kTime_us = 1'764'349'382'123'456;
  const std::array values = {0.1F, -3.25e-5F};
  std::uint64_t published = 0;
  while (publisher.counts().messages < 4 && published < 3000) {
    publisher.publish(0, kTime_us + published++, values);
    publisher.publish(1, kTime_us, std::array{7.0F});  // without a subscriber
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (const auto& [each, id] : {std::pair(&old_client, 5), std::pair(&client, 9)}) {
    const auto frame = each->frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->opcode, 2);
    EXPECT_EQ(frame->payload[0], 1);
    EXPECT_EQ(frame->payload[1], id);
    std::uint64_t time_ns = 0;
    std::memcpy(&time_ns, frame->payload.data() + 5, 8);
    EXPECT_EQ(time_ns / 1'000'000'000, kTime_us / 1'000'000);
    EXPECT_EQ(time_ns % 1000, 0U);
    const Json message = Json::parse(frame->payload.substr(13));
    EXPECT_EQ(message["torque_Nm"].get<double>(), double{0.1F});
    EXPECT_EQ(message["current_A"].get<double>(), double{-3.25e-5F});
  }
  EXPECT_EQ(publisher.counts().datagrams, 2 * published);
  const Json first = Json::parse(plotjuggler_.next());
  EXPECT_EQ(std::llround(1e6 * first["timestamp"].get<double>()), static_cast<long long>(kTime_us));
  EXPECT_EQ(first["elbow"]["torque_Nm"].get<double>(), double{0.1F});
  EXPECT_EQ(first["elbow"]["current_A"].get<double>(), double{-3.25e-5F});
  EXPECT_EQ(Json::parse(plotjuggler_.next())["wrist"]["torque_Nm"], 7.0);
  EXPECT_EQ(publisher.counts().samples, 2 * published);
  EXPECT_EQ(publisher.counts().clients, 2U);
}

TEST_F(TelemetryPublishers, UnknownOperationsGetAStatusAndTheSubscriptionsRemain) {
  TelemetryPublisher publisher(settings());
  RawWebClient client(publisher.foxglove_port());
  ASSERT_EQ(client.open({.subprotocol = "foxglove.websocket.v1"}), 101);
  text(client);
  text(client);
  const auto refused = [&](const std::string& reason) {
    const Json status = text(client);
    EXPECT_EQ(status["op"], "status") << reason;
    EXPECT_EQ(status["level"], 2) << reason;
    EXPECT_THAT(status["message"].get<std::string>(), HasSubstr(reason));
  };
  client.send_frame(1, "{");
  refused("expected a JSON object");
  client.send_frame(1, R"({"op":"setParameters"})");
  refused("setParameters: not offered");
  client.send_frame(2, "\x01\x02");
  refused("binary message");
  subscribe(client, 1, 99);
  refused("there is no channel 99");
  subscribe(client, 1, 1);
  subscribe(client, 1, 2);
  refused("id 1 is in use");
  subscribe(client, 2, 1);
  refused("channel 1 has a subscription already");
  client.send_frame(1, R"({"op":"unsubscribe","subscriptionIds":[77]})");
  refused("there is no subscription 77");
  publisher.publish(0, 1, std::array{1.0F, 2.0F});
  EXPECT_EQ(client.frame().value_or(RawWebClient::Frame{}).opcode, 2);
  publisher.warn("joint 1 is silent");
  EXPECT_EQ(text(client)["message"], "joint 1 is silent");
  client.send_frame(1, R"({"op":"unsubscribe","subscriptionIds":[1]})");
  subscribe(client, 1, 2);
  subscribe(client, 1, 2);
  refused("id 1 is in use");
  publisher.publish(0, 1, std::array{1.0F, 2.0F});
  EXPECT_EQ(publisher.counts().messages, 1U);
}

TEST_F(TelemetryPublishers, ASlowClientIsDroppedAndTheOtherGetsEverything) {
  auto made = settings();
  made.plotjuggler.reset();
  made.foxglove->queue_limit_B = 500'000;
  TelemetryPublisher publisher(made);
  RawWebClient slow(publisher.foxglove_port(), 4096);
  RawWebClient good(publisher.foxglove_port());
  for (RawWebClient* each : {&slow, &good}) {
    ASSERT_EQ(each->open({.subprotocol = "foxglove.sdk.v1"}), 101);
    subscribe(*each, 3, 1);
  }
  text(good);
  text(good);
  std::uint64_t published = 0;
  std::uint64_t received = 0;
  const auto publish_and_read = [&](int count) {
    for (int n = 0; n < count; ++n)
      publisher.publish(0, ++published, std::array{0.1F, static_cast<float>(published)});
    // The good client may have subscribed after some of them.
    for (int n = 0; n < count / 2 && received + 1 < published; ++n) {
      const auto frame = good.frame();
      ASSERT_TRUE(frame);
      ++received;
    }
  };
  ASSERT_TRUE(wait_until([&] {
    publisher.publish(0, ++published, std::array{0.1F, 0.2F});
    return publisher.counts().messages > 10;
  }));
  for (int n = 0; n < 5000 && publisher.counts().dropped == 0; ++n) {
    publish_and_read(50);
    for (int more = 0; more < 25; ++more)
      if (!good.frame()) break;
  }
  EXPECT_EQ(publisher.counts().dropped, 1U);
  EXPECT_TRUE(slow.is_closed_within(std::chrono::seconds(10)));
  publisher.warn("still here");
  bool is_found = false;
  for (auto frame = good.frame(); frame && !is_found; frame = good.frame()) {
    is_found = frame->payload.find("still here") != std::string::npos;
    if (is_found) break;
  }
  EXPECT_TRUE(is_found);
}

TEST_F(TelemetryPublishers, PagesOfOtherOriginsNeedToBeAllowed) {
  std::atomic<int> refusals = 0;
  auto made = settings();
  made.foxglove->origins = {"https://app.example"};
  made.foxglove->on_refused = [&](const WebRequest& request, int status) {
    EXPECT_EQ(request.origin, "https://other.example");
    EXPECT_EQ(status, 403);
    ++refusals;
  };
  const TelemetryPublisher publisher(made);
  const auto status = [&](const std::string& origin) {
    return RawWebClient(publisher.foxglove_port())
        .open({.subprotocol = "foxglove.sdk.v1", .origin = origin});
  };
  EXPECT_EQ(status("https://app.example"), 101);
  EXPECT_EQ(status(""), 101);
  EXPECT_EQ(status("https://other.example"), 403);
  EXPECT_EQ(refusals, 1);
  EXPECT_EQ(publisher.counts().refused, 1U);
}

TEST_F(TelemetryPublishers, MistakesAreNamed) {
  EXPECT_THAT(error_message([] { TelemetryPublisher({}); }), HasSubstr("at least one"));
  EXPECT_THAT(error_message([] {
                TelemetryPublisher({.joints = {{"a", {}}, {"a", {}}}});
              }),
              HasSubstr("'a' twice"));
  EXPECT_THAT(error_message([] {
                TelemetryPublisher({.joints = {{"a", {}}},
                                    .plotjuggler = TelemetryPublisher::PlotJuggler{"here", 1}});
              }),
              HasSubstr("an IPv4 address in numbers"));
}

}  // namespace
}  // namespace torsio
