// Binary messages of the socket (SOCKET.md), little endian.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace flexor::live {

static_assert(std::endian::native == std::endian::little);

enum class Kind : std::uint8_t { samples = 1, hand = 2, picture_in = 3, picture_out = 4, posture = 5 };

inline constexpr std::size_t kLongestPicture = 512 << 10;  // bytes

// Rows of a time and two values of each of `columns`.
class Rows {
 public:
  Rows(Kind kind, std::size_t columns)
      : bytes_{static_cast<std::uint8_t>(kind), static_cast<std::uint8_t>(columns), 0, 0} {}

  // A value of each column in `first`, and in `second`.
  void add(double host_s, const auto& first, const auto& second) {
    put(host_s);
    for (const double value : first) put(static_cast<float>(value));
    for (const double value : second) put(static_cast<float>(value));
    ++rows_;
    std::memcpy(bytes_.data() + 2, &rows_, sizeof rows_);
  }

  bool is_full() const { return rows_ == UINT16_MAX; }
  bool is_empty() const { return rows_ == 0; }
  std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  template <class T>
  void put(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }

  std::uint16_t rows_ = 0;
  std::vector<std::uint8_t> bytes_;
};

// A picture with its time.
inline std::vector<std::uint8_t> picture_message(double host_s, std::string_view jpeg) {
  std::vector<std::uint8_t> out(16 + jpeg.size());
  out[0] = static_cast<std::uint8_t>(Kind::picture_out);
  std::memcpy(out.data() + 8, &host_s, sizeof host_s);
  std::memcpy(out.data() + 16, jpeg.data(), jpeg.size());
  return out;
}

struct PictureIn {
  double t_s = 0;  // the page's clock
  std::string_view jpeg;
};

// None: no picture, or too large a one.
inline std::optional<PictureIn> picture_of(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 18 || bytes[0] != static_cast<std::uint8_t>(Kind::picture_in)) return {};
  if (bytes.size() - 16 > kLongestPicture || bytes[16] != 0xff || bytes[17] != 0xd8) return {};
  PictureIn out;
  std::memcpy(&out.t_s, bytes.data() + 8, sizeof out.t_s);
  if (!(out.t_s > -1e9 && out.t_s < 1e9)) return {};
  out.jpeg = {reinterpret_cast<const char*>(bytes.data()) + 16, bytes.size() - 16};
  return out;
}

}  // namespace flexor::live
