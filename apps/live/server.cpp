#include "apps/live/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <random>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "apps/live/assets.hpp"
#include "apps/live/request.hpp"
#include "host/io/beneath.hpp"
#include "host/io/io.hpp"
#include "host/report/templates.hpp"

namespace flexor::live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using std::chrono::seconds;
using Tcp = asio::ip::tcp;

constexpr std::uint32_t kLongestHead = 8192;
constexpr std::size_t kMostTurnedAway =
    64;  // connections that are being told so; more are closed without a word
constexpr std::uint64_t kTurnedAway = 0;  // the number of one more connection than there may be
constexpr seconds kHeadTime{10};          // to send a head, and to agree on a WebSocket
constexpr seconds kIdleTime{30};          // between two requests
constexpr seconds kStallTime{30};         // for a part of an answer
constexpr seconds kSilence{30};           // of a socket, which is asked after half of it
constexpr seconds kFarewell{1};
static_assert(kLongestText == kLongestBinary, "the limit is set before the kind is known");

// wasm-unsafe-eval: what runs the markerless model is WebAssembly. It allows that alone, no eval of text.
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self' "
    "blob:; "
    "media-src 'self' blob:; font-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";
// What lies in the sessions' folder may come from anybody: it is shown, has no origin to ask from, and runs nothing but the charts
// of our own reports.
const std::string& file_policy() {
  static const std::string policy =
      "sandbox allow-scripts; default-src 'none'; script-src " + report::report_script_source() +
      "; style-src 'unsafe-inline'; img-src data:; media-src 'self'; base-uri 'none'; "
      "form-action 'none'; frame-ancestors 'none'";
  return policy;
}

template <class Fields>
void set_headers(Fields& fields, const char* policy) {
  fields.set("Content-Security-Policy", policy);
  fields.set("X-Content-Type-Options", "nosniff");
  fields.set("Referrer-Policy", "no-referrer");
  fields.set("Cache-Control", "no-store");
  fields.set("Cross-Origin-Opener-Policy", "same-origin");
  fields.set("Cross-Origin-Resource-Policy", "same-origin");
  fields.set("Permissions-Policy", "camera=(self)");
}

struct Message {
  std::shared_ptr<const std::string> bytes;  // one for all that it goes to
  bool text = true;
};

class AnyConnection {
 public:
  AnyConnection() = default;
  virtual ~AnyConnection() = default;
  AnyConnection(const AnyConnection&) = delete;
  AnyConnection& operator=(const AnyConnection&) = delete;
  virtual void send(const Message&) {}
  virtual void give_up() = 0;      // at once
  virtual void farewell() = 0;     // the program ends
  virtual bool known() const = 0;  // has shown the token
};

struct Watch {
  Watch(asio::io_context& context, int descriptor) : stream(context, descriptor) {}
  asio::posix::stream_descriptor stream;
  std::function<void()> readable;
  bool ended = false;
};

struct Timer {
  explicit Timer(asio::io_context& context) : timer(context) {}
  asio::steady_timer timer;
  std::chrono::steady_clock::duration period{};
  std::function<void()> tick;
};

std::string random_token() {
  constexpr const char* kSystem = "/dev/urandom";  // whatever the library's own choice may be
  std::random_device bits(kSystem);
  std::string token;
  for (int word = 0; word < 4; ++word) token += fmt::format("{:08x}", bits());
  return token;
}

std::string checked_token(const std::string& token) {
  if (token.empty()) return random_token();
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
  if (token.find_first_not_of(kLetters) != token.npos)
    throw io::InputError("the token may hold letters, digits, - and _ only");
  return token;
}

// The program that runs: its sockets, its requests, what it watches.
class Hub : public Server {
 public:
  Hub(const ServerOptions& options, Handlers handlers);
  ~Hub() override;

  std::string url() const override;
  const std::string& token() const { return token_; }
  const std::filesystem::path& files() const { return files_; }
  bool is_ours(std::string_view host) const;

  void enter(std::uint64_t id, AnyConnection* connection) {
    if (id == kTurnedAway)
      ++turned_away_;
    else
      connections_[id] = connection;
  }
  void leave(std::uint64_t id, const AnyConnection* connection);
  void opened(Client client, AnyConnection* connection);
  void closed(Client client);
  void text(Client client, std::string_view text) {
    if (handlers_.text) handlers_.text(client, text);
  }
  void binary(Client client, std::span<const std::uint8_t> bytes) {
    if (handlers_.binary) handlers_.binary(client, bytes);
  }

