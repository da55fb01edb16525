#include "apps/live/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <deque>
#include <random>
#include <tuple>

#include "apps/live/assets.hpp"
#include "apps/live/request.hpp"
#include "host/io/beneath.hpp"
#include "host/io/io.hpp"
#include "host/io/serial.hpp"
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
    64;                            // connections that get that answer; more are closed without a word
constexpr seconds kHeadTime{10};   // to send a head, and to agree on a WebSocket
constexpr seconds kIdleTime{30};   // between two requests
constexpr seconds kStallTime{30};  // for a part of an answer
constexpr seconds kSilence{30};    // of a socket, which is asked after half of it
constexpr seconds kFarewell{1};

// wasm-unsafe-eval: what runs the markerless model is WebAssembly. It allows that alone, no eval of text.
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self' blob:; media-src 'self' blob:; font-src 'self'; worker-src 'self' blob:; base-uri "
    "'none'; form-action 'none'; frame-ancestors 'none'";
// What lies in the sessions' folder may come from anybody: it is shown, has no origin to ask from, and runs nothing but the charts
// of our own reports.
const std::string& file_policy() {
  static const std::string policy = "sandbox allow-scripts; default-src 'none'; script-src " +
                                    report::report_script_source() +
                                    "; style-src 'unsafe-inline'; img-src data:; media-src 'self'; base-uri "
                                    "'none'; form-action 'none'; frame-ancestors 'none'";
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

// What is awaited gives its error beside its result; what a handler throws comes out of run().
constexpr auto kResult = asio::as_tuple(asio::use_awaitable);
void rethrow(const std::exception_ptr& thrown) {
  if (thrown) std::rethrow_exception(thrown);
}

// 128 bits, as hexadecimal digits.
std::string random_token() {
  std::random_device bits(kRandomBits);
  std::string token;
  for (int word = 0; word < 4; ++word) token += fmt::format("{:08x}", bits());
  return token;
}

}  // namespace

