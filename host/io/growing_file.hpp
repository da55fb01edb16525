// A file that grows while something runs: recordings, logs.
//
// It is never written over, and holds whole pieces at any instant: after a crash or `kill -9` what came before, and on a full
// disk what there was room for.
#pragma once

#include <filesystem>
#include <string_view>

namespace flexor::io {

class GrowingFile {
 public:
  // Throws InputError: there is such a file, no such folder, no permission.
  explicit GrowingFile(const std::filesystem::path& path);
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  // All of it or nothing. Throws JobError, one line: the disk is full or gone, the file was removed.
  void append(std::string_view piece);
  void remove();  // it holds nothing worth keeping

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace flexor::io
