// A folder of results, for one job at a time: `lock` in it is held with flock(2) and names the holder. Gone when they are done.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "host/io/descriptor.hpp"

namespace flexor::io {

// While this lives nobody else holds the folder, in this process or another one. Makes the folder; takes it
// away again if nothing was put into it.
class FolderLock {
 public:
  // Throws InputError: the folder cannot be made or written, it has the results of another job than `kind`, an input has the
  // name of its results, its page or one of `files` that the job writes, or somebody, who is named, works in it.
  explicit FolderLock(std::filesystem::path folder, std::string_view kind = "",
                      const std::vector<std::string_view>& files = {});
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path folder_;
  bool made_ = false;
  Descriptor file_;
};

}  // namespace flexor::io
