#include "host/io/io.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "host/io/interrupt.hpp"
#include "host/io/posix.hpp"

namespace flexor::io {
namespace fs = std::filesystem;

std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) -> std::uint8_t {
    return at + i < text.size() ? static_cast<std::uint8_t>(text[at + i]) : 0;
  };
  const auto within = [&](std::size_t i, std::uint8_t low, std::uint8_t high) {
    return byte(i) >= low && byte(i) <= high;
  };
  const auto tail = [&](std::size_t i) { return within(i, 0x80, 0xBF); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return 1;
  if (first < 0xC2 || first > 0xF4) return 0;
  if (first < 0xE0) return tail(1) ? 2 : 0;
  if (first < 0xF0) {
    // No overlong forms, no surrogates.
    const bool second = within(1, first == 0xE0 ? 0xA0 : 0x80, first == 0xED ? 0x9F : 0xBF);
    return second && tail(2) ? 3 : 0;
  }
  const bool second = within(1, first == 0xF0 ? 0x90 : 0x80, first == 0xF4 ? 0x8F : 0xBF);
  return second && tail(2) && tail(3) ? 4 : 0;
}

namespace {

// For a terminal: ASCII's and U+0080 to U+009F, and what turns or breaks a line: U+061C, U+200E, U+200F, U+2028 to U+202E
// and U+2066 to U+2069.
bool is_control(std::string_view letter) {
  constexpr char kDelete = 127;
  if (letter.size() == 1) return static_cast<unsigned char>(letter[0]) < ' ' || letter[0] == kDelete;
  const auto within = [&](std::string_view first, std::string_view last) {
    return first <= letter && letter <= last;
  };
  return within("\u0080", "\u009f") || letter == "\u061c" || within("\u200e", "\u200f") ||
         within("\u2028", "\u202e") || within("\u2066", "\u2069");
}

}  // namespace

std::string without_controls(std::string_view text, std::string_view kept) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const std::string_view letter = text.substr(i, std::max<std::size_t>(length, 1));
    const bool is_kept = length == 0 ? static_cast<unsigned char>(text[i]) >= 0xA0
                                     : !is_control(letter) || kept.find(letter) != kept.npos;
    out += is_kept ? letter : "?";
    i += letter.size();
  }
  return out;
}

std::string one_line(std::string_view text) { return without_controls(text, ""); }

std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./-+,:@%=";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string_view::npos) return std::string(text);
  const bool has_backslashes =
      std::filesystem::path::preferred_separator == '\\';  // and no shell that reads them so
  if (text.find_first_of(has_backslashes ? "\"" : "\"$`\\!") == std::string_view::npos)
    return fmt::format("\"{}\"", text);
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
  if (!fs::exists(path, error)) throw InputError("{}: no such file", path.string());
  if (fs::is_directory(path, error)) throw InputError("{}: is a directory; name a file in it", path.string());
  // Not by opening it: a FIFO, as in <(...), can be opened once.
  if (::access(path.c_str(), R_OK) != 0)
    throw InputError("{}: cannot be read: {}", path.string(), std::strerror(errno));
}

namespace {

// By read(), which sets badbit where an iterator lets the buffer's exception through.
std::string read_all(std::istream& stream, const std::string& name, std::size_t most_bytes) {
  constexpr std::size_t kPiece_bytes = 1 << 16;
  std::string content;
  while (stream && content.size() <= most_bytes) {
    go_on();
    const std::size_t before = content.size();
    content.resize(before + kPiece_bytes);
    stream.read(content.data() + before, kPiece_bytes);
    content.resize(before + static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) throw InputError("{}: reading failed", name);
  if (content.size() > most_bytes)
    throw InputError("{}: is larger than {} MB; is it the right file?", name, most_bytes >> 20);
  return content;
}

}  // namespace

std::string read_file(const fs::path& path, std::size_t most_bytes) {
  if (path == "-") return read_all(std::cin, "standard input", most_bytes);
  require_readable(path);
  if (fs::is_character_file(path) && path != "/dev/stdin")
    throw InputError("{}: is a device, which may never end; name a file", path.string());
  std::ifstream file(path, std::ios::binary);
  std::string content = read_all(file, path.string(), most_bytes);
  if (content.empty()) throw InputError("{}: is empty", path.string());
  return content;
}

namespace {

// Whose results, or whose begun run, a folder has; empty: nobody's.
std::string kind_of(const fs::path& folder) {
  const auto read = [&](const char* name) {
    std::ifstream file(folder / name);
    return file ? nlohmann::json::parse(file, nullptr, false) : nlohmann::json();
  };
  constexpr const char* kUnknown = "?";
  const auto kind = [](const nlohmann::json& json, const std::string& otherwise) {
    return json.contains("kind") && json["kind"].is_string() ? json["kind"].get<std::string>() : otherwise;
  };
  if (const auto results = read("results.json"); !results.is_null()) return kind(results, kUnknown);
  // One that was cut off while it was written means nothing.
  if (const auto run = read("run.json"); run.is_object())
    return kind(run, run.contains("engine") ? "experiment" : kUnknown);
  std::error_code error;
  return fs::exists(folder / "cohort.csv", error) ? "cohort" : "";
}

}  // namespace

void require_folder(const fs::path& folder, std::string_view kind) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError("{}: cannot make this folder: there is a file of that name", folder.string());
  }
  const std::string there = kind.empty() ? "" : kind_of(folder);
  if (!there.empty() && there != kind)
    throw InputError("{}: holds what another job found: choose another folder", folder.string());
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError("{}: cannot make this folder: {}", folder.string(), error.message());
}

Temporary::~Temporary() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

int Temporary::rename_to(const fs::path& path) {
  if (::rename(path_.c_str(), path.c_str()) != 0) return errno;
  keep();
  return 0;
}

TemporaryFolder::TemporaryFolder()
    : Temporary([] {
        std::error_code error;
        std::string pattern = (fs::temp_directory_path(error) / "flexor-XXXXXX").string();
        if (error) throw JobError("TMPDIR does not name a folder: {}", error.message());
        if (mkdtemp(pattern.data()) == nullptr) {
          throw JobError("{}: cannot be made: {}", pattern, std::strerror(errno));
        }
        return fs::path(pattern);
      }()) {}

std::string digest(std::string_view content) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("fnv1a64:{:016x}", hash);
}

}  // namespace flexor::io
