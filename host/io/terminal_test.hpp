// For tests only: a pseudo-terminal. Tests that need one are skipped on a machine that gives none.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <string>

namespace flexor::io {

// What is written to one end comes out of the other. Ours is the board's, or whatever else is behind a port.
class Terminal {
 public:
  explicit Terminal(int flags = 0) : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | flags)) {
    if (master_ >= 0 && ::grantpt(master_) == 0 && ::unlockpt(master_) == 0) name_ = ::ptsname(master_);
  }
  ~Terminal() { hang_up(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  void hang_up() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }
  int master() const { return master_; }
  const std::string& name() const { return name_; }

 private:
  int master_;
  std::string name_;
};

inline bool gives_terminals() { return ::access(Terminal().name().c_str(), R_OK | W_OK) == 0; }

}  // namespace flexor::io

#define FLEXOR_NEEDS_TERMINALS() \
  if (!flexor::io::gives_terminals()) GTEST_SKIP() << "this machine gives no pseudo-terminals (devpts)"
