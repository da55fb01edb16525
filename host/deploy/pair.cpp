#include "host/deploy/pair.hpp"

#include <fmt/format.h>

#include "host/deploy/key_patch.hpp"
#include "host/deploy/out_folder.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::InputError;
using io::JobError;

struct Target {
  PairBoard board;
  FlashContent content;
  std::size_t address;
};

std::vector<Target> read_all(const std::vector<PairBoard>& boards) {
  std::vector<Target> out;
  for (const PairBoard& board : boards) {
    try {
      FlashContent content = board.bootloader->read();
      const std::size_t address = find_key_record(content, "the " + board.name + "'s board");
      out.push_back({board, std::move(content), address});
    } catch (const std::runtime_error& error) {
      throw JobError(fmt::format("the {}: {}; no key was changed", board.name, error.what()));
    }
  }
  return out;
}

// Which board has which key while `writing` is written.
std::string state(const std::vector<Target>& targets, std::size_t writing) {
  std::string out;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const char* has = i < writing    ? "has the new key"
                      : i == writing ? "may have either key, or none"
                                     : "has the old key";
    out += fmt::format("{}the {} {}", i > 0 ? ", " : "", targets[i].board.name, has);
  }
  return out;
}

void replace_all(std::string& text, const std::string& old, const std::string& now) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + now.size()))
    text.replace(at, old.size(), now);
}

std::string bytes_of(const link::KeyRecord& record) {
  return {reinterpret_cast<const char*>(&record), sizeof(record)};
}

// The image's own name tells whose key it has now.
void patch_hex(const fs::path& hex, const link::Key& key, Key& before) {
  FlashContent content = read_intel_hex(hex, kOptibootBegin);
  const std::size_t address = find_key_record(content, hex.filename().string());
  before = key_in(content, address);
  const FlashContent page = page_with_key(content, address, key);
  std::copy_n(page.bytes.begin() + static_cast<std::ptrdiff_t>(address), sizeof(link::KeyRecord),
              content.bytes.begin() + static_cast<std::ptrdiff_t>(address));
  io::write_file(hex, to_intel_hex(content), io::Access::owner);
}

}  // namespace

void pair_boards(const std::vector<PairBoard>& boards, const link::Key& key, const std::string& mend,
                 const std::function<void()>& about_to_write,
                 const std::function<void(const std::string&)>& says) {
  says("interrupted: no key was changed");
  const std::vector<Target> targets = read_all(boards);
  about_to_write();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const std::string now = state(targets, i);
    says(fmt::format("interrupted: {}: they are a pair again after {}", now, mend));
    try {
      targets[i].board.bootloader->write(page_with_key(targets[i].content, targets[i].address, key));
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
  for (const char* board : {"glove", "hand"}) {
    Key before;
    patch_hex(out.staging() / (std::string(board) + ".hex"), key, before);
    const std::string config = std::string(board) + "_config.hpp";
    for (const auto& entry : fs::recursive_directory_iterator(out.staging())) {
      const std::string name = entry.path().filename().string();
      if (name != config && name != std::string(board) + ".elf") continue;
      std::string text = io::read_file(entry.path());
      replace_all(text, bytes_of(key_record(before)), bytes_of(key_record(key)));
      replace_all(text, key_text(before), key_text(key));
      io::write_file(entry.path(), text, io::Access::owner);
    }
  }
  write_key(out.staging() / kKeyFile, key);
  const fs::path kept = keep_old_key(folder / kKeyFile, key);
  out.publish();
  return kept;
}

}  // namespace flexor::deploy
