#include "host/report/wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/io/io.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

constexpr const char* kInk = "#222222";
constexpr const char* kFaint = "#999999";
constexpr const char* kSignal = "#0072b2";

constexpr int kWidth = 900;
constexpr int kBoardLeft = 390;
constexpr int kBoardRight = 520;
constexpr int kTop = 80;
constexpr int kAnalogRow = 64;
constexpr int kDigitalRow = 38;

class WiringDrawing {
 public:
  void line(int x1, int y1, int x2, int y2, const char* colour = kInk) {
    body_ += fmt::format("<path d='M{},{} L{},{}' stroke='{}' stroke-width='2' fill='none'/>\n", x1, y1, x2,
                         y2, colour);
  }
  void box(int x, int y, int width, int height, const std::string& label, const char* colour = kInk) {
    body_ += fmt::format(
        "<rect x='{}' y='{}' width='{}' height='{}' rx='3' fill='#ffffff' stroke='{}' stroke-width='2'/>\n",
        x, y, width, height, colour);
    text(x + width / 2, y + height / 2 + 5, label, "middle");
  }
  void dot(int x, int y) {
    body_ += fmt::format("<circle cx='{}' cy='{}' r='3.5' fill='{}'/>\n", x, y, kSignal);
  }
  void ring(int x, int y) {
    body_ += fmt::format("<circle cx='{}' cy='{}' r='4' fill='#ffffff' stroke='{}' stroke-width='2'/>\n", x,
                         y, kInk);
  }
  void ground(int x, int y) {
    line(x, y, x, y + 8);
    for (int k = 0; k < 3; ++k) line(x - 9 + 3 * k, y + 8 + 4 * k, x + 9 - 3 * k, y + 8 + 4 * k);
  }
  void text(int x, int y, const std::string& words, const char* anchor, const char* colour = kInk,
            int size = 14) {
    body_ += fmt::format("<text x='{}' y='{}' text-anchor='{}' fill='{}' font-size='{}'>{}</text>\n", x, y,
                         anchor, colour, size, escape_html(words));
  }
  std::string svg(int height, const std::string& title) const {
    return fmt::format(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
        "font-family='sans-serif'>"
        "<title>{2}</title><desc>{2}</desc>\n<rect width='{0}' height='{1}' fill='#ffffff'/>\n{3}</svg>\n",
        kWidth, height, escape_html(title), body_);
  }

 private:
  std::string body_;
};

struct Connection {
  std::string kind;
  std::string name;
  std::string how;
};
using ByPin = std::map<std::string, Connection>;

ByPin by_pin(const Json& board) {
  ByPin out;
  for (const Json& c : board.at("connections")) {
    out[c.at("pin").get<std::string>()] = {c.at("kind").get<std::string>(), c.at("name").get<std::string>(),
                                           c.at("how").get<std::string>()};
  }
  return out;
}

// 5 V - resistor - strip - ground; the pin reads what is in between. y: of the pin.
void draw_strip(WiringDrawing& d, int y, const std::string& finger, double divider_kohm) {
  const int chain = y - 24;
  d.text(32, chain + 5, "5 V", "middle");
  d.line(48, chain, 350, chain);
  d.box(64, chain - 12, 84, 24, fmt::format("{:g} kΩ", divider_kohm));
  d.box(206, chain - 12, 124, 24, finger + " strip");
  d.ground(350, chain);
  d.dot(176, chain);
  d.line(176, chain, 176, y, kSignal);
  d.line(176, y, kBoardLeft, y, kSignal);
}

void draw_potentiometer(WiringDrawing& d, int y, const std::string& name, bool has_pull) {
  const int chain = y - 30;
  d.text(92, chain + 5, "5 V", "middle");
  d.line(108, chain, 350, chain);
  d.box(128, chain - 12, 190, 24, name);
  d.ground(350, chain);
  d.line(223, chain + 12, 223, y, kSignal);
  d.line(223, y, kBoardLeft, y, kSignal);
  if (!has_pull) return;
  d.dot(223, y);
  d.line(36, y, 223, y);
  d.box(64, y - 10, 84, 20, "100 kΩ");
  d.ground(36, y);
}

void draw_digital(WiringDrawing& d, int y, const Connection& c) {
  if (c.kind == "button") {
    d.line(kBoardRight, y, 590, y, kSignal);
    d.ring(594, y);
    d.line(597, y - 4, 632, y - 16);
    d.ring(636, y);
    d.line(640, y, 668, y);
    d.ground(668, y);
    d.text(694, y + 5, c.name + " button", "start");
    return;
  }
  d.line(kBoardRight, y, 590, y, kSignal);
  d.box(590, y - 13, 140, 26, c.name);
  d.text(740, y + 5, c.kind == "motor" ? "motor driver" : "radio at 5 V", "start");
}

