#include "host/report/wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/io/io.hpp"
#include "host/report/drawing.hpp"

namespace flexor::report {
namespace {

constexpr const char* kSignal = "#0072b2";

constexpr int kWidth = 900;
constexpr int kBoardLeft = 390;
constexpr int kBoardRight = 520;
constexpr int kTop = 80;
constexpr int kAnalogRow = 64;
constexpr int kDigitalRow = 38;

class WiringDrawing : public Drawing {
 public:
  void wire(double x1, double y1, double x2, double y2, const std::string& colour = kInk) {
    line({{x1, y1}, {x2, y2}}, colour);
  }
  void part(double x, double y, double width, double height, const std::string& label,
            const char* colour = kInk) {
    box(x, y, width, height, colour);
    text(x + width / 2, y + height / 2 + 5, label);
  }
  void joint(double x, double y) { dot(x, y, 2.5, kSignal, kSignal); }
  void ring(double x, double y) { dot(x, y, 4, kPaper, kInk); }
  void ground(double x, double y) {
    wire(x, y, x, y + 8);
    for (int k = 0; k < 3; ++k) wire(x - 9 + 3 * k, y + 8 + 4 * k, x + 9 - 3 * k, y + 8 + 4 * k);
  }
};

using ByPin = std::map<std::string, Json>;  // connections

// 5 V - resistor - sensor - ground; the pin reads what is in between. y: of the pin.
void draw_sensor(WiringDrawing& d, int y, const std::string& finger, double divider_kohm) {
  const int chain = y - 24;
  d.text(32, chain + 5, "5 V", "middle");
  d.wire(48, chain, 350, chain);
  d.part(64, chain - 12, 84, 24, fmt::format("{:g} kΩ", divider_kohm));
  d.part(206, chain - 12, 124, 24, finger + " sensor");
  d.ground(350, chain);
  d.joint(176, chain);
  d.wire(176, chain, 176, y, kSignal);
  d.wire(176, y, kBoardLeft, y, kSignal);
}

void draw_potentiometer(WiringDrawing& d, int y, const std::string& name, bool has_pull) {
  const int chain = y - 30;
  d.text(92, chain + 5, "5 V", "middle");
  d.wire(108, chain, 350, chain);
  d.part(128, chain - 12, 190, 24, name);
  d.ground(350, chain);
  d.wire(223, chain + 12, 223, y, kSignal);
  d.wire(223, y, kBoardLeft, y, kSignal);
  if (!has_pull) return;
  d.joint(223, y);
  d.wire(36, y, 223, y);
  d.part(64, y - 10, 84, 20, "100 kΩ");
  d.ground(36, y);
}

void draw_digital(WiringDrawing& d, int y, const Json& c) {
  const auto name = c.at("name").get<std::string>();
  d.wire(kBoardRight, y, 590, y, kSignal);
  if (c.at("kind") == "button") {
    d.ring(594, y);
    d.wire(597, y - 4, 632, y - 16);
    d.ring(636, y);
    d.wire(640, y, 668, y);
    d.ground(668, y);
    d.text(694, y + 5, name + " button", "start");
    return;
  }
  d.part(590, y - 13, 140, 26, name);
  d.text(740, y + 5, c.at("kind") == "motor" ? "motor driver" : "radio at 5 V", "start");
}

// A0 to A5, or as far as something is wired.
int analog_rows(const ByPin& pins) {
  int rows = 6;
  for (int k = rows; k < 12; ++k)
    if (pins.contains(fmt::format("A{}", k))) rows = k < 8 ? 8 : 12;
  return rows;
}

void draw_analog_side(WiringDrawing& d, const ByPin& pins, double divider_kohm) {
  for (int k = 0; k < analog_rows(pins); ++k) {
    const std::string pin = fmt::format("A{}", k);
    const int y = kTop + 50 + k * kAnalogRow;
    const auto it = pins.find(pin);
    d.text(kBoardLeft + 8, y + 5, pin, "start", it == pins.end() ? kFaint : kInk);
    if (it == pins.end()) continue;
    const auto name = it->second.at("name").get<std::string>();
    const bool is_hand = it->second.at("kind") == "potentiometer";
    if (it->second.at("kind") == "strip")
      draw_sensor(d, y, name, divider_kohm);
    else
      draw_potentiometer(d, y, is_hand ? name + " potentiometer" : name, is_hand);
  }
}

void draw_digital_side(WiringDrawing& d, const ByPin& pins) {
  for (int k = 0; k <= 13; ++k) {
    const std::string pin = fmt::format("D{}", k);
    const int y = kTop + 36 + k * kDigitalRow;
    const auto it = pins.find(pin);
    d.text(kBoardRight - 8, y + 5, pin, "end", it == pins.end() ? kFaint : kInk);
    if (it != pins.end()) draw_digital(d, y, it->second);
  }
}

// As a cell of a table in Markdown, which takes HTML.
std::string cell(const Json& text) {
  return escaped(io::one_line(text.get<std::string>()), {{'<', "&lt;"}, {'|', "&#124;"}});
}

std::string wiring_text(const Json& wiring) {
  const double divider = wiring.at("divider_kohm").get<double>();
  const std::string resistor = fmt::format("5 V ---[ {:g} kOhm ]---", divider);
  const std::string blank(resistor.size(), ' ');
  std::string out = "# Wiring\nEach potentiometer lies between 5 V and GND; the pin reads its wiper.\n";
  if (divider > 0)
    out = fmt::format(
        "# Wiring\nEach sensor is half of a divider: its resistance grows as it bends, and so does what the "
        "pin reads.\n\n"
        "```\n{0}+---[ flex sensor ]--- GND\n{1}|\n{1}+--- analog pin\n```\n",
        resistor, blank);
  for (const Json& board : wiring.at("boards")) {
    const auto name = board.at("name").get<std::string>();
    out += fmt::format(
        "\n## The {0}'s board: {1}\n![wiring of the {0}'s board](wiring_{0}.svg)\n\n| pin | what | how "
        "|\n|---|---|---|\n",
        name, cell(board.at("board")));
    for (const Json& c : board.at("connections")) {
      out += fmt::format("| {} | {} | {} |\n", cell(c.at("pin")), cell(c.at("name")), cell(c.at("how")));
    }
  }
  out += "\n## Parts\n| | |\n|---|---|\n";
  for (const Json& part : wiring.at("parts"))
    out += fmt::format("| {} | {} |\n", part.at("count").get<int>(), cell(part.at("what")));
  return out;
}

}  // namespace

std::string wiring_svg(const Json& board, double divider_kohm) {
  WiringDrawing d;
  const auto name = board.at("name").get<std::string>();
  const std::string title = fmt::format("Wiring of the {}: {}", name, board.at("board").get<std::string>());
  ByPin pins;
  for (const Json& c : board.at("connections")) pins[c.at("pin").get<std::string>()] = c;
  const int height = std::max(14 * kDigitalRow, analog_rows(pins) * kAnalogRow) + 40;
  d.text(kWidth / 2.0, 28, title, "middle", kInk, 18);
  d.part(kBoardLeft, kTop, kBoardRight - kBoardLeft, height, name);
  const bool usb = pins.contains("USB");
  d.part((kBoardLeft + kBoardRight) / 2.0 - 30, kTop - 26, 60, 26, "USB", usb ? kSignal : kInk);
  const bool shares_d0 = pins.contains("D0") && pins.at("D0").at("how").get<std::string>().starts_with("off");
  d.text((kBoardLeft + kBoardRight) / 2.0 + 42, kTop - 8,
         usb         ? "to the PC"
         : shares_d0 ? "for flashing; then D0 off"
                     : "for flashing",
         "start");
  draw_analog_side(d, pins, divider_kohm);
  draw_digital_side(d, pins);
  d.text(kWidth / 2.0, kTop + height + 28,
         "5 V and ground are the board's own pins; every ground is one. Grey pins are not used.", "middle");
  return d.svg({"wiring_" + name, title, "Blue wires carry what the board reads or sends."}, kWidth,
               kTop + height + 44);
}

void save_wiring(const Json& wiring, const std::filesystem::path& folder) {
  for (const Json& board : wiring.at("boards"))
    io::write_file(folder / fmt::format("wiring_{}.svg", plain_name(board.at("name").get<std::string>())),
                   wiring_svg(board, wiring.at("divider_kohm").get<double>()));
  io::write_file(folder / "wiring.md", wiring_text(wiring));
}

}  // namespace flexor::report
