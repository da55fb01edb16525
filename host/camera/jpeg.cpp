#include "host/camera/jpeg.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

constexpr std::uint8_t kFill = 0xff;
constexpr std::uint8_t kStart = 0xd8;
constexpr std::uint8_t kScan = 0xda;
constexpr std::uint8_t kEnd = 0xd9;

[[noreturn]] void refuse(const std::string& what) { throw io::InputError("picture: " + what); }

// SOF0 to SOF15, of which three codes are something else.
bool states_size(std::uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

std::uint32_t byte_of(std::string_view bytes, std::size_t i) {
  return i < bytes.size() ? static_cast<std::uint8_t>(bytes[i]) : 0;
}

std::uint32_t two_bytes(std::string_view bytes, std::size_t i) {
  return byte_of(bytes, i) << 8U | byte_of(bytes, i + 1);
}

// As the segments before the first scan state it; ITU-T T.81, B.1 and B.2.
cv::Size size_of(std::string_view bytes) {
  if (byte_of(bytes, 0) != kFill || byte_of(bytes, 1) != kStart) refuse("no JPEG");
  std::optional<cv::Size> out;
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (byte_of(bytes, at) != kFill) refuse("no JPEG behind its first bytes");
    const auto marker = static_cast<std::uint8_t>(byte_of(bytes, at + 1));
    if (marker == kFill) {
      ++at;
      continue;
    }
    if (marker == kScan || marker == kEnd) break;
    if (states_size(marker)) {
      if (out) refuse("a JPEG that states its size twice");
      if (marker > 0xc1) refuse("a progressive JPEG; only baseline ones are taken, as a canvas makes them");
      out = cv::Size{static_cast<int>(two_bytes(bytes, at + 7)), static_cast<int>(two_bytes(bytes, at + 5))};
    }
    at += 2 + static_cast<std::size_t>(two_bytes(bytes, at + 2));
  }
  if (!out) refuse("a JPEG that is cut off before its size");
  return *out;
}

}  // namespace

Picture from_jpeg(std::string_view bytes) {
  if (bytes.size() > kMostJpegBytes)
    refuse(fmt::format("{} bytes; at most {} are taken", bytes.size(), kMostJpegBytes));
  const cv::Size size = size_of(bytes);
  for (const int side : {size.width, size.height}) {
    if (side < kLeastJpeg_px || side > kMostJpeg_px) {
      refuse(fmt::format("{} x {} pixels; each side must have {} to {}", size.width, size.height,
                         kLeastJpeg_px, kMostJpeg_px));
    }
  }
  Picture decoded;
  try {
    // As the camera took it: marks are tracked in its pixels, whichever way it was held.
    decoded = cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                           cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
  }
  if (decoded.size() != size || decoded.type() != CV_8UC3) refuse("a JPEG that cannot be decoded");
  return decoded;
}

std::string to_jpeg(const Picture& picture, int quality) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace flexor::camera
