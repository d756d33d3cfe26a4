#include "live/web_thread.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "live/web_request.hpp"

namespace torsio {
namespace {

/// Connections beside the open WebSockets: files, and handshakes that are not complete.
constexpr std::size_t kOtherConnections = 64;
constexpr std::size_t kFilePart_B = 16384;
constexpr std::size_t kHeaders_B = 4096;
/// What is received at once.
constexpr std::size_t kHttpPart_B = 4096;
constexpr std::size_t kSocketPart_B = 65536;
constexpr int kFileTimeout_s = 20;
/// Messages to one client before the others get their turn.
constexpr int kMessagesInARow = 64;
constexpr int kTooLarge = LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE;

std::string address_advice(const WebServer::Settings& settings, int error_number) {
  switch (error_number) {
    case EADDRINUSE:
      return fmt::format(
          "Another program listens there (`ss -ltnp 'sport = :{}'` shows it): end it, "
          "or choose another port; port 0 is any free one.",
          settings.port);
    case EACCES: return "Ports below 1024 need a privilege: choose a higher one.";
    case EADDRNOTAVAIL:
      return "The address must be one of this machine (`ip address` lists them): 127.0.0.1 for "
             "this "
             "machine only, 0.0.0.0 for every interface.";
    default: return {};
  }
}

/// Listens for a moment, since libwebsockets does not report why it cannot. @returns the port
std::uint16_t try_to_listen(const WebServer::Settings& settings) {
  const std::string place = fmt::format("{}:{}", settings.address, settings.port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(settings.port);
  if (::inet_pton(AF_INET, settings.address.c_str(), &address.sin_addr) != 1)
    refuse("web server: address", "an IPv4 address in numbers", "'" + settings.address + "'");
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int reuse = 1;
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof(reuse));
  socklen_t size = sizeof(address);
  const bool listens =
      ::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
      ::listen(listener, 1) == 0 &&
      ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  const int error_number = errno;
  ::close(listener);
  if (!listens)
    detail::refuse_system(place, "the web server cannot listen", error_number,
                          address_advice(settings, error_number));
  return ntohs(address.sin_port);
}

std::string header(lws* connection, lws_token_indexes token) {
  const int size = lws_hdr_total_length(connection, token);
  if (size <= 0) return {};
  std::string text(static_cast<std::size_t>(size) + 1, '\0');
  const int copied = lws_hdr_copy(connection, text.data(), size + 1, token);
  text.resize(copied < 0 ? 0 : static_cast<std::size_t>(copied));
  return text;
}

std::string query_of(lws* connection) {
  std::string query;
  std::array<char, 1024> part;
  for (int n = 0;; ++n) {
    const int size =
        lws_hdr_copy_fragment(connection, part.data(), part.size(), WSI_TOKEN_HTTP_URI_ARGS, n);
    if (size < 0) return query;
    if (n > 0) query += '&';
    query.append(part.data(), static_cast<std::size_t>(size));
  }
}

std::vector<std::string> words(const std::string& list) {
  std::vector<std::string> found;
  std::string word;
  for (const char character : list + ",") {
    if (character == ',') {
      if (!word.empty()) found.push_back(std::exchange(word, {}));
    } else if (character != ' ' && character != '\t') {
      word += character;
    }
  }
  return found;
}

lws_protocols protocol(const char* name, lws_callback_function* callback, std::size_t part_B,
                       unsigned id) {
  lws_protocols made{};
  made.name = name;
  made.callback = callback;
  made.rx_buffer_size = part_B;
  made.id = id;
  return made;
}

WebThread& thread_of(lws* connection) {
  return *static_cast<WebThread*>(lws_context_user(lws_get_context(connection)));
}

/// Headers of a response, in the memory that libwebsockets requires.
class ResponseHeaders {
 public:
  ResponseHeaders(lws* connection, unsigned status) : connection_(connection) {
    is_complete_ = lws_add_http_header_status(connection_, status, &at_, end_) == 0;
  }
  void add(const char* name_with_colon, std::string_view value) {
    is_complete_ =
        is_complete_ && lws_add_http_header_by_name(
                            connection_, reinterpret_cast<const unsigned char*>(name_with_colon),
                            reinterpret_cast<const unsigned char*>(value.data()),
                            static_cast<int>(value.size()), &at_, end_) == 0;
  }
  [[nodiscard]] bool send(std::size_t content_B) {
    return is_complete_ &&
           lws_add_http_header_content_length(connection_, content_B, &at_, end_) == 0 &&
           lws_finalize_write_http_header(connection_, start_, &at_, end_) == 0;
  }