  void send(Client to, std::string text) override;
  void send_all(std::string text) override { send_all(std::move(text), true); }
  void send_all(std::span<const std::uint8_t> bytes) override {
    send_all(std::string(bytes.begin(), bytes.end()), false);
  }
  void watch(int descriptor, std::function<void()> readable) override;
  void unwatch(int descriptor) override;
  void every(double period_s, std::function<void()> tick) override;
  void post(std::function<void()> work) override { asio::post(context, std::move(work)); }
  void run() override { context.run(); }
  void stop() override {
    asio::post(context, [this] { end(); });
  }
  Counts counts() const override { return {refused, dropped, clients}; }

  std::atomic<std::uint64_t> refused{0};
  std::atomic<std::uint64_t> dropped{0};
  std::atomic<int> clients{0};

 private:
  void open(unsigned short port);
  void accept();
  void send_all(std::string bytes, bool text);
  void end();
  void accepted(Tcp::socket socket);
  bool make_room();
  void wait(const std::shared_ptr<Watch>& watch);
  void wait(const std::shared_ptr<Timer>& timer);

  // Before the context: what ends with it leaves these.
  std::map<std::uint64_t, AnyConnection*> connections_;  // oldest first
  std::map<Client, AnyConnection*> sockets_;             // those among them that are open sockets
  std::size_t turned_away_ = 0;
  Handlers handlers_;
  std::string token_;
  std::filesystem::path files_;
  Tcp::endpoint here_;

 public:
  asio::io_context context{1};

 private:
  Tcp::acceptor acceptor_{context};
  asio::steady_timer pause_{context};
  std::map<int, std::shared_ptr<Watch>> watches_;
  std::vector<std::shared_ptr<Timer>> timers_;
  std::uint64_t last_id_ = 0;
  bool stopping_ = false;
};

// After our last word: what the other side still sends is let go for a moment, so that it gets to read that word, and the line
// ends with it, or without.
void discard(beast::tcp_stream& stream, const std::shared_ptr<std::array<char, 4096>>& into,
             const std::function<void()>& done) {
  stream.async_read_some(asio::buffer(*into), [&stream, into, done](error_code error, std::size_t) {
    if (error) return done();
    discard(stream, into, done);
  });
}

void end_in_order(beast::tcp_stream& tcp, const std::function<void()>& done) {
  tcp.expires_after(kFarewell);
  error_code ignored;
  tcp.socket().shutdown(Tcp::socket::shutdown_send, ignored);
  discard(tcp, std::make_shared<std::array<char, 4096>>(), done);
}

void close_at_once(beast::tcp_stream& stream) {
  error_code ignored;
  stream.socket().set_option(asio::socket_base::linger(true, 0),
                             ignored);  // the kernel keeps nothing for it either
  stream.close();
}

// One WebSocket.
class Socket : public AnyConnection, public std::enable_shared_from_this<Socket> {
 public:
  Socket(Hub& hub, Client id, beast::tcp_stream&& stream) : hub_(hub), id_(id), socket_(std::move(stream)) {
    hub_.enter(id_, this);
  }
  ~Socket() override {
    if (open_) --hub_.clients;  // the program ends, or a handler threw
    hub_.leave(id_, this);
  }

  void accept(http::request<http::empty_body> request) {
    request_ = std::move(request);
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout{kHeadTime, kSilence, true});
    socket_.read_message_max(kLongestText);
    socket_.auto_fragment(false);
    socket_.async_accept(request_, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->open_ = true;
      self->hub_.opened(self->id_, self.get());
      self->read();
    });
  }

  void send(const Message& message) override {
    if (!open_ || dropped_ || ending_) return;
    if (waiting_bytes_ + message.bytes->size() > kLongestQueue) {
      dropped_ = true;
      ++hub_.dropped;
      return give_up();
    }
    waiting_bytes_ += message.bytes->size();
    queue_.push_back(message);
    if (queue_.size() == 1) write();
  }

  void give_up() override { close_at_once(beast::get_lowest_layer(socket_)); }

  void farewell() override {
    if (!open_ || dropped_) return give_up();
    ending_ = true;
    if (queue_.empty()) close();
  }

  bool known() const override { return true; }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->gone();
      self->take();
      self->read();
    });
  }

  void take() {
    const auto* bytes = static_cast<const std::uint8_t*>(buffer_.data().data());
    const std::size_t size = buffer_.size();
    if (socket_.got_text())
      hub_.text(id_, {reinterpret_cast<const char*>(bytes), size});
    else
      hub_.binary(id_, {bytes, size});
    buffer_.consume(size);
  }

  void write() {
    socket_.text(queue_.front().text);
    socket_.async_write(asio::buffer(*queue_.front().bytes),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          if (error) return self->give_up();
                          self->written();
                        });
  }

  void written() {
    waiting_bytes_ -= queue_.front().bytes->size();
    queue_.pop_front();
    if (dropped_) return;
    if (!queue_.empty()) return write();
    if (ending_) close();
  }

  void close() {
    socket_.async_close(websocket::close_code::going_away, [self = shared_from_this()](error_code) {});
  }

  void gone() {
    open_ = false;
    hub_.closed(id_);
  }

  Hub& hub_;
  const Client id_;
  websocket::stream<beast::tcp_stream> socket_;
  http::request<http::empty_body> request_;
  beast::flat_buffer buffer_;
  std::deque<Message> queue_;  // the first is being written
  std::size_t waiting_bytes_ = 0;
  bool open_ = false;
  bool dropped_ = false;
  bool ending_ = false;  // once what waits is written
};

