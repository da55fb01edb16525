// For tests only: those that need pseudo-terminals are skipped on a machine that gives none.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

namespace flexor::io {

inline bool gives_terminals() {
  const int end = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (end < 0) return false;
  const bool good = ::grantpt(end) == 0 && ::unlockpt(end) == 0 && ::access(::ptsname(end), R_OK | W_OK) == 0;
  ::close(end);
  return good;
}

}  // namespace flexor::io

#define FLEXOR_NEEDS_TERMINALS() \
  if (!flexor::io::gives_terminals()) GTEST_SKIP() << "this machine gives no pseudo-terminals (devpts)"
