// A glove on a pseudo-terminal, which has no rate of its own: that is found against simulated boards in cosim/.
#include "host/listen/listener.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "host/io/io.hpp"
#include "host/io/refusal_test.hpp"
#include "host/io/terminal_test.hpp"
#include "host/listen/test_board.hpp"

namespace flexor::listen {
namespace {

const auto kQuiet = [](const std::string&) {};

std::vector<Sample> listen_for(Listener& listener, double s) {
  std::vector<Sample> out;
  for (const double end_s = listener.now_s() + s; listener.now_s() < end_s;) listener.wait(0.05, out);
  return out;
}

TEST(Listening, FindsTheFormatAndGivesEverySample) {
  FLEXOR_NEEDS_TERMINALS();
  std::atomic<int> sent = 0;
  Board glove([&](const std::string&) { return std::to_string(sent++) + ",2,3\n"; });
  Listener listener({.port = glove.port()}, kQuiet);
  EXPECT_EQ(listener.format(), Format::lines);
  EXPECT_EQ(listener.baud(), 115200U);
  const std::vector<Sample> out = listen_for(listener, 0.5);
  ASSERT_GT(out.size(), 20U);
  EXPECT_EQ(listener.columns()[0], "column1");
  EXPECT_FALSE(out[0].board_s) << "without a header no column is a clock";
  for (std::size_t i = 1; i < out.size(); ++i) EXPECT_EQ(out[i].value[0], out[i - 1].value[0] + 1);
}

// A port that stays where it is, whatever board is behind it.
class Socket {
 public:
  std::string port() const { return (folder_.path() / "glove").string(); }
  void plug_in(const Board& board) {
    std::filesystem::remove(port());
    std::filesystem::create_symlink(board.port(), port());
  }

