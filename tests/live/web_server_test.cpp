#include "torsio/live/web_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "live/raw_web_client.hpp"
#include "live/web_request.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::RawWebClient;
using test::wait_until;
using testing::AllOf;
using testing::HasSubstr;
using ClientPointer = WebEndpoint::ClientPointer;

/// A server that sends back what it receives.
class WebServers : public testing::Test {
 protected:
  WebServer::Settings settings() {
    WebServer::Settings made;
    made.files = {{"/", "text/html; charset=utf-8", web_buffer("<p>page</p>")},
                  {"/large", "application/octet-stream", web_buffer(std::string(3'000'000, 'x'))}};
    made.endpoints = {
        {.subprotocol = "echo",
         .on_open =
             [this](const ClientPointer& client) {
               const std::lock_guard lock(mutex_);
               opened_.push_back(client);
             },
         .on_text = [](const ClientPointer& client,
                       std::string_view text) { client->send_text(text); },
         .on_binary =
             [](const ClientPointer& client, std::span<const std::uint8_t> bytes) {
               client->send_binary(
                   std::make_shared<std::vector<std::uint8_t>>(bytes.begin(), bytes.end()));
             },
         .on_close = [this](const ClientPointer&) { ++closed_; }},
        {.subprotocol = "picky",
         .path = "/picky",
         .origins = {"https://app.example", "http://localhost:*"},
         .accept = [](const WebRequest& request) { return request.query == "key=1" ? 0 : 401; }},
        {.subprotocol = "throws", .on_text = [](const ClientPointer&, std::string_view) {
           throw std::runtime_error("no");
         }}};
    made.handshake_timeout_s = 1;
    return made;
  }
  ClientPointer opened(std::size_t index) {
    const auto is_there = [&] {
      const std::lock_guard lock(mutex_);
      return opened_.size() > index;
    };
    EXPECT_TRUE(wait_until(is_there));
    const std::lock_guard lock(mutex_);
    return opened_.at(index);
  }

  std::mutex mutex_;
  std::vector<ClientPointer> opened_ = {};
  std::atomic<int> closed_ = 0;
};

TEST_F(WebServers, FilesHaveTheirTypeAndHeadersThatProtectThePage) {
  const WebServer server(settings());
  RawWebClient client(server.port());
  const std::string headers = client.get("/");
  EXPECT_THAT(
      headers,
      AllOf(HasSubstr("HTTP/1.1 200"), HasSubstr("content-type: text/html; charset=utf-8\r\n"),
            HasSubstr("content-security-policy: default-src 'self';"),
            HasSubstr("x-content-type-options: nosniff\r\n"),
            HasSubstr("cache-control: no-store\r\n"), HasSubstr("content-length: 11\r\n")));
  EXPECT_EQ(client.content(11), "<p>page</p>");
  RawWebClient large(server.port());
  EXPECT_THAT(large.get("/large"), HasSubstr("content-length: 3000000\r\n"));
  EXPECT_EQ(large.content(3'000'000), std::string(3'000'000, 'x'));
  EXPECT_THAT(RawWebClient(server.port()).get("/absent"), HasSubstr("HTTP/1.1 404"));
  EXPECT_THAT(RawWebClient(server.port()).get("/../etc/passwd"), HasSubstr("HTTP/1.1 40"));
  EXPECT_THAT(RawWebClient(server.port()).request("HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
              AllOf(HasSubstr("HTTP/1.1 200"), HasSubstr("content-length: 11\r\n")));
  EXPECT_THAT(RawWebClient(server.port())
                  .request("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc"),
              HasSubstr("HTTP/1.1 405"));
  EXPECT_EQ(server.counts().files, 3U);
  EXPECT_THAT(server.url(), HasSubstr("http://127.0.0.1:"));
}

TEST_F(WebServers, MessagesComeBackInTextBinaryAndParts) {
  const WebServer server(settings());
  RawWebClient client(server.port());
  ASSERT_EQ(client.open({.path = "/live?joint=1&rate=100", .origin = ""}), 101);
  EXPECT_THAT(client.response(), AllOf(HasSubstr("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="),
                                       testing::ContainsRegex("[Pp]rotocol: echo\r\n")));
  const ClientPointer opened_client = opened(0);
  EXPECT_EQ(opened_client->request().path, "/live");
  EXPECT_EQ(opened_client->request().query, "joint=1&rate=100");
  EXPECT_EQ(opened_client->request().subprotocol, "echo");
  client.send_frame(1, "torque");
  auto frame = client.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, 1);
  EXPECT_EQ(frame->payload, "torque");
  const std::string large(200'000, '\0');
  client.send_frame(2, large);
  frame = client.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, 2);
  EXPECT_EQ(frame->payload, large);
  client.send_frame(1, "ab", false);
  client.send_frame(0, "", false);
  client.send_frame(9, "ping");
  client.send_frame(0, "cd", true);
  frame = client.frame();
  ASSERT_TRUE(frame);
  if (frame->opcode == 10) frame = client.frame();  // the reply to the ping
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, "abcd");
  opened_client->send_text("bye");
  opened_client->close(1001, "the end");
  EXPECT_FALSE(opened_client->send_text("too late"));
  std::vector<std::string> last;
  while (const auto each = client.frame()) last.push_back(each->payload);
  ASSERT_GE(last.size(), 2U);
  EXPECT_EQ(last[last.size() - 2], "bye");
  EXPECT_EQ(last.back(), "\x03\xE9the end");
  client.close();
  EXPECT_TRUE(wait_until([&] { return closed_ == 1; }));
  EXPECT_FALSE(opened_client->is_open());
}