 private:
  lws* connection_;
  std::array<unsigned char, LWS_PRE + kHeaders_B> bytes_{};
  unsigned char* start_ = bytes_.data() + LWS_PRE;
  unsigned char* at_ = start_;
  unsigned char* end_ = bytes_.data() + bytes_.size() - 1;
  bool is_complete_ = true;
};

}  // namespace

WebThread::WebThread(WebServer::Settings settings) : settings_(std::move(settings)) {
  // Its messages would be printed by the library.
  lws_set_log_level(0, nullptr);
  protocols_.push_back(protocol("http", http_callback, kHttpPart_B, 0));
  for (const WebEndpoint& each : settings_.endpoints)
    protocols_.push_back(protocol(each.subprotocol.c_str(), socket_callback, kSocketPart_B,
                                  static_cast<unsigned>(protocols_.size())));
  protocols_.push_back({});
  idle_.secs_since_valid_ping = static_cast<std::uint16_t>(settings_.ping_period_s);
  idle_.secs_since_valid_hangup = static_cast<std::uint16_t>(3 * settings_.ping_period_s);
  const std::uint16_t port = try_to_listen(settings_);
  lws_context_creation_info info{};
  info.iface = settings_.address.c_str();
  info.port = port;
  info.protocols = protocols_.data();
  info.server_string = "torsio";
  info.max_http_header_data = settings_.header_limit_B;
  info.timeout_secs = static_cast<unsigned>(settings_.handshake_timeout_s);
  info.timeout_secs_ah_idle = static_cast<unsigned>(settings_.handshake_timeout_s);
  info.keepalive_timeout = settings_.handshake_timeout_s;
  info.retry_and_idle_policy = &idle_;
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_VALIDATE_UTF8 |
                 LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  info.user = this;
  context_ = lws_create_context(&info);
  if (context_ == nullptr)
    throw Error({.place = fmt::format("{}:{}", settings_.address, port),
                 .problem = "the web server cannot start",
                 .advice = "The port may have been taken in this moment: try again."});
  port_ = port;
}

WebThread::~WebThread() {
  if (context_ != nullptr) lws_context_destroy(context_);
}

void WebThread::start() {
  thread_ = std::thread([this] {
    while (lws_service(context_, 0) >= 0) {
      const std::lock_guard lock(mutex_);
      if (ends_) break;
    }
    // `wake` must not find a context that is being destroyed.
    lws_context* context = nullptr;
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
      context = std::exchange(context_, nullptr);
    }
    lws_context_destroy(context);
  });
}

void WebThread::end() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    if (context_ != nullptr) lws_cancel_service(context_);
  }
  if (thread_.joinable()) thread_.join();
}

void WebThread::post(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (ends_) return;
  work_.push_back(std::move(work));
  wake();
}

void WebThread::note(std::uint64_t client) {
  const std::lock_guard lock(mutex_);
  if (ends_) return;
  noted_.push_back(client);
  wake();
}

/// With the lock. Writes to a descriptor that never blocks.
void WebThread::wake() {
  if (!std::exchange(is_woken_, true)) lws_cancel_service(context_);
}

WebServer::Counts WebThread::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void WebThread::count(std::uint64_t WebServer::Counts::*which, std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  counts_.*which += number;
}

