#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/pair.hpp"
#include "host/deploy/pair_key.hpp"

namespace flexor::cli::pair_command {

namespace fs = std::filesystem;

struct Options {
  std::string glove;
  std::string hand;
  int baud = 0;
  std::string key;
  std::string out = "pair.key";
};

void require_sensible(const Options& o) {
  const bool boards = !o.glove.empty() || !o.hand.empty();
  if (!boards)
    throw io::InputError(
        "give two boards, --glove PORT --hand PORT; a deployment gets a key with flexor deploy --key or "
        "--new-key");
  if ((o.glove.empty() || o.hand.empty()) && o.key.empty())
    throw io::InputError(
        "one board alone needs the other's key: --key FILE, as flexor pair or deploy wrote it");
  std::error_code error;
  if (!o.glove.empty() && (o.glove == o.hand || fs::equivalent(o.glove, o.hand, error)))
    throw io::InputError("--glove and --hand name the same port");
  if (!o.key.empty()) return;
  if (fs::exists(o.out, error)) {
    throw io::InputError(
        "{}: is there already: --key {} gives both boards that key, --out writes the new one elsewhere",
        o.out, io::shell_word(o.out));
  }
  io::require_writable(o.out);
}

Output run(const Options& o) {
  require_sensible(o);
  const link::Key key = o.key.empty() ? deploy::new_key() : deploy::load_key(o.key);
  const std::string file = o.key.empty() ? o.out : o.key;
  {
    ProgressLine line;
    std::vector<deploy::PairBoard> boards;
    std::string mend = "flexor pair --key " + io::shell_word(file);
    for (const auto& [name, port] : {std::pair{"glove", o.glove}, std::pair{"hand", o.hand}}) {
      if (port.empty()) continue;
      boards.push_back({name, {deploy::choose_port(port), o.baud, line.percents(fmt::format("{}: ", name))}});
      mend += fmt::format(" --{} {}", name, io::shell_word(port));
    }
    deploy::pair_boards(boards, key, o.key.empty() ? o.out : "", mend);
  }
  const std::string who = o.glove.empty() != o.hand.empty() ? "the board has" : "glove and hand have";
  return {{{"key_file", file},
           {"key", o.key.empty() ? "new" : "given"},
           {"glove", !o.glove.empty()},
           {"hand", !o.hand.empty()}},
          fmt::format("{} the key of {}: keep that file, whoever has it can move the hand\n"
                      "later deployments: flexor deploy --key {}, since a folder's own key is the old one\n",
                      who, io::one_line(file), io::shell_word(file))};
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "pair", "One key for glove and hand over USB, without a compiler", run);
  command->add_option("--glove", o->glove, "the glove's serial port");
  command->add_option("--hand", o->hand, "the hand's serial port");
  add_positive(*command, "--baud", o->baud, "of the bootloaders (default: 115200, then the old 57600)");
  command->add_option("--key", o->key, "file with the key, 32 hexadecimal digits (default: a new key)");
  add_shown(*command, "--out", o->out, "file that a new key is written to, for its owner alone");
}

}  // namespace flexor::cli::pair_command
