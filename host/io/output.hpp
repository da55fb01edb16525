// The one way to write an output.
//
// A file is written beside its name, brought to the disk, and renamed: nobody ever finds half of one, and
// what was there before stays until then. What a process that was killed has left beside it goes with the next
// write to that name. A link is followed, and the file it points to is replaced. A file keeps its permissions.
// What is no file, as /dev/null, /dev/stdout or a FIFO, is never replaced: the bytes go into it as they come.
// Folders, disks and sockets are refused.
//
// A file that note_input() was given is refused: an output must not take its own input's place.
//
// Errors are one line, "PATH: cannot be written: REASON": InputError when the path is at fault, JobError when
// the disk is full or fails, or a reader has gone.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>

#include "host/io/io.hpp"

namespace flexor::io {

// require_writable() for each of a command's outputs; empty: none. Throws InputError where two are one file, or one lies in the
// folder of the report.
void require_outputs(std::initializer_list<std::filesystem::path> files,
                     const std::filesystem::path& report = "");

// Likewise for what a library writes: neither a device nor a pipe, which would wait for its reader.
void require_file(const std::filesystem::path& path);

// Whether `path` is this process's standard output: /dev/stdout, /proc/self/fd/1 or a link to them.
bool is_standard_output(const std::filesystem::path& path);

// Bytes as they come: tables, documents. Or what a library writes to name(); libraries do not report the last
// byte: read back what they made before commit().
class Output {
 public:
  explicit Output(const std::filesystem::path& path, Access access = Access::usual);
  ~Output();  // without commit() a file is as it was before
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void write(std::string_view bytes);
  // The file beside, empty, for a library to overwrite; ends as `path` does. Throws InputError where that is no file.
  const std::filesystem::path& name() const;
  // For when the library has failed: throws when the disk is what refuses more bytes.
  void require_room();
  void commit();  // only after this is anything there

 private:
  void flush();

  struct Open;
  std::unique_ptr<Open> open_;
  std::string buffer_;
};

}  // namespace flexor::io
