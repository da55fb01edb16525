#include "host/io/growing_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/io/io.hpp"

namespace flexor::io {

GrowingFile::GrowingFile(const std::filesystem::path& path) : path_(path) {
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0 && errno == EEXIST) {
    throw InputError(
        fmt::format("{}: is there already: a recording is never written over, name another", path.string()));
  }
  if (file_ < 0)
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
}

GrowingFile::~GrowingFile() { ::close(file_); }

void GrowingFile::append(std::string_view piece) {
  struct stat before {};
  struct stat there {};
  ::fstat(file_, &before);
  if (::stat(path_.c_str(), &there) != 0 || there.st_ino != before.st_ino)
    throw JobError(
        fmt::format("{}: was removed while it was written: nothing of it is kept there", path_.string()));
  while (!piece.empty()) {
    const ssize_t n = ::write(file_, piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int cause = errno;
      (void)!::ftruncate(file_, before.st_size);
      throw JobError(fmt::format("{}: cannot be written: {}: what came before is whole", path_.string(),
                                 std::strerror(cause)));
    }
    piece.remove_prefix(static_cast<std::size_t>(n));
  }
}

void GrowingFile::remove() { ::unlink(path_.c_str()); }

}  // namespace flexor::io
