#include "host/io/io.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>

namespace flexor::io {
namespace fs = std::filesystem;

void require_readable(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(fmt::format("{}: no such file", path.string()));
  if (fs::is_directory(path, error)) {
    throw InputError(fmt::format("{}: is a directory; name a file in it", path.string()));
  }
  if (!std::ifstream(path, std::ios::binary)) {
    throw InputError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  }
}

std::string read_file(const fs::path& path) {
  if (path == "-") return {std::istreambuf_iterator<char>(std::cin), {}};
  require_readable(path);
  std::ifstream file(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) throw InputError(fmt::format("{}: reading failed", path.string()));
  if (content.empty()) throw InputError(fmt::format("{}: is empty", path.string()));
  return content;
}

fs::path temporary_beside(const fs::path& path) {
  fs::path temporary = path;
  temporary += fmt::format(".part-{}", ::getpid());
  return temporary;
}

void commit(const fs::path& temporary, const fs::path& path) {
  std::error_code error;
  fs::rename(temporary, path, error);
  if (!error) return;
  std::error_code ignored;
  fs::remove(temporary, ignored);
  throw InputError(fmt::format("{}: cannot be written: {}", path.string(), error.message()));
}

void require_writable(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw InputError(fmt::format("{}: cannot be written: is a directory", path.string()));
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (!fs::is_directory(folder, error)) {
    throw InputError(
        fmt::format("{}: cannot be written: there is no folder {}", path.string(), folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  }
}

void require_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError(
        fmt::format("{}: cannot make this folder: there is a file of that name", folder.string()));
  }
}

void write_file(const fs::path& path, std::string_view content) {
  const fs::path temporary = temporary_beside(path);
  std::ofstream file(temporary, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();
  if (!file) {
    const std::string reason = std::strerror(errno);
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), reason));
  }
  commit(temporary, path);
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw InputError(fmt::format("{}: cannot make this folder: {}", folder.string(), error.message()));
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "flexor-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw JobError(pattern + ": cannot be made");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string digest(std::string_view content) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("fnv1a64:{:016x}", hash);
}

}  // namespace flexor::io