template <class Function, class... Arguments>
bool WebThread::call(const Function& function, const Arguments&... arguments) {
  if (!function) return true;
  try {
    function(arguments...);
    return true;
  } catch (...) {
    count(&WebServer::Counts::failed_calls);
    return false;
  }
}

const WebEndpoint& WebThread::endpoint(const WebClient& client) const {
  return *std::ranges::find(settings_.endpoints, client.request().subprotocol,
                            &WebEndpoint::subprotocol);
}

int WebThread::http_callback(lws* connection, lws_callback_reasons reason, void* /*user*/, void* in,
                             size_t /*size*/) {
  WebThread& thread = thread_of(connection);
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      if (thread.connections_.size() < thread.settings_.clients + kOtherConnections) return 0;
      thread.count(&WebServer::Counts::refused);
      return 1;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      thread.connections_.insert(connection);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      thread.connections_.erase(connection);
      thread.sessions_.erase(connection);
      thread.upgrades_.erase(connection);
      return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED: thread.work_off(); return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return thread.confirm_upgrade(connection, static_cast<const char*>(in));
    case LWS_CALLBACK_HTTP: return thread.serve_file(connection, static_cast<const char*>(in));
    case LWS_CALLBACK_HTTP_WRITEABLE: return thread.send_file(connection);
    default: return 0;
  }
}

int WebThread::socket_callback(lws* connection, lws_callback_reasons reason, void* /*user*/,
                               void* in, size_t size) {
  WebThread& thread = thread_of(connection);
  switch (reason) {
    case LWS_CALLBACK_ESTABLISHED: thread.open(connection); return 0;
    case LWS_CALLBACK_RECEIVE:
      return thread.receive(connection, static_cast<const char*>(in), size);
    case LWS_CALLBACK_SERVER_WRITEABLE: return thread.send(connection);
    case LWS_CALLBACK_CLOSED: thread.close(connection); return 0;
    default: return 0;
  }
}

void WebThread::work_off() {
  std::vector<std::function<void()>> work;
  std::vector<std::uint64_t> noted;
  {
    const std::lock_guard lock(mutex_);
    is_woken_ = false;
    if (ends_) return;
    work.swap(work_);
    noted.swap(noted_);
  }
  for (const auto& each : work) call(each);
  for (const std::uint64_t id : noted) look_at(id);
}

void WebThread::look_at(std::uint64_t id) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  const OpenClient open = found->second;
  bool is_dropped = false;
  {
    const std::lock_guard lock(open.client->state_->mutex);
    open.client->state_->is_noted = false;
    is_dropped = open.client->state_->is_dropped;
  }
  if (is_dropped)
    drop(open);
  else
    lws_callback_on_writable(open.connection);
}

/// Without a closing handshake, for which a client that does not read would be waited for.
void WebThread::drop(const OpenClient& open) {
  count(&WebServer::Counts::dropped);
  close(open.connection);
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  const int socket = lws_get_socket_fd(open.connection);
  ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  ::shutdown(socket, SHUT_RDWR);
  lws_set_timeout(open.connection, PENDING_TIMEOUT_KILLED_BY_PARENT, LWS_TO_KILL_ASYNC);
}

int WebThread::objection(const WebRequest& request, const std::vector<std::string>& subprotocols) {
  if (!is_allowed_host(request.host, settings_.hosts)) return HTTP_STATUS_FORBIDDEN;
  if (subprotocols.empty()) return HTTP_STATUS_BAD_REQUEST;
  const auto found =
      std::ranges::find(settings_.endpoints, request.subprotocol, &WebEndpoint::subprotocol);
  if (found == settings_.endpoints.end()) return HTTP_STATUS_BAD_REQUEST;
  if (!found->path.empty() && found->path != request.path) return HTTP_STATUS_NOT_FOUND;
  if (!is_allowed_origin(request.origin, request.host, found->origins))
    return HTTP_STATUS_FORBIDDEN;
  if (clients_.size() + upgrades_.size() >= settings_.clients)
    return HTTP_STATUS_SERVICE_UNAVAILABLE;
  if (!found->accept) return 0;
  int status = HTTP_STATUS_INTERNAL_SERVER_ERROR;
  call(std::function<void()>([&] { status = found->accept(request); }));
  return status;
}

