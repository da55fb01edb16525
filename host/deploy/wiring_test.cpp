#include "host/deploy/wiring.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace flexor::deploy {
namespace {

TEST(Wiring, NamesBoardsThatHaveThePins) {
  const auto plan_with = [](int pinky) {
    model::Hardware hardware;
    hardware.pins.strip[4] = pinky;
    return wiring_plan(hardware, Output::radio);
  };
  for (const int pinky : {4, 5, 6})
    EXPECT_EQ(plan_with(pinky).boards[0].board, pinky < 6 ? "Arduino Nano or Uno" : "Arduino Nano");
  EXPECT_EQ(plan_with(7).boards.back().board, "Arduino Nano or Uno") << "the hand's";
}

TEST(Wiring, HasNoWireOfAFingerWithoutSensor) {
  const WiringPlan plan = wiring_plan({}, Output::radio, {false, true});
  EXPECT_EQ(plan.boards[0].connections.size(), 3U) << "one sensor and the radio's two";
  EXPECT_EQ(plan.boards[0].connections[0].name, "index");
  EXPECT_EQ(plan.parts[1].count, 1);
  EXPECT_EQ(plan.parts[2].count, 1);
}

TEST(Wiring, NamesTheResistorThatIsSold) {
  const auto resistor = [](double kohm) {
    model::Hardware hardware;
    hardware.divider_kohm = kohm;
    const auto parts = wiring_plan(hardware, Output::opengloves).parts;
    return std::ranges::find_if(parts, [](const Part& p) { return p.what.starts_with("resistor"); })->what;
  };
  EXPECT_NE(resistor(35).find(" is 34.8 kOhm"), std::string::npos) << resistor(35);
  for (const double kohm : {10.0, 34.8, 47.0, 47.5, 0.1, 97.6})
    EXPECT_EQ(resistor(kohm).find("nearest"), std::string::npos) << resistor(kohm);
  EXPECT_NE(resistor(99).find(" is 100 kOhm"), std::string::npos) << resistor(99);
  EXPECT_NE(resistor(0.98).find(" is 0.976 kOhm"), std::string::npos) << resistor(0.98);
}

}  // namespace
}  // namespace flexor::deploy
