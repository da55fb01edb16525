#include "host/deploy/deploy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "host/deploy/arduino_library.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/sources.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/model/fixed_error.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::InputError;
using io::JobError;

constexpr const char* kCompiler = "avr-g++";
constexpr const char* kHint = "install gcc-avr, avr-libc and binutils-avr";

void write_sources(const fs::path& folder) {
  for (const Source& source : sources()) {
    io::make_folder((folder / source.path).parent_path());
    io::write_file(folder / source.path, source.text);
  }
}

std::string checked(const std::vector<std::string>& argv, const fs::path& temporaries) {
  const io::ProcessResult result = io::run_process(argv, temporaries);
  if (result.status == 0) return result.out;
  // The first error says it; what follows from it fills pages.
  const std::size_t error = result.err.find("error: ");
  const std::size_t from = error == std::string::npos ? 0 : error;
  throw JobError(fmt::format("{} failed: {}", argv.front(),
                             result.err.substr(from, result.err.find('\n', from) - from)));
}

Image build(const std::string& name, const std::string& config, const fs::path& out,
            const std::vector<std::string>& options) {
  require_toolchain();
  const fs::path folder = fs::absolute(out);  // no tool takes it for an option or a list of them
  io::make_folder(folder);
  const io::TemporaryFolder source;
  write_sources(source.path());
  io::write_file(source.path() / (name + "_config.hpp"), config);
  Image image{folder / (name + ".elf"), folder / (name + ".hex")};
  // The tools write where there is room: what a full disk does to them, they tell as an error of their own.
  const fs::path elf = source.path() / image.elf.filename();
  const fs::path hex = source.path() / image.hex.filename();
  std::vector<std::string> compile = compiler();
  compile.insert(compile.end(),
                 {"-I" + source.path().string(),
                  (source.path() / "firmware" / name / (name + ".cpp")).string(), "-o", elf.string()});
  compile.insert(compile.end(), options.begin(), options.end());
  checked(compile, source.path());
  checked({"avr-objcopy", "-O", "ihex", "-R", ".eeprom", elf.string(), hex.string()}, source.path());
  std::istringstream sizes(checked({"avr-size", elf.string()}, source.path()));
  std::string header;
  std::getline(sizes, header);
  int text = 0;
  int data = 0;
  int bss = 0;
  if (!(sizes >> text >> data >> bss)) throw JobError("avr-size: unreadable answer");
  image.flash_bytes = text + data;
  image.ram_bytes = data + bss;
  constexpr int kStackReserve = 400;  // measured: up to 360
  if (image.flash_bytes > kAtmega328p.flash_bytes ||
      image.ram_bytes > kAtmega328p.ram_bytes - kStackReserve) {
    throw InputError(fmt::format(
        "the {} image needs {} bytes of flash and {} of RAM; an {} has {} and, beside {} for the stack, {}: "
        "use fewer knots",
        name, image.flash_bytes, image.ram_bytes, kAtmega328p.name, kAtmega328p.flash_bytes, kStackReserve,
        kAtmega328p.ram_bytes - kStackReserve));
  }
  io::write_file(image.elf, io::read_file(elf));
  io::write_file(image.hex, io::read_file(hex));
  io::write_file(folder / (name + "_config.hpp"), config);
  return image;
}

