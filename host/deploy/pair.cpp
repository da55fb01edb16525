#include "host/deploy/pair.hpp"

#include <fmt/format.h>

#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

using io::JobError;

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

void pair_boards(std::vector<PairBoard>& boards, const link::Key& key, const std::filesystem::path& key_file,
                 const std::string& mend) {
  io::set_interruption_note("interrupted: no key was changed");
  for (PairBoard& board : boards) {  // each takes a key
    try {
      (void)key_in(board.bootloader.read(), "the " + board.name + "'s board");
    } catch (const std::runtime_error& error) {
      throw JobError("the {}: {}; no key was changed", board.name, error.what());
    }
  }
  if (!key_file.empty()) write_key(key_file, key);
  for (std::size_t i = 0; i < boards.size(); ++i) {
    const std::string now = state(boards, i);
    io::set_interruption_note(fmt::format("interrupted: {}: they are a pair again after {}", now, mend));
    try {
      boards[i].bootloader.write(page_with_key(key));
    } catch (const std::runtime_error& error) {
      throw JobError("{}; {}: they are a pair again after {}", error.what(), now, mend);
    }
  }
  io::set_interruption_note("");
}

}  // namespace flexor::deploy
