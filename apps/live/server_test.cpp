#include "apps/live/server.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <mutex>
#include <set>
#include <vector>

#include "apps/live/assets.hpp"
#include "apps/live/request.hpp"
#include "apps/live/test_wire.hpp"
#include "host/io/process.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::live {
namespace {

namespace fs = std::filesystem;

std::string body_of(const std::string& answer) {
  const auto end = answer.find("\r\n\r\n");
  return end == answer.npos ? "" : answer.substr(end + 4);
}

// A sessions' folder beside a file that nobody may have.
struct Sessions {
  Sessions() : folder(outside.path() / "sessions") {
    fs::create_directories(folder / "one" / "deep");
    io::write_file(outside.path() / "secret.txt", "SECRET");
    io::write_file(folder / "one" / "log.csv", "t_s,a\n0,1\n");
    io::write_file(folder / "one" / "report.html", "<p>report</p>");
    io::write_file(folder / "one" / "run.js", "alert(1)");
    io::write_file(folder / "one" / ".hidden", "SECRET");
    io::write_file(folder / "one" / "Zo\xc3\xab left.csv", "name");
    fs::create_symlink(outside.path() / "secret.txt", folder / "one" / "link.txt");
    fs::create_directory_symlink(outside.path(), folder / "way");
    mkfifo((folder / "one" / "pipe.csv").c_str(), 0600);
  }
  ServerOptions options() const {
    ServerOptions out;
    out.files = folder;
    return out;
  }
  io::TemporaryFolder outside;
  fs::path folder;
};

// What the handlers were called with.
struct Received {
  Handlers handlers() {
    Handlers out;
    out.opened = [this](Client client) { note(fmt::format("opened {}", client), client); };
    out.text = [this](Client, std::string_view text) { note(fmt::format("text {}", text)); };
    out.binary = [this](Client, std::span<const std::uint8_t> bytes) {
      note(fmt::format("binary {}", bytes.size()));
    };
    return out;
  }
  void note(std::string what, Client client = 0) {
    const std::lock_guard lock(mutex);
    if (client != 0) last = client;
    messages.push_back(std::move(what));
  }
  std::vector<std::string> all() {
    const std::lock_guard lock(mutex);
    return messages;
  }
  bool gets_text(Tab& tab) {
    tab.send("still here");
    return soon([this] { return all().back() == "text still here"; });
  }
  std::mutex mutex;
  std::vector<std::string> messages;
  Client last = 0;
};

TEST(Server, GivesThePageAndItsAssetsWithTheHeadersOfASafePage) {
  const Running running;
  for (const Asset& asset : assets()) {
    const std::string answer = get(running.place, running.path(asset.name == "index.html" ? "" : asset.name));
    ASSERT_EQ(status_of(answer), 200) << asset.name;
    EXPECT_EQ(body_of(answer), asset.bytes) << asset.name;
    EXPECT_NE(answer.find(fmt::format("Content-Type: {}\r\n", type_of_asset(asset.name))), answer.npos);
    for (const char* header :
         {"Content-Security-Policy: default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; ",
          "frame-ancestors 'none'\r\n", "X-Content-Type-Options: nosniff\r\n",
          "Referrer-Policy: no-referrer\r\n", "Cache-Control: no-store\r\n",
          "Cross-Origin-Opener-Policy: same-origin\r\n", "Cross-Origin-Resource-Policy: same-origin\r\n",
          "Permissions-Policy: camera=(self)\r\n"})
      EXPECT_NE(answer.find(header), answer.npos) << header;
  }
  EXPECT_EQ(running.status("none.js"), 404);
  const std::string bare = get(running.place, "/" + running.place.token + "?x");
  EXPECT_EQ(status_of(bare), 308);
  EXPECT_NE(bare.find("Location: " + running.path("") + "\r\n"), bare.npos);
}

TEST(Server, HeadIsTheSameWithoutTheBody) {
  const Sessions sessions;
  const Running running(sessions.options());
  for (const char* path : {"", "files/one/log.csv", "none"}) {
    const std::string whole = get(running.place, running.path(path));
    const std::string head = get(running.place, running.path(path), "", "HEAD");
    EXPECT_EQ(head, whole.substr(0, whole.size() - body_of(whole).size()));
    EXPECT_FALSE(body_of(whole).empty());
  }
}

TEST(Server, AConnectionServesOneRequestAfterAnother) {
  const Running running;
  Wire wire(running.place.port);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(wire.put(
        fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n\r\n", running.path("none"), running.place.host)));
    EXPECT_EQ(status_of(wire.until("no such file\n")), 404);
  }
}

TEST(Server, AnotherHostIsRefused) {
  const Running running;
  const auto ask = [&](const std::string& hosts) {
    Wire wire(running.place.port);
    wire.put(fmt::format("GET {} HTTP/1.1\r\n{}Connection: close\r\n\r\n", running.path(""), hosts));
    return wire.rest();
  };
  const int port = running.place.port;
  for (const char* own : {"127.0.0.1", "localhost", "[::1]"})
    EXPECT_EQ(status_of(ask(fmt::format("Host: {}:{}\r\n", own, port))), 200) << own;
  for (const std::string& other :
       {std::string("evil.example"), fmt::format("evil.example:{}", port), std::string("127.0.0.1"),
        fmt::format("127.0.0.1:{}", port + 1), fmt::format("127.0.0.1.evil.example:{}", port),
        fmt::format("127.0.0.1:{}.", port), fmt::format("127.0.0.2:{}", port), fmt::format(":{}", port),
        fmt::format("localhost:{0}@evil.example:{0}", port), std::string()}) {
    const std::string answer = ask(fmt::format("Host: {}\r\n", other));
    EXPECT_EQ(status_of(answer), 403) << other;
    EXPECT_EQ(std::count(answer.begin(), answer.end(), '\n') - 1,
              std::count(answer.begin(), answer.end(), '\r'))
        << answer;
  }
  EXPECT_EQ(status_of(ask("")), 403);
  EXPECT_EQ(status_of(ask(fmt::format("Host: {0}\r\nHost: {0}\r\n", running.place.host))), 403);
  EXPECT_TRUE(running.answers());
}

TEST(Server, AForeignOriginIsRefusedAlsoAtTheSocket) {
  const Running running;
  const std::string own = fmt::format("Origin: http://{}\r\n", running.place.host);
  EXPECT_EQ(running.status("", own), 200);
  EXPECT_EQ(Tab(running.place, own).status, 101);
  EXPECT_EQ(Tab(running.place).status, 101);  // a program, which has none
  for (const std::string& other :
       {std::string("null"), std::string("http://evil.example"), "https://" + running.place.host,
        "http://" + running.place.host + "/", fmt::format("http://localhost:{}", running.place.port),
        std::string("http://127.0.0.1"), std::string()}) {
    const std::string field = fmt::format("Origin: {}\r\n", other);
    EXPECT_EQ(running.status("", field), 403) << other;
    EXPECT_EQ(Tab(running.place, field).status, 403) << other;
  }
  EXPECT_EQ(Tab(running.place, own + own).status, 403);
  EXPECT_TRUE(running.answers());
}

TEST(Server, WithoutTheTokenNothingIsThere) {
  const Sessions sessions;
  const Running running(sessions.options());
  Place other = running.place;
  std::string& wrong = other.token;
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  for (const std::string& path :
       {std::string("/"), std::string("/index.html"), std::string("/socket"), std::string("//"),
        "/" + wrong + "/", "/" + wrong + "/files/one/log.csv", running.path("").substr(0, 20) + "/",
        "/" + running.place.token + "0/", "/x/" + running.place.token + "/", "//" + running.place.token + "/",
        "http://" + running.place.host + running.path(""), std::string("*"),
        "/%" + fmt::format("{:02x}", static_cast<int>(running.place.token[0])) +
            running.place.token.substr(1) + "/"})
    EXPECT_EQ(status_of(get(running.place, path)), 403) << path;
  EXPECT_EQ(Tab(other).status, 403);
  EXPECT_TRUE(running.answers());
}

TEST(Server, TokensAreRandom) {
  std::set<std::string> tokens;
  for (int i = 0; i < 20; ++i) {
    tokens.insert(Place(Server({}, {}).url()).token);
    EXPECT_EQ(tokens.begin()->size(), 32U);
  }
  EXPECT_EQ(tokens.size(), 20U);
}

TEST(Server, GivesFilesOfTheSessions) {
  const Sessions sessions;
  const Running running(sessions.options());
  const std::string log = get(running.place, running.path("files/one/log.csv"));
  EXPECT_EQ(status_of(log), 200);
  EXPECT_EQ(body_of(log), "t_s,a\n0,1\n");
  EXPECT_NE(log.find("Content-Type: text/csv"), log.npos);
  EXPECT_EQ(body_of(get(running.place, running.path("files/one/Zo%C3%AB%20left.csv?x=1"))), "name");
  const std::string report = get(running.place, running.path("files/one/report.html"));
  EXPECT_EQ(body_of(report), "<p>report</p>");
  EXPECT_NE(
      report.find("Content-Security-Policy: sandbox allow-scripts; default-src 'none'; script-src 'sha256-"),
      report.npos);
  for (const char* more : {"script-src 'unsafe-inline'", "script-src 'self'", "allow-same-origin"})
    EXPECT_EQ(report.find(more), report.npos) << more;
  EXPECT_NE(get(running.place, running.path("files/one/run.js")).find("Content-Type: text/plain"),
            std::string::npos);
  io::write_file(sessions.folder / "one" / "large.csv", std::string(30'000'000, 'x'));
  EXPECT_EQ(body_of(get(running.place, running.path("files/one/large.csv"))), std::string(30'000'000, 'x'));
}

TEST(Server, NoPathLeadsOutOfTheSessions) {
  const Sessions sessions;
  const Running running(sessions.options());
  for (const char* path : {"files/../secret.txt",
                           "files/one/../../secret.txt",
                           "files/%2e%2e/secret.txt",
                           "files/%2E%2e/secret.txt",
                           "files/.%2e/secret.txt",
                           "files/..%2fsecret.txt",
                           "files/one/..%2f..%2fsecret.txt",
                           "files/one%2f..%2f..%2fsecret.txt",
                           "files/%252e%252e/secret.txt",
                           "files/..%5csecret.txt",
                           "files/..\\secret.txt",
                           "files/%c0%ae%c0%ae/secret.txt",
                           "files/..;/secret.txt",
                           "files//etc/passwd",
                           "files/%2fetc/passwd",
                           "files//secret.txt",
                           "files/one/link.txt",
                           "files/way/secret.txt",
                           "files/way/sessions/one/log.csv",
                           "files/one/.hidden",
                           "files/./one/log.csv",
                           "files/one//log.csv",
                           "files/one/log.csv/",
                           "files/one/log.csv%00.txt",
                           "files/one/log.csv%",
                           "files/one/log.csv%2",
                           "files/one/%zz",
                           "files/one",
                           "files/one/",
                           "files/",
                           "files",
                           "files/one/pipe.csv",
                           "../secret.txt",
                           "assets/../files/../secret.txt",
                           "%66iles/../secret.txt",
                           "socket/../files/one/log.csv"}) {
    const std::string answer = get(running.place, running.path(path));
    EXPECT_EQ(status_of(answer), 404) << path;
    EXPECT_EQ(answer.find("SECRET"), answer.npos) << path;
    EXPECT_EQ(answer.find("root:"), answer.npos) << path;
  }
  const std::string long_name(5000, 'a');
  EXPECT_EQ(running.status("files/" + long_name), 404);
  EXPECT_EQ(status_of(get(Running().place, "/x/files/one/log.csv")), 403);
  EXPECT_EQ(Running().status("files/one/log.csv"), 404);
  EXPECT_TRUE(running.answers());
}

TEST(Server, OnlyGetAndHeadAndNoBody) {
  const Running running;
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "PROPFIND"})
    EXPECT_EQ(running.status("", "Content-Length: 0\r\n", method), 405) << method;
  for (const char* body : {"Content-Length: 5", "Content-Length: 99999999999", "Transfer-Encoding: chunked"})
    EXPECT_EQ(running.status("", fmt::format("{}\r\n", body)), 413) << body;
  EXPECT_TRUE(running.answers());
}

