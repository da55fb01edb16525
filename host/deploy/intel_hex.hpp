// Flash content as the tools write it: Intel HEX, records of 16 bits of address and a checksum each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace flexor::deploy {

using Bytes = std::vector<std::uint8_t>;

// Of a flash from its first byte on: what no record wrote is 0xff, as erased flash is.
struct FlashContent {
  Bytes bytes;            // up to the highest that a record wrote
  std::size_t begin = 0;  // the lowest
};

// `text` of a file `name`. Throws io::InputError, one line naming file and line: no Intel HEX, a checksum that is
// wrong, bytes that are written twice or at `flash_bytes` and beyond, a missing end, nothing in it.
FlashContent parse_intel_hex(const std::string& text, const std::string& name, std::size_t flash_bytes);
FlashContent read_intel_hex(const std::filesystem::path& path, std::size_t flash_bytes);

// Records of 16 bytes from `content.begin` on.
std::string to_intel_hex(const FlashContent& content);

}  // namespace flexor::deploy
