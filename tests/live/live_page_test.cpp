#include "torsio/live/live_page.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "live/live_block.hpp"
#include "live/raw_web_client.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::RawWebClient;
using testing::ElementsAre;
using testing::HasSubstr;
using Json = nlohmann::json;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

template <class Number>
Number number_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, &bytes.at(at), sizeof number);
  return number;
}

std::vector<float> numbers_of(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  std::vector<float> numbers;
  for (; at < bytes.size(); at += sizeof(float)) numbers.push_back(number_at<float>(bytes, at));
  return numbers;
}

TEST(LiveBlocks, HaveTheChannelsOneAfterTheOther) {
  LiveBlock block(2, 100);
  block.add(7, std::vector{1.5, 2.5});
  block.add(8, std::vector{3.5, 4.5});
  std::vector<std::uint8_t> message;
  block.append_to(message, 3);
  ASSERT_EQ(message.size(), 16U + 4 * sizeof(float));
  EXPECT_EQ(number_at<std::uint16_t>(message, 0), 3);
  EXPECT_EQ(number_at<std::uint16_t>(message, 2), 2);
  EXPECT_EQ(number_at<std::uint32_t>(message, 4), 2U);
  EXPECT_EQ(number_at<double>(message, 8), 7.0);
  EXPECT_THAT(numbers_of(message, 16), ElementsAre(1.5F, 3.5F, 2.5F, 4.5F));
  EXPECT_TRUE(block.empty());
}

TEST(LiveBlocks, HaveNaNWhereSamplesAreLeftOut) {
  LiveBlock block(1, 100);
  block.add(1, std::vector{1.0});
  block.add(4, std::vector{4.0});
  block.add(3, std::vector{3.0});  // too late
  block.add(4, std::vector{5.0});  // twice
  std::vector<std::uint8_t> message;
  block.append_to(message, 0);
  const std::vector<float> values = numbers_of(message, 16);
  ASSERT_EQ(values.size(), 4U);
  EXPECT_EQ(values[0], 1.0F);
  EXPECT_TRUE(std::isnan(values[1]) && std::isnan(values[2]));
  EXPECT_EQ(values[3], 4.0F);
}

TEST(LiveBlocks, BeginAgainBeyondTheirLength) {
  LiveBlock block(1, 10);
  for (std::uint64_t number = 0; number < 9; ++number) block.add(number, std::vector{0.0});
  block.add(std::uint64_t{1} << 60U, std::vector{8.0});  // a gap that no memory holds
  std::vector<std::uint8_t> message;
  block.append_to(message, 0);
  EXPECT_EQ(number_at<std::uint32_t>(message, 4), 1U);
  EXPECT_EQ(number_at<double>(message, 8), std::pow(2.0, 60.0));
  EXPECT_THAT(numbers_of(message, 16), ElementsAre(8.0F));
}

TEST(LiveBlocks, HaveNaNForValuesThatAreMissing) {
  LiveBlock block(2, 10);
  block.add(0, std::vector{1.0});
  std::vector<std::uint8_t> message;
  block.append_to(message, 0);
  EXPECT_TRUE(std::isnan(numbers_of(message, 16).at(1)));
}

LivePage::Settings two_joints() {
  return {.token = "secret",
          .rate_Hz = 1000.0,
          .joints = {{.id = 3,
                      .name = "knee",
                      .actuator = "dfki-50",
                      .channels = {"torque_Nm", "truth_torque_Nm"},
                      .models = {{.name = "m", .target = "torque_Nm"}}},
                     {.id = 4, .name = "hip", .channels = {"torque_Nm"}}}};
}

std::uint16_t port_of(const LivePage& page) {
  const std::string url = page.url();
  return static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
}

RawWebClient::Handshake with_token(const std::string& token, const std::string& origin = {}) {
  return {.path = "/live?token=" + token, .subprotocol = "torsio.live.v1", .origin = origin};
}

template <class IsDone>
bool comes_true(const IsDone& is_done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!is_done() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return is_done();
}