TEST(Server, AHeadHasAnEnd) {
  const Running running;
  EXPECT_EQ(running.status("", fmt::format("X: {}\r\n", std::string(7000, 'x'))), 200);
  EXPECT_EQ(running.status("", fmt::format("X: {}\r\n", std::string(9000, 'x'))), 431);
  std::string many;
  for (int i = 0; i < 3000; ++i) many += "X: y\r\n";
  EXPECT_EQ(running.status("", many), 431);
  EXPECT_TRUE(running.answers());
}

TEST(Server, GarbageIsABadRequest) {
  const Running running;
  const std::string zeros(4000, '\0');
  for (const std::string& bytes :
       {std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc", 9) + zeros, std::string("\xff\xfe\n\n\n\n"),
        zeros, std::string("GET\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string("GET / HTTP/1.1\nHost\n\n"), frame(kText, "hello"),
        fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\nContent-Length: x\r\n\r\n", running.path(""),
                    running.place.host)}) {
    Wire wire(running.place.port);
    wire.put(bytes);
    wire.socket().shutdown(Wire::Tcp::socket::shutdown_send);
    EXPECT_EQ(status_of(wire.rest()), 400) << bytes.substr(0, 40);
    EXPECT_TRUE(wire.ended());
  }
  Wire early(running.place.port);
  early.put(handshake(running.place) + frame(kText, "too early"));
  EXPECT_EQ(status_of(early.rest()), 400);
  EXPECT_EQ(running.status("socket"), 426);
  EXPECT_TRUE(running.answers());
}

