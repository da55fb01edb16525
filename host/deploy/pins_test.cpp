#include "host/deploy/mcu.hpp"
#include "host/deploy/wiring.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host/io/refusal_test.hpp"

namespace flexor::deploy {
namespace {

std::string refusal(const std::string& text) {
  return io::refusal_of([&] { (void)pins_from_text(text); });
}

TEST(Pins, PresetsAreOppositeOrders) {
  EXPECT_EQ(to_text(Pins()), "thumb=A0,index=A1,middle=A2,ring=A3,pinky=A4");
  EXPECT_EQ(to_text(pins_from_text("flexor")), to_text(Pins()));
  EXPECT_EQ(to_text(pins_from_text("lucidgloves")), "thumb=A4,index=A3,middle=A2,ring=A1,pinky=A0");
}

TEST(Pins, ComeBackFromTheirText) {
  const std::string text =
      "thumb=A4,index=A3,middle=A2,ring=A1,pinky=A0,joystick=A6+A7,joystick_button=D7,a=D8,b=D9,menu=D10,"
      "calibrate=D12";
  EXPECT_EQ(to_text(pins_from_text(text)), text);
  EXPECT_EQ(to_text(pins_from_text(
                "lucidgloves,joystick=a6+a7,joystick_button=d7,a=D8,b=D9,menu=D10,calibrate=D12")),
            text);
  EXPECT_EQ(scan_of(pins_from_text(text)), (std::vector<int>{4, 3, 2, 1, 0, 6, 7}));
  EXPECT_EQ(scan_of(pins_from_text("pinky=A5")), (std::vector<int>{0, 1, 2, 3, 5}));
}

TEST(Pins, AreRefusedByNameInOneLine) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "is empty"},
      {"toe=A1", "unknown \"toe\"; known: flexor, lucidgloves, or PIN for thumb"},
      {"a=D8,lucidgloves", "unknown \"lucidgloves\""},
      {"thumb=A8", "thumb=A8: an analog pin is A0 to A7"},
      {"thumb=D4", "an analog pin is A0 to A7"},
      {"thumb", "thumb=: an analog pin"},
      {"thumb=A", "an analog pin"},
      {"thumb=A4444444444444", "an analog pin"},
      {"thumb=A4", "thumb and pinky are both on A4"},
      {"joystick=A6", "give the pins of x and y"},
      {"joystick=A6+A6", "joystick x and joystick y are both on A6"},
      {"joystick=A4+A6", "pinky and joystick x are both on A4"},
      {"a=D13", "D13 has the board's LED"},
      {"a=D1", "D0 and D1 are the serial port"},
      {"a=D8,b=D8", "a and b are both on D8"},
      {"a=D8,a=D9", "a comes twice"},
  };
  for (const auto& [text, says] : cases) {
    EXPECT_NE(refusal(text).find(says), std::string::npos) << text << ": " << refusal(text);
    EXPECT_EQ(refusal(text).find('\n'), std::string::npos);
  }
}

TEST(Pins, DigitalPinsAreThoseOfThePrintedNumbers) {
  EXPECT_EQ(port_bit(2).port, 'D');
  EXPECT_EQ(port_bit(7).bit, 7);
  EXPECT_EQ(port_bit(8).port, 'B');
  EXPECT_EQ(port_bit(12).bit, 4);
}

TEST(Wiring, NamesBoardsThatHaveThePins) {
  const auto board = [](const char* pins) {
    return wiring_plan(pins_from_text(pins), Output::radio, 10).boards.front().board;
  };
  EXPECT_EQ(board("flexor"), "Arduino Nano or Uno");
  EXPECT_EQ(board("pinky=A5"), "Arduino Nano or Uno");
  EXPECT_EQ(board("pinky=A6"), "Arduino Nano");
  const WiringPlan plan = wiring_plan(pins_from_text("pinky=A7"), Output::radio, 10);
  EXPECT_EQ(plan.boards.back().board, "Arduino Nano or Uno") << "the hand's";
  EXPECT_EQ(plan.parts.at(0).what, "Arduino Nano (ATmega328P, 16 MHz, 5 V) with its USB cable");
  EXPECT_EQ(plan.parts.at(1).what,
            "Arduino Nano or Uno (ATmega328P, 16 MHz, 5 V) with its USB cable, for the hand");
}

TEST(Wiring, NamesTheResistorThatIsSold) {
  const auto resistor = [](double kohm) {
    const auto parts = wiring_plan({}, Output::opengloves, kohm).parts;
    return std::ranges::find_if(parts, [](const Part& p) { return p.what.starts_with("resistor"); })->what;
  };
  EXPECT_EQ(resistor(35),
            "resistor 35 kOhm, 1 %, one for each strip; the nearest that is sold (E96) is 34.8 kOhm: tell "
            "Flexor of it, "
            "or of any other, with --set divider.fixed_kohm=34.8, here and in flexor deploy");
  for (const double kohm : {10.0, 34.8, 47.0, 47.5, 0.1, 97.6})
    EXPECT_EQ(resistor(kohm).find("nearest"), std::string::npos) << resistor(kohm);
  EXPECT_NE(resistor(99).find(" is 100 kOhm"), std::string::npos) << resistor(99);
  EXPECT_NE(resistor(0.98).find(" is 0.976 kOhm"), std::string::npos) << resistor(0.98);
}

}  // namespace
}  // namespace flexor::deploy
