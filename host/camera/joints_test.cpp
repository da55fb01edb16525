#include "host/camera/joints.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "host/io/refusal_test.hpp"

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
  return io::refusal_of([&] { (void)joints_from_json(text, "hand.json"); });
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
      {"flexor-joints", "flexor-model", "must be \"flexor-joints\""},
      {"\"schema_version\": 1", "\"schema_version\": 2", "update Flexor"},
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

TEST(Joints, NumbersThatNoHandOrPictureHasAreNamed) {
  const std::vector<std::array<std::string, 3>> cases = {
      {R"(["b", "c", 1]])", R"(["b", "c", 1e300]])", "link 2: must be"},
      {R"("positive_turn")", R"("length_tolerance": 1e300, "positive_turn")",
       "\"length_tolerance\" is 1e+300; it must lie between 0.001 and 1000"},
      {R"("name": "j",)", R"("name": "j", "offset_deg": 1e300,)",
       "\"offset_deg\" is 1e+300; it must lie between -360 and 360"},
      {R"("name": "j",)", R"("name": "j", "range_deg": [-1e308, 1e308],)",
       "\"range_deg\" is -1e+308; it must lie between -1000 and 1000"},
      {R"("automatic")", R"("automatic", "start": {"a": [1e300, 0]})",
       "the start of \"a\" must be [x, y] in pixels"},
  };
  for (const auto& [from, to, expected] : cases) {
    const std::string message = error(changed(from, to));
    EXPECT_NE(message.find(expected), std::string::npos) << message;
  }
  const auto colour = [](const std::string& field, const std::string& value) {
    std::string model = R"({"weight_bgr": [-0.5, 0.8, -0.3], "level": 90, "background": 20, "area_px": 110})";
    const auto at = model.find(field) + field.size() + 3;
    model.replace(at, model.find_first_of(model[at] == '[' ? "]" : ",}", at) - at + (model[at] == '['),
                  value);
    return error(changed("\"automatic\"", model));
  };
  EXPECT_EQ(colour("level", "90"), "accepted");
  EXPECT_NE(colour("weight_bgr", "[1e300, 0, 0]").find("between -1 and 1"), std::string::npos);
  EXPECT_NE(colour("level", "1e300").find("\"level\" is 1e+300"), std::string::npos);
  EXPECT_NE(colour("background", "-1e300").find("\"background\" is -1e+300"), std::string::npos);
  EXPECT_NE(colour("area_px", "-1").find("\"area_px\" is -1"), std::string::npos);
}

TEST(Joints, APrintedMarksNumberIsTakenAsItIsWritten) {
  const auto printed = [](const std::string& id, const std::string& size_mm) {
    return error(R"({"schema": "flexor-joints", "schema_version": 1, "name": "x", "skeletons": [{"name": "s",
      "marks": {"kind": "printed", "dictionary": "apriltag_36h11", "size_mm": )" +
                 size_mm + R"(, "ids": {"a": 1, "b": )" + id +
                 R"(}}, "angles": [{"name": "j", "marks": ["a", "b"]}]}]})");
  };
  EXPECT_EQ(printed("586", "12"), "accepted");
  EXPECT_NE(printed("4294967296", "12").find("a whole number from 0 to 586"), std::string::npos);
  EXPECT_NE(printed("2", "1e300").find("\"size_mm\" is 1e+300; it must lie between 0.1 and 10000"),
            std::string::npos);
}

}  // namespace
}  // namespace flexor::camera