TEST(Server, MessagesGoBothWaysInOrder) {
  Received received;
  Running running({}, received.handlers());
  Tab one(running.place);
  ASSERT_TRUE(soon([&] { return received.all().size() == 1; }));
  const Client first = received.last;
  Tab two(running.place);
  ASSERT_TRUE(soon([&] { return running.server.clients() == 2; }));
  running.server.post([&] {
    running.server.send(first, "for one");
    const std::vector<std::uint8_t> samples(70000, 7);
    running.server.send_all(samples);
    running.server.send_all("for all");
    running.server.send(99, "for nobody");
  });
  EXPECT_EQ(one.receive(), std::pair(kText, std::string("for one")));
  for (Tab* tab : {&one, &two}) {
    EXPECT_EQ(tab->receive(), std::pair(kBinary, std::string(70000, '\7')));
    EXPECT_EQ(tab->receive(), std::pair(kText, std::string("for all")));
  }
  one.send("hello");
  one.put(frame(kBinary, std::string(kLongestMessage, 'x')));
  one.send(std::string(kLongestMessage, 'y'));
  one.put(frame(kPing, "?"));
  EXPECT_EQ(one.receive(), std::pair(10, std::string("?")));
  const auto messages = received.all();
  ASSERT_EQ(messages.size(), 5U);
  EXPECT_EQ(messages[2], "text hello");
  EXPECT_EQ(messages[3], fmt::format("binary {}", kLongestMessage));
  EXPECT_EQ(messages[4].size(), kLongestMessage + 5);
  one.put(frame(kClose, "\x03\xe8"));
  EXPECT_EQ(one.receive(), std::pair(kClose, std::string("\x03\xe8")));
  EXPECT_TRUE(soon([&] { return running.server.clients() == 1; }));
}

