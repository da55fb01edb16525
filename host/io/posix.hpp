// What POSIX asks of the system, and Windows' C library lacks or does otherwise: under the same names, so that this room is written
// once.
#pragma once

#ifdef _WIN32
#include "host/io/posix_windows.hpp"
#else
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>

constexpr const char* kNothing = "/dev/null";
constexpr const char* kHome = "HOME";
constexpr const char* kRandomBits = "/dev/urandom";  // whatever the library's own choice may be
constexpr const char* kProgramSuffix = "";
constexpr const char* kWorkers = "a part of Flexor that belongs there; script/build makes it";
constexpr char kBetweenFolders = ':';  // in PATH
constexpr short kToRead = POLLIN, kToWrite = POLLOUT;
using Waiting = pollfd;
inline std::filesystem::path this_program() { return std::filesystem::read_symlink("/proc/self/exe"); }
#endif
