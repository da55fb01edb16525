#include "host/deploy/pair.hpp"

#include <fmt/format.h>

#include "host/deploy/images.hpp"
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
      throw JobError("the {}: {}; no key was changed", board.name, error.what());
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
      throw JobError("{}; {}: they are a pair again after {}", error.what(), now, mend);
    }
  }
  says("");
}

}  // namespace flexor::deploy
