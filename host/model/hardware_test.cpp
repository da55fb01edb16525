#include "host/model/hardware.hpp"

#include <gtest/gtest.h>

#include "host/io/json.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::model {
namespace {

std::string refusal(const std::string& members) {
  return io::refusal_of([&] {
    (void)hardware_of(
        io::parse_json(R"({"schema":"flexor-hardware","schema_version":1,)" + members + "}", ""), "my.json");
  });
}

TEST(Hardware, ComesBackFromItsDocumentToTheBit) {
  Hardware h = preset("lucidgloves");
  h.divider_kohm = 34.8;
  h.hand_lower_deg[3] = 17.3;
  h.pins.joystick = {6, 7};
  h.pins.button = {7, 8, {}, {}, 12};
  EXPECT_EQ(to_json(hardware_of(to_json(h), "my.json")), to_json(h));
  EXPECT_EQ(scan_of(h.pins), (std::vector<int>{4, 3, 2, 1, 0, 6, 7}));
}

TEST(Hardware, WhatIsLeftOutIsThePublishedGloveAndHand) {
  EXPECT_EQ(to_json(hardware_of({{"schema", "flexor-hardware"}, {"schema_version", 1}}, "my.json")),
            to_json(Hardware()));
  EXPECT_EQ(preset("flexor").pins.strip, (std::array{0, 1, 2, 3, 4}));
}

TEST(Hardware, APresetIsOneWhateverLiesInTheWorkingFolder) {
  const std::filesystem::path before = std::filesystem::current_path();
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "hardware_preset";
  std::filesystem::create_directories(folder / "flexor");
  std::filesystem::current_path(folder);
  EXPECT_EQ(io::refusal_of([] { (void)hardware("flexor"); }), "accepted");
  std::filesystem::current_path(before);
}

TEST(Hardware, IsRefusedByFileAndKey) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {R"("pin":{})", R"(my.json: unknown key "pin")"},
      {R"("sensor":"hall")", R"(my.json: "sensor" is "hall")"},
      {R"("parameters":{"motor.suply_V":{"value":6}})", R"(my.json: unknown parameter "motor.suply_V")"},
      {R"("parameters":{"motor.supply_V":{"value":6,"unit":"mV"}})",
       "my.json: motor.supply_V: the unit is V"},
      {R"("parameters":{"motor.supply_V":{"volt":6}})", R"(my.json: motor.supply_V: "value" is missing)"},
      {R"("parameters":{"loop.duty":{"value":2}})", "my.json: loop.duty: 2 1 is impossible"},
      {R"("parameters":{"hand.lower_deg":{"value":{"ring":120}}})", "my.json: ring: hand.lower_deg, 120"},
      {R"("parameters":{"loop.lower_deg":{"value":120}})",
       "my.json: index: loop.lower_deg, 120, must be below hand.upper_deg, 113"},
      {R"("parameters":{"loop.upper_deg":{"value":1e-300}})",
       "my.json: thumb: hand.lower_deg, 90, must be below loop.upper_deg, 1e-300"},
      {R"("pins":{"toe":"A1"})", R"(my.json: pins: unknown key "toe")"},
      {R"("pins":{"thumb":"A8"})", R"(my.json: pins: thumb: "A8": an analog pin is A0 to A7)"},
      {R"("pins":{"thumb":4})", "my.json: pins: thumb: 4: an analog pin"},
      {R"("pins":{"thumb":"A4"})", "my.json: pins: thumb and pinky are both on A4"},
      {R"("pins":{"joystick":["A6"]})", "my.json: pins: joystick: give the pins of x and y"},
      {R"("pins":{"joystick":["A6","A6"]})", "my.json: pins: joystick x and joystick y are both on A6"},
      {R"("pins":{"a":"D13"})", R"(my.json: pins: a: "D13": a button's pin is D2 to D12)"},
      {R"("pins":{"a":"D8","b":"D8"})", "my.json: pins: a and b are both on D8"},
  };
  for (const auto& [members, expected] : cases) {
    EXPECT_TRUE(refusal(members).starts_with(expected)) << members << ": " << refusal(members);
    EXPECT_EQ(refusal(members).find('\n'), std::string::npos);
  }
  const auto of = [](const char* document) {
    return io::refusal_of([&] { (void)hardware_of(io::parse_json(document, ""), "my.json"); });
  };
  EXPECT_TRUE(
      of(R"({"schema":"flexor-hardware","schema_version":2})").ends_with("newer than 1: update Flexor"));
  EXPECT_EQ(of(R"({"schema":"flexor-model","schema_version":1})"),
            R"(my.json: "schema" must be "flexor-hardware")");
}

}  // namespace
}  // namespace flexor::model
