// What lies in a board's flash behind its image (runtime/core/flash_map.hpp), read and replaced through the board's
// bootloader: the board pauses while its flash is read and pages are written, and starts with the new blocks.
#pragma once

#include <optional>

#include "host/deploy/config.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/intel_hex.hpp"

namespace flexor::deploy {

// What a board reports of itself.
struct BoardContents {
  link::BoardKind board;
  std::string version;                    // of its image
  bool is_our_image;                      // byte for byte the one that this program carries
  std::optional<std::uint16_t> settings;  // digest, CRC-16; none: there are no settings of this version
  std::optional<std::uint16_t> model;     // likewise; one that was sent into EEPROM may run instead
  std::size_t model_bytes = 0;
};

// None: it is no image of Flexor's, or one older than versions in images.
std::optional<BoardContents> contents_of(const FlashContent& content);
std::string to_text(const BoardContents& contents);
// Throws io::InputError where both are known and differ. `name`: of what is wanted.
void require_same_board(const std::optional<BoardContents>& there, const std::optional<BoardContents>& wanted,
                        const std::string& name);

// What is to be written over a board's flash, whose content this is: the copy that does not run, with the next
// generation. `name`: of the board, for errors. Throws io::InputError, one line with the mend, where the board has no
// settings of this version, or has another rate, calibration or key (where the glove has one: over USB none is needed), or the model is too large.
FlashContent pages_with_model(const FlashContent& content, const Glove& glove, const std::string& name);

struct BlockPages {
  std::string what;  // settings, key, model
  FlashContent pages;
};

// What brings the settings, key and model of a deployment's image `wanted` into a board that holds `content`, in this
// order; settings and key where they differ, a model always, since another may have been sent into EEPROM. Power that is lost at any instant leaves the old settings or the new, and the old model or the new; a key
// is one page. Throws io::InputError, one line: the images are not the same, or not of the same board.
std::vector<BlockPages> pages_with_blocks(FlashContent content, FlashContent wanted, const std::string& name);

}  // namespace flexor::deploy
