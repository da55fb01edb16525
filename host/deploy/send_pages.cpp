#include "host/deploy/send_pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "host/deploy/key_patch.hpp"
#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

struct Board {
  glove::ModelRecord record;
  std::size_t copies;  // where the first begins
};

Board find_pages(const FlashContent& content, const std::string& name) {
  const glove::ModelRecord wanted = {};
  const std::string_view magic = kModelMagic;
  const auto at = std::search(content.bytes.begin(), content.bytes.end(), magic.begin(), magic.end());
  const auto begin = static_cast<std::size_t>(at - content.bytes.begin());
  if (content.bytes.size() < begin + sizeof(wanted)) {
    throw InputError(
        fmt::format("{}: its image takes no models in flash: deploy a model that needs it with --model-as "
                    "data, and flash it once",
                    name));
  }
  Board board{{}, begin + sizeof(wanted)};
  std::memcpy(&board.record, content.bytes.data() + begin, sizeof(wanted));
  if (begin % glove::kFlashPage != 0 || crc_of(board.record) != board.record.crc ||
      content.bytes.size() < board.copies + 2 * std::size_t{board.record.copy_bytes}) {
    throw InputError(fmt::format("{}: the record of its models is damaged: flash it anew", name));
  }
  return board;
}

void check(const glove::ModelRecord& record, const Glove& glove, const ModelBlock& block,
           const std::string& name) {
  if (record.version != compensator::kGraphVersion) {
    throw InputError(
        fmt::format("{}: its image is of another version: deploy the model anew, then flexor flash", name));
  }
  check_made_for(glove, record.rate_hz, record.calibration, name);
  if (block.bytes() + glove::kCopyHead > record.copy_bytes || block.state_bytes > kFlashArenaBytes) {
    throw InputError(fmt::format(
        "model {:?} does not fit {}: {} bytes of flash where {} are, {} of RAM where {} are: fewer knots",
        glove.model.name, name, block.bytes(), record.copy_bytes - glove::kCopyHead, block.state_bytes,
        kFlashArenaBytes));
  }
}

void check_key(const FlashContent& content, const Key& key, const std::string& name) {
  if (!key) return;
  const Key there = key_in(content, find_key_record(content, name));
  if (there && std::ranges::equal(there->bytes, key->bytes)) return;
  throw InputError(fmt::format("{} has {} key: --key FILE is that of its deployment, or is left out over USB",
                               name, there ? "another" : "no"));
}

}  // namespace

FlashContent pages_with_model(const FlashContent& content, const Glove& glove, const std::string& name) {
  const Board board = find_pages(content, name);
  check_key(content, glove.key, name);
  const ModelBlock block = model_block(glove, 1);
  check(board.record, glove, block, name);
  const std::size_t bytes = board.record.copy_bytes;
  std::array<glove::Copy, 2> copy{};
  std::array<bool, 2> whole{};
  for (std::size_t i = 0; i < 2; ++i) {
    whole[i] = glove::read_copy(content.bytes.data() + board.copies + i * bytes, board.record.copy_bytes,
                                board.record.image, copy[i]);
  }
  const std::uint8_t runs = glove::newest_copy(whole.data(), copy.data());
  const std::size_t other = runs == 0 ? 1 : 0;
  const auto generation = static_cast<std::uint16_t>(runs < 2 ? copy.at(runs).generation + 1 : 1);
  const Bytes now = model_copy(block, board.record.image, generation);
  FlashContent out;
  out.begin = board.copies + other * bytes;
  out.bytes.assign(out.begin, 0xff);
  out.bytes.insert(out.bytes.end(), now.begin(), now.end());
  out.bytes.resize((out.bytes.size() + glove::kFlashPage - 1) / glove::kFlashPage * glove::kFlashPage, 0xff);
  return out;
}

}  // namespace flexor::deploy
