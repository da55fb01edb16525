// The page's server: files by HTTP and messages by WebSocket, on the loopback, in one thread with whatever else waits.
//
// Whoever asks must know the token, which is the first part of every path: /TOKEN/app.js, and must name this server
// in Host and, where there is one, in Origin: a page of somebody else's in the same browser gets nothing. Nothing
// changes by GET. A client that does not read is dropped when kMostWaiting bytes wait for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace flexor::live {

inline constexpr std::size_t kMostWaiting = 4 << 20;     // bytes for one client
inline constexpr std::size_t kLongestMessage = 1 << 16;  // bytes from a client
inline constexpr int kMostClients = 64;

struct File {
  std::string_view type;  // MIME
  std::string_view bytes;
  bool gzipped = false;
};

struct ServerOptions {
  std::string address = "127.0.0.1";
  unsigned short port = 0;  // 0: any that is free
  std::string token;        // empty: a new one, 128 bits
};

class Server {
 public:
  struct Handlers {
    // A path below the token, "/" for the page; null type: there is none.
    std::function<File(std::string_view path)> file;
    std::function<std::string()> greeting;                        // for a socket that has just opened; JSON
    std::function<std::string(std::string_view message)> answer;  // to a client's JSON; empty: none
  };

  // Throws io::InputError: the address cannot be bound.
  Server(const ServerOptions& options, Handlers handlers);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::string url() const;
  std::size_t clients() const;

  // To every socket.
  void send(const std::string& json);
  void send(std::span<const std::uint8_t> bytes);

  // Calls `ready` when `descriptor` has something to read, until forget().
  void watch(int descriptor, std::function<void()> ready);
  void forget(int descriptor);
  void every(double period_s, std::function<void()> job);

  // Until stop() or SIGINT, SIGTERM.
  void run();
  void stop();

 private:
  struct Beast;
  std::unique_ptr<Beast> beast_;
};

}  // namespace flexor::live
