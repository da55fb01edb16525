#include "host/camera/jpeg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "host/camera/opencv.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

constexpr std::uint8_t kFill = 0xff;
constexpr std::uint8_t kStart = 0xd8;
constexpr std::uint8_t kScan = 0xda;
constexpr std::uint8_t kEnd = 0xd9;

struct Size {
  int width = 0;
  int height = 0;
};

[[noreturn]] void refuse(const std::string& what) { throw io::InputError("picture: " + what); }

// SOF0 to SOF15, of which three codes are something else.
bool states_size(std::uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

std::uint32_t byte_of(std::string_view bytes, std::size_t i) {
  return i < bytes.size() ? static_cast<std::uint8_t>(bytes[i]) : 0;
}

std::uint32_t big_endian(std::string_view bytes, std::size_t at, int count) {
  std::uint32_t out = 0;
  for (int k = 0; k < count; ++k) out = out << 8U | byte_of(bytes, at + static_cast<std::size_t>(k));
  return out;
}

std::uint32_t little_endian(std::string_view bytes, std::size_t at, int count) {
  std::uint32_t out = 0;
  for (int k = count; k-- > 0;) out = out << 8U | byte_of(bytes, at + static_cast<std::size_t>(k));
  return out;
}

// Calls frame(marker, size) for each size that the segments before the first scan state; ITU-T T.81, B.1 and B.2.
template <class Frame>
void each_size(std::string_view bytes, Frame&& frame) {
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (byte_of(bytes, at) != kFill) refuse("no JPEG behind its first bytes");
    const auto marker = static_cast<std::uint8_t>(byte_of(bytes, at + 1));
    if (marker == kFill) {
      ++at;
      continue;
    }
    if (marker == kScan || marker == kEnd) break;
    if (states_size(marker)) {
      frame(marker, Size{static_cast<int>(big_endian(bytes, at + 7, 2)),
                         static_cast<int>(big_endian(bytes, at + 5, 2))});
    }
    at += 2 + static_cast<std::size_t>(big_endian(bytes, at + 2, 2));
  }
}

bool is_jpeg(std::string_view bytes) { return byte_of(bytes, 0) == kFill && byte_of(bytes, 1) == kStart; }

Size size_of(std::string_view bytes) {
  if (!is_jpeg(bytes)) refuse("no JPEG");
  std::optional<Size> out;
  each_size(bytes, [&](std::uint8_t marker, const Size& size) {
    if (out) refuse("a JPEG that states its size twice");
    if (marker > 0xc1) refuse("a progressive JPEG; only baseline ones are taken, as a canvas makes them");
    out = size;
  });
  if (!out) refuse("a JPEG that is cut off before its size");
  return *out;
}

double area(std::uint32_t width, std::uint32_t height) { return static_cast<double>(width) * height; }

// TIFF 6.0, section 2: tags 256 and 257 of the first directory; where that lies behind the bytes, none can be told.
std::optional<double> tiff_pixels(std::string_view bytes) {
  const auto number = bytes.starts_with("II") ? little_endian : big_endian;
  const std::size_t directory = number(bytes, 4, 4);
  std::uint32_t side[2] = {0, 0};
  if (directory + 2 > bytes.size()) return {};
  for (std::size_t k = 0; k < number(bytes, directory, 2); ++k) {
    const std::size_t at = directory + 2 + 12 * k;
    const std::uint32_t tag = number(bytes, at, 2);
    if (tag == 256 || tag == 257)
      side[tag - 256] = number(bytes, at + 8, number(bytes, at + 2, 2) == 3 ? 2 : 4);
  }
  if (side[0] == 0 || side[1] == 0) return {};
  return area(side[0], side[1]);
}

// RFC 9649, section 2: one frame lossy, lossless, or extended with the canvas's size.
double webp_pixels(std::string_view bytes) {
  const std::string_view kind = bytes.substr(12, 4);
  if (kind == "VP8X") return area(1 + little_endian(bytes, 24, 3), 1 + little_endian(bytes, 27, 3));
  if (kind == "VP8 ")
    return area(little_endian(bytes, 26, 2) & 0x3fffU, little_endian(bytes, 28, 2) & 0x3fffU);
  const std::uint32_t sides = little_endian(bytes, 21, 4);
  return area(1 + (sides & 0x3fffU), 1 + (sides >> 14U & 0x3fffU));
}

// None: of no kind that is known here.
std::optional<double> stated_pixels(std::string_view bytes) {
  using std::literals::operator""sv;
  const auto magnitude = [&](std::size_t at) {  // a BMP from the top down has a negative height
    const auto side = static_cast<std::int32_t>(little_endian(bytes, at, 4));
    return std::abs(static_cast<double>(side));
  };
  if (bytes.starts_with("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR"sv))
    return area(big_endian(bytes, 16, 4), big_endian(bytes, 20, 4));
  if (bytes.starts_with("GIF8"sv)) return area(little_endian(bytes, 6, 2), little_endian(bytes, 8, 2));
  if (bytes.starts_with("BM"sv)) {
    if (little_endian(bytes, 14, 4) == 12)
      return area(little_endian(bytes, 18, 2), little_endian(bytes, 20, 2));
    return magnitude(18) * magnitude(22);
  }
  if (bytes.starts_with("RIFF"sv) && bytes.substr(std::min<std::size_t>(8, bytes.size()), 4) == "WEBP") {
    return bytes.size() < 30 ? std::optional<double>() : webp_pixels(bytes);
  }
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return tiff_pixels(bytes);
  int width = 0;
  int height = 0;
  if (std::sscanf(std::string(bytes.substr(0, 40)).c_str(), "P%*1[1-6] %d %d", &width, &height) ==
      2)  // Netpbm
    return std::abs(static_cast<double>(width) * height);
  if (!is_jpeg(bytes)) return {};
  std::optional<double> most;
  each_size(bytes, [&](std::uint8_t, const Size& size) {
    most = std::max(most.value_or(0), static_cast<double>(size.width) * size.height);
  });
  return most;
}

}  // namespace

bool states_few_pixels(std::string_view start, const std::string& source) {
  std::optional<double> pixels;
  try {
    pixels = stated_pixels(start);
  } catch (const io::InputError&) {  // a broken JPEG
  }
  if (pixels && *pixels > kMostPixels) {
    throw io::InputError(
        fmt::format("{}: a picture of {:.4g} million pixels; at most {:.0f} million are taken", source,
                    *pixels / 1e6, kMostPixels / 1e6));
  }
  return pixels.has_value();
}

Picture from_jpeg(std::string_view bytes) {
  if (bytes.size() > kMostJpegBytes)
    refuse(fmt::format("{} bytes; at most {} are taken", bytes.size(), kMostJpegBytes));
  const Size size = size_of(bytes);
  for (const int side : {size.width, size.height}) {
    if (side < kLeastJpeg_px || side > kMostJpeg_px) {
      refuse(fmt::format("{} x {} pixels; each side must have {} to {}", size.width, size.height,
                         kLeastJpeg_px, kMostJpeg_px));
    }
  }
  Picture out(size.width, size.height);
  cv::Mat decoded;
  try {
    // As the camera took it: marks are tracked in its pixels, whichever way it was held.
    decoded = cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                           cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
  }
  if (decoded.cols != size.width || decoded.rows != size.height || decoded.type() != CV_8UC3)
    refuse("a JPEG that cannot be decoded");
  decoded.copyTo(mat(out));
  return out;
}

std::string to_jpeg(const Picture& picture, int quality) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", mat(picture), bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace flexor::camera
