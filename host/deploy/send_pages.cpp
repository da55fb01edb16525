#include "host/deploy/send_pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/deploy/images.hpp"
#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

using Copies = std::array<core::Copy, 2>;

std::size_t place_of(std::size_t copy) { return core::kModelBegin + copy * core::kModelCopy; }

Copies models_in(const FlashContent& content) {
  Copies out{};
  for (std::size_t i = 0; i < out.size(); ++i)
    out.at(i) = core::read_copy(content.bytes.data() + place_of(i), core::kModelCopy);
  return out;
}

// `block` as a copy at `at`, whole pages.
FlashContent pages_at(std::size_t at, const Bytes& block, int generation) {
  const Bytes copy = copy_of(block, static_cast<std::uint16_t>(generation));
  FlashContent out{Bytes(at, 0xff), at};
  out.bytes.insert(out.bytes.end(), copy.begin(), copy.end());
  out.bytes.resize((out.bytes.size() + core::kFlashPage - 1) / core::kFlashPage * core::kFlashPage, 0xff);
  return out;
}

// Over the copy of the model that does not run, so many generations newer than the one that does.
FlashContent pages_beside_model(const FlashContent& content, const Bytes& block, int newer) {
  const Copies copy = models_in(content);
  const std::uint8_t runs = core::newest_of(copy.data());
  const int generation = runs < 2 ? copy.at(runs).generation + newer : std::max(newer, 0);
  return pages_at(place_of(runs == 0 ? 1 : 0), block, generation);
}

Bytes bytes_of(const core::Copy& copy) { return {copy.bytes, copy.bytes + copy.size}; }

core::Copy settings_at_their_place(const FlashContent& content) {
  return core::read_copy(content.bytes.data() + core::kSettingsBegin, core::kSettingsCopy);
}

// First over the copy of the model that does not run, and never the newest there; then at their place.
void add_settings(const FlashContent& content, const Bytes& block, std::vector<BlockPages>& out) {
  const core::Copy there = settings_at_their_place(content);
  if (there.size > 0 && bytes_of(there) == block) return;
  if (there.size > 0) out.push_back({"settings", pages_beside_model(content, block, -1)});
  out.push_back({"settings", pages_at(core::kSettingsBegin, block, 0)});
}

// The digest of the settings that the board runs with.
std::optional<std::uint16_t> settings_digest(const FlashContent& content, link::BoardKind board) {
  const std::uint8_t* flash = content.bytes.data();
  const void* found = nullptr;
  if (board == link::BoardKind::glove) found = core::find_settings<glove::Settings>(flash);
  if (board == link::BoardKind::hand) found = core::find_settings<hand::Settings>(flash);
  if (found == nullptr) return {};
  return core::Flash::word(static_cast<const std::uint8_t*>(found) - core::kCopyHead + 4);
}

const char* name_of(link::BoardKind board) { return board == link::BoardKind::glove ? "glove" : "hand"; }

std::string digest_text(const std::optional<std::uint16_t>& digest) {
  return digest ? fmt::format("{:04x}", *digest) : "none";
}

}  // namespace

std::optional<BoardContents> contents_of(const FlashContent& content) {
  const FlashContent all = whole(content);
  core::ImageId id;
  std::memcpy(&id, all.bytes.data() + core::kImageIdBegin, sizeof(id));
  if (id.mark[0] != 'F' || id.mark[1] != 'X' || id.board > 1) return {};
  BoardContents out{};
  out.board = static_cast<link::BoardKind>(id.board);
  out.version = fmt::format("{}.{}.{}", id.version[0], id.version[1], id.version[2]);
  const Bytes& ours = (id.board == 0 ? glove_image() : hand_image()).content.bytes;
  out.is_our_image = std::ranges::equal(ours, std::span(all.bytes).first(ours.size()));
  out.settings = settings_digest(all, out.board);
  const Copies copy = models_in(all);
  const std::uint8_t runs = core::newest_of(copy.data());
  if (out.board == link::BoardKind::glove && runs < 2) {
    out.model = copy.at(runs).crc;
    out.model_bytes = copy.at(runs).size;
  }
  return out;
}

void require_same_board(const std::optional<BoardContents>& there, const std::optional<BoardContents>& wanted,
                        const std::string& name) {
  if (there && wanted && there->board != wanted->board)
    throw InputError(
        "{}: is for a {}, and the board is a {}: take the other port; a board that is to change "
        "gets any other sketch first",
        name, name_of(wanted->board), name_of(there->board));
}

std::string to_text(const BoardContents& c) {
  std::string out = fmt::format("a {}, image of Flexor {}{}, settings {}", name_of(c.board), c.version,
                                c.is_our_image ? "" : " (not this program's: flexor flash replaces it)",
                                digest_text(c.settings));
  if (c.board == link::BoardKind::glove)
    out +=
        c.model ? fmt::format(", model {} of {} bytes", digest_text(c.model), c.model_bytes) : ", no model";
  return out;
}

FlashContent pages_with_model(const FlashContent& content, const Glove& glove, const std::string& name) {
  const FlashContent all = whole(content);
  const std::optional<glove::Settings> settings = glove_settings_in(all);
  if (!settings) {
    throw InputError(
        "{}: holds no settings of this Flexor: its image is an older one, or a hand's: flexor "
        "deploy, then flexor flash",
        name);
  }
  const Key there = glove.key ? key_in(all, name) : Key();
  if (glove.key && !(there && std::ranges::equal(there->bytes, glove.key->bytes)))
    throw InputError("{} has {} key: --key FILE is that of its deployment, or is left out over USB", name,
                     there ? "another" : "no");
  check_made_for(glove, settings->head.rate_hz, settings->head.calibration_id, name);
  Glove board = glove;  // what leaves it is the board's business
  board.output = settings->head.output;
  board.encoding = (settings->head.vr & glove::kFurtherJoints) != 0 ? Encoding::beta : Encoding::alpha;
  return pages_beside_model(all, flash_block(board), 1);
}

std::vector<BlockPages> pages_with_blocks(FlashContent content, FlashContent wanted,
                                          const std::string& name) {
  content = whole(std::move(content));
  wanted = whole(std::move(wanted));
  const std::optional<BoardContents> there = contents_of(content);
  const std::optional<BoardContents> now = contents_of(wanted);
  if (!now || !now->settings)
    throw InputError("{}: its image is of no Flexor that sends settings: deploy again", name);
  require_same_board(there, now, name);
  if (!there ||
      !std::equal(content.bytes.begin(), content.bytes.begin() + core::kKeyBegin, wanted.bytes.begin())) {
    throw InputError(
        "the board has {}: flexor flash {} --board {} writes the image of Flexor {} with settings and model",
        there ? "another image, of Flexor " + there->version : "an image without a version", name,
        name_of(now->board), now->version);
  }
  std::vector<BlockPages> out;
  add_settings(content, bytes_of(settings_at_their_place(wanted)), out);
  const auto key = [](const FlashContent& flash) {
    return std::span(flash.bytes).subspan(core::kKeyBegin, sizeof(link::KeyRecord));
  };
  if (!std::ranges::equal(key(content), key(wanted)))
    out.push_back({"key", page_with_key(key_in(wanted, name))});
  if (!now->model) return out;
  // Whether it is there or not: one that was sent into EEPROM may run, and counts no more then.
  out.push_back({"model", pages_beside_model(content, bytes_of(models_in(wanted)[0]), 1)});
  return out;
}

}  // namespace flexor::deploy
