// `flexor monitor` and `record` with --from: a file, the twin or a camera in place of a port.
#include <chrono>
#include <cmath>

#include "apps/cli/command_test.hpp"
#include "host/io/process.hpp"
#include "host/listen/test_board.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace from_test {

class From : public Command {
 protected:
  // A recording of a second and a half, 50 rows a second.
  From() {
    std::ofstream file(path("log.csv"));
    file.precision(12);
    file << "time (ms),index (count),middle (count)\n";
    for (int k = 0; k <= 75; ++k)
      file << 7000 + 20 * k << ',' << 400 + k << ',' << 512 + std::round(100 * std::sin(0.1 * k)) << '\n';
  }
};

TEST_F(From, ARecordingIsRecordedAsItWas) {
  const auto begin = std::chrono::steady_clock::now();
  const Finished r = run("record again.csv --from log.csv --json");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const auto result = json_of(r);
  EXPECT_GT(took.count(), 1.5);
  EXPECT_LT(took.count(), 10);
  EXPECT_EQ(result.at("rows"), 76);
  EXPECT_EQ(result.at("unplugged"), 0);
  EXPECT_EQ(result.at("board_restarts"), 0);
  EXPECT_TRUE(result.at("port").is_null() && result.at("baud").is_null() && result.at("format").is_null());
  EXPECT_NE(result.at("source").get<std::string>().find("76 rows in 1.5 s"), std::string::npos);
  const recording::Recording first = recording::read_csv(path("log.csv"), {});
  const recording::Recording again = recording::read_csv(path("again.csv"), {});
  ASSERT_EQ(again.t_s.size(), first.t_s.size());
  for (std::size_t k = 0; k < first.t_s.size(); ++k)
    EXPECT_NEAR(again.t_s[k], first.t_s[k] - first.t_s[0], 2e-6);
  for (const recording::Column& column : first.columns) {
    EXPECT_EQ(again.column(column.name).value, column.value);
    EXPECT_EQ(again.column(column.name).unit, column.unit);
  }
}

TEST_F(From, ARecordingIsShownFaster) {
  const auto result = json_of("monitor --from log.csv --speed 10 --json");
  EXPECT_EQ(result.at("columns").size(), 2U);
  EXPECT_EQ(result.at("columns")[0].at("now"), 475);
  EXPECT_EQ(result.at("columns")[0].at("least"), 400);
  EXPECT_EQ(result.at("columns")[0].at("most"), 475);
}

