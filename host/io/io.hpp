// Whole files in and out, and the two kinds of failure that a user can see.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace flexor {
using Json = nlohmann::ordered_json;
}

namespace flexor::io {

// Bytes of the letter at `at`; 0: no UTF-8. RFC 3629, section 4.
std::size_t utf8_length(std::string_view text, std::size_t at);

// The same text with all but those in `kept` of what controls a terminal replaced by a question mark, bytes 80 to 9F
// alone among it: names in documents may hold line ends, escapes, and marks that turn a line's order round.
std::string without_controls(std::string_view text, std::string_view kept);
std::string one_line(std::string_view text);  // none is kept

// The same text as one word of a command for a POSIX shell: as it is where nothing in it needs quotes.
std::string shell_word(std::string_view text);

// The first bytes of a text, `longest` at most, no letter cut in two.
std::string start_of(std::string_view text, std::size_t longest);

// What failed: a text, or a format and what fills it.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
  template <class First, class... Rest>
  Failure(fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest)
      : Failure(fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...)) {}
};

struct FailureInOneLine : Failure {
  explicit FailureInOneLine(std::string_view what) : Failure(one_line(what)) {}
  template <class First, class... Rest>
  FailureInOneLine(fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest)
      : FailureInOneLine(fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...)) {}
};

// The user's input or command line is wrong; one line that states what, where, and how to mend it. Exit 2.
struct InputError : FailureInOneLine {
  using FailureInOneLine::FailureInOneLine;
};

// The input is well-formed but the job cannot be done with it. Exit 1.
struct JobError : Failure {
  using Failure::Failure;
};

// The caller's progress function asked to stop, or a signal did.
struct Cancelled : Failure {
  using Failure::Failure;
};

// The result is written, but it means little: one line.
struct Doubt : FailureInOneLine {
  using FailureInOneLine::FailureInOneLine;
};

// No output of this process replaces this file from now on. Paths that are no file are ignored.
void note_input(const std::filesystem::path& path);

// Throws InputError: missing, a directory, unreadable.
void require_readable(const std::filesystem::path& path);

// The whole file; "-" is standard input. Throws InputError as above, empty, or larger.
std::string read_file(const std::filesystem::path& path, std::size_t most_bytes = 256 << 20);

// Throws InputError when a file could not be written to `path`, by the rules of host/io/output.hpp: its
// folder is missing, it is a folder itself, or it may not be written. For failing before the work rather than
// after it.
void require_writable(const std::filesystem::path& path);

// Likewise for a folder that will be made; and where it has what another job than `kind` found, or has begun.
void require_folder(const std::filesystem::path& folder, std::string_view kind = "");

// Who may read what is written.
enum class Access {
  usual,  // as an existing file has it, a new one by the umask
  owner,  // nobody but the owner: keys
};

// Replaces `path` by `content` in one step, by the rules and with the errors of Output in host/io/output.hpp.
void write_file(const std::filesystem::path& path, std::string_view content, Access access = Access::usual);

// Makes `folder` and its parents. Throws InputError.
void make_folder(const std::filesystem::path& folder);

// A file or a folder that is removed, with all that is in it, when its owner goes.
class Temporary {
 public:
  explicit Temporary(std::filesystem::path path) : path_(std::move(path)) {}
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // Gives it its name for good in one step: 0, and there is nothing to remove any more, or errno.
  int rename_to(const std::filesystem::path& path);
  void keep() { path_.clear(); }  // it stays where it is

 private:
  std::filesystem::path path_;
};

// A new folder for the time being. Throws JobError.
struct TemporaryFolder : Temporary {
  TemporaryFolder();
};

// FNV-1a, 64 bits, as "fnv1a64:<16 hex digits>": names the data that a model was trained on.
std::string digest(std::string_view content);

}  // namespace flexor::io
