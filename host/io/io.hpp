// Whole files in and out, and the two kinds of failure that a user can see.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace flexor::io {

// The user's input or command line is wrong; one line that says what, where, and how to mend it. Exit 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The input is well-formed but the job cannot be done with it. Exit 1.
struct JobError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Throws InputError: missing, a directory, unreadable.
void require_readable(const std::filesystem::path& path);

// The whole file; "-" is standard input. Throws InputError as above, or empty.
std::string read_file(const std::filesystem::path& path);

// A name beside `path` to write to before renaming.
std::filesystem::path temporary_beside(const std::filesystem::path& path);

// Renames `temporary` to `path`, or removes it and throws InputError.
void commit(const std::filesystem::path& temporary, const std::filesystem::path& path);

// Throws InputError when a file could not be written to `path`: its folder is missing, or it is a folder
// itself. For failing before the work rather than after it.
void require_writable(const std::filesystem::path& path);

// Likewise for a folder that will be made.
void require_folder(const std::filesystem::path& folder);

// Replaces `path` by `content` in one step. Throws InputError and leaves nothing behind when it cannot.
void write_file(const std::filesystem::path& path, std::string_view content);

// Makes `folder` and its parents. Throws InputError.
void make_folder(const std::filesystem::path& folder);

// A new folder for the time being, removed with all that is in it. Throws JobError.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// FNV-1a, 64 bits, as "fnv1a64:<16 hex digits>": names the data that a model was trained on.
std::string digest(std::string_view content);

}  // namespace flexor::io