// On a terminal a bar is drawn over the one before, by escapes of ours; those of a name are none.
TEST_F(From, AMonitorDrawsWithItsOwnEscapesAlone) {
  FLEXOR_NEEDS_TERMINALS();
  write("log.csv", "t_s,in\xc2\x9b\x32Jdex\n0,1\n0.1,2\n0.2,3\n");
  const io::Terminal screen;
  const int terminal = ::open(screen.name().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  io::Process monitor(FLEXOR_PROGRAM, {"flexor", "monitor", "--from", path("log.csv")},
                      {{terminal, STDOUT_FILENO}});
  ::close(terminal);
  std::string shown;
  for (char c = 0; ::read(screen.master(), &c, 1) == 1;) shown += c;
  EXPECT_EQ(monitor.wait(), 0);
  EXPECT_NE(shown.find("\x1b[Kin?2Jdex"), std::string::npos) << shown;
  EXPECT_EQ(shown.find("?[K"), std::string::npos) << shown;
}

TEST_F(From, TheTwinsGlove) {
  const auto result = json_of("record twin.csv --from twin --for 4 --json");
  EXPECT_EQ(result.at("columns").size(), 5U);
  EXPECT_NEAR(result.at("rows").get<double>(), 401, 12);
  const recording::Recording log = recording::read_csv(path("twin.csv"), {});
  for (const recording::Column& column : log.columns) {
    if (column.name == "host_s") continue;
    EXPECT_EQ(column.unit, "count");
    EXPECT_GT(*std::ranges::min_element(column.value), 0);
    EXPECT_LT(*std::ranges::max_element(column.value), 1023);
  }
}

TEST_F(From, APortThatGoesAndComesBackIsRecordedOn) {
  FLEXOR_NEEDS_TERMINALS();
  std::optional<listen::Board> board;
  const auto plug = [&] {
    board.emplace([](const std::string&) { return "1,2,3\n"; });
    fs::create_symlink(board->port(), path("port"));
  };
  plug();
  const pid_t child = start("record x.csv --port " + path("port") + " --for 6 --json");
  const auto wait_for = [](const std::function<bool()>& holds) {
    for (int k = 0; k < 3000 && !holds(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  };
  wait_for([&] { return lines(content(path("x.csv"))) > 10; });
  fs::remove(path("port"));
  board.reset();
  wait_for([&] { return content(path("stderr")).find("gone") != std::string::npos; });
  const std::ptrdiff_t before = lines(content(path("x.csv")));
  plug();
  const auto result = json_of(wait(child));
  EXPECT_EQ(result.at("unplugged"), 1);
  EXPECT_GT(result.at("rows"), before + 10);
}

TEST_F(From, AVideoOfAHand) {
  make(FLEXOR_TEST_INPUTS);
  EXPECT_EQ(json_of("record angles.csv --from video.mp4 --joints joints.json --json").at("rows"), 20);
  const recording::Recording log = recording::read_csv(path("angles.csv"), {});
  const std::vector<double>& index = log.column("index_mcp_deg").value;
  for (std::size_t k = 0; k < index.size(); ++k) {
    EXPECT_NEAR(index[k], 10 + static_cast<double>(k), 1);
    EXPECT_NEAR(log.t_s[k], static_cast<double>(k) / 30, 2e-3);
  }
  const Finished shown = run("monitor --from video.mp4 --joints paper_hand");
  EXPECT_EQ(shown.exit, 0) << shown.err;
  EXPECT_NE(shown.out.find("index_mcp_deg"), std::string::npos);
  EXPECT_EQ(shown.out.find("_quality"), std::string::npos);
}

TEST_F(From, BothSimulatedBoards) {
  FLEXOR_NEEDS_TERMINALS();
  const auto result = json_of("record boards.csv --from boards --for 2 --json");
  EXPECT_EQ(result.at("columns")[1], "index_deg");
  EXPECT_NEAR(result.at("rows").get<double>(), 21, 5);
  EXPECT_NE(result.at("source").get<std::string>().find("Flexor's frames"), std::string::npos);
  const recording::Recording log = recording::read_csv(path("boards.csv"), {"index_deg"});
  EXPECT_GT(*std::ranges::min_element(log.columns[0].value), 10);
  EXPECT_LT(*std::ranges::max_element(log.columns[0].value), 110);
}

TEST_F(From, WhatDoesNotFitIsRefused) {
  write("timeless.csv", "index,middle\n1,2\n3,4\n");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"monitor --from log.csv --port /dev/null", "excludes"},
      {"record x.csv --from twin --baud 9600", "excludes"},
      {"monitor --from none.csv", "no such file"},
      {"ports --ask --port none", "no such port"},
      {"monitor --from none.mp4 --joints paper_hand", "none.mp4"},
      {"monitor --from none.mp4", "needs --joints"},
      {"monitor --from twin --joints paper_hand", "no camera"},
      {"monitor --from twin --readings", "--readings is for"},
      {"monitor --from twin --speed 2", "for recordings"},
      {"monitor --from log.csv --speed 0", "must lie between"},
      {"monitor --joints paper_hand", "requires --from"},
      {"record x.csv --from timeless.csv", "no time column"}};
  for (const auto& [arguments, reason] : cases) expect_refused(arguments, 2, reason);
}

}  // namespace from_test
}  // namespace flexor::cli
