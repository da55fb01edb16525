#include "host/io/growing_file.hpp"

#include <cerrno>
#include <cstring>

#include "host/io/io.hpp"

namespace flexor::io {

GrowingFile::GrowingFile(const std::filesystem::path& path)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_ && errno == EEXIST) {
    throw InputError("{}: is there already: a recording is never written over, name another", path.string());
  }
  if (!file_) throw InputError("{}: cannot be written: {}", path.string(), std::strerror(errno));
}

GrowingFile::GrowingFile(const std::filesystem::path& path, std::uintmax_t kept_bytes)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_ || ::ftruncate(file_.number(), static_cast<off_t>(kept_bytes)) != 0) fail(errno);
}

void GrowingFile::append(std::string_view piece) {
  struct stat before {};
  struct stat there {};
  ::fstat(file_.number(), &before);
  if (::stat(path_.c_str(), &there) != 0 || there.st_ino != before.st_ino)
    throw JobError("{}: was removed while it was written: nothing of it is kept there", path_.string());
  if (const int error = write_all(file_.number(), piece); error != 0) {
    (void)!::ftruncate(file_.number(), before.st_size);
    fail(error);
  }
}

void GrowingFile::bring_to_disk() {
  if (::fsync(file_.number()) != 0 && errno != EINVAL)
    fail(errno);  // EINVAL: this file system has nothing to do
}

void GrowingFile::fail(int error) const {
  throw JobError("{}: cannot be written: {}: what came before is whole", path_.string(),
                 std::strerror(error));
}

void GrowingFile::remove() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace flexor::io
