#include "host/deploy/send_pages.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/deploy/images.hpp"
#include "host/deploy/key_patch.hpp"
#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

void check_key(const FlashContent& content, const Key& key, const std::string& name) {
  if (!key) return;
  const Key there = key_in(content, name);
  if (there && std::ranges::equal(there->bytes, key->bytes)) return;
  throw InputError(fmt::format("{} has {} key: --key FILE is that of its deployment, or is left out over USB",
                               name, there ? "another" : "no"));
}

}  // namespace

FlashContent pages_with_model(const FlashContent& content, const Glove& glove, const std::string& name) {
  const glove::Settings* settings = glove_settings_in(content);
  if (settings == nullptr) {
    throw InputError(
        fmt::format("{}: holds no settings of this Flexor: its image is an older one, or a hand's: flexor "
                    "deploy, then flexor flash",
                    name));
  }
  check_key(content, glove.key, name);
  check_made_for(glove, settings->head.rate_hz, settings->head.calibration_id, name);
  Glove board = glove;  // what leaves it is the board's business
  board.output = settings->head.output;
  const Bytes block = flash_block(board);
  std::array<core::Copy, 2> copy{};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t at = core::kModelBegin + i * core::kModelCopy;
    if (content.bytes.size() < at + core::kModelCopy) continue;
    copy[i] = core::read_copy(content.bytes.data() + at, core::kModelCopy);
  }
  const std::uint8_t runs = core::newest_of(copy.data());
  const auto generation = static_cast<std::uint16_t>(runs < 2 ? copy.at(runs).generation + 1 : 1);
  const Bytes now = copy_of(block, generation);
  FlashContent out;
  out.begin = core::kModelBegin + (runs == 0 ? core::kModelCopy : 0);
  out.bytes.assign(out.begin, 0xff);
  out.bytes.insert(out.bytes.end(), now.begin(), now.end());
  out.bytes.resize((out.bytes.size() + core::kFlashPage - 1) / core::kFlashPage * core::kFlashPage, 0xff);
  return out;
}

}  // namespace flexor::deploy