TEST_F(WebServers, WrongHostsOriginsPathsAndSubprotocolsAreRefused) {
  auto made = settings();
  made.hosts = {"robot.local"};
  const WebServer server(made);
  const std::string port = std::to_string(server.port());
  const auto status = [&](const RawWebClient::Handshake& handshake) {
    return RawWebClient(server.port()).open(handshake);
  };
  EXPECT_EQ(status({.host = "localhost:" + port}), 101);
  EXPECT_EQ(status({.host = "robot.local"}), 101);
  EXPECT_EQ(status({.host = "[::1]:" + port}), 101);
  EXPECT_EQ(status({.host = "evil.example:" + port}), 403);
  EXPECT_EQ(status({.host = "127.0.0.1.evil.example"}), 403);
  EXPECT_EQ(status({.origin = "http://127.0.0.1:" + port}), 101);
  EXPECT_EQ(status({.origin = "https://127.0.0.1:" + port}), 403);
  EXPECT_EQ(status({.origin = "http://evil.example"}), 403);
  EXPECT_EQ(status({.origin = "null"}), 403);
  EXPECT_EQ(status({.subprotocol = "absent"}), 400);
  EXPECT_EQ(status({.subprotocol = ""}), 400);
  EXPECT_EQ(status({.subprotocol = "absent, echo"}), 101);
  const auto picky = [&](const std::string& path, const std::string& origin) {
    return status({.path = path, .subprotocol = "picky", .origin = origin});
  };
  EXPECT_EQ(picky("/picky?key=1", "https://app.example"), 101);
  EXPECT_EQ(picky("/picky?key=1", "http://localhost:9000"), 101);
  EXPECT_EQ(picky("/picky?key=1", "http://localhost.evil.example"), 403);
  EXPECT_EQ(picky("/picky?key=1", "http://evil.example"), 403);
  EXPECT_EQ(picky("/picky?key=2", "https://app.example"), 401);
  EXPECT_EQ(picky("/other?key=1", "https://app.example"), 404);
  EXPECT_THAT(RawWebClient(server.port()).get("/", "evil.example"), HasSubstr("403"));
  EXPECT_THAT(RawWebClient(server.port()).request("GET / HTTP/1.0\r\n\r\n"), HasSubstr("403"));
  EXPECT_EQ(server.counts().refused, 13U);
}