void write_library(const fs::path& folder, const std::string& name, const std::string& room,
                   const std::string& config, const std::string& what) {
  io::make_folder(folder / "src");
  io::make_folder(folder / "examples" / name);
  for (const Source& source : sources()) {
    const bool other = source.path.starts_with("firmware/") &&
                       source.path.find('/', 9) != std::string::npos &&
                       !source.path.starts_with("firmware/" + room + "/");
    if (other) continue;
    io::make_folder((folder / "src" / source.path).parent_path());
    io::write_file(folder / "src" / source.path, source.text);
  }
  io::write_file(folder / "src" / (room + "_config.hpp"), config);
  io::write_file(folder / "src" / (name + ".h"),
                 "// Including this header compiles the firmware into the sketch: it brings its own "
                 "main().\n#pragma once\n");
  io::write_file(folder / "library.properties",
                 fmt::format("name={}\nversion={}\nauthor=Flexor\nmaintainer=Flexor\nsentence={}\nparagraph="
                             "Written by flexor deploy.\n"
                             "category=Device Control\nurl=\narchitectures=avr\nincludes={}.h\n",
                             name, FLEXOR_VERSION, what, name));
  io::write_file(
      folder / "examples" / name / (name + ".ino"),
      fmt::format("// {}\n// Board: {} ({}, 16 MHz). The library has its own main(); there is nothing "
                  "to add here.\n#include <{}.h>\n",
                  what, kAtmega328p.boards, kAtmega328p.printed, name));
}

}  // namespace

void require_toolchain(const char* path) {
  for (const char* program : {kCompiler, "avr-objcopy", "avr-size"}) {
    if (io::find_program(program, path).empty())
      throw InputError(fmt::format("{} is missing: {}", program, kHint));
  }
  const std::vector<std::string> headers = {kCompiler, "-E",  "-include", "avr/eeprom.h",
                                            "-x",      "c++", "/dev/null"};
  if (io::run_process(headers, fs::temp_directory_path()).status != 0)  // Debian's gcc-avr comes without
    throw InputError(fmt::format("avr-libc is missing: {}", kHint));
}

std::vector<std::string> compiler() {
  return {kCompiler,
          std::string("-mmcu=") + kAtmega328p.name,
          "-DF_CPU=16000000UL",
          "-Os",
          "-std=c++14",
          "-Wall",
          "-Wextra",
          "-Werror",
          "-fno-exceptions",
          "-fno-rtti",
          "-fno-threadsafe-statics",
          "-ffunction-sections",
          "-fdata-sections",
          "-fshort-enums",
          "-mrelax",
          "-flto",
          "-flto-partition=none",
          "-fwhole-program",
          "-Wl,--gc-sections"};
}

Image build_glove(const Glove& glove, const fs::path& folder) {
  if (glove.model_as == ModelAs::code || data_block(glove).in_flash)
    return build_glove(glove_config(glove), folder);
  return build("glove", glove_config(glove), folder,
               {"-fno-move-loop-invariants", "-fno-tree-loop-optimize", "-fno-gcse", "-mcall-prologues",
                "-mstrict-X"});
}

Image build_glove(const std::string& config, const fs::path& folder) {
  return build("glove", config, folder, {"-fno-move-loop-invariants"});
}

Image build_hand(const Hand& hand, const fs::path& folder) {
  return build("hand", hand_config(hand), folder,
               {"-mcall-prologues", "-mstrict-X", "-fno-move-loop-invariants"});
}

void write_arduino(const Glove& glove, const Hand& hand, const fs::path& folder) {
  write_arduino_library(glove, folder / "Flexor");
  write_library(folder / "FlexorGlove", "FlexorGlove", "glove", glove_config(glove),
                "A flex-sensor glove with its compensator");
  if (glove.output == Output::radio) {
    write_library(folder / "FlexorHand", "FlexorHand", "hand", hand_config(hand),
                  "A five-motor hand that follows a glove over a radio");
  }
}

Error fixed_point_error(const model::Model& model, const std::vector<std::vector<double>>& recording) {
  Error out;
  out.range_deg = model::worst_fixed_error_deg(model);
  if (!recording.empty()) out.recording_deg = model::fixed_error_deg(model, recording);
  if (out.worst_deg() > kWorstError_deg) {
    throw InputError(fmt::format(
        "model {:?}: fixed point is up to {:.4f} degree from double, more than the {:g} allowed: steep "
        "curves and large gains cost precision",
        model.name, out.worst_deg(), kWorstError_deg));
  }
  return out;
}

}  // namespace flexor::deploy
