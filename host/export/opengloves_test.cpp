#include "host/export/opengloves.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <sstream>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/io/terminal_test.hpp"

namespace flexor::exports {
namespace {

OpenGlovesOptions index_and_thumb() {
  ::signal(SIGPIPE, SIG_IGN);
  OpenGlovesOptions options;
  options.fingers[1] = FingerRange{0, 10, 110};
  options.fingers[0] = FingerRange{1, 60, 0};  // the other way round
  options.right = false;
  return options;
}

std::string read_now(int file) {
  std::string out;
  char buffer[4096];
  pollfd ready{file, POLLIN, 0};
  while (::poll(&ready, 1, 100) > 0 && (ready.revents & POLLIN) != 0) {
    const ssize_t n = ::read(file, buffer, sizeof buffer);
    if (n <= 0) break;
    out.append(buffer, static_cast<std::size_t>(n));
  }
  return out;
}

// Every line, as the driver reads it; fails where one is no whole frame.
std::vector<link::GloveLine> lines_of(const std::string& text) {
  std::vector<link::GloveLine> lines;
  EXPECT_TRUE(text.empty() || text.ends_with('\n')) << "half a line";
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    line += '\n';
    EXPECT_EQ(link::parse_gloves(line.data(), static_cast<std::uint16_t>(line.size()), lines.emplace_back()),
              link::GloveParse::ok)
        << line;
  }
  return lines;
}

class ToFifo : public testing::Test {
 protected:
  ToFifo() { ::mkfifo(fifo().c_str(), 0600); }
  std::filesystem::path fifo() const { return folder_.path() / "gloves"; }
  int reader() const { return ::open(fifo().c_str(), O_RDONLY | O_NONBLOCK); }
  io::TemporaryFolder folder_;
};

TEST_F(ToFifo, AnglesBecomeBendAndTheGesturesOfTheGlovesFirmware) {
  const int in = reader();
  OpenGloves out(fifo(), index_and_thumb());
  const double half[] = {60, 15};
  out.add(0, half);
  const double beyond[] = {-500, -1};
  out.add(0.01, beyond);
  const double unknown[] = {NAN, 60};
  out.add(0.02, unknown);
  const double fist[] = {110, 0};
  out.add(0.03, fist);
  const auto lines = lines_of(read_now(in));
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_NEAR(lines[0].values.flexion[1], 512, 1);
  EXPECT_NEAR(lines[0].values.flexion[0], 767, 1);
  EXPECT_EQ(lines[0].values.flexion[2], 0) << "no range, straight";
  EXPECT_EQ(lines[1].values.flexion[1], 0);
  EXPECT_EQ(lines[1].values.flexion[0], 1023);
  EXPECT_EQ(lines[2].values.flexion[1], 0) << "not known: as it was";
  EXPECT_EQ(lines[2].values.flexion[0], 0);
  EXPECT_EQ(lines[3].values.buttons,
            link::glove_button::kTrigger | link::glove_button::kPinch | link::glove_button::kGrab);
  EXPECT_EQ(lines[3].values.trigger, 1023);
  ::close(in);
}

TEST_F(ToFifo, NobodyWhoDoesNotReadHoldsItUpAndWhoComesBackIsServed) {
  OpenGloves out(fifo(), index_and_thumb());
  const double open[] = {10, 60};
  const double bent[] = {110, 60};
  double t_s = 0;
  const auto send = [&](const double(&angles)[2], int count) {
    for (int i = 0; i < count; ++i) out.add(t_s += 0.01, angles);
  };
  send(open, 100);  // there is no reader at all
  int in = reader();
  send(open, 10'000);  // one that does not read
  const std::size_t kept = lines_of(read_now(in)).size();
  EXPECT_GT(kept, 50u);
  EXPECT_LT(kept, 400u) << "no old hand is kept for long";
  send(bent, 10);  // it reads again
  const auto lines = lines_of(read_now(in));
  ASSERT_EQ(lines.size(), 10u);
  EXPECT_EQ(lines.back().values.flexion[1], 1023);
  ::close(in);
  send(open, 100);
  in = reader();  // another one
  send(bent, 100);
  const auto again = lines_of(read_now(in));
  ASSERT_GE(again.size(), 40u);
  EXPECT_EQ(again.back().values.flexion[1], 1023);
  ::close(in);
}

TEST(ToPort, ADriverThatAsksIsAnswered) {
  FLEXOR_NEEDS_TERMINALS();
  const io::Terminal terminal;
  OpenGloves out(terminal.name(), index_and_thumb());
  const double open[] = {10, 60};
  out.add(0, open);
  const std::string frame = read_now(terminal.master());
  EXPECT_EQ(lines_of(frame).size(), 1u);
  ASSERT_EQ(::write(terminal.master(), "A0B0C0D0E0\nZ\n", 13), 13);
  out.add(0.01, open);
  EXPECT_EQ(read_now(terminal.master()), "Z(ZV)1(ZG)0(ZH)0\n" + frame);
}

TEST(ToPort, ThatIsNotReadOrHasGoneDoesNotHoldItUp) {
  FLEXOR_NEEDS_TERMINALS();
  io::Terminal terminal;
  OpenGloves out(terminal.name(), index_and_thumb());
  const double open[] = {10, 60};
  double t_s = 0;
  for (int i = 0; i < 10'000; ++i) out.add(t_s += 0.01, open);
  const std::string text = read_now(terminal.master());
  const std::size_t kept = lines_of(text.substr(0, text.rfind('\n') + 1)).size();
  EXPECT_GT(kept, 50u);
  EXPECT_LT(kept, 1'000u);
  for (int i = 0; i < 10; ++i) out.add(t_s += 0.01, open);
  const std::string rest = text.substr(text.rfind('\n') + 1) + read_now(terminal.master());
  EXPECT_GE(lines_of(rest).size(), 9u) << "it is served again, from the rest of the line that was cut";
  terminal.hang_up();
  for (int i = 0; i < 200; ++i) out.add(t_s += 0.01, open);
}

TEST(OpenGloves, RefusesWhatIsNoPort) {
  const io::TemporaryFolder folder;
  const auto expect_refused = [](const std::filesystem::path& path, const std::string& part) {
    io::expect_refused([&] { const OpenGloves out(path, index_and_thumb()); }, part);
  };
  io::write_file(folder.path() / "file", "x");
  expect_refused(folder.path() / "none", "mkfifo");
  expect_refused(folder.path() / "file", "neither a serial port nor a FIFO");
  expect_refused("/dev/null", "neither a serial port nor a FIFO");
}

}  // namespace
}  // namespace flexor::exports
