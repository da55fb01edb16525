// A glove on a pseudo-terminal, which has no rate of its own: that is found against simulated boards in cosim/.
#include "host/listen/listener.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include "host/io/io.hpp"
#include "host/io/test_terminal.hpp"
#include "runtime/link/glove_end.hpp"

namespace flexor::listen {
namespace {

// The glove's end of the line; says `text` every 10 ms.
class Glove {
 public:
  explicit Glove(std::function<std::string()> says) : end_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(end_);
    unlockpt(end_);
    port_ = ptsname(end_);
    termios raw{};
    tcgetattr(end_, &raw);
    cfmakeraw(&raw);
    tcsetattr(end_, TCSANOW, &raw);
    thread_ = std::jthread([this, says = std::move(says)](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const std::string text = says();
        (void)!write(end_, text.data(), text.size());
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    });
  }
  ~Glove() { unplug(); }
  void unplug() {
    if (end_ < 0) return;
    thread_.request_stop();
    thread_.join();
    close(end_);
    end_ = -1;
  }
  int end() const { return end_; }
  const std::string& port() const { return port_; }

 private:
  int end_;
  std::string port_;
  std::jthread thread_;
};

const auto kQuiet = [](const std::string&) {};

std::vector<Sample> listen_for(Listener& listener, double s) {
  std::vector<Sample> out;
  for (const double end_s = listener.now_s() + s; listener.now_s() < end_s;) listener.wait(0.05, out);
  return out;
}

TEST(Listening, FindsTheFormatAndGivesEverySample) {
  FLEXOR_NEEDS_TERMINALS();
  std::atomic<int> said = 0;
  Glove glove([&] { return std::to_string(said++) + ",2,3\n"; });
  Listener listener({.port = glove.port()}, kQuiet);
  EXPECT_EQ(listener.format(), Format::lines);
  EXPECT_EQ(listener.baud(), 115200U);
  const std::vector<Sample> out = listen_for(listener, 0.5);
  ASSERT_GT(out.size(), 20U);
  for (std::size_t i = 1; i < out.size(); ++i) EXPECT_EQ(out[i].value[0], out[i - 1].value[0] + 1);
}

TEST(Listening, TellsAPulledPlug) {
  FLEXOR_NEEDS_TERMINALS();
  Glove glove([] { return "1,2,3\n"; });
  Listener listener({.port = glove.port()}, kQuiet);
  glove.unplug();
  std::vector<Sample> out;
  Event event = Event::quiet;
  for (int i = 0; i < 100 && event != Event::gone; ++i) event = listener.wait(0.02, out);
  EXPECT_EQ(event, Event::gone);
  EXPECT_EQ(listener.wait(0.02, out), Event::quiet) << "it looks for the port";
  EXPECT_EQ(listener.times_gone(), 1);
}

std::string refusal(const ListenerOptions& options) {
  try {
    const Listener listener(options, kQuiet);
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Listening, SaysWhyItHearsNothing) {
  FLEXOR_NEEDS_TERMINALS();
  Glove silent([] { return ""; });
  EXPECT_NE(refusal({.port = silent.port()}).find("nothing comes"), std::string::npos);
  Glove noise([] { return std::string(20, '\x81'); });
  EXPECT_NE(refusal({.port = noise.port(), .baud = 9600}).find("no format that is known"), std::string::npos);
  EXPECT_NE(refusal({.port = "/dev/none"}).find("there is no such port"), std::string::npos);
}

TEST(Listening, IsTheHandOfAGloveWithAKey) {
  FLEXOR_NEEDS_TERMINALS();
  const link::Key key = {{1, 2, 3}};
  link::GloveEnd end(&key);
  int line = -1;
  const auto says = [&] {
    std::array<std::uint8_t, link::kMaxWire> wire{};
    for (std::uint8_t byte = 0; line >= 0 && read(line, &byte, 1) == 1;) (void)end.push(byte);
    link::Frame frame{};
    const std::uint8_t size =
        end.in_touch() ? end.angles(frame, false, wire.data()) : end.state(0, 0, wire.data());
    return std::string(wire.begin(), wire.begin() + size);
  };
  Glove glove(says);
  line = glove.end();
  EXPECT_NE(refusal({.port = glove.port()}).find("waits for its hand"), std::string::npos);
  Listener listener({.port = glove.port(), .key = key}, kQuiet);
  EXPECT_EQ(listener.format(), Format::frames);
  EXPECT_GT(listen_for(listener, 0.3).size(), 10U);
}

}  // namespace
}  // namespace flexor::listen
