// A client of the server for its tests: bytes of its own making, so that it can be as wrong as it likes.
#pragma once

#include <fmt/format.h>
#include <poll.h>

#include <boost/asio/write.hpp>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "apps/live/server.hpp"

namespace flexor::live {

// The parts of a server's address.
struct Place {
  explicit Place(const std::string& url) {
    const auto colon = url.rfind(':');
    const auto slash = url.find('/', colon);
    port = static_cast<unsigned short>(std::stoi(url.substr(colon + 1)));
    token = url.substr(slash + 1, url.size() - slash - 2);
    host = fmt::format("127.0.0.1:{}", port);
  }
  unsigned short port = 0;
  std::string token;
  std::string host;
};

class Wire {
 public:
  using Tcp = boost::asio::ip::tcp;

  explicit Wire(unsigned short port, int receive_bytes = 0) {
    const Tcp::endpoint end(boost::asio::ip::address_v4::loopback(), port);
    socket_.open(end.protocol());
    if (receive_bytes > 0) socket_.set_option(Tcp::socket::receive_buffer_size(receive_bytes));
    socket_.set_option(Tcp::no_delay(true));
    socket_.connect(end);
  }

  Tcp::socket& socket() { return socket_; }

  // False once the other side has closed.
  bool put(std::string_view bytes) {
    boost::system::error_code error;
    write(socket_, boost::asio::buffer(bytes), error);
    return !error;
  }

  // Waits for more; false at the end, or after `patience_s`.
  bool more(double patience_s) {
    pollfd wanted{socket_.native_handle(), POLLIN, 0};
    if (poll(&wanted, 1, static_cast<int>(patience_s * 1e3)) <= 0) return false;
    char bytes[65536];
    boost::system::error_code error;
    read_.append(bytes, socket_.read_some(boost::asio::buffer(bytes), error));
    ended_ = error.failed();
    return !ended_;
  }

  // Everything until the other side closes.
  std::string rest(double patience_s = 20) {
    while (more(patience_s)) {
    }
    return std::exchange(read_, {});
  }

  bool ended() const { return ended_; }

  // Up to and with `mark`.
  std::string until(std::string_view mark, double patience_s = 20) {
    while (read_.find(mark) == read_.npos)
      if (!more(patience_s)) return {};
    return take(read_.find(mark) + mark.size());
  }

  std::string take(std::size_t size, double patience_s = 20) {
    while (read_.size() < size)
      if (!more(patience_s)) return {};
    std::string out = read_.substr(0, size);
    read_.erase(0, size);
    return out;
  }

 private:
  static boost::asio::io_context& context() {
    static boost::asio::io_context one;
    return one;
  }
  Tcp::socket socket_{context()};
  std::string read_;
  bool ended_ = false;
};

inline std::string get(const Place& place, std::string_view path, std::string_view more_fields = {},
                       std::string_view method = "GET") {
  Wire wire(place.port);
  wire.put(fmt::format("{} {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{}\r\n", method, path, place.host,
                       more_fields));
  return wire.rest();
}

inline int status_of(const std::string& answer) {
  return answer.starts_with("HTTP/1.") && answer.size() > 12 ? std::stoi(answer.substr(9, 3)) : 0;
}

inline std::string handshake(const Place& place, std::string_view more_fields = {}) {
  return fmt::format(
      "GET /{}/socket HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n{}\r\n",
      place.token, place.host, more_fields);
}

// A frame as a client sends it, masked by zeros.
inline std::string frame(int opcode, std::string_view payload, bool masked = true) {
  std::string out(1, static_cast<char>(0x80 | opcode));
  const int mask_bit = masked ? 0x80 : 0;
  const auto size = payload.size();
  const int bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
  out += static_cast<char>(mask_bit | (bytes == 0 ? static_cast<int>(size) : bytes == 2 ? 126 : 127));
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>((size >> (8 * i)) & 0xff);
  if (masked) out.append(4, '\0');
  return out.append(payload);
}

constexpr int kText = 1;
constexpr int kBinary = 2;
constexpr int kClose = 8;
constexpr int kPing = 9;
constexpr int kPong = 10;

// A WebSocket.
struct Tab : Wire {
  explicit Tab(const Place& place, std::string_view more_fields = {}, int receive_bytes = 0)
      : Wire(place.port, receive_bytes) {
    put(handshake(place, more_fields));
    status = status_of(until("\r\n\r\n"));
  }
  int status = 0;

  bool send(std::string_view text) { return put(frame(kText, text)); }

  // The next frame: opcode, or 0 at the end, and payload.
  std::pair<int, std::string> receive(double patience_s = 20) {
    const std::string head = take(2, patience_s);
    if (head.empty()) return {0, {}};
    std::uint64_t size = static_cast<unsigned char>(head[1]) & 0x7f;
    if (size >= 126) {
      const std::string longer = take(size == 126 ? 2 : 8, patience_s);
      size = 0;
      for (const char byte : longer) size = size << 8 | static_cast<unsigned char>(byte);
    }
    return {head[0] & 0x0f, size == 0 ? std::string() : take(size, patience_s)};
  }
  // The next text; null at the end.
  nlohmann::json receive_json() {
    for (;;) {
      const auto [opcode, payload] = receive();
      if (opcode == kText) return nlohmann::json::parse(payload);
      if (opcode == 0 || opcode == kClose) return nullptr;
    }
  }
};

// A server on a thread of its own.
class Running {
 public:
  explicit Running(const ServerOptions& options = {}, Handlers handlers = {})
      : server(options, std::move(handlers)), place(server.url()), thread_([this] { server.run(); }) {}
  ~Running() { stop(); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  void stop() {
    if (!thread_.joinable()) return;
    server.stop();
    thread_.join();
  }
  std::string path(std::string_view behind_the_token) const {
    return fmt::format("/{}/{}", place.token, behind_the_token);
  }
  int status(std::string_view behind, std::string_view fields = {}, std::string_view method = "GET") const {
    return status_of(get(place, path(behind), fields, method));
  }
  bool answers() const { return status("") == 200; }

  Server server;
  Place place;

 private:
  std::thread thread_;
};

template <class Condition>
bool soon(Condition condition, double patience_s = 60) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace flexor::live
