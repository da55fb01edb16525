#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/io/beneath.hpp"

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

}  // namespace flexor::io
