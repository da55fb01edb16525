// A key for two boards over USB, without a compiler; or for the images of a deployment.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/deploy/config.hpp"
#include "host/deploy/flash.hpp"

namespace flexor::deploy {

struct PairBoard {
  std::string name;  // "glove", "hand"
  Bootloader bootloader;
};

// Reads every board's flash before any is changed, writes the key into `key_file` (empty: it is kept elsewhere),
// then the page with the key's record, board by board, each compared. An interruption reports at every step which board has which
// key, as do io::InputError and io::JobError, one line, with the command `mend` where that helps.
void pair_boards(std::vector<PairBoard>& boards, const link::Key& key, const std::filesystem::path& key_file,
                 const std::string& mend);

}  // namespace flexor::deploy
