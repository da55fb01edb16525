#include "apps/live/server.hpp"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <map>
#include <random>
#include <set>

#include "host/io/io.hpp"

namespace flexor::live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using beast::error_code;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr auto kPatience = std::chrono::seconds(10);  // for a request, and for the end of a connection
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' blob: data:; "
    "media-src 'self' blob:; connect-src 'self'; font-src 'self'; worker-src 'self' blob:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

std::string new_token() {
  std::random_device random;
  std::string out;
  for (int i = 0; i < 4; ++i) out += fmt::format("{:08x}", random());
  return out;
}

// Takes as long for a wrong first letter as for a wrong last.
bool same(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char differs = 0;
  for (std::size_t i = 0; i < a.size(); ++i) differs = static_cast<unsigned char>(differs | (a[i] ^ b[i]));
  return differs == 0;
}

// What is sent to every socket is one text in memory.
struct Message {
  std::string bytes;
  bool text;
};
using Shared = std::shared_ptr<const Message>;

class Socket;

// What sockets and requests share.
struct Hub {
  Server::Handlers handlers;
  std::string token;
  std::set<std::string, std::less<>> hosts;
  std::set<Socket*> sockets;
  int connections = 0;

  // The status that a request deserves, and the path below the token.
  http::status judge(const Request& request, std::string& path) const;
};

http::status Hub::judge(const Request& request, std::string& path) const {
  const auto host = request[http::field::host];
  if (!hosts.contains(std::string_view(host.data(), host.size()))) return http::status::misdirected_request;
  const auto origin = request[http::field::origin];
  constexpr std::string_view kScheme = "http://";
  const std::string_view from(origin.data(), origin.size());
  if (!from.empty() && (!from.starts_with(kScheme) || !hosts.contains(from.substr(kScheme.size()))))
    return http::status::forbidden;
  const std::string_view target(request.target().data(), request.target().size());
  const std::size_t end = std::min(target.find('/', 1), target.size());
  if (target.empty() || target[0] != '/' || !same(target.substr(1, end - 1), token))
    return http::status::forbidden;
  path = target.substr(end);
  return http::status::ok;
}

class Socket : public std::enable_shared_from_this<Socket> {
 public:
  Socket(tcp::socket socket, Hub& hub) : stream_(std::move(socket)), hub_(hub) {
    stream_.read_message_max(kLongestMessage);
    stream_.auto_fragment(false);
    stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  }
  ~Socket() {
    hub_.sockets.erase(this);
    --hub_.connections;
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void accept(const Request& request) {
    stream_.async_accept(request, [self = shared_from_this()](const error_code& error) {
      if (error) return;
      self->hub_.sockets.insert(self.get());
      self->send(std::make_shared<const Message>(Message{self->hub_.handlers.greeting(), true}));
      self->read();
    });
  }

  void send(const Shared& message) {
    if (dropped_) return;
    waiting_ += message->bytes.size();
    if (waiting_ > kMostWaiting) return drop();
    queue_.push_back(message);
    if (queue_.size() == 1) write();
  }

 private:
  void drop() {
    dropped_ = true;
    hub_.sockets.erase(this);
    beast::get_lowest_layer(stream_).cancel();
    error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
  }

  void write() {
    stream_.text(queue_.front()->text);
    stream_.async_write(asio::buffer(queue_.front()->bytes),
                        [self = shared_from_this()](const error_code& error, std::size_t) {
                          if (error || self->dropped_) return self->drop();
                          self->waiting_ -= self->queue_.front()->bytes.size();
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) self->write();
                        });
  }

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (error || self->dropped_) return self->drop();
      const std::string message = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.clear();
      if (self->stream_.got_text()) {
        std::string answer = self->hub_.handlers.answer(message);
        if (!answer.empty()) self->send(std::make_shared<const Message>(Message{std::move(answer), true}));
      }
      self->read();
    });
  }

  websocket::stream<beast::tcp_stream> stream_;
  Hub& hub_;
  beast::flat_buffer buffer_;
  std::deque<Shared> queue_;
  std::size_t waiting_ = 0;
  bool dropped_ = false;
};