TEST(Server, AMessageBeyondTheLimitEndsItsSocketOnly) {
  Received received;
  Running running({}, received.handlers());
  Tab other(running.place);
  Tab large(running.place);
  ASSERT_TRUE(soon([&] { return received.all().size() == 2; }));
  std::thread sending([&] { large.put(frame(kBinary, std::string(100 << 20, 'x'))); });
  const auto [opcode, why] = large.receive();
  EXPECT_EQ(opcode, kClose);
  EXPECT_EQ(why.substr(0, 2), "\x03\xf1");  // 1009
  large.rest();
  sending.join();
  ASSERT_TRUE(soon([&] { return running.server.clients() == 1; }));
  EXPECT_TRUE(received.gets_text(other));

  Tab pieces(running.place);  // likewise in pieces
  std::string piece = frame(kBinary, std::string(60000, 'x'));
  piece[0] = kBinary;
  for (int i = 0; i < 30; ++i) {
    pieces.put(piece);
    piece[0] = 0;
  }
  EXPECT_EQ(pieces.receive().first, kClose);
  EXPECT_TRUE(running.answers());
}

TEST(Server, GarbageInASocketEndsItOnly) {
  Received received;
  Running running({}, received.handlers());
  Tab other(running.place);
  for (const std::string& bytes :
       {std::string(40, '\xff'), frame(kText, "unmasked", false), frame(kText, "\xc3\x28\xff"), frame(3, "x"),
        frame(kPing, std::string(200, 'x')),
        std::string("\x82\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14),
        std::string("GET / HTTP/1.1\r\n\r\n"), frame(0, "goes on from nothing")}) {
    Tab tab(running.place);
    ASSERT_EQ(tab.status, 101);
    tab.put(bytes);
    EXPECT_EQ(tab.receive().first, kClose);
    tab.rest();
    EXPECT_TRUE(tab.ended());
  }
  EXPECT_TRUE(soon([&] { return running.server.clients() == 1; }));
  for (const std::string& message : received.all()) EXPECT_FALSE(message.starts_with("text")) << message;
  EXPECT_TRUE(received.gets_text(other));
}

TEST(Server, AThousandConnectionsThatSendNothingKeepNobodyOut) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur < 3000) {
    limit.rlim_cur = std::min<rlim_t>(3000, limit.rlim_max);
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  Received received;
  Running running({}, received.handlers());
  Tab tab(running.place);
  std::vector<Wire> idle;
  for (int i = 0; i < 1000; ++i) idle.emplace_back(running.place.port);
  EXPECT_TRUE(running.answers());
  EXPECT_TRUE(received.gets_text(tab));
  EXPECT_EQ(running.server.clients(), 1);
}

