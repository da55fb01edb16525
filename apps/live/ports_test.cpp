// Gloves at serial ports as a page sees them.
#include "apps/live/test_program.hpp"
#include "host/io/test_terminal.hpp"
#include "host/listen/test_board.hpp"

namespace flexor::live {
namespace {

using listen::Board;
using listen::FramesGlove;

class Ports : public Program {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }
};

bool says(const Json& text, const char* what) {
  return text.is_string() && text.get<std::string>().find(what) != std::string::npos;
}

TEST_F(Ports, AGloveThatSendsAnglesAloneMovesAndSaysWhatItLacks) {
  FramesGlove frames({}, false);
  Board glove(std::ref(frames));
  begin({"--port", glove.port()});
  const Json state = state_when([](const Json& s) { return s.at("fingers").size() == 5; });
  ASSERT_FALSE(state.is_null());
  EXPECT_EQ(state["fingers"][0]["unit"], "deg");
  const double first_deg = state["fingers"][0]["angle_deg"];
  EXPECT_FALSE(
      state_when([&](const Json& s) { return s["fingers"][0]["angle_deg"] != first_deg; }).is_null());
  EXPECT_TRUE(says(state["device"]["format"], "compensated on the glove")) << state["device"];
  EXPECT_TRUE(says(state["next"], "A calibration needs readings")) << state["next"];
  EXPECT_TRUE(state["link"]["lost"].is_number()) << "its angles have a counter";
  expect_refused({{"do", "calibrate.start"}, {"person", "anna"}, {"side", "left"}, {"reference", "poses"}},
                 "no readings");
  EXPECT_TRUE(ask({{"do", "record.start"}}).at("ok").get<bool>());
}

TEST_F(Ports, AGloveThatWaitsForItsHandGivesItsReadings) {
  FramesGlove frames(link::Key{{1, 2, 3}}, true);
  Board glove(std::ref(frames));
  begin({"--port", glove.port()});
  const Json state = state_when([](const Json& s) { return s.at("fingers").size() == 5; });
  ASSERT_FALSE(state.is_null());
  EXPECT_EQ(state["fingers"][0]["unit"], "count");
  EXPECT_TRUE(says(state["device"]["format"], "nothing guards its readings")) << state["device"];
  EXPECT_TRUE(state["link"]["lost"].is_null()) << "readings have no counter";
  EXPECT_TRUE(ask({{"do", "record.start"}}).at("ok").get<bool>());
}

}  // namespace
}  // namespace flexor::live
