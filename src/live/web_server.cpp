#include "torsio/live/web_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/checks.hpp"
#include "live/web_thread.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestReason = 123;
constexpr int kLongestTime_s = 3600;

void check(const WebServer::Settings& settings) {
  std::set<std::string> paths;
  for (const WebFile& each : settings.files) {
    const std::string place = fmt::format("web server: file '{}'", each.path);
    require(each.path.starts_with('/'), place, "a path that begins with /", "another one");
    require(each.content != nullptr, place, "a content", "none");
    require(paths.insert(each.path).second, place, "each path once", "twice");
  }
  std::set<std::string> subprotocols;
  for (const WebEndpoint& each : settings.endpoints) {
    const std::string place = fmt::format("web server: subprotocol '{}'", each.subprotocol);
    const bool is_token = !each.subprotocol.empty() && each.subprotocol != "http" &&
                          each.subprotocol.find_first_of(" ,\t\r\n") == std::string::npos;
    require(is_token, place, "a name without spaces and commas, other than http", "another one");
    require(subprotocols.insert(each.subprotocol).second, place, "each subprotocol once", "twice");
  }
  const auto require_time = [](int value_s, const char* name) {
    require(value_s >= 1 && value_s <= kLongestTime_s, fmt::format("web server: {}", name),
            fmt::format("1 to {}", kLongestTime_s), fmt::format("{}", value_s));
  };
  require_time(settings.handshake_timeout_s, "handshake_timeout_s");
  require_time(settings.ping_period_s, "ping_period_s");
  require(settings.clients >= 1, "web server: clients", "at least 1", "0");
  require(settings.header_limit_B >= 1024, "web server: header_limit_B", "at least 1024",
          fmt::format("{}", settings.header_limit_B));
}

}  // namespace

WebBuffer web_buffer(std::string_view bytes) {
  return std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
}

WebClient::WebClient(std::unique_ptr<State> state) : state_(std::move(state)) {}
WebClient::~WebClient() = default;

template <class Change>
bool WebClient::State::add(const Change& change) {
  bool is_added = false;
  {
    const std::lock_guard lock(mutex);
    if (!is_open || is_dropped || closing) return false;
    is_added = change(*this);
    if (std::exchange(is_noted, true)) return is_added;
  }
  if (const auto alive = thread.lock()) alive->note(id);
  return is_added;
}

bool WebClient::send_text(WebBuffer text) {
  return state_->add([&](State& state) { return state.push({std::move(text), true}); });
}

bool WebClient::send_binary(WebBuffer bytes) {
  return state_->add([&](State& state) { return state.push({std::move(bytes), false}); });
}

void WebClient::close(std::uint16_t status, std::string_view reason) {
  state_->add([&](State& state) {
    state.closing = State::Closing{status, std::string(reason.substr(0, kLongestReason))};
    return true;
  });
}

const WebRequest& WebClient::request() const noexcept { return state_->request; }
std::uint64_t WebClient::id() const noexcept { return state_->id; }

bool WebClient::is_open() const {
  const std::lock_guard lock(state_->mutex);
  return state_->is_open && !state_->is_dropped;
}

std::size_t WebClient::queued_B() const {
  const std::lock_guard lock(state_->mutex);
  return state_->queued_B;
}

WebServer::WebServer(Settings settings) {
  check(settings);
  thread_ = std::make_shared<WebThread>(std::move(settings));
  thread_->start();
}

WebServer::~WebServer() { thread_->end(); }

std::uint16_t WebServer::port() const noexcept { return thread_->port(); }

std::string WebServer::url() const {
  const std::string& address = thread_->settings().address;
  return fmt::format("http://{}:{}", address == "0.0.0.0" ? "127.0.0.1" : address, port());
}

WebServer::Counts WebServer::counts() const { return thread_->counts(); }
void WebServer::post(std::function<void()> work) { thread_->post(std::move(work)); }

}  // namespace torsio
