#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <thread>

#include "apps/cli/commands.hpp"
#include "host/io/posix.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::cli {
namespace protocol_command {

struct Options {
  bool json = false;
  bool list = false;
};

constexpr double kReady_s = 5;  // to start both recordings
constexpr double kFrame_s = 0.1;
constexpr int kIndex = 1;  // its finger is shown; the others follow a little after one another

struct Move {
  double start_s = 0;
  double percent = 0;  // of the way from the open hand to the fist
  double speed_deg_s = 0;
};

// From its first move on.
struct Part {
  double start_s;
  const char* what;
  const char* purpose;
};
constexpr std::array<Part, 5> kParts = {{
    {0, "Close halfway and open, quickly, 3 times", "matches the two clocks"},
    {7.5, "Close in four steps and open, with holds", "shows hysteresis and creep"},
    {24.85, "Each finger to places of its own", "shows what one does to the next"},
    {48.75, "Close all the way and open, at 3 speeds", "shows a sensor's blind ends"},
    {68.58, "Each finger to places of its own", "shows what is no script"},
}};

struct Motion {
  twin::Motion motion = study::recommended_motion();
  Json document = io::parse_json(motion.document(), "the recommended motion");
  double open_deg = document.at("poses").at("open").at("index");
  double closed_deg = document.at("poses").at("closed").at("index");
  std::vector<Move> moves = {};

  Motion() {
    for (const Json& move : document.at("moves")) {
      if (move.at("fingers").at(0) == "index")
        moves.push_back({move.at("start_s"), percent(move.at("to")), move.at("speed_deg_s")});
    }
  }
  double percent(double angle_deg) const { return 100 * (angle_deg - open_deg) / (closed_deg - open_deg); }
  double percent_at(double t_s) const { return percent(motion.angle(kIndex, t_s, {})); }
};

const char* pace(double speed_deg_s) {
  if (speed_deg_s < 30) return "very slowly";
  if (speed_deg_s < 70) return "slowly";
  return speed_deg_s < 100 ? "as you always do" : "quickly";
}

std::string clock(double t_s) {
  const int whole_s = static_cast<int>(std::max(0.0, t_s));
  return fmt::format("{}:{:02}", whole_s / 60, whole_s % 60);
}

// `at`: how many moves have begun.
std::string in_words(const std::vector<Move>& moves, std::size_t at) {
  if (at == 0) return "Start both recordings, and hold your hand open";
  if (at > moves.size()) return "The end";
  const Move& move = moves[at - 1];
  const double before = at == 1 ? 0 : moves[at - 2].percent;
  const std::string to =
      std::abs(move.percent - 50) < 49 ? fmt::format("to {:.0f} %", move.percent) : "all the way";
  return fmt::format("{} {}, {}", move.percent > before ? "Close" : "Open", to, pace(move.speed_deg_s));
}

// A line that the terminal would break is cut off by it. The last thing is a line's end: all goes out in one write.
std::string frame(const Motion& m, std::size_t at, double t_s) {
  constexpr int kWidth = 50;
  const auto part = std::ranges::find_if(kParts.rbegin(), kParts.rend() - 1,
                                         [&](const Part& p) { return p.start_s <= t_s; });
  const double end_s = at < m.moves.size() ? m.moves[at].start_s : m.motion.duration_s();
  const double percent = std::clamp(m.percent_at(t_s), 0.0, 100.0);
  const int filled = static_cast<int>(std::lround(kWidth * percent / 100));
  return fmt::format(
      "\033[?7l\033[KPart {} of {}: {}\n"
      "\033[KNow   {}: {:.0f} s\n"
      "\033[KNext  {}\n"
      "\033[K{:█<{}}{:·<{}} {:3.0f} % closed\n"
      "\033[K{} of {}; Ctrl-C ends this\033[?7h\n",
      kParts.rend() - part, kParts.size(), part->what, in_words(m.moves, at), std::ceil(end_s - t_s),
      in_words(m.moves, at + 1), "", filled, "", kWidth - filled, percent, clock(t_s),
      clock(m.motion.duration_s()));
}

void list() {
  print(
      "The motion to identify a compensator from, glove and camera recording. Start with an open hand.\n"
      "Let your fingers follow a little after one another, thumb first, but for parts 3 and 5, where each "
      "goes its own way; seconds\n"
      "need not be met.\n"
      "In a terminal, flexor protocol leads through it, with a bell at each change.\n\n");
  const double duration_s = study::recommended_motion().duration_s();
  for (const Part& part : kParts) {
    const double end_s = &part == &kParts.back() ? duration_s : (&part + 1)->start_s;
    print(fmt::format("{}-{}  {:<41} {}\n", clock(part.start_s), clock(end_s), part.what, part.purpose));
  }
}

void run(const Options& o) {
  if (o.json) {
    const Motion m;
    Json moves = Json::array();
    for (const auto& [start_s, percent, speed_deg_s] : m.moves)
      moves.push_back({{"start_s", start_s}, {"percent", std::round(percent)}, {"speed_deg_s", speed_deg_s}});
    return print({{{"duration_s", m.document.at("duration_s")}, {"moves", moves}}, ""}, true);
  }
  if (o.list || isatty(STDOUT_FILENO) == 0) return list();
  const auto wait = [begin = std::chrono::steady_clock::now()](double t_s) {
    using Seconds = std::chrono::duration<double>;
    std::this_thread::sleep_until(begin + Seconds(kReady_s + t_s));
    return Seconds(std::chrono::steady_clock::now() - begin).count() - kReady_s;
  };
  guide_motion(wait, print_as_it_is);
}

}  // namespace protocol_command

void guide_motion(const std::function<double(double t_s)>& wait,
                  const std::function<void(const std::string& text)>& write) {
  using namespace protocol_command;
  const Motion m;
  write(
      "The bar is the index finger's. Let the others follow a little after one another, thumb first; in "
      "parts 3 and 5 each goes its own\n"
      "way. Seconds need not be met.\n\n");
  std::size_t at = 0;
  double t_s = wait(-kReady_s);
  for (std::string before; t_s < m.motion.duration_s(); before = "\033[5A") {
    const std::size_t last = at;
    while (at < m.moves.size() && m.moves[at].start_s <= t_s) ++at;
    write(before + (at > last ? "\a" : "") + frame(m, at, t_s));
    t_s = wait(t_s + kFrame_s);
  }
  write("\aThat is all: end both recordings.\n");
}

void protocol_command::add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "protocol", "The motion to record a glove and a camera with: in a terminal a guide through it",
      run, "one JSON object on standard output: every move");
  command->add_flag("--list", o->list, "its parts and what each is for, as where the output is no terminal");
}

}  // namespace flexor::cli