 private:
  io::TemporaryFolder folder_;
};

Event listen_until(Listener& listener, Event wanted, std::vector<Sample>& out) {
  Event event = Event::quiet;
  for (int i = 0; i < 200 && event != wanted; ++i) event = listener.wait(0.02, out);
  return event;
}

// What a board sends once, then again and again.
Board::Sends once_then(const std::string& first, const std::string& again) {
  return [first, again, sent = false](const std::string&) mutable {
    return std::exchange(sent, true) ? again : first;
  };
}

TEST(Listening, GluesNoLinesTogetherAcrossAPulledPlug) {
  FLEXOR_NEEDS_TERMINALS();
  Socket socket;
  std::atomic<int> sent = 0;
  Board before([&](const std::string&) {
    const int n = sent++;
    return n < 100 ? "100,200,300\n" : n == 100 ? "100,200,3" : "";
  });
  socket.plug_in(before);
  Listener listener({.port = socket.port()}, kQuiet);
  std::vector<Sample> out;
  while (sent < 110) listener.wait(0.02, out);
  listener.wait(0.05, out);
  before.unplug();
  ASSERT_EQ(listen_until(listener, Event::gone, out), Event::gone);
  EXPECT_EQ(listener.tally().malformed, 1U) << "what was half";
  EXPECT_EQ(listener.wait(0.02, out), Event::quiet) << "it looks for the port";
  Board after(once_then("77\n9,", "100,200,301\n"));
  socket.plug_in(after);
  ASSERT_EQ(listen_until(listener, Event::back, out), Event::back);
  out = listen_for(listener, 0.3);
  ASSERT_GT(out.size(), 5U);
  for (const Sample& sample : out) EXPECT_EQ(sample.value, (std::vector<double>{100, 200, 301}));
}

TEST(Listening, EndsWithBothHeadersWhereAnotherGloveIsPluggedIn) {
  FLEXOR_NEEDS_TERMINALS();
  Socket socket;
  Board before(once_then("millis,thumb,index\n", "1,10,20\n"));
  socket.plug_in(before);
  Listener listener({.port = socket.port()}, kQuiet);
  std::vector<Sample> out;
  before.unplug();
  ASSERT_EQ(listen_until(listener, Event::gone, out), Event::gone);
  Board after(once_then("millis,ring,pinky\n", "1,30,40\n"));
  socket.plug_in(after);
  ASSERT_EQ(listen_until(listener, Event::back, out), Event::back);
  out.clear();
  EXPECT_EQ(
      io::refusal_of<io::JobError>([&] { listen_for(listener, 2); }),
      socket.port() +
          ": another glove speaks: its columns are millis,ring,pinky, and they were millis,thumb,index");
  EXPECT_TRUE(out.empty());
}

// "0B20" is an end of a line as good as a line: every finger of a later one would be left out but these.
TEST(Listening, LearnsNoColumnsFromTheEndOfALine) {
  FLEXOR_NEEDS_TERMINALS();
  Board glove(once_then("D40E50F512G512P0\n", "A10B20C30D40E50F512G512P0\n"));
  Listener listener({.port = glove.port()}, kQuiet);
  EXPECT_GT(listen_for(listener, 0.3).size(), 5U);
  EXPECT_EQ(listener.columns().size(), 5U);
}

std::string refusal(const ListenerOptions& options) {
  return io::refusal_of([&] { const Listener listener(options, kQuiet); });
}

TEST(Listening, ReportsWhyItReceivesNothing) {
  FLEXOR_NEEDS_TERMINALS();
  Board silent([](const std::string&) { return ""; });
  EXPECT_NE(refusal({.port = silent.port()}).find("nothing comes"), std::string::npos);
  Board noise([](const std::string&) { return std::string(20, '\x81'); });
  EXPECT_NE(refusal({.port = noise.port(), .baud = 9600}).find("no format that is known"), std::string::npos);
  EXPECT_NE(refusal({.port = "/dev/none"}).find("no such port"), std::string::npos);
}

TEST(Listening, IsTheHandOfAGloveWithAKey) {
  FLEXOR_NEEDS_TERMINALS();
  const link::Key key = {{1, 2, 3}};
  FramesGlove frames(key, false);
  Board glove(std::ref(frames));
  EXPECT_NE(refusal({.port = glove.port()}).find("waits for its hand"), std::string::npos);
  Listener listener({.port = glove.port(), .key = key}, kQuiet);
  EXPECT_EQ(listener.format(), Format::frames);
  EXPECT_GT(listen_for(listener, 0.3).size(), 10U);
}

// Its readings are nobody's to guard: they come without the hand, and without the key.
TEST(Listening, TakesTheReadingsOfAGloveThatWaitsForItsHand) {
  FLEXOR_NEEDS_TERMINALS();
  FramesGlove frames(link::Key{{1, 2, 3}}, true);
  Board glove(std::ref(frames));
  Listener listener({.port = glove.port(), .readings = true}, kQuiet);
  EXPECT_GT(listen_for(listener, 0.5).size(), 10U);
  EXPECT_EQ(listener.columns().front(), "thumb_count");
  EXPECT_NE(listener.description().find("waits for its hand; nothing guards its readings"), std::string::npos)
      << listener.description();
  EXPECT_TRUE(listener.takes_models());
  EXPECT_FALSE(listener.is_compensated());
}

TEST(Listening, MissesNoReadingWhereTwoOfThreeRequestsAreLost) {
  FLEXOR_NEEDS_TERMINALS();
  FramesGlove frames({}, true);
  frames.receive_one_request_of(3);
  Board glove(std::ref(frames));
  Listener listener({.port = glove.port(), .readings = true}, kQuiet);
  const std::vector<Sample> out = listen_for(listener, 2.5);
  ASSERT_GT(out.size(), 100U);
  double longest_s = 0;
  for (std::size_t i = 1; i < out.size(); ++i)
    longest_s = std::max(longest_s, *out[i].board_s - *out[i - 1].board_s);
  EXPECT_LT(longest_s, 0.015) << "10 ms lie between two";
}

TEST(Listening, TakesAnglesWhereNoReadingsComeAndTheyWillDo) {
  FLEXOR_NEEDS_TERMINALS();
  for (const bool gives_readings : {false, true}) {
    FramesGlove frames({}, gives_readings);
    Board glove(std::ref(frames));
    Listener listener({.port = glove.port(), .readings = true, .any_will_do = true}, kQuiet);
    EXPECT_GT(listen_for(listener, 0.3).size(), 10U);
    EXPECT_EQ(listener.columns().front(), gives_readings ? "thumb_count" : "thumb_deg");
    EXPECT_EQ(listener.is_compensated(), !gives_readings);
    EXPECT_EQ(listener.takes_models(), gives_readings);
  }
}

}  // namespace
}  // namespace flexor::listen