TEST_F(WebServers, OriginsAreComparedAsAWhole) {
  const std::vector<std::string> allowed = {"https://app.example", "http://localhost:*"};
  EXPECT_TRUE(is_allowed_origin("HTTPS://App.Example", "x", allowed));
  EXPECT_FALSE(is_allowed_origin("https://app.example.org", "x", allowed));
  EXPECT_FALSE(is_allowed_origin("http://localhost:80x", "x", allowed));
  EXPECT_FALSE(is_allowed_origin("http://localhost:", "x", allowed));
  EXPECT_TRUE(is_allowed_origin("null", "x", std::vector<std::string>{"*"}));
  for (const char* host : {"", ":80", "localhost:port", "localhost.", "[::1", "127.0.0.1:123456"})
    EXPECT_FALSE(is_allowed_host(host, {})) << host;
}

TEST_F(WebServers, AClientThatDoesNotReadIsDroppedWithoutAnEffectOnTheOthers) {
  auto made = settings();
  made.queue_limit_B = 1'000'000;
  WebServer server(made);
  RawWebClient stalled(server.port(), 4096);
  ASSERT_EQ(stalled.open({}), 101);
  const ClientPointer to_stalled = opened(0);
  RawWebClient reading(server.port());
  ASSERT_EQ(reading.open({}), 101);
  const ClientPointer to_reading = opened(1);
  constexpr int kMessages = 600;
  // Without frame() in between, the reading client would be one that stalls as well.
  auto received = std::async(std::launch::async, [&] {
    int count = 0;
    while (count < kMessages && reading.frame()) ++count;
    return count;
  });
  const WebBuffer shared = web_buffer(std::string(50'000, 'y'));
  std::chrono::steady_clock::duration longest{};
  for (int n = 0; n < kMessages; ++n) {
    const auto start = std::chrono::steady_clock::now();
    to_stalled->send_binary(shared);
    longest = std::max(longest, std::chrono::steady_clock::now() - start);
    EXPECT_TRUE(wait_until([&] { return to_reading->queued_B() < 500'000; }));
    EXPECT_TRUE(to_reading->send_binary(shared));
  }
  EXPECT_EQ(received.get(), kMessages);
  EXPECT_FALSE(to_stalled->is_open());
  EXPECT_FALSE(to_stalled->send_binary(shared));
  EXPECT_TRUE(wait_until([&] { return server.counts().dropped == 1 && closed_ == 1; }));
  EXPECT_TRUE(stalled.is_closed_within(std::chrono::seconds(10)));
  EXPECT_TRUE(to_reading->is_open());
  EXPECT_LT(longest, std::chrono::seconds(1));
}

TEST_F(WebServers, ATooLargeMessageClosesItsClientOnly) {
  auto made = settings();
  made.message_limit_B = 100'000;
  const WebServer server(made);
  RawWebClient huge(server.port());
  ASSERT_EQ(huge.open({}), 101);
  RawWebClient in_parts(server.port());
  ASSERT_EQ(in_parts.open({}), 101);
  RawWebClient small(server.port());
  ASSERT_EQ(small.open({}), 101);
  huge.send_frame(2, std::string(100'001, 'z'));
  in_parts.send_frame(2, std::string(60'000, 'z'), false);
  in_parts.send_frame(0, std::string(60'000, 'z'), true);
  for (RawWebClient* each : {&huge, &in_parts}) {
    const auto end = each->frame();
    ASSERT_TRUE(end);
    EXPECT_EQ(end->opcode, 8);
    EXPECT_EQ(end->payload, "\x03\xF1");  // 1009
  }
  small.send_frame(2, std::string(100'000, 'z'));
  const auto frame = small.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload.size(), 100'000U);
  EXPECT_EQ(server.counts().too_large, 2U);
}

TEST_F(WebServers, HalfAHandshakeAndWrongBytesAreClosedInTime) {
  const WebServer server(settings());
  RawWebClient silent(server.port());
  RawWebClient half(server.port());
  half.send("GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: webs");
  RawWebClient wrong(server.port());
  wrong.send("\x16\x03\x01 no HTTP at all \r\n\r\n");
  RawWebClient many(server.port());
  many.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(100'000, 'h') + "\r\n\r\n");
  RawWebClient bad_frame(server.port());
  ASSERT_EQ(bad_frame.open({}), 101);
  bad_frame.send("\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF");
  RawWebClient bad_text(server.port());
  ASSERT_EQ(bad_text.open({}), 101);
  bad_text.send_frame(1, "\xC0\xAF");
  for (RawWebClient* each : {&silent, &half, &wrong, &many, &bad_frame, &bad_text})
    EXPECT_TRUE(each->is_closed_within(std::chrono::seconds(20)));
  RawWebClient good(server.port());
  EXPECT_EQ(good.open({}), 101);
}

TEST_F(WebServers, ManyClientsShareABufferAndFurtherOnesAreRefused) {
  auto made = settings();
  made.clients = 50;
  WebServer server(made);
  std::vector<RawWebClient> clients;
  for (int n = 0; n < 50; ++n) {
    clients.emplace_back(server.port());
    ASSERT_EQ(clients.back().open({}), 101);
  }
  EXPECT_EQ(RawWebClient(server.port()).open({}), 503);
  const WebBuffer shared = web_buffer("telemetry");
  for (std::size_t n = 0; n < 50; ++n) EXPECT_TRUE(opened(n)->send_binary(shared));
  for (RawWebClient& each : clients) {
    const auto frame = each.frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->payload, "telemetry");
  }
  clients.clear();
  EXPECT_TRUE(wait_until([&] { return server.counts().closed == 50; }));
  EXPECT_EQ(RawWebClient(server.port()).open({}), 101);
}

TEST_F(WebServers, WorkIsPostedInOrderAndExceptionsCloseOnlyTheirClient) {
  WebServer server(settings());
  std::promise<std::vector<int>> done;
  std::vector<int> order;
  for (int n = 0; n < 100; ++n) server.post([&order, n] { order.push_back(n); });
  server.post([] { throw std::runtime_error("no"); });
  server.post([&] { done.set_value(order); });
  const std::vector<int> found = done.get_future().get();
  ASSERT_EQ(found.size(), 100U);
  EXPECT_TRUE(std::ranges::is_sorted(found));
  RawWebClient client(server.port());
  ASSERT_EQ(client.open({.subprotocol = "throws"}), 101);
  client.send_frame(1, "text");
  EXPECT_TRUE(client.is_closed_within(std::chrono::seconds(10)));
  EXPECT_EQ(server.counts().failed_calls, 2U);
}

TEST_F(WebServers, ClientsOutliveTheServer) {
  ClientPointer client;
  {
    WebServer server(settings());
    RawWebClient raw(server.port());
    ASSERT_EQ(raw.open({}), 101);
    client = opened(0);
    for (int n = 0; n < 100; ++n) client->send_text("queued");
  }
  EXPECT_EQ(closed_, 1);
  EXPECT_FALSE(client->is_open());
  EXPECT_FALSE(client->send_text("more"));
  client->close();
}

TEST_F(WebServers, MistakesNameWhatToDo) {
  const WebServer first({});
  EXPECT_THAT(error_message([&] { WebServer({.port = first.port()}); }),
              AllOf(HasSubstr("127.0.0.1:" + std::to_string(first.port())),
                    HasSubstr("Address already in use"), HasSubstr("choose another port")));
  EXPECT_THAT(error_message([] { WebServer({.address = "localhost"}); }),
              HasSubstr("an IPv4 address in numbers"));
  EXPECT_THAT(error_message([] { WebServer({.address = "192.0.2.1"}); }),
              HasSubstr("one of this machine"));
  EXPECT_THAT(error_message([] {
                WebServer({.endpoints = {{.subprotocol = "a"}, {.subprotocol = "a"}}});
              }),
              HasSubstr("each subprotocol once"));
  EXPECT_THAT(error_message([] {
                WebServer({.files = {{"a", "text/css", web_buffer("")}}});
              }),
              HasSubstr("begins with /"));
}

}  // namespace
}  // namespace torsio
