#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli/commands.hpp"
#include "host/io/json.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::cli {
namespace protocol_command {

using Json = nlohmann::ordered_json;

// What the index finger does; the others follow a little after one another.
struct Move {
  double start_s;
  double percent;  // of the way from the open hand to the fist
  double speed_deg_s;
};

std::vector<Move> moves_of(const Json& document) {
  constexpr const char* kFinger = "index";
  const double open = document.at("poses").at("open").at(kFinger);
  const double closed = document.at("poses").at("closed").at(kFinger);
  std::vector<Move> out;
  for (const Json& move : document.at("moves")) {
    if (move.at("fingers").at(0) != kFinger) continue;
    out.push_back({move.at("start_s"), 100 * (move.at("to").get<double>() - open) / (closed - open),
                   move.at("speed_deg_s")});
  }
  return out;
}

const char* pace(double speed_deg_s) {
  if (speed_deg_s < 30) return "very slowly";
  if (speed_deg_s < 70) return "slowly";
  return speed_deg_s < 100 ? "as you always do" : "quickly";
}

void run(bool json) {
  const Json document = io::parse_json(study::recommended_motion().document(), "the recommended motion");
  const std::vector<Move> moves = moves_of(document);
  if (json) {
    Json list = Json::array();
    for (const Move& m : moves) {
      list.push_back(
          {{"start_s", m.start_s}, {"percent", std::round(m.percent)}, {"speed_deg_s", m.speed_deg_s}});
    }
    print(io::dump(
        Json{{"duration_s", document.at("duration_s")}, {"moves", list}, {"version", FLEXOR_VERSION}}));
    return;
  }
  print(fmt::format(
      "Two minutes to identify a compensator from, glove and camera recording ({:.0f} s). Start with an open "
      "hand. Let "
      "your fingers\nfollow a little after one another, thumb first. 0 % is the open hand, 100 % the "
      "fist. Seconds need not be met.\n\n",
      document.at("duration_s").get<double>()));
  for (const Move& m : moves) {
    print(fmt::format("{:6.1f} s  to {:3.0f} %  {}\n", m.start_s, m.percent, pace(m.speed_deg_s)));
  }
  print(
      "\nWhat each part is for: quick bends match the two clocks; steps with holds show the cloth's "
      "hysteresis and "
      "creep;\nthe full range shows where the strip goes blind; poses in no order show what is no script.\n");
}

}  // namespace protocol_command

void add_protocol(CLI::App& app) {
  using namespace protocol_command;
  auto json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("protocol", "The motion to record a glove and a camera with, second by second");
  command->add_flag("--json", *json, "one JSON object on standard output");
  command->callback([json] { run(*json); });
}

}  // namespace flexor::cli
