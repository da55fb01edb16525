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
#endif
