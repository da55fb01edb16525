// A key for two boards over USB, without a compiler; or for the images of a deployment.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/deploy/config.hpp"
#include "host/deploy/flash.hpp"

namespace flexor::deploy {

struct PairBoard {
  std::string name;  // "glove", "hand"
  Bootloader* bootloader;
};

// Reads every board's flash before any is changed, calls `about_to_write` (which may throw: nothing is changed yet),
// then writes the page with the key's record, board by board, each compared. `says` hears at every step what would have
// to be told if the process ended now. Throws io::InputError and io::JobError, one line that says which board has which
// key and, where `mend` helps, that command.
void pair_boards(const std::vector<PairBoard>& boards, const link::Key& key, const std::string& mend,
                 const std::function<void()>& about_to_write,
                 const std::function<void(const std::string&)>& says);

}  // namespace flexor::deploy
