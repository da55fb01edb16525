#include "host/deploy/pair_key.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iostream>
#include <random>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

constexpr std::size_t kDigits = 32;
constexpr const char* kNeeds = "32 hexadecimal digits are needed";

// The text without what editors and shells leave at its end; empty when there is more than a key can have.
std::string first_line(std::istream& stream) {
  std::array<char, 2 * kDigits> buffer;
  stream.read(buffer.data(), buffer.size());
  std::string text(buffer.data(), static_cast<std::size_t>(stream.gcount()));
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  return text;
}

}  // namespace

link::Key new_key() {
  std::random_device random;  // the system's
  link::Key key{};
  for (std::uint8_t& byte : key.bytes) byte = static_cast<std::uint8_t>(random());
  return key;
}

std::string to_hex(const link::Key& key) { return fmt::format("{:02x}", fmt::join(key.bytes, "")); }

bool is_key(const std::string& text) {
  return text.size() == kDigits && text.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
}

link::Key key_from_hex(const std::string& hex) {
  if (!is_key(hex)) throw io::InputError("not a key: {}", kNeeds);
  link::Key key{};
  for (std::size_t i = 0; i < sizeof(key.bytes); ++i)
    key.bytes[i] = static_cast<std::uint8_t>(std::stoi(hex.substr(2 * i, 2), nullptr, 16));
  if (std::ranges::all_of(key.bytes, [](std::uint8_t b) { return b == 0; }))
    throw io::InputError("not a key: all its digits are 0; without --key a random one is made");
  return key;
}

link::Key load_key(const std::filesystem::path& path) {
  std::string text;
  if (path == "-") {
    text = first_line(std::cin);
  } else {
    io::require_readable(path);
    std::ifstream file(path, std::ios::binary);
    text = first_line(file);
  }
  if (!is_key(text)) throw io::InputError("{}: is not a key: {}", path.string(), kNeeds);
  try {
    return key_from_hex(text);
  } catch (const io::InputError& error) {
    throw io::InputError("{}: {}", path.string(), error.what());
  }
}

void write_key(const std::filesystem::path& path, const link::Key& key) {
  io::write_file(path, to_hex(key) + "\n", io::Access::owner);
}

std::string keep_old_key(const std::filesystem::path& path, const link::Key& next) {
  if (!std::filesystem::is_regular_file(path)) return {};
  const link::Key old = load_key(path);
  const auto is_old = [&](const link::Key& key) { return to_hex(key) == to_hex(old); };
  if (is_old(next)) return {};
  std::filesystem::path copy = path.string() + ".old";
  for (int n = 2; std::filesystem::exists(copy) && !is_old(load_key(copy)); ++n)
    copy = fmt::format("{}.old-{}", path.string(), n);
  if (!std::filesystem::exists(copy)) write_key(copy, old);
  return fmt::format("the key that was there is kept in {}: boards have it until they are flashed",
                     copy.string());
}

}  // namespace flexor::deploy
