// The server of the live view: one page, files of the sessions' folder, and a WebSocket (SOCKET.md), on one thread.
//
// Every request and every socket is checked: the token, first part of the path; Host, which must be where the server
// listens (this machine's own names on the loopback); Origin, where there is one, which must be its own. GET and HEAD are
// all there is, and they change nothing. A path that leaves the sessions' folder, by dots, by links or by bytes that are no name, is not found. Heads, bodies,
// messages and queues are bounded; a client that does not read is dropped, not waited for. Where all places are taken, the
// oldest connection that has not shown the token makes room. Everything of Boost.Beast is in server.cpp.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace flexor::live {

using Client = std::uint64_t;  // a socket; never used twice

inline constexpr std::size_t kLongestMessage = 1 << 20;  // bytes, to the server
inline constexpr std::size_t kLongestQueue = 4U << 20U;  // bytes that wait for a client, dropped beyond
inline constexpr int kMostClients = 64;                  // connections; one more is answered 503

struct ServerOptions {
  unsigned short port = 0;      // of 127.0.0.1; 0: any
  std::filesystem::path files;  // the sessions' folder; empty: none are served
};

// What is left out does nothing.
struct Handlers {
  std::function<void(Client)> opened = [](Client) {};
  std::function<void(Client, std::string_view)> text = [](Client, std::string_view) {};
  std::function<void(Client, std::span<const std::uint8_t>)> binary = [](Client, auto) {};
};

class Connection;  // of server.cpp

class Server {
 public:
  // Listens. Throws io::InputError, one line with the mend: the port is taken.
  Server(const ServerOptions& options, Handlers handlers);

  std::string url() const;  // with the token

  // Queued, in order; on the server's thread, that is from handlers and what follows here, or before run(). What goes to a
  // client that has gone is forgotten. One copy serves all clients. Text must be UTF-8.
  void send(Client to, std::string text);
  void send_all(std::string text) { send_all(std::move(text), true); }
  void send_all(std::span<const std::uint8_t> bytes) {
    send_all(std::string(bytes.begin(), bytes.end()), false);
  }

  // On the server's thread: once `descriptor` is readable or has ended, again and again until what is returned goes, which comes
  // before its close and the server's end; every so often; as soon as it can, from any thread. The descriptor stays the caller's.
  std::shared_ptr<void> watch(int descriptor, std::function<void()> readable);
  void every(double period_s, std::function<void()> tick);
  void post(std::function<void()> work);

  void run() { context_.run(); }  // until stop(). What a handler throws comes out of it
  void stop();                    // from any thread, also from a signal's thread

  int clients() const { return clients_; }  // open sockets

 private:
  friend class Connection;

  bool is_ours(std::string_view host) const;
  void open(unsigned short port);
  boost::asio::awaitable<void> accept();
  bool make_room();
  void send_all(std::string bytes, bool text);

  // Before the context: what ends with it leaves these.
  std::map<Client, Connection*> connections_;  // oldest first
  Handlers handlers_;
  std::string token_;
  std::filesystem::path files_;
  boost::asio::ip::tcp::endpoint here_;
  std::atomic<int> clients_{0};
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_{context_};
  boost::asio::steady_timer pause_{context_};  // after what could not be accepted, and before the end
  Client last_id_ = 0;
  bool stopping_ = false;
};

}  // namespace flexor::live
