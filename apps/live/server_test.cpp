// The server against clients that speak bytes: what a browser would never send is sent, too.
#include "apps/live/server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

namespace flexor::live {
namespace {

constexpr const char* kToken = "0123456789abcdef";

class Client {
 public:
  explicit Client(unsigned short port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    open_ = connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0;
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool is_open() const { return open_; }
  bool say(const std::string& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  // What comes until it holds `until`, or nothing more comes.
  std::string hear(const std::string& until = "\r\n\r\n") const {
    std::string out;
    char buffer[4096];
    for (pollfd ready{socket_, POLLIN, 0};
         out.find(until) == std::string::npos && poll(&ready, 1, 3000) == 1;) {
      const ssize_t n = recv(socket_, buffer, sizeof(buffer), 0);
      if (n <= 0) break;
      out.append(buffer, static_cast<std::size_t>(n));
    }
    return out;
  }

  // Bytes that are there, or come within a second.
  std::size_t swallow() const {
    std::vector<char> buffer(1 << 20);
    pollfd ready{socket_, POLLIN, 0};
    if (poll(&ready, 1, 1000) != 1) return 0;
    return static_cast<std::size_t>(std::max<ssize_t>(0, recv(socket_, buffer.data(), buffer.size(), 0)));
  }

 private:
  int socket_;
  bool open_ = false;
};

class Served : public testing::Test {
 protected:
  Served() : server_({.address = "127.0.0.1", .port = 0, .token = kToken}, handlers()) {
    server_.every(0.01, [this] {
      clients_ = server_.clients();
      if (floods_) server_.send(std::string(100000, 'x'));
    });
    thread_ = std::thread([this] { server_.run(); });
    const std::string url = server_.url();
    port_ = static_cast<unsigned short>(std::stoi(url.substr(url.find(':', 6) + 1)));
  }
  ~Served() override {
    server_.stop();
    thread_.join();
  }

  Server::Handlers handlers() {
    return {[this](std::string_view path) {
              asked_ = path;
              return path == "/" ? File{"text/html", "page"} : File{};
            },
            [] { return std::string("{\"hello\":1}"); },
            [](std::string_view message) { return "{\"echo\":" + std::string(message) + "}"; }};
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string request(const std::string& target, const std::string& more = "",
                      const std::string& method = "GET") const {
    return method + " " + target + " HTTP/1.1\r\n" +
           (more.find("Host:") == std::string::npos ? "Host: " + host() + "\r\n" : "") + more + "\r\n";
  }
  int status(const std::string& bytes) const {
    const Client client(port_);
    client.say(bytes);
    const std::string said = client.hear();
    return said.size() > 12 ? std::stoi(said.substr(9, 3)) : 0;
  }
  std::string upgrade(const std::string& origin) const {
    return request(std::string("/") + kToken + "/live",
                   "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
                       (origin.empty() ? "" : "Origin: " + origin + "\r\n"));
  }
  std::string page() const { return std::string("/") + kToken + "/"; }

  std::string asked_;
  std::atomic<bool> floods_ = false;
  std::atomic<std::size_t> clients_ = 0;
  Server server_;
  unsigned short port_ = 0;
  std::thread thread_;
};

// A client's frame, masked with zeros.
std::string frame(const std::string& text) {
  return std::string("\x81", 1) + static_cast<char>(0x80 | text.size()) + std::string(4, '\0') + text;
}

TEST_F(Served, GivesThePageToWhoKnowsTheToken) {
  const Client client(port_);
  client.say(request(page()));
  const std::string said = client.hear("page");
  EXPECT_NE(said.find("200 OK"), std::string::npos) << said;
  EXPECT_NE(said.find("Content-Security-Policy: default-src 'none'"), std::string::npos);
  EXPECT_NE(said.find("\r\n\r\npage"), std::string::npos);
}

TEST_F(Served, RefusesWhoDoesNot) {
  EXPECT_EQ(status(request("/")), 403);
  EXPECT_EQ(status(request("/0123456789abcdee/")), 403);
  EXPECT_EQ(status(request("/0123456789abcdef0/")), 403);
  EXPECT_EQ(status(request(page(), "Host: evil.example\r\n")), 421) << "a name that was pointed here";
  EXPECT_EQ(status(request(page(), "Origin: http://evil.example\r\n")), 403);
  EXPECT_EQ(status(request(page(), "Origin: https://" + host() + "\r\n")), 403);
  EXPECT_EQ(status(request(page(), "Origin: http://" + host() + "\r\n")), 200);
  EXPECT_EQ(status(request(page(), "", "POST")), 405);
  EXPECT_EQ(status(request(page() + "none.js")), 404);
  EXPECT_EQ(status(request(page(), "Content-Length: 100000000\r\n", "POST")), 413);
  EXPECT_EQ(status(request(page(), "X: " + std::string(20000, 'x') + "\r\n")), 413);
}

TEST_F(Served, PassesPathsOnAsTheyAre) {
  EXPECT_EQ(status(request(page() + "../../etc/passwd")), 404);
  EXPECT_EQ(asked_, "/../../etc/passwd") << "only what is in the table of files is given";
}

TEST_F(Served, SurvivesGarbage) {
  for (const std::string& bytes : {std::string(1000, '\0'), std::string("\r\n\r\n\r\n"),
                                   std::string("GET\r\n\r\n"), std::string(5000, 'A')}) {
    const Client client(port_);
    client.say(bytes);
  }
  EXPECT_EQ(status(request(page())), 200);
}

TEST_F(Served, SpeaksWithAPageOfItsOwn) {
  EXPECT_EQ(status(upgrade("")), 403);
  EXPECT_EQ(status(upgrade("http://evil.example")), 403);
  const Client client(port_);
  client.say(upgrade("http://" + host()));
  EXPECT_NE(client.hear("hello").find("101 Switching"), std::string::npos);
  client.say(frame("7"));
  EXPECT_NE(client.hear("{\"echo\":7}"), "");
}

TEST_F(Served, DropsWhoDoesNotReadAndServesTheOthers) {
  const Client slow(port_);
  const Client quick(port_);
  for (const Client* client : {&slow, &quick}) {
    client->say(upgrade("http://" + host()));
    client->hear("hello");
  }
  floods_ = true;
  while (clients_ < 2) std::this_thread::yield();
  std::size_t heard = 0;
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       clients_ > 1 && std::chrono::steady_clock::now() < end;)
    heard += quick.swallow();
  EXPECT_EQ(clients_, 1U);
  EXPECT_GT(heard, kMostWaiting);
}

TEST_F(Served, KeepsOnlySoManyConnections) {
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < 300; ++i) clients.push_back(std::make_unique<Client>(port_));
  clients.clear();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(status(request(page())), 200);
}

}  // namespace
}  // namespace flexor::live