TEST(Server, OneSocketMoreThanThereMayBeIsRefused) {
  Running running;
  std::vector<std::unique_ptr<Tab>> tabs;
  for (int i = 0; i < kMostClients; ++i) {
    tabs.push_back(std::make_unique<Tab>(running.place));
    ASSERT_EQ(tabs.back()->status, 101);
  }
  EXPECT_EQ(Tab(running.place).status, 503);
  EXPECT_EQ(running.status(""), 503);
  for (int i = 0; i < 300; ++i) Wire(running.place.port).put("GET");
  tabs.pop_back();
  EXPECT_TRUE(soon([&] { return running.answers(); }));
  EXPECT_EQ(running.server.clients(), kMostClients - 1);
}

TEST(Server, WhoDoesNotReadIsDroppedAndTheOthersGetEverything) {
  constexpr int kMessages = 400;
  std::atomic<int> got{0};  // before the server, whose ticks read both until it ends
  int sent = 0;
  Received received;
  Running running({}, received.handlers());
  Tab slow(running.place, "", 4096);
  ASSERT_EQ(slow.status, 101);
  Tab fast(running.place);
  ASSERT_TRUE(soon([&] { return running.server.clients() == 2; }));
  running.server.post([&] {
    running.server.every(0.001, [&] {
      if (sent < kMessages && sent - got < 20)
        running.server.send_all(fmt::format("{:06} {}", sent++, std::string(65536, 'x')));
    });
  });
  for (; got < kMessages; ++got) {
    const auto [opcode, text] = fast.receive();
    ASSERT_EQ(opcode, kText);
    ASSERT_EQ(text.substr(0, 6), fmt::format("{:06}", got.load()));
    ASSERT_EQ(text.size(), 65536U + 7);
  }
  EXPECT_EQ(running.server.clients(), 1);
  slow.rest();
  EXPECT_TRUE(slow.ended());
  EXPECT_TRUE(running.answers());
}

TEST(Server, AHeadThatNeverEndsIsGivenUp) {
  Running running;
  const auto start = std::chrono::steady_clock::now();
  Wire slow(running.place.port);
  Wire idle(running.place.port);
  slow.put("GET / HTTP/1.1\r\n");
  while (slow.put("X: y\r\n") && !slow.more(0.5) && !slow.ended()) {
    EXPECT_TRUE(running.answers());
    if (std::chrono::steady_clock::now() - start > std::chrono::seconds(20)) break;
  }
  EXPECT_TRUE(slow.ended());
  idle.rest();
  EXPECT_TRUE(idle.ended());
  const auto took = std::chrono::steady_clock::now() - start;
  EXPECT_GT(took, std::chrono::seconds(9));
  EXPECT_LT(took, std::chrono::seconds(18));
}

