#include <algorithm>
#include <chrono>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/calibration.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/hardware.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/deploy/send.hpp"
#include "host/deploy/send_pages.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/serial.hpp"

namespace flexor::cli::send_command {

struct Options {
  std::string model;  // or the folder of a deployment
  std::string board;
  std::string port = "auto";
  unsigned baud = 0;  // 0: the hardware's
  std::string key;
  std::optional<double> rate_hz;
  std::string calibration;
  std::string hardware = "flexor";
  bool bootloader = false;
};

// A hand gets its own ends, other outputs the model's.
deploy::Glove glove_of(const Options& o, std::optional<double> rate_hz,
                       deploy::Output output = deploy::Output::radio) {
  model::Model model = model::load(o.model);
  set_rate(model, rate_hz);
  const model::Hardware hardware = model::hardware(o.hardware);
  std::vector<std::string> notes;
  if (output == deploy::Output::radio) model = deploy::on_hand(std::move(model), hardware, notes);
  for (const std::string& note : notes) log(note);
  return deploy::glove_that_runs(
      hardware, model, o.key.empty() ? deploy::Key() : deploy::load_key(o.key),
      o.calibration.empty() ? deploy::CalibrationDocument() : deploy::load_calibration(o.calibration));
}

// Over the line on which the glove speaks, while it runs.
deploy::Sent send_live(const Options& o, const deploy::Glove& glove, const std::string& path) {
  io::SerialPort port(path, o.baud != 0 ? o.baud : static_cast<unsigned>(glove.baud));
  const auto begin = std::chrono::steady_clock::now();
  const deploy::Line line = {
      [&](std::span<const std::uint8_t> bytes) { port.write(bytes); },
      [&](double timeout_s) { return port.read(timeout_s); },
      [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); }};
  ProgressLine progress;
  io::set_interruption_note(fmt::format(
      "interrupted: the glove at {} runs its old model; to send the new one, run the same command again",
      path));
  const auto step = [&](int done, int all) {
    progress.step("bytes sent:", static_cast<std::size_t>(done), static_cast<std::size_t>(all));
  };
  deploy::AtRate at_rate;
  if (!o.rate_hz) at_rate = [&](double rate_hz) { return glove_of(o, rate_hz); };
  const deploy::Sent sent = deploy::send_model(line, glove, step, at_rate);
  io::set_interruption_note("");
  return sent;
}

// Through the board's bootloader, with a pause.
deploy::Sent send_pages(const Options& o, const std::string& path) {
  const auto begin = std::chrono::steady_clock::now();
  ProgressLine progress;
  deploy::Bootloader bootloader(path, 0, progress.percents());
  const deploy::FlashContent there = bootloader.read();
  const std::optional<glove::Settings> settings = deploy::glove_settings_in(there);
  const deploy::Glove glove =
      !settings ? glove_of(o, o.rate_hz) : glove_of(o, settings->head.rate_hz, settings->head.output);
  const deploy::FlashContent pages = deploy::pages_with_model(there, glove, "the board");
  bootloader.write(pages);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  return {static_cast<int>(pages.bytes.size() - pages.begin), {}, took.count()};
}

// Settings, key and model of a deployment, whichever the board does not have.
Output send_folder(const Options& o) {
  const std::filesystem::path hex = deploy::image_of(o.model, o.board);
  const deploy::FlashContent wanted = deploy::read_image(hex);
  const std::string path = deploy::choose_port(o.port);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<std::string> sent;
  std::size_t bytes = 0;
  {
    ProgressLine progress;
    std::string block;
    deploy::Bootloader bootloader(
        path, 0, [&](const std::string& what, int percent) { progress.percent(block + what, percent); });
    for (const deploy::BlockPages& next : deploy::pages_with_blocks(bootloader.read(), wanted, o.model)) {
      block = next.what + ": ";
      bootloader.write(next.pages);
      bytes += next.pages.bytes.size() - next.pages.begin;
      if (std::ranges::find(sent, next.what) == sent.end()) sent.push_back(next.what);
    }
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const std::string image = io::one_line(hex.string());
  return {{{"folder", o.model}, {"port", path}, {"sent", sent}, {"bytes", bytes}, {"took_s", took.count()}},
          sent.empty() ? fmt::format("{}: has all of {} already\n", path, image)
                       : fmt::format("{}: has the {} of {} now: {} bytes, written and read back, {:.1f} s\n",
                                     path, fmt::join(sent, " and "), image, bytes, took.count())};
}

Output run(const Options& o) {
  std::error_code error;
  if (std::filesystem::is_directory(o.model, error)) return send_folder(o);

  const deploy::Glove glove = glove_of(o, o.rate_hz);
  const bool bootloader = o.bootloader || !deploy::fits_eeprom(glove);
  const std::string path = deploy::choose_port(o.port);
  if (o.port == "auto") log(fmt::format("the glove is at {}", path));
  if (bootloader && !o.bootloader)
    log("the model is too large for EEPROM: it goes through the bootloader, over USB, and the glove pauses");
  const deploy::Sent sent = bootloader ? send_pages(o, path) : send_live(o, glove, path);
  Json json = {{"model", o.model}, {"port", path}, {"bytes", sent.bytes}};
  if (sent.pieces) json["pieces"] = *sent.pieces;
  json["bootloader"] = bootloader;
  json["took_s"] = sent.took_s;
  return {json, fmt::format("{}: the glove runs {} now: {} bytes{}, written and read back, {:.1f} s\n", path,
                            io::one_line(o.model), sent.bytes,
                            sent.pieces ? fmt::format(" in {} pieces", *sent.pieces) : "", sent.took_s)};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "send", "A model into a glove that runs, or what changed in a deployment into its board", run);
  command
      ->add_option("MODEL_OR_FOLDER", o->model,
                   "model file; or the folder of a deployment, whose settings, key and model go to the board "
                   "over USB where they differ")
      ->required();
  command->add_option("--board", o->board, "of the folder: glove or hand")
      ->check(CLI::IsMember({"glove", "hand"}));
  add_port(*command, o->port, " of the glove or of a radio");
  command->add_option("--baud", o->baud,
                      "of the glove's radio, which is that of its USB, too (default: the hardware's)");
  command->add_option("--key", o->key, "file with the pair's key: pair.key of the deployment");
  command->add_option(
      "--rate", o->rate_hz,
      "sample rate of the glove: 10, 20, 50 or 100 Hz (default: the one that the glove says)");
  command->add_option("--calibration", o->calibration, "as at the deployment");
  add_hardware(*command, o->hardware);
  command->add_flag("--bootloader", o->bootloader,
                    "through the board's bootloader, over USB: into flash, where larger models have room; "
                    "the glove pauses for some seconds (default where the model does not fit EEPROM)");
}

}  // namespace flexor::cli::send_command
