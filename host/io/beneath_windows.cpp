#include "host/io/beneath.hpp"

#include <windows.h>

#include <sstream>

namespace flexor::io {

int open_beneath(const std::filesystem::path& folder, std::string_view name) {
  std::filesystem::path at = folder;
  std::istringstream parts{std::string(name)};
  for (std::string part; std::getline(parts, part, '/');) {
    // Neither another folder, nor a stream, nor a device, which no folder holds.
    if (part.empty() || part == "." || part == ".." ||
        part.find_first_of(std::string_view("\0\\:*?<>|\"", 9)) != part.npos)
      return -1;
    at /= part;
    WIN32_FIND_DATAW found;
    const HANDLE search = FindFirstFileW(at.c_str(), &found);
    if (search == INVALID_HANDLE_VALUE) return -1;
    FindClose(search);
    if ((found.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0) return -1;
  }
  return std::filesystem::is_regular_file(at) ? ::open(at.c_str(), O_RDONLY) : -1;
}

}  // namespace flexor::io
