// Gloves at serial ports as a page sees them.
#include <algorithm>
#include <atomic>
#include <cstring>

#include "apps/live/live.hpp"
#include "apps/live/messages.hpp"
#include "apps/live/program_test.hpp"
#include "host/io/terminal_test.hpp"
#include "host/listen/test_board.hpp"

namespace flexor::live {
namespace ports_test {

using listen::Board;
using listen::FramesGlove;

class Ports : public Program {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }
};

bool holds(const Json& text, const char* what) {
  return text.is_string() && text.get<std::string>().find(what) != std::string::npos;
}

TEST_F(Ports, AGloveThatSendsAnglesAloneMovesAndReportsWhatItLacks) {
  FramesGlove frames({}, false);
  Board glove(std::ref(frames));
  begin({"--port", glove.port()});
  const Json state = five_fingers();
  EXPECT_EQ(state["fingers"][0]["unit"], "deg");
  const double first_deg = state["fingers"][0]["angle_deg"];
  state_when([&](const Json& s) { return s["fingers"][0]["angle_deg"] != first_deg; });
  EXPECT_TRUE(holds(state["device"]["format"], "compensated on the glove")) << state["device"];
  EXPECT_EQ(state["next"]["kind"], "compensated");
  EXPECT_TRUE(state["link"]["lost"].is_number()) << "its angles have a counter";
  expect_refused({{"do", "calibrate.start"}, {"person", "anna"}, {"side", "left"}, {"reference", "poses"}},
                 "no_readings");
  done({{"do", "record.start"}});
}

TEST_F(Ports, AGloveThatWaitsForItsHandGivesItsReadings) {
  FramesGlove frames(link::Key{{1, 2, 3}}, true);
  Board glove(std::ref(frames));
  begin({"--port", glove.port()});
  const Json state = five_fingers();
  EXPECT_EQ(state["fingers"][0]["unit"], "count");
  EXPECT_TRUE(holds(state["device"]["format"], "nothing guards its readings")) << state["device"];
  EXPECT_TRUE(state["link"]["lost"].is_null()) << "readings have no counter";
  done({{"do", "record.start"}});
}

// A hand in touch with its glove, one finger of it stalled.
std::string hand_sends(link::HandEnd& hand) {
  const std::vector<std::uint8_t> bytes = listen::telemetry(hand, false);
  return {bytes.begin(), bytes.end()};
}

TEST_F(Ports, AHandIsShownAndRecordedBesideTheGlove) {
  FramesGlove frames({}, true);
  Board glove(std::ref(frames));
  link::HandEnd end(nullptr);
  Board hand([&](const std::string&) { return hand_sends(end); });
  begin({"--port", glove.port(), "--hand", hand.port()});
  const auto both = [](const Json& s) { return s.at("fingers").size() == 5 && s.at("hand").is_object(); };
  const Json state = state_when(both);
  EXPECT_EQ(state["device"]["port"], glove.port());
  EXPECT_EQ(state["hand"]["port"], hand.port());
  const Json connected = state_when([](const Json& s) { return s["hand"]["status"] == "connected"; });
  EXPECT_EQ(connected["hand"]["faults"], Json({"", "stalled", "", "", ""}));
  EXPECT_TRUE(holds(connected["hand"]["board"], "supply dip"));

  std::string rows;
  while (rows.empty() || rows[0] != static_cast<char>(Kind::hand)) rows = tab_->receive().second;
  ASSERT_EQ((rows.size() - 4) % (8 + 2 * 5 * 4), 0U)
      << "whole rows, several where the page was not asked for long";
  float index_deg = 0;
  std::memcpy(&index_deg, rows.data() + 4 + 8 + (5 + 1) * sizeof index_deg, sizeof index_deg);
  EXPECT_EQ(index_deg, 45);

  done({{"do", "record.start"}});
  const Json grown =
      state_when([](const Json& s) { return s.at("recording").is_object() && s["recording"]["rows"] > 30; });
  done({{"do", "record.stop"}});
  const auto log = folder_.path() / "sessions" / grown["recording"]["file"].get<std::string>();
  const std::string text = io::read_file(log.parent_path() / "hand.csv");
  EXPECT_TRUE(text.starts_with("t_s,host_s,thumb_deg,index_deg")) << text.substr(0, text.find('\n'));
  EXPECT_GT(std::count(text.begin(), text.end(), '\n'), 10);

  hand.unplug();
  const Json gone = state_when([](const Json& s) { return s["hand"]["status"] == "gone"; });
  EXPECT_EQ(gone["device"]["status"], "glove");
  done({{"do", "device.leave"}});
  state_when([](const Json& s) { return s.at("hand").is_null() && s["device"]["status"] == "none"; });
}

TEST_F(Ports, AHandThatIsChosenLaterLeavesTheGloveWhereItIs) {
  FramesGlove frames({}, true);
  Board glove(std::ref(frames));
  const link::Key key = {{1, 2, 3}};
  link::HandEnd end(&key);
  end.start(1);
  std::atomic<bool> in_touch = false;
  link::HandEnd open(nullptr);
  Board hand([&](const std::string&) {
    if (in_touch) return hand_sends(open);
    std::array<std::uint8_t, link::kMaxWire> wire{};
    const std::uint8_t size = end.challenge(wire.data());
    return std::string(wire.begin(), wire.begin() + size);
  });
  begin({"--port", glove.port(), "--model", FLEXOR_SOURCE_DIR "/models/published_hw.json"});
  five_fingers();
  expect_refused({{"do", "flash"}, {"board", "hand"}}, "no_board");
  done({{"do", "device.connect"}, {"port", hand.port()}});
  const Json waits = state_when([](const Json& s) {
    EXPECT_EQ(s["device"]["status"], "glove") << "all the time";
    return s.at("hand").is_object();
  });
  EXPECT_EQ(waits["hand"]["status"], "waits");
  EXPECT_EQ(waits["device"]["port"], glove.port());
  in_touch = true;
  state_when([](const Json& s) { return s["hand"]["status"] == "connected"; });
}

TEST_F(Ports, WhatIsChosenAndNotUnderstoodChangesNothing) {
  FramesGlove frames({}, true);
  Board glove(std::ref(frames));
  Board silent([](const std::string&) { return std::string(); });
  begin({"--port", glove.port()});
  five_fingers();
  done({{"do", "device.connect"}, {"port", silent.port()}});
  const Json state = state_when([](const Json& s) { return s.at("last").is_object(); });
  EXPECT_TRUE(holds(state["last"]["text"], "nothing comes")) << state["last"];
  EXPECT_EQ(state["device"]["status"], "glove");
  EXPECT_EQ(state["fingers"].size(), 5U);
}

TEST_F(Ports, AGloveThatIsSwitchedOnLaterIsFoundAtTheNamedPort) {
  FramesGlove frames({}, true);
  std::atomic<bool> is_on = false;
  Board glove([&](const std::string& received) { return is_on ? frames(received) : std::string(); });
  begin({"--port", glove.port()});
  const Json silent = state_when([](const Json& s) { return holds(s["device"]["says"], "nothing comes"); });
  is_on = true;
  state_when([](const Json& s) { return s["device"]["status"] == "glove"; });
}

TEST_F(Ports, AGloveAtTheHandsPortDoesNotTakeTheGlovesPlace) {
  FramesGlove frames({}, true);
  Board glove(std::ref(frames));
  FramesGlove others({}, true);
  Board other(std::ref(others));
  begin({"--port", glove.port(), "--hand", other.port()});
  const Json state = state_when([](const Json& s) { return s["last"].is_object(); });
  EXPECT_TRUE(holds(state["last"]["text"], "--hand names a glove's port")) << state["last"];
  EXPECT_EQ(state["device"]["port"], glove.port());
  EXPECT_TRUE(state["hand"].is_null());
}

TEST_F(Ports, RowsThatFitNoLongerAreShownAndReportedAtTheStop) {
  std::atomic<bool> is_short = false;
  Board glove([&](const std::string&) { return is_short ? "1,2,3\n" : "1,2,3,4,5\n"; });
  begin({"--port", glove.port()});
  five_fingers();
  done({{"do", "record.start"}});
  is_short = true;
  const Json state = state_when([](const Json& s) {
    return s["next"]["kind"] == "misfit" && holds(s["next"]["why"], "3 values, and 5 are expected");
  });
  EXPECT_TRUE(holds(state["device"]["says"], "3 values, and 5 are expected")) << state["device"];
  done({{"do", "record.stop"}});
  const Json stopped = state_when([](const Json& s) { return s["last"].is_object(); });
  EXPECT_FALSE(stopped["last"]["ok"].get<bool>());
  EXPECT_TRUE(holds(stopped["last"]["text"], "left out")) << stopped["last"];
}

// Plugged in one after the other; neither port was named.
TEST_F(Ports, AGloveAndAHandAreFoundByThemselves) {
  const std::filesystem::path devices = folder_.path() / "dev";
  std::filesystem::create_directories(devices);
  LiveOptions options;
  options.devices = devices;
  options.sessions = folder_.path() / "sessions";
  std::atomic<bool> stop = false;
  Live live(std::move(options));
  std::jthread server([&] { live.run(stop); });
  const std::shared_ptr<void> ends(nullptr, [&](void*) { stop = true; });
  tab_.emplace(Place(live.url()));
  state_when([](const Json& s) { return s["next"]["kind"] == "plug_in"; });

  FramesGlove frames({}, true);
  Board glove(std::ref(frames));
  std::filesystem::create_symlink(glove.port(), devices / "ttyUSB0");
  state_when([](const Json& s) { return s["device"]["status"] == "glove"; });
  link::HandEnd end(nullptr);
  Board hand([&](const std::string&) { return hand_sends(end); });
  std::filesystem::create_symlink(hand.port(), devices / "ttyACM0");
  const Json both = state_when([](const Json& s) { return s["hand"].is_object(); });
  EXPECT_EQ(both["device"]["port"], (devices / "ttyUSB0").string());
  EXPECT_EQ(both["hand"]["port"], (devices / "ttyACM0").string());
}

}  // namespace ports_test
}  // namespace flexor::live