// One connection, request after request, until it becomes a WebSocket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Server& server, Client id, Tcp::socket&& socket, bool place)
      : has_place(place), server_(server), id_(id), socket_(std::move(socket)) {
    server_.connections_[id_] = this;
  }
  ~Connection() {
    if (is_open_) --server_.clients_;  // the program ends, or a handler threw
    server_.connections_.erase(id_);
  }

  void start() { spawn(&Connection::serve); }
  bool is_known() const { return is_known_; }  // has shown the token

  void send(const Message& message) {
    if (!is_open_ || dropped_ || ending_) return;
    if (waiting_bytes_ + message.bytes->size() > kLongestQueue) {
      dropped_ = true;
      return give_up();
    }
    waiting_bytes_ += message.bytes->size();
    queue_.push_back(message);
    if (queue_.size() == 1) spawn(&Connection::write);
  }

  // At once.
  void give_up() {
    error_code ignored;
    line().socket().set_option(asio::socket_base::linger(true, 0),
                               ignored);  // the kernel keeps nothing for it either
    line().close();
  }

  // The program ends: once what waits is written.
  void farewell() {
    if (!is_open_ || dropped_) return give_up();
    ending_ = true;
    if (queue_.empty()) close();
  }

  const bool has_place;  // else it is answered that there is none

 private:
  beast::tcp_stream& line() { return socket_.next_layer(); }

  // A part of it, which it outlives.
  void spawn(asio::awaitable<void> (Connection::*part)()) {
    const auto run = [](std::shared_ptr<Connection> self, auto of) -> asio::awaitable<void> {
      co_await (self.get()->*of)();
    };
    asio::co_spawn(socket_.get_executor(), run(shared_from_this(), part), rethrow);
  }

  asio::awaitable<void> serve() {
    bool goes_on = has_place;
    if (!goes_on)
      co_await reply(http::status::service_unavailable, "too many connections: close a tab of this page");
    for (seconds patience = kHeadTime; goes_on; patience = kIdleTime) goes_on = co_await next(patience);
    if (!socket_.is_open() && line().socket().is_open()) co_await end_in_order();
  }

  // A request and its answer: whether another may follow.
  asio::awaitable<bool> next(seconds patience) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kLongestHead);
    parser.body_limit(boost::none);  // a body is refused, not read
    line().expires_after(patience);
    const auto [error, bytes] = co_await http::async_read_header(line(), buffer_, parser, kResult);
    head_ = parser.is_header_done() ? parser.get() : http::request<http::empty_body>();
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      co_return co_await reply(http::status::request_header_fields_too_large,
                               "the head is too long: 8192 bytes at most");
    const bool is_http = error.category() == make_error_code(http::error::bad_target).category();
    if (is_http && error != http::error::end_of_stream && error != http::error::partial_message)
      co_return co_await reply(http::status::bad_request, "this is no request that HTTP knows");
    if (error) {
      give_up();
      co_return false;
    }
    co_return co_await answer(parser.is_done());
  }

  asio::awaitable<bool> answer(bool is_whole) {
    if (const char* why = foreign()) co_return co_await reply(http::status::forbidden, why);
    const Target target = read_target({head_.target().data(), head_.target().size()}, server_.token_);
    if (target.kind == Target::Kind::foreign)
      co_return co_await reply(http::status::forbidden,
                               "the token is missing or another: open the address that the program printed");
    is_known_ = true;
    if (head_.method() != http::verb::get && head_.method() != http::verb::head)
      co_return co_await reply(http::status::method_not_allowed,
                               "only GET and HEAD: everything else goes through the socket");
    if (!is_whole) co_return co_await reply(http::status::payload_too_large, "a request holds no body");
    switch (target.kind) {
      case Target::Kind::bare:
        co_return co_await redirect();
      case Target::Kind::asset:
        co_return co_await give_asset(target.name);
      case Target::Kind::file:
        co_return co_await give_file(target.name);
      case Target::Kind::socket:
        co_return co_await upgrade();
      default:
        co_return co_await not_found();
    }
  }

  // Why the request is not from our own page or a program of this machine; null where it may be.
  const char* foreign() const {
    if (head_.count(http::field::host) != 1) return "there must be one Host";
    const auto host = head_[http::field::host];
    if (!server_.is_ours({host.data(), host.size()}))
      return "another Host than the one that listens: open the address that the program printed";
    const auto origins = head_.count(http::field::origin);
    if (origins == 0) return nullptr;
    const auto origin = head_[http::field::origin];
    if (origins > 1 || !is_origin_of({origin.data(), origin.size()}, {host.data(), host.size()}))
      return "a page of another Origin has no access";
    return nullptr;
  }

  template <class Body>
  http::response<Body> response(http::status status, std::string_view type, bool keep_alive) {
    http::response<Body> out{status, head_.version() == 10 ? 10U : 11U};
    set_headers(out, kPagePolicy);
    out.set(http::field::content_type, {type.data(), type.size()});
    out.keep_alive(keep_alive);
    return out;
  }

  asio::awaitable<bool> not_found() {
    return reply(http::status::not_found, "there is no such file", head_.keep_alive());
  }

  asio::awaitable<bool> reply(http::status status, const char* why, bool keep_alive = false) {
    auto out = response<http::string_body>(status, "text/plain; charset=utf-8", keep_alive);
    if (status == http::status::method_not_allowed) out.set(http::field::allow, "GET, HEAD");
    if (status == http::status::upgrade_required) out.set(http::field::upgrade, "websocket");
    out.body() = fmt::format("{}: {}\n", static_cast<unsigned>(status), why);
    return give(std::move(out));
  }

  asio::awaitable<bool> redirect() {
    auto out =
        response<http::string_body>(http::status::permanent_redirect, "text/plain", head_.keep_alive());
    out.set(http::field::location, fmt::format("/{}/", server_.token_));
    return give(std::move(out));
  }

  asio::awaitable<bool> give_asset(const std::string& name) {
    const auto found = std::ranges::find(assets(), name, &Asset::name);
    if (found == assets().end()) return not_found();
    auto out =
        response<http::span_body<const char>>(http::status::ok, type_of_asset(name), head_.keep_alive());
    out.body() = {found->bytes.data(), found->bytes.size()};
    return give(std::move(out));
  }

  asio::awaitable<bool> give_file(const std::string& name) {
    const int descriptor = server_.files_.empty() ? -1 : io::open_beneath(server_.files_, name);
    if (descriptor < 0) return not_found();
    beast::file_stdio file;
    file.native_handle(::fdopen(descriptor, "rb"));
    auto out = response<http::basic_file_body<beast::file_stdio>>(http::status::ok, type_of_file(name),
                                                                  head_.keep_alive());
    out.set("Content-Security-Policy", file_policy());
    error_code error;
    out.body().reset(std::move(file), error);
    if (error) return not_found();
    return give(std::move(out));
  }

  template <class Body>
  asio::awaitable<bool> give(http::response<Body> out) {
    out.prepare_payload();
    const bool head_only = head_.method() == http::verb::head;
    http::response_serializer<Body> serializer{out};
    serializer.split(head_only);
    error_code error;
    while (!error && !(head_only ? serializer.is_header_done() : serializer.is_done())) {
      line().expires_after(kStallTime);
      std::tie(error, std::ignore) = co_await http::async_write_some(line(), serializer, kResult);
    }
    if (error) give_up();
    co_return !error && out.keep_alive();
  }

  // After our last word: what the other side still sends is let go for a moment, so that it gets to read that word, and the
  // line ends with it, or without.
  asio::awaitable<void> end_in_order() {
    line().expires_after(kFarewell);
    error_code error;
    line().socket().shutdown(Tcp::socket::shutdown_send, error);
    std::array<char, 4096> unread{};
    while (!error)
      std::tie(error, std::ignore) = co_await line().async_read_some(asio::buffer(unread), kResult);
  }

  asio::awaitable<bool> upgrade() {
    if (!websocket::is_upgrade(head_))
      co_return co_await reply(http::status::upgrade_required, "this is the WebSocket");
    if (buffer_.size() > 0)
      co_return co_await reply(http::status::bad_request, "nothing is sent before the socket is open");
    line().expires_never();
    socket_.set_option(websocket::stream_base::timeout{kHeadTime, kSilence, true});
    socket_.read_message_max(kLongestMessage);
    socket_.auto_fragment(false);
    auto [error] = co_await socket_.async_accept(head_, kResult);
    if (error) co_return false;
    is_open_ = true;
    ++server_.clients_;
    server_.handlers_.opened(id_);
    for (beast::flat_buffer message;; message.clear()) {
      std::tie(error, std::ignore) = co_await socket_.async_read(message, kResult);
      if (error) break;
      take(message);
    }
    is_open_ = false;
    --server_.clients_;
    if (server_.stopping_ && server_.clients_ == 0) server_.context_.stop();
    co_return false;
  }

  void take(const beast::flat_buffer& message) {
    const auto* bytes = static_cast<const std::uint8_t*>(message.data().data());
    if (socket_.got_text())
      server_.handlers_.text(id_, {reinterpret_cast<const char*>(bytes), message.size()});
    else
      server_.handlers_.binary(id_, {bytes, message.size()});
  }

  // Until nothing waits.
  asio::awaitable<void> write() {
    while (!queue_.empty()) {
      socket_.text(queue_.front().text);
      const auto [error, size] = co_await socket_.async_write(asio::buffer(*queue_.front().bytes), kResult);
      if (error || dropped_) co_return give_up();
      waiting_bytes_ -= size;
      queue_.pop_front();
    }
    if (ending_) close();
  }

  void close() {
    socket_.async_close(websocket::close_code::going_away, [self = shared_from_this()](error_code) {});
  }

  Server& server_;
  const Client id_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_{2 * kLongestHead};
  http::request<http::empty_body> head_;  // of the request that is answered
  std::deque<Message> queue_;             // the first is being written
  std::size_t waiting_bytes_ = 0;
  bool is_known_ = false;
  bool is_open_ = false;
  bool dropped_ = false;
  bool ending_ = false;
};

