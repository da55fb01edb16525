#include "host/io/beneath.hpp"

#include <fcntl.h>
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

Descriptor step(const Descriptor& folder, std::string_view part, int flags) {
  const std::string name(part);
  return Descriptor(is_name(name) ? openat(folder.number(), name.c_str(), flags | O_NOFOLLOW | O_CLOEXEC)
                                  : -1);
}

}  // namespace

int open_beneath(const std::filesystem::path& folder, std::string_view name) {
  Descriptor at(open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  for (auto slash = name.find('/'); at && slash != name.npos; slash = name.find('/')) {
    at = step(at, name.substr(0, slash), O_PATH | O_DIRECTORY);
    name.remove_prefix(slash + 1);
  }
  // A pipe without a writer does not hold us.
  if (at) at = step(at, name, O_RDONLY | O_NONBLOCK | O_NOCTTY);
  struct stat status {};
  return at && fstat(at.number(), &status) == 0 && S_ISREG(status.st_mode) ? at.release() : -1;
}

FileBeneath::FileBeneath(const std::filesystem::path& folder, std::string_view name, std::uint64_t most_bytes)
    : place_((folder / name).string()), file_(open_beneath(folder, name)) {
  if (!file_) throw InputError("{}: there is no file of this name that is no link, FIFO or device", place_);
  struct stat status {};
  ::fstat(file_.number(), &status);
  bytes_ = static_cast<std::uint64_t>(status.st_size);
  if (bytes_ > most_bytes)
    throw InputError("{}: is larger than {} bytes: no file of Flexor's is", place_, most_bytes);
}

std::string FileBeneath::read(std::uint64_t offset, std::uint64_t count) const {
  std::string out(offset < bytes_ ? std::min(count, bytes_ - offset) : 0, '\0');
  std::size_t have = 0;
  while (have < out.size()) {
    const ssize_t n =
        ::pread(file_.number(), out.data() + have, out.size() - have, static_cast<off_t>(offset + have));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw InputError("{}: cannot be read: {}", place_, std::strerror(errno));
    if (n == 0) break;  // it was made shorter meanwhile
    have += static_cast<std::size_t>(n);
  }
  out.resize(have);
  return out;
}

}  // namespace flexor::io
