#include "apps/live/beneath.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

namespace flexor::live {
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

}  // namespace flexor::live