Server::Server(const ServerOptions& options, Handlers handlers)
    : handlers_(std::move(handlers)), token_(random_token()), files_(options.files) {
  open(options.port);
  asio::co_spawn(context_, accept(), rethrow);
}

void Server::open(unsigned short port) {
  error_code error;
  const Tcp::endpoint end(asio::ip::address_v4::loopback(), port);
  acceptor_.open(end.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(end, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw io::InputError(
        "port {} is in use: close the program that listens there, or give another port, or 0 for any", port);
  if (error == asio::error::access_denied)
    throw io::InputError("port {}: permission denied: give a port above 1023, or 0 for any", port);
  if (error) throw io::InputError("port {}: cannot be listened on: {}", port, error.message());
  here_ = acceptor_.local_endpoint();
}

std::string Server::url() const { return fmt::format("http://127.0.0.1:{}/{}/", here_.port(), token_); }

// The name in Host, without its port: this machine's to itself. A name that somebody else points at this machine is none.
bool Server::is_ours(std::string_view host) const {
  const std::string port = fmt::format(":{}", here_.port());
  if (host.ends_with(port))
    host.remove_suffix(port.size());
  else if (here_.port() != 80)
    return false;
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

asio::awaitable<void> Server::accept() {
  for (;;) {
    auto [error, socket] = co_await acceptor_.async_accept(kResult);
    if (stopping_) co_return;
    if (error) {  // no descriptors are left, for example
      pause_.expires_after(std::chrono::milliseconds(100));
      co_await pause_.async_wait(kResult);
      continue;
    }
    socket.set_option(Tcp::no_delay(true), error);
    const bool has_place = make_room();
    if (connections_.size() < kMostClients + kMostTurnedAway)
      std::make_shared<Connection>(*this, ++last_id_, std::move(socket), has_place)->start();
  }
}

// Where all places are taken, the oldest connection that has not shown the token goes.
bool Server::make_room() {
  const auto has_place = [](const auto& entry) { return entry.second->has_place; };
  if (std::ranges::count_if(connections_, has_place) < kMostClients) return true;
  const auto unknown = std::ranges::find_if(
      connections_, [&](const auto& entry) { return has_place(entry) && !entry.second->is_known(); });
  if (unknown == connections_.end()) return false;
  Connection* connection = unknown->second;
  connections_.erase(unknown);
  connection->give_up();
  return true;
}

void Server::send(Client to, std::string text) {
  const auto found = connections_.find(to);
  if (found != connections_.end())
    found->second->send({std::make_shared<const std::string>(std::move(text)), true});
}

void Server::send_all(std::string bytes, bool text) {
  const Message message{std::make_shared<const std::string>(std::move(bytes)), text};
  for (const auto& [id, connection] : connections_) connection->send(message);
}

std::shared_ptr<void> Server::watch(int descriptor, std::function<void()> readable) {
  return io::watch(context_, descriptor, std::move(readable));
}

// Ticks that the thread had no time for are left out.
void Server::every(double period_s, std::function<void()> tick) {
  const auto again = [](asio::steady_timer timer, std::chrono::nanoseconds period,
                        std::function<void()> act) -> asio::awaitable<void> {
    for (;;) {
      timer.expires_at(std::max(timer.expiry() + period, std::chrono::steady_clock::now()));
      co_await timer.async_wait(asio::use_awaitable);
      act();
    }
  };
  const std::chrono::nanoseconds period(std::llround(std::max(period_s, 1e-3) * 1e9));
  asio::steady_timer timer(context_, std::chrono::steady_clock::now());
  asio::co_spawn(context_, again(std::move(timer), period, std::move(tick)), rethrow);
}

void Server::post(std::function<void()> work) { asio::post(context_, std::move(work)); }

void Server::stop() {
  post([this] {
    if (std::exchange(stopping_, true)) return;
    error_code ignored;
    acceptor_.close(ignored);
    const auto all = connections_;
    for (const auto& [id, connection] : all) connection->farewell();
    pause_.expires_after(clients_ == 0 ? std::chrono::milliseconds(0) : std::chrono::milliseconds(200));
    pause_.async_wait([this](error_code) { context_.stop(); });
  });
}

}  // namespace flexor::live
