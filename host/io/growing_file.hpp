// A file that grows while something runs: recordings, logs.
//
// A recording is never written over. It holds whole pieces at any instant: after a crash or `kill -9` what came before, and on a full
// disk what there was room for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "host/io/descriptor.hpp"

namespace flexor::io {

class GrowingFile {
 public:
  // Throws InputError: there is such a file, no such folder, no permission.
  explicit GrowingFile(const std::filesystem::path& path);
  // Goes on after the first `kept_bytes` of what may be there. Throws JobError.
  GrowingFile(const std::filesystem::path& path, std::uintmax_t kept_bytes);

  // All of it or nothing. Throws JobError, one line: the disk is full or gone, the file was removed.
  void append(std::string_view piece);
  void bring_to_disk();  // throws JobError, likewise
  void remove();         // it holds nothing worth keeping

 private:
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;
  Descriptor file_;
};

}  // namespace flexor::io
