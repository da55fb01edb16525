#include "host/camera/joints.hpp"

#include <gtest/gtest.h>

#include "host/io/expect_test.hpp"

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

TEST(Joints, MistakesAreNamedWithTheirPlace) {
  EXPECT_NO_THROW(joints_from_json(changed("\"x\"", "\"x\""), ""));
  const auto colour = [](const std::string& members) {
    return R"({"weight_bgr": [-0.5, 0.8, -0.3], )" + members + "}";
  };
  const std::vector<std::array<std::string, 3>> cases = {
      {"flexor-joints", "flexor-model", "must be \"flexor-joints\""},
      {R"(["b", "c", 1]])", R"(["b", "d", 1]])", "no mark is called \"d\"; there are: a, b, c"},
      {R"(["b", "c", 1]])", R"(["c", "b", 1]])", "must begin at a mark that an earlier link reaches"},
      {R"(, ["b", "c", 1]])", "]", "no link reaches mark \"c\""},
      {R"(["b", "c", 1]])", R"(["b", "c", 1e300]])", "link 2: must be"},
      {R"("c"], "colour")", R"("b"], "colour")", "same name"},
      {"\"automatic\"", "\"greenish\"", "#rrggbb"},
      {"\"automatic\"", R"("automatic", "start": {"a": [1e300, 0]})", "the start of \"a\" must be [x, y]"},
      {"\"automatic\"", colour(R"("level": 1e300, "background": 20, "area_px": 110)"), "\"level\" is 1e+300"},
      {"\"automatic\"", colour(R"("level": 90, "background": -1e300, "area_px": 1)"),
       "\"background\" is -1e+300"},
      {"\"automatic\"", colour(R"("level": 90, "background": 20, "area_px": -1)"), "\"area_px\" is -1"},
      {"\"clockwise\"", "\"left\"", "counterclockwise"},
      {"\"positive_turn\"", R"("length_tolerance": 1e300, "positive_turn")",
       "\"length_tolerance\" is 1e+300"},
      {R"("marks": ["a", "b", "c"])", R"("marks": ["a", "b"])", "three marks, or four"},
      {R"("name": "j",)", R"("name": "j k",)", "becomes a column"},
      {R"("name": "j",)", R"("name": "j", "offset_deg": 1e300,)", "\"offset_deg\" is 1e+300"},
      {R"("name": "j",)", R"("name": "j", "range_deg": [90, -5],)", "[smallest, largest]"},
      {R"("name": "j",)", R"("name": "j", "measure": "bend",)", "\"turn\" or \"opening\""},
      {R"("name": "j",)", R"("name": "j", "colour": 3,)", "unknown key"},
  };
  for (const auto& [from, to, expected] : cases) {
    const std::string text = changed(from, to);
    io::expect_refused([&] { (void)joints_from_json(text, "hand.json"); }, expected);
  }
}

TEST(Joints, APrintedMarksNumberIsTakenAsItIsWritten) {
  const auto printed = [](const std::string& id) {
    return io::refusal_of([&] {
      (void)joints_from_json(
          R"({"schema": "flexor-joints", "schema_version": 1, "name": "x", "skeletons": [{"name": "s",
      "marks": {"kind": "printed", "dictionary": "apriltag_36h11", "size_mm": 12, "ids": {"a": 1, "b": )" +
              id + R"(}}, "angles": [{"name": "j", "marks": ["a", "b"]}]}]})",
          "hand.json");
    });
  };
  EXPECT_EQ(printed("586"), "accepted");
  io::expect_line(printed("4294967296"), "a whole number from 0 to 586");
}

}  // namespace
}  // namespace flexor::camera
