#include "host/camera/joints.hpp"

#include <gtest/gtest.h>

#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

TEST(Joints, ShippedFilesLoadAndRoundTrip) {
  for (const char* name : {"green_markers", "paper_hand", "printed_finger"}) {
    const Joints joints = load_joints(std::string(FLEXOR_SOURCE_DIR "/models/joints/") + name + ".json");
    EXPECT_EQ(joints.name, name);
    const std::string text = to_json(joints);
    EXPECT_EQ(to_json(joints_from_json(text, "again")), text);
  }
}

TEST(Joints, TheArticlesThumbReadsNinetyWhenTheOthersReadZero) {
  const Joints hand = load_joints(FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json");
  ASSERT_EQ(hand.skeletons.size(), 5U);
  EXPECT_EQ(hand.skeletons[0].angles[0].name, "thumb_mcp");
  EXPECT_EQ(hand.skeletons[0].angles[0].offset_deg, 90);
  EXPECT_EQ(hand.skeletons[1].angles[0].offset_deg, 0);
}

std::string error(const std::string& text) {
  try {
    (void)joints_from_json(text, "hand.json");
  } catch (const io::InputError& e) {
    return e.what();
  }
  return "accepted";
}

// A file with one thing changed.
std::string changed(const std::string& from, const std::string& to) {
  std::string text =
      R"({"schema": "flexor-joints", "schema_version": 1, "name": "x", "skeletons": [{"name": "s",
    "marks": {"kind": "colour", "names": ["a", "b", "c"], "colour": "automatic"},
    "links": [["a", "b", 1], ["b", "c", 1]], "positive_turn": {"view": "clockwise"},
    "angles": [{"name": "j", "marks": ["a", "b", "c"]}]}]})";
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Joints, MistakesAreNamedWithTheirPlaceAndTheMend) {
  EXPECT_EQ(error(changed("\"x\"", "\"x\"")), "accepted");
  const std::vector<std::array<std::string, 3>> cases = {
      {"flexor-joints", "flexor-model", "not a joint file"},
      {"\"schema_version\": 1", "\"schema_version\": 2", "newer flexor"},
      {R"(["b", "c", 1]])", R"(["b", "d", 1]])", "no mark is called \"d\"; there are: a, b, c"},
      {R"(["b", "c", 1]])", R"(["c", "b", 1]])", "must begin at a mark that an earlier link reaches"},
      {R"(, ["b", "c", 1]])", "]", "no link reaches mark \"c\""},
      {R"(["b", "c", 1]])", R"(["b", "c", 0]])", "link 2"},
      {R"("c"], "colour")", R"("b"], "colour")", "same name"},
      {"\"automatic\"", "\"greenish\"", "#rrggbb"},
      {"\"clockwise\"", "\"left\"", "counterclockwise"},
      {R"("marks": ["a", "b", "c"])", R"("marks": ["a", "b"])", "three marks, or four"},
      {R"("name": "j",)", R"("name": "j k",)", "becomes a column"},
      {R"("name": "j",)", R"("name": "j", "range_deg": [90, -5],)", "[smallest, largest]"},
      {R"("name": "j",)", R"("name": "j", "measure": "bend",)", "\"turn\" or \"opening\""},
      {R"("name": "j",)", R"("name": "j", "colour": 3,)", "unknown key"},
  };
  for (const auto& [from, to, expected] : cases) {
    const std::string message = error(changed(from, to));
    EXPECT_NE(message.find(expected), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_EQ(message.find("hand.json"), 0U) << message;
  }
}

}  // namespace
}  // namespace flexor::camera
