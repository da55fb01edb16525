#include "host/io/beneath.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host/io/io.hpp"

namespace flexor::io {

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
