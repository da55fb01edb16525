#include <chrono>
#include <random>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/send_pages.hpp"
#include "host/io/interrupt.hpp"

namespace flexor::cli::flash_command {

struct Options {
  std::string what;
  std::string board;
  std::string port = "auto";
  int baud = 0;  // 0: both
};

// With its model in a generation of its own, so that none that was sent to the board before runs on.
deploy::FlashContent fresh(const deploy::FlashContent& image, const std::string& name) {
  const std::optional<deploy::BoardContents> contents = deploy::contents_of(image);
  if (contents && !contents->settings)
    throw io::InputError(
        "{}: holds no settings for its image, whose board would stay silent: flexor deploy writes them",
        name);
  return deploy::with_generation(image, static_cast<std::uint16_t>(std::random_device()()));
}

Output run(const Options& o) {
  const std::filesystem::path hex = deploy::image_of(o.what, o.board);
  const deploy::FlashContent image = fresh(deploy::read_image(hex), hex.string());
  const std::string port = deploy::choose_port(o.port);
  if (o.port == "auto") log(fmt::format("the board is at {}", port));
  const auto begin = std::chrono::steady_clock::now();
  int rate_Bd = 0;
  {
    ProgressLine line;
    deploy::Bootloader bootloader(port, o.baud, line.percents());
    deploy::require_same_board(deploy::contents_of(bootloader.read()), deploy::contents_of(image),
                               hex.string());
    io::set_interruption_note(fmt::format(
        "interrupted: {} may hold part of the image; its bootloader is whole: run the same command again",
        port));
    bootloader.write(image);
    io::set_interruption_note("");
    rate_Bd = bootloader.rate_Bd();
  }
  const std::chrono::duration<double> took_s = std::chrono::steady_clock::now() - begin;
  const std::size_t bytes = image.bytes.size() - image.begin;
  std::string text = fmt::format(
      "{}: {} bytes written through the bootloader at {} baud and read back: the same, {:.1f} s\n", port,
      bytes, rate_Bd, took_s.count());
  if (rate_Bd == deploy::kOldRate_Bd)
    text +=
        "This is an old bootloader: after the watchdog has ended a program that hung, the board stays off "
        "until its supply was. Optiboot (Arduino IDE: Tools, Burn Bootloader, as an Uno) mends that.\n";
  return {{{"image", hex.string()},
           {"port", port},
           {"target", deploy::kAtmega328p.name},
           {"baud", rate_Bd},
           {"flash_bytes", bytes},
           {"verified", true},
           {"took_s", took_s.count()}},
          text};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "flash", "Writes a deployment's image into a board through its bootloader, and compares", run);
  command->add_option("FOLDER_OR_HEX", o->what, "folder of flexor deploy, or an image in Intel HEX")
      ->required();
  command->add_option("--board", o->board, "of the folder: glove or hand")
      ->check(CLI::IsMember({"glove", "hand"}));
  add_port(*command, o->port, "");
  add_positive(*command, "--baud", o->baud, "of the bootloader (default: 115200, then the old 57600)");
}

}  // namespace flexor::cli::flash_command
