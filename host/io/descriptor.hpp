// An open file that closes itself, and all of some bytes into one.
#pragma once

#include <cerrno>
#include <string_view>
#include <utility>

#include "host/io/posix.hpp"

namespace flexor::io {

class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() { (void)close(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }

  explicit operator bool() const { return number_ >= 0; }
  int number() const { return number_; }
  int release() { return std::exchange(number_, -1); }
  int close() { return number_ >= 0 && ::close(release()) != 0 ? errno : 0; }  // 0, or errno

 private:
  int number_;
};

// Waits where the descriptor does not block. Returns 0, or the errno of what is in the way.
inline int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
    } else if (errno == EAGAIN) {
      Waiting ready{descriptor, kToWrite, 0};
      (void)::poll(&ready, 1, -1);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

}  // namespace flexor::io