TEST(LivePages, HaveDocumentScriptAndStyle) {
  const LivePage page(two_joints());
  EXPECT_THAT(page.url(), HasSubstr("http://127.0.0.1:"));
  EXPECT_THAT(page.url(), HasSubstr("/?token=secret"));
  for (const char* path : {"/?token=secret", "/live.js", "/live.css", "/icon.svg"}) {
    RawWebClient client(port_of(page));
    EXPECT_THAT(client.get(path), HasSubstr(" 200 ")) << path;
  }
  RawWebClient client(port_of(page));
  EXPECT_THAT(client.get("/other"), HasSubstr(" 404 "));
}

TEST(LivePages, HaveATokenOfTheirOwn) {
  LivePage::Settings settings = two_joints();
  settings.token.clear();
  const LivePage one(settings);
  const LivePage other(settings);
  const auto token_of = [](const LivePage& page) {
    return page.url().substr(page.url().find('=') + 1);
  };
  EXPECT_EQ(token_of(one).size(), 32U);
  EXPECT_NE(token_of(one), token_of(other));
}

TEST(LivePages, AreRefusedWithoutTheTokenAndToOtherOrigins) {
  const LivePage page(two_joints());
  const auto status_of = [&](const RawWebClient::Handshake& handshake) {
    RawWebClient client(port_of(page));
    return client.open(handshake);
  };
  EXPECT_EQ(status_of(with_token("wrong")), 403);
  EXPECT_EQ(status_of(with_token("secret1")), 403);
  EXPECT_EQ(status_of(with_token("")), 403);
  EXPECT_EQ(status_of({.path = "/live", .subprotocol = "torsio.live.v1"}), 403);
  EXPECT_EQ(status_of(with_token("secret", "https://example.org")), 403);
  EXPECT_EQ(status_of({.path = "/live?token=secret",
                       .subprotocol = "torsio.live.v1",
                       .host = "attacker.example"}),
            403);
  EXPECT_NE(status_of({.path = "/live?token=secret", .subprotocol = "other"}), 101);
  EXPECT_FALSE(page.is_connected());
  EXPECT_EQ(page.counts().pages, 0U);
  EXPECT_EQ(status_of(with_token("secret", fmt::format("http://127.0.0.1:{}", port_of(page)))),
            101);
}

TEST(LivePages, ReceiveTheJointsAndTheirSamples) {
  LivePage page(two_joints());
  page.add(0, 0, std::vector{1.0, 2.0, 3.0, 4.0});
  page.flush();  // no page is connected
  RawWebClient client(port_of(page));
  ASSERT_EQ(client.open(with_token("secret")), 101);
  const auto welcome = client.frame();
  ASSERT_TRUE(welcome.has_value());
  const Json joints = Json::parse(welcome->payload);
  EXPECT_EQ(joints["op"], "joints");
  EXPECT_EQ(joints["rate_Hz"], 1000.0);
  EXPECT_EQ(joints["joints"][0]["id"], 3);
  EXPECT_THAT(joints["joints"][0]["channels"].get<std::vector<std::string>>(),
              ElementsAre("torque_Nm", "truth_torque_Nm", "m: estimate", "m: standard deviation"));
  ASSERT_TRUE(comes_true([&] { return page.is_connected(); }));
  page.add(1, 5, std::vector{0.1});
  page.add(0, 5, std::vector{1.0, 2.0, kNoNumber, 4.0});
  page.flush();
  const auto samples = client.frame();
  ASSERT_TRUE(samples.has_value());
  EXPECT_EQ(samples->opcode, 2);
  const std::vector<std::uint8_t> bytes(samples->payload.begin(), samples->payload.end());
  ASSERT_EQ(bytes.size(), 2 * 16 + 5 * sizeof(float));
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 0), 0);
  EXPECT_EQ(number_at<double>(bytes, 8), 5.0);
  EXPECT_EQ(number_at<float>(bytes, 16), 1.0F);
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 32), 1);
  EXPECT_EQ(number_at<float>(bytes, 48), 0.1F);
  page.show({.recorded_files = {"a.csv"},
             .recorded_s = 1.5,
             .joints = {{.state = "ready", .lost = 7, .models = {true}}, {.is_silent = true}}});
  const auto status = client.frame();
  ASSERT_TRUE(status.has_value());
  const Json shown = Json::parse(status->payload);
  EXPECT_EQ(shown["recording"]["files"][0], "a.csv");
  EXPECT_EQ(shown["joints"][0]["lost"], 7);
  EXPECT_EQ(shown["joints"][0]["models"][0], true);
  EXPECT_EQ(shown["joints"][1]["silent"], true);
}

