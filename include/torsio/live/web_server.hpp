#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// Bytes of one message, which many clients may share. Not null, and not changed after they were given to a client.
using WebBuffer = std::shared_ptr<const std::vector<std::uint8_t>>;
[[nodiscard]] WebBuffer web_buffer(std::string_view bytes);

/// What a client asks for when it opens a WebSocket.
struct WebRequest {
  std::string path = {};         ///< "/live", decoded, without the query
  std::string query = {};        ///< "joint=1&rate=100", decoded; empty: none
  std::string subprotocol = {};  ///< the endpoint's
  std::string origin =
      {};  ///< address of the page that opens it, "http://localhost:8080"; empty: not a browser
  std::string host = {};  ///< the name by which the server was reached, "localhost:8080"
};

/// An open WebSocket. Every function may be called from any thread, never waits for the client, and may be called after the
/// client has gone: then it does nothing.
class WebClient {
 public:
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;
  ~WebClient();

  /// Queues a message. @returns false if the client has gone, or was dropped since more than the limit of bytes waits for it
  bool send_text(WebBuffer text);
  bool send_text(std::string_view text) { return send_text(web_buffer(text)); }
  bool send_binary(WebBuffer bytes);
  /// Closes the connection after what was queued before.
  /// @param status of RFC 6455: 1000 normal, 1001 the server ends, 1008 refused, ...
  /// @param reason at most 123 bytes
  void close(std::uint16_t status = 1000, std::string_view reason = {});

  [[nodiscard]] const WebRequest& request() const noexcept;
  /// Different for each client of a server, from 1 on.
  [[nodiscard]] std::uint64_t id() const noexcept;
  [[nodiscard]] bool is_open() const;
  /// Bytes that wait in this process; those in the socket of the system are not among them.
  [[nodiscard]] std::size_t queued_B() const;

 private:
  friend class WebThread;
  struct State;
  explicit WebClient(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A file that is served from memory for GET and HEAD.
struct WebFile {
  std::string path = {};  ///< "/", "/report.js"
  std::string type = {};  ///< "text/html; charset=utf-8"
  WebBuffer content = {};
};

/// What speaks a subprotocol of WebSocket. Every function is called in the server's thread, one at a time, and should be short;
/// one that is empty does nothing. An exception from one closes the client, and is counted.
struct WebEndpoint {
  using ClientPointer = std::shared_ptr<WebClient>;

  std::string subprotocol = {};  ///< value of Sec-WebSocket-Protocol; each once
  std::string path = {};         ///< at which it is; empty: at every path
  /// Pages of other origins that may open it: "https://app.foxglove.dev", or "*" for each. A page of this server always may, and
  /// so may programs that are not browsers and send no origin.
  std::vector<std::string> origins = {};
  /// @returns 0 to accept, or the HTTP status of the refusal (400 to 599). Is called after the checks of host and origin.
  std::function<int(const WebRequest&)> accept = {};
  std::function<void(const ClientPointer&)> on_open = {};
  std::function<void(const ClientPointer&, std::string_view)> on_text = {};  ///< UTF-8 is checked
  std::function<void(const ClientPointer&, std::span<const std::uint8_t>)> on_binary = {};
  /// Once for each client that was opened, also for those that were dropped and when the server ends.
  std::function<void(const ClientPointer&)> on_close = {};
};

/// A small web server: files from memory, and WebSockets, in a thread of its own (libwebsockets,
/// docs/decisions/0034-libwebsockets.md). Nothing that a client does, or does not do, blocks or slows a caller.
///
///     WebServer server({.port = 8080,
///                       .files = {{"/", "text/html; charset=utf-8", web_buffer(page)}},
///                       .endpoints = {{.subprotocol = "torsio.live", .on_open = [&](auto client) { ... }}}});
///     client->send_binary(buffer);   // from any thread
///
/// It is for one machine or a network of which every user is trusted: it has no encryption and no password. A page of another
/// server cannot use it: requests must have a `Host` that is an address in numbers, localhost or one of `hosts`, against names
/// that are made to lead here (DNS rebinding), and a browser's WebSocket must come from an allowed origin.
class WebServer {
 public:
  struct Settings {
    std::string address = "127.0.0.1";  ///< IPv4 in numbers; "0.0.0.0": every interface
    std::uint16_t port = 0;             ///< 0: any free one
    /// Further names by which it may be reached, without a port: "robot.local".
    std::vector<std::string> hosts = {};
    std::vector<WebFile> files = {};
    std::vector<WebEndpoint> endpoints = {};
    std::string content_security_policy =
        "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'";
    std::size_t queue_limit_B = std::size_t{8} << 20;    ///< waiting for one client
    std::size_t message_limit_B = std::size_t{1} << 20;  ///< from a client, in one message
    std::size_t clients = 64;                            ///< open WebSockets at the same time
    std::uint16_t header_limit_B = 8192;                 ///< all headers of a request
    int handshake_timeout_s = 5;  ///< for a request to be complete, and for an idle connection
    int ping_period_s = 20;  ///< while a client is idle; it is closed after three times as long
    /// Is called in the server's thread for each refused WebSocket.
    std::function<void(const WebRequest&, int status)> on_refused = {};
  };
  struct Counts {
    std::uint64_t opened = 0;     ///< WebSockets
    std::uint64_t closed = 0;     ///< WebSockets that were opened
    std::uint64_t refused = 0;    ///< requests: host, origin, path, subprotocol, `accept`, too many
    std::uint64_t dropped = 0;    ///< clients for which too much was waiting
    std::uint64_t too_large = 0;  ///< clients that were closed for a message above the limit
    std::uint64_t files = 0;      ///< served
    std::uint64_t sent = 0;       ///< messages given to the system
    std::uint64_t sent_B = 0;     ///< their bytes
    std::uint64_t failed_calls = 0;  ///< functions of an endpoint that have thrown
  };

  /// The server listens when it returns.
  /// @throws Error if the address is not one, the port is in use or needs a privilege (with what to do), or a setting is
  /// beyond its limits; if a path of a file or a subprotocol is given twice
  explicit WebServer(Settings settings);
  /// Closes all clients, and waits until the thread has ended. Not in the server's thread.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// "http://127.0.0.1:8080"
  [[nodiscard]] std::string url() const;
  [[nodiscard]] Counts counts() const;
  /// Calls the function in the server's thread, in order, at once if it is idle. From any thread, without waiting. What the
  /// destructor finds is not called any more.
  void post(std::function<void()> work);

 private:
  std::shared_ptr<class WebThread> thread_;
};

}  // namespace torsio