// A0 to A5, or as far as something is wired.
int analog_rows(const ByPin& pins) {
  int rows = 6;
  for (const int upper : {8, 12}) {
    for (int k = rows; k < upper; ++k) {
      if (pins.contains(fmt::format("A{}", k))) rows = upper;
    }
  }
  return rows;
}

void draw_analog_side(WiringDrawing& d, const ByPin& pins, double divider_kohm) {
  for (int k = 0; k < analog_rows(pins); ++k) {
    const std::string pin = fmt::format("A{}", k);
    const int y = kTop + 50 + k * kAnalogRow;
    const auto it = pins.find(pin);
    d.text(kBoardLeft + 8, y + 5, pin, "start", it == pins.end() ? kFaint : kInk);
    if (it == pins.end()) continue;
    const Connection& c = it->second;
    if (c.kind == "strip") {
      draw_strip(d, y, c.name, divider_kohm);
      continue;
    }
    const bool is_hand = c.kind == "potentiometer";
    draw_potentiometer(d, y, is_hand ? c.name + " potentiometer" : c.name, is_hand);
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

std::string wiring_text(const Json& wiring) {
  const double divider = wiring.at("divider_kohm").get<double>();
  const std::string resistor = fmt::format("5 V ---[ {:g} kOhm ]---", divider);
  const std::string blank(resistor.size(), ' ');
  std::string out = "# Wiring\nEach potentiometer lies between 5 V and GND; the pin reads its wiper.\n";
  if (divider > 0)
    out = fmt::format(
        "# Wiring\nEach strip is half of a divider: its resistance grows as it bends, and so does what the "
        "pin "
        "reads.\n\n"
        "```\n{0}+---[ flex strip ]--- GND\n{1}|\n{1}+--- analog pin\n```\n",
        resistor, blank);
  for (const Json& board : wiring.at("boards")) {
    const auto name = board.at("name").get<std::string>();
    out += fmt::format(
        "\n## The {0}'s board: {1}\n![wiring of the {0}'s board](wiring_{0}.svg)\n\n| pin | what | how "
        "|\n|---|---|---|\n",
        name, board.at("board").get<std::string>());
    for (const Json& c : board.at("connections")) {
      out += fmt::format("| {} | {} | {} |\n", c.at("pin").get<std::string>(),
                         c.at("name").get<std::string>(), c.at("how").get<std::string>());
    }
  }
  out += "\n## Parts\n| | |\n|---|---|\n";
  for (const Json& part : wiring.at("parts"))
    out += fmt::format("| {} | {} |\n", part.at("count").get<int>(), part.at("what").get<std::string>());
  return out;
}

}  // namespace

std::string wiring_svg(const Json& board, double divider_kohm) {
  WiringDrawing d;
  const auto name = board.at("name").get<std::string>();
  const std::string title = fmt::format("Wiring of the {}: {}", name, board.at("board").get<std::string>());
  const ByPin pins = by_pin(board);
  const int height = std::max(14 * kDigitalRow, analog_rows(pins) * kAnalogRow) + 40;
  d.text(kWidth / 2, 28, title, "middle", kInk, 18);
  d.box(kBoardLeft, kTop, kBoardRight - kBoardLeft, height, name);
  const bool usb = pins.contains("USB");
  d.box((kBoardLeft + kBoardRight) / 2 - 30, kTop - 26, 60, 26, "USB", usb ? kSignal : kInk);
  const bool shares_d0 = pins.contains("D0") && pins.at("D0").how.starts_with("off");
  d.text((kBoardLeft + kBoardRight) / 2 + 42, kTop - 8,
         usb         ? "to the PC"
         : shares_d0 ? "for flashing; then D0 off"
                     : "for flashing",
         "start");
  draw_analog_side(d, pins, divider_kohm);
  draw_digital_side(d, pins);
  d.text(kWidth / 2, kTop + height + 28,
         "5 V and ground are the board's own pins; every ground is one. Grey pins are not used.", "middle");
  return d.svg(kTop + height + 44, title);
}

void save_wiring(const Json& wiring, const std::filesystem::path& folder) {
  for (const Json& board : wiring.at("boards")) {
    io::write_file(folder / fmt::format("wiring_{}.svg", board.at("name").get<std::string>()),
                   wiring_svg(board, wiring.at("divider_kohm").get<double>()));
  }
  io::write_file(folder / "wiring.md", wiring_text(wiring));
}

}  // namespace flexor::report
