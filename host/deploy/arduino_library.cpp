#include "host/deploy/arduino_library.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <span>

#include "host/deploy/images.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/sources.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kArduino = "firmware/arduino/";

// Where a source of this repository lies in the library; empty: it is none of it.
fs::path place_of(std::string_view source, Output output) {
  if (source.starts_with("runtime/")) return fs::path("src") / source;
  if (!source.starts_with(kArduino)) return {};
  const std::string name(source.substr(kArduino.size()));
  if (name == "Flexor.h") return "src/Flexor.h";
  const bool is_of_usb = name == "GloveVr.ino";
  if (name.ends_with(".ino") && is_of_usb != (output != Output::radio)) return {};
  if (name.ends_with(".ino")) return fs::path("examples") / name.substr(0, name.size() - 4) / name;
  return name;
}

template <class Bytes>
std::string array_of(const char* name, const Bytes& bytes) {
  return fmt::format("alignas(2) const uint8_t {}[] PROGMEM = {{{}}};\n", name, fmt::join(bytes, ","));
}

// Settings, key and model as a board's flash holds them.
std::string data_of(Glove glove) {
  glove.track = false;
  const glove::Settings settings = glove_settings(glove);
  const link::KeyRecord key = key_record(glove.key);
  const auto bytes = [](const auto& one) {
    return std::span(reinterpret_cast<const std::uint8_t*>(&one), sizeof(one));
  };
  return fmt::format(
             "// Written by flexor deploy {}: settings, the pair's key and the model \"{}\" of this glove.\n"
             "#pragma once\n#include <Flexor.h>\n\n",
             FLEXOR_VERSION, io::digest(model::to_json(glove.model))) +
         array_of("kFlexorSettings", bytes(settings)) + array_of("kFlexorKey", bytes(key)) +
         array_of("kFlexorModel", flash_block(glove));
}

void replace(std::string& text, std::string_view shipped, const std::string& now) {
  const std::size_t at = text.find(shipped);
  if (at != std::string::npos) text.replace(at, shipped.size(), now);
}

std::string buttons_of(const Pins& pins) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < model::kButtons; ++i) {
    if (pins.button[i]) out.push_back(fmt::format("{{{}, {}}}", *pins.button[i], model::buttons()[i].bit));
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
  for (const auto& [path, text] : sources()) {
    const fs::path place = place_of(path, glove.output);
    if (!place.empty()) write(folder / place, wired(text, glove));
  }
  write(folder / "src/glove_data.h", data_of(glove));
  write(
      folder / "library.properties",
      fmt::format(
          "name=Flexor\nversion={}\nauthor=Flexor\nmaintainer=Flexor\nsentence=A flex-sensor glove with its "
          "compensator, for any board.\nparagraph=Written by flexor deploy.\ncategory=Device Control\nurl=\n"
          "architectures=*\nincludes=glove_data.h\n",
          FLEXOR_VERSION));
}

}  // namespace flexor::deploy