TEST(LivePages, RefuseASecondOneWithTheReason) {
  LivePage page(two_joints());
  RawWebClient first(port_of(page));
  ASSERT_EQ(first.open(with_token("secret")), 101);
  ASSERT_TRUE(first.frame().has_value());
  RawWebClient second(port_of(page));
  ASSERT_EQ(second.open(with_token("secret")), 101);
  const auto refusal = second.frame();
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(Json::parse(refusal->payload)["op"], "refused");
  const auto end = second.frame();
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->opcode, 8);
  EXPECT_TRUE(page.is_connected());
  first.close();
  EXPECT_TRUE(comes_true([&] { return !page.is_connected(); }));
  RawWebClient third(port_of(page));
  EXPECT_EQ(third.open(with_token("secret")), 101);
  EXPECT_EQ(Json::parse(third.frame().value_or(RawWebClient::Frame{.payload = "{}"}).payload)["op"],
            "joints");
}

TEST(LivePages, PassRequestsOnAndIgnoreOtherMessages) {
  LivePage page(two_joints());
  RawWebClient client(port_of(page));
  ASSERT_EQ(client.open(with_token("secret")), 101);
  ASSERT_TRUE(client.frame().has_value());
  const std::vector<std::string> wrong{"",
                                       "no json",
                                       "[1]",
                                       "{}",
                                       R"({"op":"record"})",
                                       R"({"op":"record","on":1})",
                                       R"({"op":"other","on":true})",
                                       R"({"op":5,"on":true})",
                                       R"({"op":"model","on":true})",
                                       R"({"op":"model","on":true,"joint":0,"model":1})",
                                       R"({"op":"model","on":true,"joint":1,"model":0})",
                                       R"({"op":"model","on":true,"joint":-1,"model":0})",
                                       R"({"op":"model","on":true,"joint":1e300,"model":0})",
                                       R"({"op":"model","on":true,"joint":"0","model":0})",
                                       std::string(2000, '[')};
  for (const std::string& each : wrong) client.send_frame(1, each);
  client.send_frame(2, "binary");
  client.send_frame(1, R"({"op":"record","on":true})");
  client.send_frame(1, R"({"op":"model","on":false,"joint":0,"model":0})");
  client.send_frame(1, R"({"op":"record","on":false})");
  std::vector<LivePage::Request> requests;
  ASSERT_TRUE(comes_true([&] {
    for (const LivePage::Request& each : page.take_requests()) requests.push_back(each);
    return requests.size() >= 3;
  }));
  ASSERT_EQ(requests.size(), 3U);
  using Kind = LivePage::Request::Kind;
  EXPECT_EQ(requests[0].kind, Kind::begin_recording);
  EXPECT_EQ(requests[1].kind, Kind::switch_model);
  EXPECT_FALSE(requests[1].is_on);
  EXPECT_EQ(requests[2].kind, Kind::end_recording);
  EXPECT_EQ(page.counts().refused, wrong.size() + 1);
  EXPECT_TRUE(page.is_connected());
}

TEST(LivePages, DropOneThatNeverReads) {
  LivePage::Settings settings = two_joints();
  settings.server.queue_limit_B = 100'000;
  LivePage page(settings);
  RawWebClient client(port_of(page), 4096);
  ASSERT_EQ(client.open(with_token("secret")), 101);
  ASSERT_TRUE(comes_true([&] { return page.is_connected(); }));
  const std::vector<double> values{1.0, 2.0, 3.0, 4.0};
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint64_t number = 0; page.is_connected() && number < 5'000'000; ++number) {
    page.add(0, number, values);
    if (number % 500 == 499) page.flush();
  }
  EXPECT_TRUE(comes_true([&] { return !page.is_connected(); }));
  EXPECT_EQ(page.counts().server.dropped, 1U);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(LivePages, NeedAJointAndARate) {
  EXPECT_THAT(error_message([] { const LivePage page(LivePage::Settings{}); }),
              HasSubstr("live page: joints"));
  EXPECT_THAT(error_message([] {
                LivePage::Settings settings = two_joints();
                settings.rate_Hz = 0.0;
                const LivePage page(settings);
              }),
              HasSubstr("rate_Hz"));
}

}  // namespace
}  // namespace torsio
