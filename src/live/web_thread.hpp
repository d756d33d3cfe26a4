#pragma once

#include <libwebsockets.h>

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "torsio/live/web_server.hpp"

namespace torsio {

/// Guarded by `mutex`, but for what is constant.
struct WebClient::State {
  struct Message {
    WebBuffer bytes;
    bool is_text = false;
  };
  struct Closing {
    std::uint16_t status = 1000;
    std::string reason = {};
  };

  std::uint64_t id = 0;
  WebRequest request = {};
  std::size_t queue_limit_B = 0;
  std::weak_ptr<WebThread> thread = {};

  mutable std::mutex mutex = {};
  std::deque<Message> queue = {};
  std::size_t queued_B = 0;
  bool is_open = true;
  bool is_dropped = false;
  bool is_noted = false;  ///< the thread will look at it
  std::optional<Closing> closing = {};

  /// With the lock. @returns false: too much is waiting, and the client is dropped
  bool push(Message message) {
    is_dropped = queued_B + message.bytes->size() > queue_limit_B;
    if (is_dropped) {
      queue.clear();
      queued_B = 0;
      return false;
    }
    queued_B += message.bytes->size();
    queue.push_back(std::move(message));
    return true;
  }
  /// Calls `change(state)` with the lock if the client is open, and wakes the thread. @returns what it returns
  template <class Change>
  bool add(const Change& change);
};

/// The thread of a `WebServer` with libwebsockets' loop. Its callbacks run in this thread; only `post`, `note` and `counts` may
/// be called by others.
class WebThread : public std::enable_shared_from_this<WebThread> {
 public:
  /// Listens. @throws Error
  explicit WebThread(WebServer::Settings settings);
  ~WebThread();
  WebThread(const WebThread&) = delete;
  WebThread& operator=(const WebThread&) = delete;

  void start();
  void end();
  void post(std::function<void()> work);
  /// The client has something to send, or to close for.
  void note(std::uint64_t client);

  [[nodiscard]] const WebServer::Settings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  [[nodiscard]] WebServer::Counts counts() const;

 private:
  using ClientPointer = WebEndpoint::ClientPointer;
  struct Session {
    ClientPointer client = {};
    std::string message = {};  ///< the part of it that has arrived
    const WebFile* file = nullptr;
    std::size_t sent = 0;  ///< bytes of the file
  };
  struct OpenClient {
    ClientPointer client;
    lws* connection = nullptr;
  };

  static int http_callback(lws* connection, lws_callback_reasons reason, void* user, void* in,
                           size_t size);
  static int socket_callback(lws* connection, lws_callback_reasons reason, void* user, void* in,
                             size_t size);

  void wake();
  void work_off();
  void look_at(std::uint64_t id);
  void drop(const OpenClient& open);
  int confirm_upgrade(lws* connection, const char* what);
  /// @returns 0, or the HTTP status of a refusal
  int objection(const WebRequest& request, const std::vector<std::string>& subprotocols);
  int serve_file(lws* connection, const char* path);
  int send_file(lws* connection);
  int refuse_request(lws* connection, unsigned status);
  void open(lws* connection);
  int receive(lws* connection, const char* bytes, std::size_t size);
  int send(lws* connection);
  void close(lws* connection);
  [[nodiscard]] const WebEndpoint& endpoint(const WebClient& client) const;
  /// Calls a function of an endpoint. @returns false if it has thrown
  template <class Function, class... Arguments>
  bool call(const Function& function, const Arguments&... arguments);
  void count(std::uint64_t WebServer::Counts::*which, std::uint64_t number = 1);

  WebServer::Settings settings_;
  std::uint16_t port_ = 0;
  std::vector<lws_protocols> protocols_ = {};
  lws_retry_bo_t idle_ = {};
  lws_context* context_ = nullptr;
  std::thread thread_ = {};

  // Only the server's thread uses these.
  std::map<lws*, Session> sessions_ = {};
  std::map<lws*, WebRequest> upgrades_ = {};  ///< accepted, not yet open
  std::set<lws*> connections_ = {};
  std::map<std::uint64_t, OpenClient> clients_ = {};
  std::uint64_t last_id_ = 0;
  std::vector<unsigned char> scratch_ = {};

  mutable std::mutex mutex_ = {};  ///< for what follows
  bool ends_ = false;
  bool is_woken_ = false;
  std::vector<std::function<void()>> work_ = {};
  std::vector<std::uint64_t> noted_ = {};
  WebServer::Counts counts_ = {};
};

}  // namespace torsio
