#include "host/io/io.hpp"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>

namespace flexor::io {
namespace fs = std::filesystem;

std::string without_controls(std::string_view text, std::string_view kept) {
  constexpr unsigned char kDelete = 127;
  const auto is_second_set = [](unsigned char c) { return c >= 0x80 && c < 0xA0; };
  std::string out;
  int following = 0;  // bytes of this letter of UTF-8 that are to come
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool continues = (c & 0xC0U) == 0x80 && following > 0;
    following = continues ? following - 1 : c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : c >= 0xC0 ? 1 : 0;
    const bool is_pair =
        c == 0xC2 && i + 1 < text.size() && is_second_set(static_cast<unsigned char>(text[i + 1]));
    const bool is_control = is_pair || c < ' ' || c == kDelete || (is_second_set(c) && !continues);
    out += is_control && kept.find(text[i]) == kept.npos ? '?' : text[i];
    if (!is_pair) continue;
    ++i;
    following = 0;
  }
  return out;
}

std::string one_line(std::string_view text) { return without_controls(text, ""); }

std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./-+,:@%=";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string_view::npos) return std::string(text);
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string start_of(std::string_view text, std::size_t longest) {
  const auto continues = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80;
  };
  std::size_t end = std::min(text.size(), longest);
  while (end > 0 && end < text.size() && continues(end)) --end;
  return std::string(text.substr(0, end));
}

void require_readable(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(fmt::format("{}: no such file", path.string()));
  if (fs::is_directory(path, error)) {
    throw InputError(fmt::format("{}: is a directory; name a file in it", path.string()));
  }
  // Not by opening it: a FIFO, as in <(...), can be opened once.
  if (::access(path.c_str(), R_OK) != 0) {
    throw InputError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  }
}

namespace {

// By read(), which sets badbit where an iterator lets the buffer's exception through.
std::string read_all(std::istream& stream, const std::string& name) {
  constexpr std::size_t kPiece_bytes = 1 << 16;
  constexpr std::size_t kMost_bytes = 256 << 20;
  std::string content;
  while (stream && content.size() <= kMost_bytes) {
    const std::size_t before = content.size();
    content.resize(before + kPiece_bytes);
    stream.read(content.data() + before, kPiece_bytes);
    content.resize(before + static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) throw InputError(fmt::format("{}: reading failed", name));
  if (content.size() > kMost_bytes)
    throw InputError(fmt::format("{}: is larger than {} MB; is it the right file?", name, kMost_bytes >> 20));
  return content;
}

}  // namespace

std::string read_file(const fs::path& path) {
  if (path == "-") return read_all(std::cin, "standard input");
  require_readable(path);
  if (fs::is_character_file(path) && path != "/dev/stdin")
    throw InputError(fmt::format("{}: is a device, which may never end; name a file", path.string()));
  std::ifstream file(path, std::ios::binary);
  std::string content = read_all(file, path.string());
  if (content.empty()) throw InputError(fmt::format("{}: is empty", path.string()));
  return content;
}

void require_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError(
        fmt::format("{}: cannot make this folder: there is a file of that name", folder.string()));
  }
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw InputError(fmt::format("{}: cannot make this folder: {}", folder.string(), error.message()));
}

TemporaryFolder::TemporaryFolder()
    : temporary_([] {
        std::error_code error;
        std::string pattern = (fs::temp_directory_path(error) / "flexor-XXXXXX").string();
        if (error) throw JobError(fmt::format("TMPDIR does not name a folder: {}", error.message()));
        if (mkdtemp(pattern.data()) == nullptr) {
          throw JobError(fmt::format("{}: cannot be made: {}", pattern, std::strerror(errno)));
        }
        return fs::path(pattern);
      }) {}

std::string digest(std::string_view content) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("fnv1a64:{:016x}", hash);
}

}  // namespace flexor::io