// One connection, request after request, until it becomes a socket.
class Connection : public AnyConnection, public std::enable_shared_from_this<Connection> {
 public:
  Connection(Hub& hub, std::uint64_t id, Tcp::socket&& socket)
      : hub_(hub), id_(id), stream_(std::move(socket)), parser_(std::in_place) {
    hub_.enter(id_, this);
  }
  ~Connection() override { hub_.leave(id_, this); }

  void start() { read_head(kHeadTime); }
  void turn_away() {
    say(http::status::service_unavailable, "too many connections: close a tab of this page", false);
  }

  void give_up() override { close_at_once(stream_); }
  void farewell() override { give_up(); }
  bool known() const override { return known_; }

 private:
  template <class Body>
  struct Answer {
    explicit Answer(http::response<Body>&& what) : response(std::move(what)) {}
    http::response<Body> response;
    http::response_serializer<Body> serializer{response};
  };

  void read_head(seconds time) {
    parser_.emplace();
    parser_->header_limit(kLongestHead);
    parser_->body_limit(boost::none);  // a body is refused, not read
    stream_.expires_after(time);
    http::async_read_header(
        stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
          if (!error) return self->answer();
          if (error == http::error::header_limit || error == http::error::buffer_overflow)
            return self->refuse(http::status::request_header_fields_too_large,
                                "the head is too long: 8192 bytes at most");
          if (error.category() == make_error_code(http::error::bad_target).category() &&
              error != http::error::end_of_stream && error != http::error::partial_message)
            self->refuse(http::status::bad_request, "this is no request that HTTP knows");
        });
  }

  void answer() {
    const auto& head = parser_->get();
    if (const char* why = foreign()) return refuse(http::status::forbidden, why);
    Target target = read_target({head.target().data(), head.target().size()}, hub_.token());
    if (target.kind == Target::Kind::foreign)
      return refuse(http::status::forbidden,
                    "the token is missing or another: open the address that the program printed");
    known_ = true;
    if (head.method() != http::verb::get && head.method() != http::verb::head)
      return refuse(http::status::method_not_allowed,
                    "only GET and HEAD: everything else goes through the socket");
    if (!parser_->is_done()) return refuse(http::status::payload_too_large, "a request holds no body");
    route(std::move(target));
  }

  // Why the request is not from our own page or a program of this machine; null where it may be.
  const char* foreign() {
    const auto& head = parser_->get();
    if (head.count(http::field::host) != 1) return "there must be one Host";
    const auto host = head[http::field::host];
    if (!hub_.is_ours({host.data(), host.size()}))
      return "another Host than the one that listens: open the address that the program printed";
    const auto origins = head.count(http::field::origin);
    if (origins == 0) return nullptr;
    const auto origin = head[http::field::origin];
    if (origins > 1 || !is_origin_of({origin.data(), origin.size()}, {host.data(), host.size()}))
      return "a page of another Origin has no access";
    return nullptr;
  }

  void route(Target target) {
    switch (target.kind) {
      case Target::Kind::bare:
        return redirect();
      case Target::Kind::asset:
        return give_asset(target.name);
      case Target::Kind::file:
        return give_file(target.name);
      case Target::Kind::socket:
        return upgrade();
      default:
        return say(http::status::not_found, "there is no such file", keeps_alive());
    }
  }

  bool keeps_alive() const { return parser_->get().keep_alive(); }

  template <class Body>
  http::response<Body> response(http::status status, std::string_view type, bool keep_alive) {
    http::response<Body> out{status, parser_->get().version() == 10 ? 10U : 11U};
    set_headers(out, kPagePolicy);
    out.set(http::field::content_type, {type.data(), type.size()});
    out.keep_alive(keep_alive);
    return out;
  }

  void refuse(http::status status, const char* why) {
    ++hub_.refused;
    say(status, why, false);
  }

  void say(http::status status, const char* why, bool keep_alive) {
    auto out = response<http::string_body>(status, "text/plain; charset=utf-8", keep_alive);
    if (status == http::status::method_not_allowed) out.set(http::field::allow, "GET, HEAD");
    if (status == http::status::upgrade_required) out.set(http::field::upgrade, "websocket");
    out.body() = fmt::format("{}: {}\n", static_cast<unsigned>(status), why);
    give(std::move(out));
  }

  void redirect() {
    auto out = response<http::string_body>(http::status::permanent_redirect, "text/plain", keeps_alive());
    out.set(http::field::location, fmt::format("/{}/", hub_.token()));
    give(std::move(out));
  }

  void give_asset(const std::string& name) {
    const auto all = assets();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Asset& asset) { return asset.name == name; });
    if (found == all.end()) return say(http::status::not_found, "there is no such file", keeps_alive());
    auto out = response<http::span_body<const char>>(http::status::ok, found->type, keeps_alive());
    out.body() = {found->bytes.data(), found->bytes.size()};
    give(std::move(out));
  }

  void give_file(const std::string& name) {
    const int descriptor = hub_.files().empty() ? -1 : io::open_beneath(hub_.files(), name);
    if (descriptor < 0) return say(http::status::not_found, "there is no such file", keeps_alive());
    beast::file_posix file;
    file.native_handle(descriptor);
    auto out = response<http::basic_file_body<beast::file_posix>>(http::status::ok, type_of_file(name),
                                                                  keeps_alive());
    out.set("Content-Security-Policy", file_policy());
    error_code error;
    out.body().reset(std::move(file), error);
    if (error) return say(http::status::not_found, "the file cannot be read", keeps_alive());
    give(std::move(out));
  }

  void upgrade() {
    const auto& head = parser_->get();
    if (!websocket::is_upgrade(head))
      return say(http::status::upgrade_required, "this is the WebSocket", false);
    if (buffer_.size() > 0)
      return refuse(http::status::bad_request, "nothing is sent before the socket is open");
    std::make_shared<Socket>(hub_, id_, std::move(stream_))->accept(parser_->release());
  }

  template <class Body>
  void give(http::response<Body>&& response) {
    response.prepare_payload();
    const bool head_only = parser_->is_header_done() && parser_->get().method() == http::verb::head;
    auto answer = std::make_shared<Answer<Body>>(std::move(response));
    answer->serializer.split(head_only);
    write(answer, head_only);
  }

  template <class Body>
  void write(const std::shared_ptr<Answer<Body>>& answer, bool head_only) {
    stream_.expires_after(kStallTime);
    http::async_write_some(stream_, answer->serializer,
                           [self = shared_from_this(), answer, head_only](error_code error, std::size_t) {
                             if (error) return;
                             auto& serializer = answer->serializer;
                             if (!(head_only ? serializer.is_header_done() : serializer.is_done()))
                               return self->write(answer, head_only);
                             if (answer->response.keep_alive()) return self->read_head(kIdleTime);
                             end_in_order(self->stream_, [self] {});
                           });
  }

  Hub& hub_;
  const std::uint64_t id_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{2 * kLongestHead};
  std::optional<http::request_parser<http::empty_body>> parser_;
  bool known_ = false;
};