TEST(Server, LivesWithoutDescriptors) {
  Running running;
  Tab tab(running.place);
  std::vector<int> taken;
  Wire waiting(running.place.port);
  ASSERT_TRUE(running.answers());
  const int late = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = static_cast<rlim_t>(late) + 8;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  for (int copy = dup(late); copy >= 0; copy = dup(late)) taken.push_back(copy);
  sockaddr_in end{};
  end.sin_family = AF_INET;
  end.sin_port = htons(running.place.port);
  end.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(late, reinterpret_cast<const sockaddr*>(&end), sizeof end), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  for (const int copy : taken) close(copy);
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_FALSE(taken.empty());
  EXPECT_TRUE(running.answers());
  EXPECT_EQ(running.server.clients(), 1);
  close(late);
}

TEST(Server, WatchesTicksAndWorksOnItsThread) {
  Running running;
  io::Pipe line;
  const int end = line.end[0].number();
  std::atomic<int> read_bytes{0};
  std::atomic<int> ticks{0};
  std::set<std::thread::id> threads;
  std::shared_ptr<void> watch;
  running.server.post([&] {
    watch = running.server.watch(end, [&] {
      threads.insert(std::this_thread::get_id());
      char byte = 0;
      if (read(end, &byte, 1) == 1) ++read_bytes;  // one of several: it is readable still
    });
    running.server.every(0.01, [&] {
      threads.insert(std::this_thread::get_id());
      ++ticks;
    });
  });
  for (const int bytes : {5, 2}) {
    const int before = read_bytes;
    ASSERT_EQ(write(line.end[1].number(), "abcde", static_cast<std::size_t>(bytes)), bytes);
    EXPECT_TRUE(soon([&] { return read_bytes == before + bytes; }));
  }
  running.server.post([&] { watch.reset(); });
  const auto start = std::chrono::steady_clock::now();
  const int before = ticks;
  EXPECT_TRUE(soon([&] { return ticks - before >= 1; }));
  ASSERT_EQ(write(line.end[1].number(), "h", 1), 1);
  EXPECT_TRUE(soon([&] { return ticks - before >= 21; }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(180));
  EXPECT_EQ(read_bytes, 7);
  running.stop();
  EXPECT_EQ(threads.size(), 1U);
  EXPECT_EQ(write(line.end[1].number(), "i", 1), 1);  // the descriptor is still the caller's
}

TEST(Server, AWatchMayEndItselfAndItsDescriptor) {
  Running running;
  io::Pipe line;
  std::atomic<bool> over{false};
  std::shared_ptr<void> watch;
  running.server.post([&] {
    watch = running.server.watch(line.end[0].number(), [&] {
      watch.reset();
      line.end[0].close();
      over = true;
    });
  });
  line.end[1].close();  // the end of a pipe is readable too
  EXPECT_TRUE(soon([&] { return over.load(); }));
  EXPECT_TRUE(running.answers());
}

TEST(Server, StopsFromAnotherThreadAndSendsWhatWaits) {
  Received received;
  Running running({}, received.handlers());
  Tab tab(running.place);
  Wire idle(running.place.port);
  ASSERT_TRUE(soon([&] { return running.server.clients() == 1; }));
  running.server.post([&] { running.server.send_all("last words " + std::string(1'000'000, '.')); });
  std::thread reading([&] { EXPECT_EQ(tab.receive().second.substr(0, 10), "last words"); });
  running.stop();
  reading.join();
  const auto [opcode, why] = tab.receive();
  EXPECT_EQ(opcode, kClose);
  EXPECT_EQ(why.substr(0, 2), "\x03\xe9");  // 1001
  idle.rest();
  EXPECT_TRUE(idle.ended());
  EXPECT_THROW(Wire(running.place.port), std::runtime_error);
}

TEST(Server, ReportsWhyItCannotListen) {
  const Running running;
  ServerOptions options;
  options.port = running.place.port;
  const std::string why = io::refusal_of([&] { Server(options, {}); });
  EXPECT_TRUE(why.starts_with(fmt::format("port {} is in use: ", running.place.port))) << why;
  EXPECT_TRUE(running.answers());
}

}  // namespace
}  // namespace flexor::live
