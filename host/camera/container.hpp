// Whether a video file goes on to its last byte. FFmpeg drops what comes after the first byte that a disk
// refuses, the sizes that it fills in at the end among it, and its callers are not told.
#pragma once

#include <filesystem>

namespace flexor::camera {

// True when the sizes in the file add up to its length: MP4 (ISO 14496-12, 4.2: boxes, the index last), AVI
// (chunks "RIFF"), Matroska (RFC 8794: EBML header and one segment), by the file's extension. False for
// others, and when it cannot be read.
bool is_whole(const std::filesystem::path& path);

}  // namespace flexor::camera
