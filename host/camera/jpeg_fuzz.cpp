// Pictures from anybody, as they are and as a good one with bytes flipped: a picture of the size that it states, or an
// error in one line.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "host/camera/jpeg.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;

std::string good() {
  const camera::Picture p(80, 96, CV_8UC3);
  for (std::size_t i = 0; i < 3 * p.total(); ++i) p.data[i] = static_cast<std::uint8_t>(i * 7);
  return camera::to_jpeg(p, 80);
}

void decode(std::string_view bytes) {
  try {
    const camera::Picture p = camera::from_jpeg(bytes);
    if (std::min(p.cols, p.rows) < camera::kLeastJpeg_px || p.type() != CV_8UC3) std::abort();
  } catch (const io::InputError& error) {
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  decode({reinterpret_cast<const char*>(data), size});
  static const std::string whole = good();
  std::string bytes = whole;
  for (std::size_t at = 0; at + 3 <= size; at += 3)
    bytes[static_cast<std::size_t>(data[at] << 8U | data[at + 1]) % bytes.size()] ^=
        static_cast<char>(data[at + 2]);
  decode(bytes);
  return 0;
}
