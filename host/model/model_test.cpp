#include "host/model/model.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <fstream>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {
namespace fs = std::filesystem;

Model example() {
  Model m;
  m.name = "example";
  m.written_by = "test";
  m.sample_period_s = 0.05;
  Channel c;
  c.name = "index";
  c.input_column = "SensorA1";
  c.input_unit = "count";
  c.dead_zone = DeadZone{-10.1, 1.0 / 3.0};
  c.hysteresis = Hysteresis{{3, 7.7}, {0.5, -0.25}};
  c.input_curve = Curve{{0, 300, 700.7}, {10, 20, 95.3}};
  c.lti = Lti{1, 0, {-12, -0.7}, {0, 1.25}};
  c.output_curve = Curve{{0, 100}, {0, 99}};
  c.saturation = Saturation{5, 101};
  m.channels = {c};
  m.training = {{"split", 0.5}};
  return m;
}

std::string reason(const std::string& text) {
  try {
    (void)from_json(text, "m.json");
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string edited(const std::function<void(nlohmann::ordered_json&)>& edit) {
  auto json = nlohmann::ordered_json::parse(to_json(example()));
  edit(json);
  return reason(json.dump());
}

TEST(Model, RoundTripsExactly) {
  const Model m = example();
  EXPECT_EQ(from_json(to_json(m), "m.json"), m);
  EXPECT_EQ(to_json(from_json(to_json(m), "m.json")), to_json(m));
}

TEST(Model, EveryDoubleRoundTripsExactly) {
  int exponent = 0;
  EXPECT_TRUE(rc::check([&](double gain, double offset) {
    Model m = example();
    // Of any size below the bounds, all bits of the mantissa kept.
    m.channels[0].lti.gain = std::ldexp(std::frexp(gain, &exponent), -std::abs(exponent % 900));
    m.channels[0].lti.offset = std::ldexp(std::frexp(offset, &exponent), -std::abs(exponent % 900));
    RC_ASSERT(from_json(to_json(m), "m.json") == m);
  }));
}

TEST(Model, OptionalBlocksMayBeLeftOut) {
  Model m = example();
  Channel& c = m.channels[0];
  c.dead_zone.reset();
  c.hysteresis.reset();
  c.input_curve.reset();
  c.output_curve.reset();
  EXPECT_EQ(from_json(to_json(m), "m.json"), m);
}

TEST(Model, AnOutputCurveAloneStaysBehindTheLti) {
  Model m = example();
  m.channels[0].input_curve.reset();
  EXPECT_EQ(from_json(to_json(m), "m.json"), m);
}

TEST(Model, ReadsThePapersAndTheClinicsNames) {
  EXPECT_EQ(finger("pointer"), "index");
  EXPECT_EQ(finger("little"), "pinky");
  EXPECT_THROW((void)finger("toe"), io::InputError);
}

TEST(Model, RefusesANewerSchemaByName) {
  const auto what = edited([](auto& j) { j["schema_version"] = 2; });
  EXPECT_NE(what.find("m.json: has schema version 2"), std::string::npos) << what;
  EXPECT_NE(what.find("update Flexor"), std::string::npos);
}

TEST(Model, RefusesATruncatedFileWithThePlace) {
  const std::string text = to_json(example());
  const auto what = reason(text.substr(0, text.size() / 2));
  EXPECT_NE(what.find("m.json: not valid JSON at line"), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos);
}

TEST(Model, RefusesANumberThatNoDoubleHolds) {
  const auto what = reason("{\"sample_period_s\": 1E400}");
  EXPECT_EQ(what, "m.json: number overflow parsing '1E400'");
}

TEST(Model, NamesChannelBlockAndRule) {
  const auto unknown = edited([](auto& j) { j["channels"][0]["blocks"][0]["uper"] = 1; });
  EXPECT_NE(unknown.find("channels[0]: blocks[0]: unknown key \"uper\""), std::string::npos) << unknown;
  const auto unstable = edited([](auto& j) { j["channels"][0]["blocks"][3]["poles_rad_s"][0] = 12; });
  EXPECT_NE(unstable.find("poles must be negative"), std::string::npos) << unstable;
  const auto order =
      edited([](auto& j) { std::swap(j["channels"][0]["blocks"][0], j["channels"][0]["blocks"][3]); });
  EXPECT_NE(order.find("cannot stand here"), std::string::npos) << order;
  const auto finger_name = edited([](auto& j) { j["channels"][0]["name"] = "toe"; });
  EXPECT_NE(finger_name.find("unknown finger \"toe\""), std::string::npos) << finger_name;
  const auto knots = edited([](auto& j) { j["channels"][0]["blocks"][2]["x"] = {0, 0, 1}; });
  EXPECT_NE(knots.find("strictly increasing"), std::string::npos) << knots;
  const auto missing = edited([](auto& j) { j.erase("sample_period_s"); });
  EXPECT_NE(missing.find("\"sample_period_s\" is missing"), std::string::npos) << missing;
  const auto bare = edited([](auto& j) { j["channels"][0]["blocks"].erase(5); });
  EXPECT_NE(bare.find("must end with a saturation"), std::string::npos) << bare;
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
