// The server of the live view: one page, files of the sessions' folder, and a WebSocket (SOCKET.md), on one thread.
//
// Every request and every socket is checked: the token, first part of the path; Host, which must be where the server
// listens (this machine's own names on the loopback); Origin, where there is one, which must be its own. GET and HEAD are
// all there is, and they change nothing. A path that leaves the sessions' folder, by dots, by links or by bytes that are no name, is not found. Heads, bodies,
// messages and queues are bounded; a client that does not read is dropped, not waited for. Where all places are taken, the
// oldest connection that has not shown the token makes room. Everything of Boost.Beast is in server.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace flexor::live {

using Client = std::uint64_t;  // a socket; never used twice

inline constexpr std::size_t kLongestText = 1 << 20;    // bytes of a message to the server
inline constexpr std::size_t kLongestBinary = 1 << 20;  // likewise
inline constexpr std::size_t kLongestQueue = 4
                                             << 20;  // bytes that wait for a client, which is dropped beyond
inline constexpr int kMostClients = 64;              // connections; one more is answered 503

struct ServerOptions {
  unsigned short port = 0;      // of 127.0.0.1; 0: any
  std::string token;            // empty: 128 random bits, as hexadecimal digits
  std::filesystem::path files;  // the sessions' folder; empty: none are served
};

struct Handlers {
  std::function<void(Client)> opened;
  std::function<void(Client, std::string_view)> text;
  std::function<void(Client, std::span<const std::uint8_t>)> binary;
  std::function<void(Client)> closed;
};

class Server {
 public:
  // Listens. Throws io::InputError, one line with the mend: the port is taken.
  static std::unique_ptr<Server> listen(const ServerOptions& options, Handlers handlers);
  Server() = default;
  virtual ~Server() = default;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  virtual std::string url() const = 0;  // with the token

  // Queued, in order; on the server's thread, that is from handlers and what follows here, or before run(). What goes to a
  // client that has gone is forgotten. One copy serves all clients. Text must be UTF-8.
  virtual void send(Client to, std::string text) = 0;
  virtual void send_all(std::string text) = 0;
  virtual void send_all(std::span<const std::uint8_t> bytes) = 0;

  // On the server's thread: once `descriptor` is readable or has ended, again and again until unwatch, which comes before its
  // close; every so often; as soon as it can, from any thread. The descriptor stays the caller's.
  virtual void watch(int descriptor, std::function<void()> readable) = 0;
  virtual void unwatch(int descriptor) = 0;
  virtual void every(double period_s, std::function<void()> tick) = 0;
  virtual void post(std::function<void()> work) = 0;

  virtual void run() = 0;   // until stop(). What a handler throws comes out of it
  virtual void stop() = 0;  // from any thread, also from a signal's thread

  struct Counts {
    std::uint64_t refused = 0;  // requests and sockets
    std::uint64_t dropped = 0;  // clients that did not read
    int clients = 0;            // open sockets
  };
  virtual Counts counts() const = 0;
};

}  // namespace flexor::live
