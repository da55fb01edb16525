#include "host/deploy/pins.hpp"

#include <gtest/gtest.h>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

std::string refusal(const std::string& text) {
  try {
    (void)pins_from_text(text);
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "";
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

}  // namespace
}  // namespace flexor::deploy
