#include "host/model/model.hpp"

#include <gtest/gtest.h>

#include <set>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"

namespace flexor::model {
namespace {
namespace fs = std::filesystem;
using io::expect_line;

// One joint from one sensor.
Channel chain() {
  Channel c;
  c.name = "index";
  c.input_column = "SensorA1";
  c.input_unit = "count";
  c.rest_deg = 20;
  c.dead_zone = DeadZone{-10.1, 1.0 / 3.0};
  c.hysteresis = Hysteresis{{3, 7.7}, {0.5, -0.25}};
  c.input_curve = Curve{{0, 300, 700.7}, {10, 20, 95.3}};
  c.lti = Lti{1, 0, {-12, -0.7}, {0, 1.25}};
  c.output_curve = Curve{{0, 100}, {0, 99}};
  c.saturation = Saturation{5, 101};
  return c;
}

TEST(Model, NamesTheColumnThatFeedsEachInputUnlessOneIsGivenForEach) {
  Model m;
  m.inputs.resize(2);
  m.inputs[0].name = "index";
  m.inputs[1].name = "middle";
  m.inputs[1].column = "SensorA2";
  EXPECT_EQ(columns_of(m, {}), (std::vector<std::string>{"index", "SensorA2"}));
  EXPECT_EQ(columns_of(m, {"b", "a"}), (std::vector<std::string>{"b", "a"}));
  EXPECT_THROW((void)columns_of(m, {"a"}), io::InputError);
  EXPECT_THROW((void)columns_of(m, {"a", "b", "c"}), io::InputError);
}

// Two sensors, two joints, and every kind once.
Model example() {
  Model m;
  m.name = "example";
  m.description = "d";
  m.written_by = "test";
  m.sample_period_s = 0.05;
  m.max_gap_s = 0.25;
  m.inputs = {{"a", "SensorA1", "count", "index", 0, 1023}, {"b", "", "", "", -5, 5.5}};
  m.blocks = {{{"a"}, "zone", DeadZone{-10.1, 1.0 / 3.0}},
              {{"zone"}, "play", Play{0.1}},
              {{"play"}, "bank", Hysteresis{{3, 7.7}, {0.5, -0.25}}},
              {{"bank"}, "curve", Curve{{0, 300, 700.7}, {10, 20, 95.3}}},
              {{"b"}, "gain", Gain{-7, 1.0 / 7.0}},
              {{"curve", "gain", "curve"}, "both", Sum{{0.5, 0.25, 1.0 / 3.0}, -2}},
              {{"both"}, "lag", Lti{1, 0, {-12, -0.7}, {0, 1.25}}},
              {{"lag"}, "swing", PolePair{9, 0.3, {0.1, -0.2}}},
              {{"swing"}, "angle", Saturation{5, 101}},
              {{"gain"}, "other", Saturation{0, 90}},
              {{"b"}, "slow", Lag{0.7}}};
  m.joints = {{"index_mcp", "angle", 10}, {"wrist", "other", 0}, {"pinky", "angle", 7}};
  m.training = {{"split", 0.5}};
  m.fit = {{"rmse_deg", 1.5}};
  return m;
}

std::string reason(const std::string& text) {
  return io::refusal_of([&] { (void)from_json(text, "m.json"); });
}

// Of the example, changed in one place; null: taken out of it.
std::string edited(const std::string& place, const Json& value) {
  const Json patch = {{{"op", value.is_null() ? "remove" : "add"}, {"path", place}, {"value", value}}};
  return reason(Json::parse(to_json(example())).patch(patch).dump());
}

TEST(Model, ASavedDocumentLoadsEqual) {
  const fs::path path = fs::path(testing::TempDir()) / "saved_model.json";
  save(example(), path);
  EXPECT_EQ(load(path), example());
  fs::remove(path);
}

TEST(Model, EveryKindHasANameOfItsOwnAndItsMembersInWords) {
  std::set<std::string> types;
  for (const Block& block : example().blocks) {
    EXPECT_FALSE(text_of(block.kind).empty()) << type_of(block.kind);
    types.insert(type_of(block.kind));
  }
  EXPECT_EQ(types.size(), std::variant_size_v<Kind>) << "a kind is missing above, or two have one name";
}

TEST(Model, OptionalBlocksMayBeLeftOut) {
  Channel c = chain();
  c.input_curve.reset();  // the other stays behind the lti
  EXPECT_EQ(channel(from_json(to_json(model_of(c, 0.05)), "m.json"), 0), c);
  c.dead_zone.reset();
  c.hysteresis.reset();
  c.output_curve.reset();
  c.pair = PolePair{9, 0.3, {0.1, -0.2}};
  EXPECT_EQ(channel(from_json(to_json(model_of(c, 0.05)), "m.json"), 0), c);
}

TEST(Model, OnlyAChainInAChannelsOrderIsAChannel) {
  const Model two = [] {
    Model m = model_of(chain(), 0.05);
    Channel c = chain();
    c.name = "ring";
    add(m, c);
    return m;
  }();
  ASSERT_EQ(two.joints.size(), 2u);
  EXPECT_EQ(channel(two, 0), chain());
  EXPECT_EQ(channel(two, 1)->name, "ring");
  EXPECT_NE(two.inputs[0].name, two.inputs[1].name) << "both come from one column, but names are given once";
  EXPECT_EQ(channel(example(), 0), std::nullopt);
  EXPECT_EQ(channel(example(), 1), std::nullopt);
}

TEST(Model, ReadsThePapersAndTheClinicsNames) {
  EXPECT_EQ(finger("pointer"), "index");
  EXPECT_EQ(finger("little"), "pinky");
  EXPECT_THROW((void)finger("toe"), io::InputError);
  EXPECT_EQ(joint_name("little_dip"), "pinky_dip");
  EXPECT_EQ(joint_name("wrist"), "wrist");
}

TEST(Model, RefusesANewerSchemaByName) {
  const auto what = edited("/schema_version", 3);
  expect_line(what, "m.json: has schema_version 3");
  expect_line(what, "update Flexor");
  expect_line(edited("/schema_version", 0), "whole number from 1 to 2");
}

TEST(Model, RefusesATruncatedFileWithThePlaceAndANumberThatNoDoubleHolds) {
  const std::string text = to_json(example());
  expect_line(reason(text.substr(0, text.size() / 2)), "m.json: not valid JSON at line");
  EXPECT_EQ(reason("{\"sample_period_s\": 1E400}"), "m.json: number overflow parsing '1E400'");
}

TEST(Model, NamesSignalBlockAndRule) {
  expect_line(edited("/blocks/0/uper", 1), "m.json: blocks[0]: unknown key \"uper\"");
  expect_line(edited("/inputs/1/valid_min", nullptr), "m.json: inputs[1]: \"valid_min\" is missing");
  expect_line(edited("/joints/1/rest_deg", nullptr), "m.json: joints[1]: \"rest_deg\" is missing");
  expect_line(edited("/blocks/1/type", "friction"),
              "m.json: blocks[1]: unknown block \"friction\"; known: gain, dead_zone, curve, play");
  expect_line(edited("/blocks/1/from", {"a", 3}), "m.json: blocks[1]: \"from\" must be a signal's name");
  expect_line(edited("/blocks/6/poles_rad_s/0", 12), "m.json: lag: lti: poles must be negative");
  expect_line(edited("/channels", Json::array()), "m.json: unknown key \"channels\"");
}

TEST(Model, RefusesAGraphThatDoesNotFitTogether) {
  expect_line(edited("/blocks/0/from", "c"), "m.json: zone: dead_zone: no signal \"c\" comes before it");
  // A cycle: of two blocks that take one another, one comes first.
  expect_line(edited("/blocks/0/from", "play"),
              "m.json: zone: dead_zone: no signal \"play\" comes before it");
  expect_line(edited("/blocks/1/to", "zone"), "m.json: zone: two signals have this name");
  expect_line(edited("/blocks/0/to", "b"), "m.json: b: two signals have this name");
  expect_line(edited("/inputs/1/name", "a"), "m.json: a: two signals have this name");
  expect_line(edited("/blocks/0/to", "two\nlines"), "m.json: block \"two\\nlines\" needs");
  for (const char* signal : {"swing", "a"})
    expect_line(edited("/joints/0/from", signal), "m.json: index_mcp: joint: must come from a saturation");
  expect_line(edited("/joints/0/from", "nowhere"), "m.json: index_mcp: joint: no signal \"nowhere\"");
  expect_line(edited("/joints/1/name", "index_mcp"), "m.json: index_mcp: joint: occurs twice");
  expect_line(edited("/blocks/0/from", {"a", "b"}), "m.json: zone: dead_zone: takes 1 to 1 signals");
  expect_line(edited("/blocks/5/from", {"a", "b"}),
              fmt::format("m.json: both: sum: takes 1 to {} signals", kMaxTerms));
  Model m = example();
  m.blocks[5].from.assign(kMaxTerms + 1, "a");
  m.blocks[5].kind = Sum{std::vector<double>(kMaxTerms + 1, 0.1), 0};
  expect_line(reason(to_json(m)), fmt::format("m.json: both: sum: takes 1 to {} signals", kMaxTerms));
  expect_line(edited("/joints", Json::array()), "m.json: \"joints\" must be a list, not empty");
}

TEST(Model, ADiagramStatesThatTheSearchWasStopped) {
  Model m = example();
  m.fit = {{"joints", {{"index", {{"holdout", {{"rmse_deg", 2.5}}}, {"untried_structures", 3}}}}}};
  EXPECT_NE(diagram(m).find("fitted, by a search that was stopped"), std::string::npos);
}

TEST(Model, SavingABrokenModelWritesNothing) {
  Model m = example();
  m.sample_period_s = 0;
  const fs::path path = fs::path(testing::TempDir()) / "broken_model.json";
  fs::remove(path);
  EXPECT_THROW(save(m, path), io::InputError);
  EXPECT_FALSE(fs::exists(path));
}

}  // namespace
}  // namespace flexor::model