Hub::Hub(const ServerOptions& options, Handlers handlers)
    : handlers_(std::move(handlers)), token_(checked_token(options.token)), files_(options.files) {
  open(options.port);
  accept();
}

void Hub::open(unsigned short port) {
  error_code error;
  const Tcp::endpoint end(asio::ip::address_v4::loopback(), port);
  acceptor_.open(end.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(end, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw io::InputError(fmt::format(
        "port {} is in use: close the program that listens there, or give another port, or 0 for any", port));
  if (error == asio::error::access_denied)
    throw io::InputError(
        fmt::format("port {}: permission denied: give a port above 1023, or 0 for any", port));
  if (error) throw io::InputError(fmt::format("port {}: cannot be listened on: {}", port, error.message()));
  here_ = acceptor_.local_endpoint();
}

// The caller's descriptors stay open.
Hub::~Hub() {
  while (!watches_.empty()) unwatch(watches_.begin()->first);
}

std::string Hub::url() const { return fmt::format("http://127.0.0.1:{}/{}/", here_.port(), token_); }

// The name in Host, without its port: this machine's to itself. A name that somebody else points at this machine is none.
bool Hub::is_ours(std::string_view host) const {
  const std::string port = fmt::format(":{}", here_.port());
  if (host.ends_with(port))
    host.remove_suffix(port.size());
  else if (here_.port() != 80)
    return false;
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

void Hub::accept() {
  acceptor_.async_accept([this](error_code error, Tcp::socket socket) {
    if (stopping_ || error == asio::error::operation_aborted) return;
    if (!error) {
      accepted(std::move(socket));
      return accept();
    }
    pause_.expires_after(std::chrono::milliseconds(100));  // no descriptors are left, say
    pause_.async_wait([this](error_code ended) {
      if (!ended) accept();
    });
  });
}

// Where all places are taken, the oldest connection that has not shown the token goes.
bool Hub::make_room() {
  if (connections_.size() < static_cast<std::size_t>(kMostClients)) return true;
  const auto unknown = std::find_if(connections_.begin(), connections_.end(),
                                    [](const auto& entry) { return !entry.second->known(); });
  if (unknown == connections_.end()) return false;
  AnyConnection* connection = unknown->second;
  connections_.erase(unknown);
  connection->give_up();
  return true;
}

void Hub::accepted(Tcp::socket socket) {
  error_code ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  if (make_room()) return std::make_shared<Connection>(*this, ++last_id_, std::move(socket))->start();
  ++refused;
  if (turned_away_ < kMostTurnedAway)
    std::make_shared<Connection>(*this, kTurnedAway, std::move(socket))->turn_away();
}

void Hub::leave(std::uint64_t id, const AnyConnection* connection) {
  if (id == kTurnedAway) --turned_away_;
  const auto found = connections_.find(id);
  if (found != connections_.end() && found->second == connection) connections_.erase(found);
  const auto socket = sockets_.find(id);
  if (socket != sockets_.end() && socket->second == connection) sockets_.erase(socket);
}

void Hub::opened(Client client, AnyConnection* connection) {
  sockets_[client] = connection;
  ++clients;
  if (handlers_.opened) handlers_.opened(client);
}

void Hub::closed(Client client) {
  sockets_.erase(client);
  --clients;
  if (handlers_.closed) handlers_.closed(client);
  if (stopping_ && sockets_.empty()) context.stop();
}

void Hub::send(Client to, std::string text) {
  const auto found = sockets_.find(to);
  if (found != sockets_.end())
    found->second->send({std::make_shared<const std::string>(std::move(text)), true});
}

void Hub::send_all(std::string bytes, bool text) {
  const Message message{std::make_shared<const std::string>(std::move(bytes)), text};
  for (const auto& [client, socket] : sockets_) socket->send(message);
}

void Hub::watch(int descriptor, std::function<void()> readable) {
  unwatch(descriptor);
  auto watch = std::make_shared<Watch>(context, descriptor);
  watch->readable = std::move(readable);
  watches_[descriptor] = watch;
  wait(watch);
}

void Hub::unwatch(int descriptor) {
  const auto found = watches_.find(descriptor);
  if (found == watches_.end()) return;
  found->second->ended = true;
  found->second->stream.release();  // the descriptor stays the caller's
  watches_.erase(found);
}

void Hub::wait(const std::shared_ptr<Watch>& watch) {
  watch->stream.async_wait(asio::posix::stream_descriptor::wait_read, [this, watch](error_code error) {
    if (error || watch->ended) return;
    watch->readable();
    if (!watch->ended) wait(watch);
  });
}

void Hub::every(double period_s, std::function<void()> tick) {
  auto timer = std::make_shared<Timer>(context);
  timer->period = std::chrono::nanoseconds(std::llround(std::max(period_s, 1e-3) * 1e9));
  timer->tick = std::move(tick);
  timer->timer.expires_after(timer->period);
  timers_.push_back(timer);
  wait(timer);
}

// Ticks that the thread had no time for are left out.
void Hub::wait(const std::shared_ptr<Timer>& timer) {
  timer->timer.async_wait([this, timer](error_code error) {
    if (error) return;
    timer->tick();
    timer->timer.expires_at(
        std::max(timer->timer.expiry() + timer->period, std::chrono::steady_clock::now()));
    wait(timer);
  });
}

void Hub::end() {
  if (std::exchange(stopping_, true)) return;
  error_code ignored;
  acceptor_.close(ignored);
  const auto all = connections_;
  for (const auto& [id, connection] : all) connection->farewell();
  pause_.expires_after(sockets_.empty() ? std::chrono::milliseconds(0) : std::chrono::milliseconds(200));
  pause_.async_wait([this](error_code) { context.stop(); });
}

}  // namespace

std::unique_ptr<Server> Server::listen(const ServerOptions& options, Handlers handlers) {
  return std::make_unique<Hub>(options, std::move(handlers));
}

}  // namespace flexor::live
