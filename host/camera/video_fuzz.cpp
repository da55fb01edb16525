// Truncated and bit-flipped videos: either frames whose times increase and whose pictures are whole, or an
// error in one line. The input is what to do to a good file: where to cut, and which bytes to flip.
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "host/camera/video.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;

std::string film() {
  const io::TemporaryFolder folder;
  const auto path = folder.path() / "film.mp4";
  camera::VideoWriter writer(path, 64, 48, 30);
  for (int k = 0; k < 12; ++k) {
    const camera::Picture p(48, 64, CV_8UC3);
    for (std::size_t i = 0; i < 3 * p.total(); ++i)
      p.data[i] = static_cast<std::uint8_t>(i * 7 + static_cast<std::size_t>(k) * 31);
    writer.add(p);
  }
  writer.finish();
  return io::read_file(path);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string whole = film();
  if (size < 4) return 0;
  std::string bytes = whole;
  const auto number = [&](std::size_t at) {
    return static_cast<std::size_t>(data[at] << 16U | data[at + 1] << 8U | data[at + 2]);
  };
  if ((data[0] & 2U) != 0) bytes.resize(number(1) % bytes.size());
  for (std::size_t at = 4; at + 4 <= size && !bytes.empty(); at += 4) {
    bytes[number(at) % bytes.size()] ^= static_cast<char>(data[at + 3]);
  }
  const int file = memfd_create("film", 0);
  if (file < 0 || ::write(file, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    std::abort();
  try {
    camera::VideoReader reader("/proc/self/fd/" + std::to_string(file));
    camera::Picture picture;
    double t_s = 0;
    double last_s = -1e300;
    while (reader.frames() < 50 && reader.next(picture, t_s)) {
      if (!std::isfinite(t_s) || t_s <= last_s) std::abort();
      if (picture.empty() || picture.type() != CV_8UC3) std::abort();
      last_s = t_s;
    }
  } catch (const io::InputError&) {
  } catch (const io::JobError&) {
  }
  ::close(file);
  return 0;
}