int WebThread::confirm_upgrade(lws* connection, const char* what) {
  if (std::string_view(what) != "websocket") return -1;
  WebRequest request{.path = header(connection, WSI_TOKEN_GET_URI),
                     .query = query_of(connection),
                     .origin = header(connection, WSI_TOKEN_ORIGIN),
                     .host = header(connection, WSI_TOKEN_HOST)};
  const std::vector<std::string> subprotocols = words(header(connection, WSI_TOKEN_PROTOCOL));
  // The first one of the client that there is, which libwebsockets chooses, too.
  for (const std::string& each : subprotocols) {
    if (!request.subprotocol.empty()) break;
    if (std::ranges::find(settings_.endpoints, each, &WebEndpoint::subprotocol) !=
        settings_.endpoints.end())
      request.subprotocol = each;
  }
  if (const int status = objection(request, subprotocols); status != 0) {
    call(settings_.on_refused, request, status);
    static_cast<void>(refuse_request(connection, static_cast<unsigned>(status)));
    return 1;
  }
  upgrades_[connection] = std::move(request);
  return 0;
}

int WebThread::refuse_request(lws* connection, unsigned status) {
  count(&WebServer::Counts::refused);
  return lws_return_http_status(connection, status, nullptr);
}

int WebThread::serve_file(lws* connection, const char* path) {
  const bool is_head = lws_hdr_total_length(connection, WSI_TOKEN_HEAD_URI) > 0;
  const bool is_get = lws_hdr_total_length(connection, WSI_TOKEN_GET_URI) > 0;
  const auto refuse_with = [&](unsigned status) {
    if (refuse_request(connection, status) != 0) return -1;
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  };
  if (!is_allowed_host(header(connection, WSI_TOKEN_HOST), settings_.hosts))
    return refuse_with(HTTP_STATUS_FORBIDDEN);
  if (!is_get && !is_head) {
    static_cast<void>(refuse_with(HTTP_STATUS_METHOD_NOT_ALLOWED));
    return -1;  // what follows would be its content
  }
  const auto found = std::ranges::find(settings_.files, std::string_view(path), &WebFile::path);
  if (found == settings_.files.end()) return refuse_with(HTTP_STATUS_NOT_FOUND);
  ResponseHeaders headers(connection, HTTP_STATUS_OK);
  headers.add("content-type:", found->type);
  headers.add("content-security-policy:", settings_.content_security_policy);
  headers.add("x-content-type-options:", "nosniff");
  headers.add("x-frame-options:", "DENY");
  headers.add("referrer-policy:", "no-referrer");
  headers.add("cross-origin-resource-policy:", "same-origin");
  headers.add("cross-origin-opener-policy:", "same-origin");
  headers.add("cache-control:", "no-store");
  if (!headers.send(found->content->size())) return -1;
  count(&WebServer::Counts::files);
  if (is_head || found->content->empty())
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  sessions_[connection] = {.file = &*found};
  lws_callback_on_writable(connection);
  return 0;
}

int WebThread::send_file(lws* connection) {
  const auto found = sessions_.find(connection);
  if (found == sessions_.end() || found->second.file == nullptr) return 0;
  Session& session = found->second;
  const std::vector<std::uint8_t>& content = *session.file->content;
  const std::size_t size = std::min(kFilePart_B, content.size() - session.sent);
  const bool is_last = session.sent + size == content.size();
  scratch_.resize(LWS_PRE + size);
  std::copy_n(content.begin() + static_cast<std::ptrdiff_t>(session.sent), size,
              scratch_.begin() + LWS_PRE);
  if (lws_write(connection, scratch_.data() + LWS_PRE, size,
                is_last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) != static_cast<int>(size))
    return -1;
  session.sent += size;
  if (is_last) {
    sessions_.erase(found);
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  }
  lws_set_timeout(connection, PENDING_TIMEOUT_HTTP_CONTENT, kFileTimeout_s);
  lws_callback_on_writable(connection);
  return 0;
}

