#include "host/io/beneath.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host/io/io.hpp"

namespace flexor::io {
namespace {

bool is_name(const std::string& part) {
  return !part.empty() && part != "." && part != ".." && part.find('\0') == part.npos;
}

// Opens `part` in `folder`, which it closes.
int step(int folder, const std::string& part, int flags) {
  const int next = is_name(part) ? openat(folder, part.c_str(), flags | O_NOFOLLOW | O_CLOEXEC) : -1;
  close(folder);
  return next;
}

}  // namespace

int open_beneath(const std::filesystem::path& folder, std::string_view name) {
  int at = open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  for (auto slash = name.find('/'); at >= 0 && slash != name.npos; slash = name.find('/')) {
    at = step(at, std::string(name.substr(0, slash)), O_PATH | O_DIRECTORY);
    name.remove_prefix(slash + 1);
  }
  if (at < 0) return -1;
  at = step(at, std::string(name),
            O_RDONLY | O_NONBLOCK | O_NOCTTY);  // a pipe without a writer does not hold us
  struct stat status {};
  if (at >= 0 && (fstat(at, &status) != 0 || !S_ISREG(status.st_mode))) {
    close(at);
    return -1;
  }
  return at;
}

FileBeneath::FileBeneath(const std::filesystem::path& folder, std::string_view name, std::uint64_t most_bytes)
    : place_((folder / name).string()), file_(open_beneath(folder, name)) {
  if (file_ < 0)
    throw InputError(
        fmt::format("{}: there is no file of this name that is no link, FIFO or device", place_));
  struct stat status {};
  ::fstat(file_, &status);
  bytes_ = static_cast<std::uint64_t>(status.st_size);
  if (bytes_ <= most_bytes) return;
  ::close(file_);
  throw InputError(fmt::format("{}: is larger than {} bytes: no file of Flexor's is", place_, most_bytes));
}

FileBeneath::~FileBeneath() { ::close(file_); }

std::string FileBeneath::read(std::uint64_t offset, std::uint64_t count) const {
  std::string out(offset < bytes_ ? std::min(count, bytes_ - offset) : 0, '\0');
  std::size_t have = 0;
  while (have < out.size()) {
    const ssize_t n = ::pread(file_, out.data() + have, out.size() - have, static_cast<off_t>(offset + have));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw InputError(fmt::format("{}: cannot be read: {}", place_, std::strerror(errno)));
    if (n == 0) break;  // it was made shorter meanwhile
    have += static_cast<std::size_t>(n);
  }
  out.resize(have);
  return out;
}

}  // namespace flexor::io
