#include "torsio/live/live_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <string_view>
#include <utility>

#include "core/checks.hpp"
#include "live/live_block.hpp"
#include "live/page_files.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kSubprotocol = "torsio.live.v1";
constexpr std::string_view kPath = "/live";
/// What is not sent within this time is not shown any more.
constexpr double kLongestBlock_s = 1.0;
/// A page that asks more often than a person does.
constexpr std::size_t kMaxRequests = 64;
constexpr std::size_t kMaxMessage_B = 4096;
constexpr int kForbidden = 403;
/// A hysteresis loop.
constexpr std::string_view kIcon =
    R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><path fill="none" stroke="#0b5cad" )"
    R"(stroke-width="2" d="M2 14C9 13 12 9 14 2C7 3 4 7 2 14"/></svg>)";
constexpr std::uint16_t kPolicyViolation = 1008;

std::string random_token() {
  std::random_device chance;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", chance());
  return token;
}

/// In a time that does not depend on where they differ.
bool is_same(std::string_view a, std::string_view b) noexcept {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0U;
}

std::string welcome_of(const LivePage::Settings& settings) {
  Json joints = Json::array();
  for (const LivePage::Joint& joint : settings.joints) {
    std::vector<std::string> channels = joint.channels;
    Json models = Json::array();
    for (const LivePage::Model& model : joint.models) {
      channels.push_back(model.name + ": estimate");
      channels.push_back(model.name + ": standard deviation");
      models.push_back({{"name", model.name}, {"target", model.target}, {"on", model.is_on}});
    }
    joints.push_back({{"id", joint.id},
                      {"name", joint.name},
                      {"actuator", joint.actuator},
                      {"channels", std::move(channels)},
                      {"models", std::move(models)}});
  }
  const Json document{{"op", "joints"},
                      {"rate_Hz", settings.rate_Hz},
                      {"reference", settings.reference},
                      {"joints", std::move(joints)}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string text_of(const LivePage::Status& status) {
  Json joints = Json::array();
  for (const LivePage::JointStatus& joint : status.joints)
    joints.push_back({{"state", joint.state},
                      {"monitor", joint.monitor},
                      {"silent", joint.is_silent},
                      {"lost", joint.lost},
                      {"models", joint.models}});
  Json recording = nullptr;
  if (!status.recorded_files.empty())
    recording = {{"files", status.recorded_files}, {"duration_s", status.recorded_s}};
  const Json document{{"op", "status"},
                      {"trouble", status.trouble},
                      {"recording", std::move(recording)},
                      {"joints", std::move(joints)}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

WebFile page_file(std::string path, std::string type, std::string_view content) {
  return {.path = std::move(path), .type = std::move(type), .content = web_buffer(content)};
}

}  // namespace

class LivePage::Parts {
 public:
  explicit Parts(Settings settings)
      : settings_(std::move(settings)), welcome_(web_buffer(welcome_of(settings_))) {
    if (settings_.token.empty()) settings_.token = random_token();
    const auto longest = static_cast<std::size_t>(kLongestBlock_s * settings_.rate_Hz) + 1;
    for (const Joint& joint : settings_.joints) blocks_.emplace_back(joint.values(), longest);
    WebServer::Settings server = settings_.server;
    server.message_limit_B = kMaxMessage_B;
    server.files = {page_file("/", "text/html; charset=utf-8", live_html()),
                    page_file("/live.js", "text/javascript; charset=utf-8", live_script()),
                    page_file("/live.css", "text/css; charset=utf-8", live_style()),
                    page_file("/icon.svg", "image/svg+xml", kIcon)};
    server.endpoints = {{.subprotocol = std::string(kSubprotocol),
                         .path = std::string(kPath),
                         .accept = [this](const WebRequest& request) { return accept(request); },
                         .on_open = [this](const auto& client) { open(client); },
                         .on_text = [this](const auto& client, auto text) { take(client, text); },
                         .on_binary = [this](const auto&, auto) { ++refused_; },
                         .on_close = [this](const auto& client) { close(client); }}};
    server_ = std::make_unique<WebServer>(std::move(server));
  }

  [[nodiscard]] std::string url() const { return server_->url() + "/?token=" + settings_.token; }

  void add(std::size_t joint, std::uint64_t number, std::span<const double> values) {
    blocks_.at(joint).add(number, values);
  }

  void flush() {
    const std::shared_ptr<WebClient> page = connected();
    if (!page) {
      for (LiveBlock& block : blocks_) block.clear();
      return;
    }
    std::vector<std::uint8_t> message;
    for (std::size_t j = 0; j < blocks_.size(); ++j)
      if (!blocks_[j].empty()) blocks_[j].append_to(message, static_cast<std::uint16_t>(j));
    if (message.empty()) return;
    messages_B_ += message.size();
    page->send_binary(std::make_shared<const std::vector<std::uint8_t>>(std::move(message)));
  }

  void show(const Status& status) {
    if (const auto page = connected()) page->send_text(text_of(status));
  }

  [[nodiscard]] std::vector<Request> take_requests() {
    const std::lock_guard lock(mutex_);
    return std::exchange(requests_, {});
  }
  [[nodiscard]] bool is_connected() const { return connected() != nullptr; }
  [[nodiscard]] Counts counts() const {
    return {.pages = pages_.load(),
            .refused = refused_.load(),
            .messages_B = messages_B_,
            .server = server_->counts()};
  }

 private:
  [[nodiscard]] std::shared_ptr<WebClient> connected() const {
    const std::lock_guard lock(mutex_);
    return page_;
  }

  // In the server's thread.

  [[nodiscard]] int accept(const WebRequest& request) const {
    constexpr std::string_view kName = "token=";
    const bool has_token =
        request.query.starts_with(kName) &&
        is_same(std::string_view(request.query).substr(kName.size()), settings_.token);
    return has_token ? 0 : kForbidden;
  }
  void open(const std::shared_ptr<WebClient>& client) {
    const std::lock_guard lock(mutex_);
    if (page_) {
      ++refused_;
      client->send_text(
          Json{{"op", "refused"},
               {"reason", "another page is connected to this program; close it first"}}
              .dump());
      client->close(kPolicyViolation, "another page is connected");
      return;
    }
    ++pages_;
    client->send_text(welcome_);
    page_ = client;
  }
  void close(const std::shared_ptr<WebClient>& client) {
    const std::lock_guard lock(mutex_);
    if (page_ == client) page_.reset();
  }
  void take(const std::shared_ptr<WebClient>& client, std::string_view text) {
    const std::optional<Request> request = request_of(Json::parse(text, nullptr, false));
    const std::lock_guard lock(mutex_);
    if (page_ != client) return;
    if (!request || requests_.size() >= kMaxRequests) {
      ++refused_;
      return;
    }
    requests_.push_back(*request);
  }
  [[nodiscard]] std::optional<Request> request_of(const Json& message) const {
    if (!message.is_object() || !message.contains("op") || !message.contains("on") ||
        !message["on"].is_boolean())
      return std::nullopt;
    const bool is_on = message["on"].get<bool>();
    if (message["op"] == "record")
      return Request{.kind = is_on ? Request::Kind::begin_recording : Request::Kind::end_recording};
    if (message["op"] != "model") return std::nullopt;
    const std::size_t joint = index_of(message, "joint", settings_.joints.size());
    if (joint == settings_.joints.size()) return std::nullopt;
    const std::size_t models = settings_.joints[joint].models.size();
    const std::size_t model = index_of(message, "model", models);
    if (model == models) return std::nullopt;
    return Request{
        .kind = Request::Kind::switch_model, .joint = joint, .model = model, .is_on = is_on};
  }
  /// @returns `count` for one that does not exist
  [[nodiscard]] static std::size_t index_of(const Json& message, const char* name,
                                            std::size_t count) {
    if (!message.contains(name) || !message[name].is_number_unsigned()) return count;
    return static_cast<std::size_t>(
        std::min<std::uint64_t>(message[name].get<std::uint64_t>(), count));
  }

  Settings settings_;
  WebBuffer welcome_;
  std::vector<LiveBlock> blocks_ = {};
  std::uint64_t messages_B_ = 0;
  std::atomic<std::uint64_t> pages_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  mutable std::mutex mutex_ = {};
  std::shared_ptr<WebClient> page_ = {};
  std::vector<Request> requests_ = {};
  std::unique_ptr<WebServer> server_ = {};  // last: its thread uses the others
};

LivePage::LivePage(Settings settings) {
  require(!settings.joints.empty(), "live page: joints", "at least one", "none");
  require(settings.rate_Hz > 0.0, "live page: rate_Hz", "above 0", settings.rate_Hz);
  parts_ = std::make_unique<Parts>(std::move(settings));
}
LivePage::~LivePage() = default;

std::string LivePage::url() const { return parts_->url(); }
void LivePage::add(std::size_t joint, std::uint64_t number, std::span<const double> values) {
  parts_->add(joint, number, values);
}
void LivePage::flush() { parts_->flush(); }
void LivePage::show(const Status& status) { parts_->show(status); }
std::vector<LivePage::Request> LivePage::take_requests() { return parts_->take_requests(); }
bool LivePage::is_connected() const { return parts_->is_connected(); }
LivePage::Counts LivePage::counts() const { return parts_->counts(); }

}  // namespace torsio