void WebThread::open(lws* connection) {
  auto state = std::make_unique<WebClient::State>();
  state->id = ++last_id_;
  state->request = std::move(upgrades_[connection]);
  upgrades_.erase(connection);
  state->queue_limit_B = settings_.queue_limit_B;
  state->thread = weak_from_this();
  const ClientPointer client(new WebClient(std::move(state)));
  sessions_[connection] = {.client = client};
  clients_[last_id_] = {.client = client, .connection = connection};
  count(&WebServer::Counts::opened);
  if (!call(endpoint(*client).on_open, client)) client->close(1011);
}

int WebThread::receive(lws* connection, const char* bytes, std::size_t size) {
  const auto found = sessions_.find(connection);
  if (found == sessions_.end() || !found->second.client) return -1;
  Session& session = found->second;
  const ClientPointer client = session.client;
  if (session.message.size() + size + lws_remaining_packet_payload(connection) >
      settings_.message_limit_B) {
    count(&WebServer::Counts::too_large);
    lws_close_reason(connection, static_cast<lws_close_status>(kTooLarge), nullptr, 0);
    return -1;
  }
  session.message.append(bytes, size);
  if (lws_remaining_packet_payload(connection) > 0 || lws_is_final_fragment(connection) == 0)
    return 0;
  const std::string message = std::exchange(session.message, {});
  const WebEndpoint& receiver = endpoint(*client);
  const bool has_worked =
      lws_frame_is_binary(connection) != 0
          ? call(receiver.on_binary, client,
                 std::span(reinterpret_cast<const std::uint8_t*>(message.data()), message.size()))
          : call(receiver.on_text, client, std::string_view(message));
  if (!has_worked) client->close(1011);
  return 0;
}

int WebThread::send(lws* connection) {
  const auto found = sessions_.find(connection);
  if (found == sessions_.end() || !found->second.client) return -1;
  WebClient::State& state = *found->second.client->state_;
  for (int n = 0; n < kMessagesInARow; ++n) {
    WebClient::State::Message message;
    {
      const std::lock_guard lock(state.mutex);
      if (state.queue.empty()) {
        if (!state.closing) return 0;
        lws_close_reason(connection, static_cast<lws_close_status>(state.closing->status),
                         reinterpret_cast<unsigned char*>(state.closing->reason.data()),
                         state.closing->reason.size());
        return -1;
      }
      message = std::move(state.queue.front());
      state.queue.pop_front();
      state.queued_B -= message.bytes->size();
    }
    scratch_.resize(LWS_PRE + message.bytes->size());
    std::ranges::copy(*message.bytes, scratch_.begin() + LWS_PRE);
    if (lws_write(connection, scratch_.data() + LWS_PRE, message.bytes->size(),
                  message.is_text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY) < 0)
      return -1;
    count(&WebServer::Counts::sent);
    count(&WebServer::Counts::sent_B, message.bytes->size());
    if (lws_send_pipe_choked(connection) != 0) break;
  }
  lws_callback_on_writable(connection);
  return 0;
}

/// Once per client, by whatever ends it.
void WebThread::close(lws* connection) {
  const auto found = sessions_.find(connection);
  if (found == sessions_.end() || !found->second.client) return;
  const ClientPointer client = std::exchange(found->second.client, nullptr);
  clients_.erase(client->id());
  {
    const std::lock_guard lock(client->state_->mutex);
    client->state_->is_open = false;
    client->state_->queue.clear();
    client->state_->queued_B = 0;
  }
  count(&WebServer::Counts::closed);
  call(endpoint(*client).on_close, client);
}

}  // namespace torsio
