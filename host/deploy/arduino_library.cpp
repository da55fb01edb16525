#include "host/deploy/arduino_library.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "host/deploy/sources.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kArduino = "firmware/arduino/";

// What it takes of the firmware as it is.
bool is_portable(const std::string& source) {
  return source.starts_with("runtime/") || source == "firmware/markers.hpp";
}

// Where a source of this repository lies in the library; empty: it is none of it.
fs::path place_of(const std::string& source, Output output) {
  if (is_portable(source)) return "src/" + source;
  if (!source.starts_with(kArduino)) return {};
  const std::string name = source.substr(kArduino.size());
  if (name == "Flexor.h") return "src/Flexor.h";
  if (name == "board.hpp") return "src/firmware/board.hpp";
  const bool is_of_vr = name == "GloveVr.ino";
  if (name.ends_with(".ino") && is_of_vr != (output == Output::opengloves)) return {};
  if (name.ends_with(".ino")) return fs::path("examples") / name.substr(0, name.size() - 4) / name;
  return name;
}

std::string portable_config(Glove glove) {
  glove.assembly = false;
  glove.track = false;
  glove.model_as =
      ModelAs::code;  // data is replaced in EEPROM or through a bootloader, of which it asks for neither
  glove.pins.joystick.reset();  // the sketch reads them
  glove.pins.button = {};
  std::string text = glove_config(glove);
  constexpr std::string_view kRegisters = "#include <avr/pgmspace.h>\n\n";
  const std::size_t at = text.find(kRegisters);
  if (at != std::string::npos) text.erase(at, kRegisters.size());
  return text;
}

void replace(std::string& text, std::string_view shipped, const std::string& now) {
  const std::size_t at = text.find(shipped);
  if (at != std::string::npos) text.replace(at, shipped.size(), now);
}

std::string buttons_of(const Pins& pins) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < kButtons; ++i) {
    if (pins.button[i]) out.push_back(fmt::format("{{{}, {}}}", *pins.button[i], buttons()[i].bit));
  }
  return fmt::format("{{{}}}", fmt::join(out, ", "));
}

// Examples have everything where it is wired, and the radio's rate.
std::string wired(std::string text, const Glove& glove) {
  const Pins& pins = glove.pins;
  if (buttons_of(pins) != "{}") replace(text, "{{kNone, 0}}", buttons_of(pins));
  if (pins.joystick)
    replace(text, "{kNone, kNone}", fmt::format("{{A{}}}", fmt::join(*pins.joystick, ", A")));
  replace(text, "{A0, A1, A2, A3, A4}", fmt::format("{{A{}}}", fmt::join(glove.pins.strip, ", A")));
  replace(text, ".begin(9600);", fmt::format(".begin({:.0f});", glove.baud));
  return text;
}

void write(const fs::path& path, const std::string& text) {
  io::make_folder(path.parent_path());
  io::write_file(path, text);
}

}  // namespace

void write_arduino_library(const Glove& glove, const fs::path& folder) {
  for (const Source& source : sources()) {
    const fs::path place = place_of(source.path, glove.output);
    if (!place.empty()) write(folder / place, wired(source.text, glove));
  }
  write(folder / "src/glove_config.hpp", portable_config(glove));
  write(
      folder / "library.properties",
      fmt::format(
          "name=Flexor\nversion={}\nauthor=Flexor\nmaintainer=Flexor\nsentence=A flex-sensor glove with its "
          "compensator, for any board.\nparagraph=Written by flexor deploy.\ncategory=Device Control\nurl=\n"
          "architectures=*\nincludes=Flexor.h\n",
          FLEXOR_VERSION));
}

}  // namespace flexor::deploy
