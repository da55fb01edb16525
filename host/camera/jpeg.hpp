// One picture as JPEG: what a browser's canvas gives and what a page shows.
//
// Bytes may come from anybody: the size that they state is looked at before anything is decoded, and what they state
// twice, or in a way that takes many passes over the picture (progressive), is refused.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "host/camera/picture.hpp"

namespace flexor::camera {

inline constexpr std::size_t kMostJpegBytes = std::size_t{2} << 20U;
inline constexpr int kUsualQuality = 80;
inline constexpr int kLeastJpeg_px = 64;  // of each side
inline constexpr int kMostJpeg_px = 4096;

// Throws io::InputError, one line: no JPEG, cut off before its size, progressive, a side or the file out of bounds.
// What is damaged behind its start is decoded as far as it goes.
Picture from_jpeg(std::string_view bytes);

// `quality` 1 to 100.
std::string to_jpeg(const Picture& picture, int quality = kUsualQuality);

}  // namespace flexor::camera
