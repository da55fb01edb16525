// Files of one folder that others may write into, whatever a name holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "host/io/descriptor.hpp"

namespace flexor::io {

// A descriptor of the regular file `name` below `folder`, to read; -1 where there is none. No link is followed on the way, each
// part is opened in the one before: nothing that happens to the folder meanwhile leads out of it. The caller closes it.
int open_beneath(const std::filesystem::path& folder, std::string_view name);

// The same file, held open. Neither a FIFO nor a device is waited for.
class FileBeneath {
 public:
  // Throws InputError, which names the file and none of its content: no such regular file; more than `most_bytes`.
  FileBeneath(const std::filesystem::path& folder, std::string_view name, std::uint64_t most_bytes);

  std::uint64_t bytes() const { return bytes_; }  // when it was opened
  // At most `count` bytes from `offset`. Throws InputError: it cannot be read.
  std::string read(std::uint64_t offset, std::uint64_t count) const;
  std::string all() const { return read(0, bytes_); }

 private:
  std::string place_;
  Descriptor file_;
  std::uint64_t bytes_ = 0;
};

}  // namespace flexor::io