// One connection until it becomes a socket or ends.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Hub& hub) : stream_(std::move(socket)), hub_(hub) {}
  ~Connection() {
    if (!handed_on_) --hub_.connections;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    parser_.emplace();
    parser_->body_limit(kLongestMessage);
    parser_->header_limit(8192);
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const error_code& error, std::size_t) {
                       if (error == http::error::body_limit || error == http::error::header_limit)
                         return self->refuse(http::status::payload_too_large);
                       if (!error) self->take(self->parser_->release());
                     });
  }

 private:
  void take(const Request& request) {
    std::string path;
    const http::status status = hub_.judge(request, path);
    if (status != http::status::ok) return refuse(status);
    if (websocket::is_upgrade(request)) {
      if (path != "/live") return refuse(http::status::not_found);
      if (request[http::field::origin].empty()) return refuse(http::status::forbidden);
      stream_.expires_never();
      handed_on_ = true;
      std::make_shared<Socket>(stream_.release_socket(), hub_)->accept(request);
      return;
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(http::status::method_not_allowed);
    if (path.empty()) path = "/";
    answer(request, hub_.handlers.file(path));
  }

  void answer(const Request& request, const File& file) {
    if (file.type.empty()) return refuse(http::status::not_found);
    Response response{http::status::ok, request.version()};
    response.set(http::field::content_type, beast::string_view(file.type.data(), file.type.size()));
    if (file.gzipped) response.set(http::field::content_encoding, "gzip");
    if (request.method() == http::verb::get) response.body() = file.bytes;
    response.keep_alive(request.keep_alive());
    write(std::move(response));
  }

  void refuse(http::status status) {
    Response response{status, 11};
    response.set(http::field::content_type, "text/plain; charset=utf-8");
    response.body() = fmt::format("{}\n", static_cast<unsigned>(status));
    response.keep_alive(false);
    write(std::move(response));
  }

  void write(Response response) {
    response.set("Content-Security-Policy", kPolicy);
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set(http::field::cache_control, "no-store");
    response.prepare_payload();
    response_ = std::make_shared<Response>(std::move(response));
    stream_.expires_after(kPatience);
    http::async_write(stream_, *response_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (!error && self->response_->keep_alive()) return self->read();
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  beast::tcp_stream stream_;
  Hub& hub_;
  beast::flat_buffer buffer_{kLongestMessage + 16384};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<Response> response_;
  bool handed_on_ = false;
};

}  // namespace

struct Server::Beast {
  Hub hub;  // outlives what waits in the context
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::signal_set signals{context, SIGINT, SIGTERM};
  std::map<int, std::unique_ptr<asio::posix::stream_descriptor>> watched;
  std::deque<asio::steady_timer> timers;

  void accept() {
    acceptor.async_accept([this](const error_code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && hub.connections < kMostClients) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        ++hub.connections;
        std::make_shared<Connection>(std::move(socket), hub)->read();
      }
      accept();
    });
  }

  void wait(int descriptor, const std::function<void()>& ready) {
    const auto found = watched.find(descriptor);
    if (found == watched.end()) return;
    found->second->async_wait(asio::posix::stream_descriptor::wait_read,
                              [this, descriptor, ready](const error_code& error) {
                                if (error || !watched.contains(descriptor)) return;
                                ready();
                                wait(descriptor, ready);
                              });
  }

  void tick(asio::steady_timer& timer, std::chrono::nanoseconds period, const std::function<void()>& job) {
    timer.async_wait([this, &timer, period, job](const error_code& error) {
      if (error) return;
      job();
      timer.expires_at(std::max(timer.expiry() + period, std::chrono::steady_clock::now()));
      tick(timer, period, job);
    });
  }

  void send(const Shared& message) {
    const std::vector<Socket*> all(hub.sockets.begin(),
                                   hub.sockets.end());  // one that is dropped leaves the set
    for (Socket* socket : all) socket->send(message);
  }
};

Server::Server(const ServerOptions& options, Handlers handlers) : beast_(std::make_unique<Beast>()) {
  Beast& b = *beast_;
  b.hub.handlers = std::move(handlers);
  b.hub.token = options.token.empty() ? new_token() : options.token;
  error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  const tcp::endpoint end(address, options.port);
  if (!error) b.acceptor.open(end.protocol(), error);
  if (!error) b.acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) b.acceptor.bind(end, error);
  if (!error) b.acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    throw io::InputError(
        fmt::format("{}:{}: cannot be served: {}", options.address, options.port, error.message()));
  const unsigned short port = b.acceptor.local_endpoint().port();
  for (const std::string& name : {options.address, std::string("localhost")})
    b.hub.hosts.insert(fmt::format("{}:{}", name, port));
  b.accept();
}

Server::~Server() { beast_->context.stop(); }

std::string Server::url() const {
  const auto end = beast_->acceptor.local_endpoint();
  return fmt::format("http://{}:{}/{}/", end.address().to_string(), end.port(), beast_->hub.token);
}

std::size_t Server::clients() const { return beast_->hub.sockets.size(); }

void Server::send(const std::string& json) {
  beast_->send(std::make_shared<const Message>(Message{json, true}));
}

void Server::send(std::span<const std::uint8_t> bytes) {
  beast_->send(std::make_shared<const Message>(Message{{bytes.begin(), bytes.end()}, false}));
}

void Server::watch(int descriptor, std::function<void()> ready) {
  beast_->watched[descriptor] = std::make_unique<asio::posix::stream_descriptor>(beast_->context, descriptor);
  beast_->wait(descriptor, ready);
}

void Server::forget(int descriptor) {
  const auto found = beast_->watched.find(descriptor);
  if (found == beast_->watched.end()) return;
  found->second->release();  // who opened it closes it
  beast_->watched.erase(found);
}

void Server::every(double period_s, std::function<void()> job) {
  const auto period =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(period_s));
  beast_->timers.emplace_back(beast_->context, period);
  beast_->tick(beast_->timers.back(), period, job);
}

void Server::run() {
  beast_->signals.async_wait([this](const error_code& error, int) {
    if (!error) stop();
  });
  beast_->context.run();
}

void Server::stop() { beast_->context.stop(); }

}  // namespace flexor::live
