#include "host/deploy/pair.hpp"

#include <fmt/format.h>

#include "host/deploy/arduino_library.hpp"
#include "host/deploy/key_patch.hpp"
#include "host/deploy/out_folder.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::InputError;
using io::JobError;

// Each takes a key.
void check_all(const std::vector<PairBoard>& boards) {
  for (const PairBoard& board : boards) {
    try {
      (void)key_in(board.bootloader->read(), "the " + board.name + "'s board");
    } catch (const std::runtime_error& error) {
      throw JobError(fmt::format("the {}: {}; no key was changed", board.name, error.what()));
    }
  }
}

// Which board has which key while `writing` is written.
std::string state(const std::vector<PairBoard>& boards, std::size_t writing) {
  std::string out;
  for (std::size_t i = 0; i < boards.size(); ++i) {
    const char* has = i < writing    ? "has the new key"
                      : i == writing ? "may have either key, or none"
                                     : "has the old key";
    out += fmt::format("{}the {} {}", i > 0 ? ", " : "", boards[i].name, has);
  }
  return out;
}

}  // namespace

void pair_boards(const std::vector<PairBoard>& boards, const link::Key& key, const std::string& mend,
                 const std::function<void()>& about_to_write,
                 const std::function<void(const std::string&)>& says) {
  says("interrupted: no key was changed");
  check_all(boards);
  about_to_write();
  for (std::size_t i = 0; i < boards.size(); ++i) {
    const std::string now = state(boards, i);
    says(fmt::format("interrupted: {}: they are a pair again after {}", now, mend));
    try {
      boards[i].bootloader->write(page_with_key(key));
    } catch (const std::runtime_error& error) {
      throw JobError(fmt::format("{}; {}: they are a pair again after {}", error.what(), now, mend));
    }
  }
  says("");
}

fs::path pair_folder(const fs::path& folder, const link::Key& key) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw InputError(fmt::format("{}: no such folder", folder.string()));
  OutFolder out(folder);
  if (!fs::exists(folder / "glove.hex", error) || !fs::exists(folder / "hand.hex", error)) {
    throw InputError(fmt::format(
        "{}: holds no images of a glove and a hand with a radio: flexor deploy makes them", folder.string()));
  }
  out.stage_what_is_there();
  for (const char* board : {"glove.hex", "hand.hex"}) {
    FlashContent content = read_intel_hex(out.staging() / board, kOptibootBegin);
    (void)key_in(content, board);
    const FlashContent page = page_with_key(key);
    const auto begin = static_cast<std::ptrdiff_t>(page.begin);
    std::copy(page.bytes.begin() + begin, page.bytes.end(), content.bytes.begin() + begin);
    io::write_file(out.staging() / board, to_intel_hex(content), io::Access::owner);
  }
  if (fs::exists(folder / kArduinoFolder, error)) put_key(key_record(key), out.staging() / kArduinoFolder);
  write_key(out.staging() / kKeyFile, key);
  const fs::path kept = keep_old_key(folder / kKeyFile, key);
  out.publish();
  return kept;
}

}  // namespace flexor::deploy
