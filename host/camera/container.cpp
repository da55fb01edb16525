#include "host/camera/container.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

namespace flexor::camera {
namespace {

class Bytes {
 public:
  explicit Bytes(const std::filesystem::path& path)
      : stream_(path, std::ios::binary), length_(std::filesystem::file_size(path)) {}

  std::uint64_t length() const { return length_; }

  // Most significant byte first; nothing past the end.
  std::optional<std::uint64_t> number(std::uint64_t at, int bytes) {
    std::array<char, 8> raw{};
    stream_.clear();
    if (at > length_ || !stream_.seekg(static_cast<std::streamoff>(at)) || !stream_.read(raw.data(), bytes)) {
      return {};
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(bytes); ++i) {
      value = value << 8 | static_cast<std::uint8_t>(raw[i]);
    }
    return value;
  }

 private:
  std::ifstream stream_;
  std::uint64_t length_;
};

// Each function says where the part that begins at `at` ends.
using End = std::optional<std::uint64_t>;

End end_of_box(Bytes& file, std::uint64_t at) {
  const auto size = file.number(at, 4);
  if (size != 1) return size && *size >= 8 ? End(at + *size) : End();
  const auto large = file.number(at + 8, 8);
  return large && *large >= 16 && *large <= file.length() ? End(at + *large) : End();
}

End end_of_riff(Bytes& file, std::uint64_t at) {
  constexpr std::uint64_t kRiff = 0x52494646;
  const auto size = file.number(at + 4, 4);
  if (file.number(at, 4) != kRiff || !size) return {};
  const std::uint32_t bytes = __builtin_bswap32(static_cast<std::uint32_t>(*size));
  return bytes >= 4 ? End(at + 8 + bytes + bytes % 2) : End();
}

// Identifier of four bytes, then a size whose leading zeros say how many bytes it has; all ones: not known.
End end_of_element(Bytes& file, std::uint64_t at) {
  const auto first = file.number(at + 4, 1);
  if (!first || *first == 0) return {};
  const int bytes = std::countl_zero(static_cast<std::uint8_t>(*first)) + 1;
  const auto raw = file.number(at + 4, bytes);
  if (!raw) return {};
  const std::uint64_t unknown = (std::uint64_t{1} << (7 * bytes)) - 1;
  const std::uint64_t size = *raw & unknown;
  if (size == unknown || size > file.length()) return {};
  return at + 4 + static_cast<std::uint64_t>(bytes) + size;
}

}  // namespace

bool is_whole(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  const auto end_of = extension == ".mp4"   ? end_of_box
                      : extension == ".avi" ? end_of_riff
                      : extension == ".mkv" ? end_of_element
                                            : nullptr;
  if (end_of == nullptr) return false;
  Bytes file(path);
  std::uint64_t last = 0;
  End at = 0;
  while (at && *at < file.length()) {
    last = *at;
    at = end_of(file, last);
  }
  constexpr std::uint64_t kMoov = 0x6D6F6F76;
  if (end_of == end_of_box && file.number(last + 4, 4) != kMoov) return false;
  return at && *at > 0 && *at == file.length();
}

}  // namespace flexor::camera
