#include "host/recording/lines.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

constexpr std::uint64_t kFnvPrime = 0x100000001b3;

void append_utf8(std::string& out, std::uint32_t code) {
  const std::uint32_t more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  const std::uint32_t mark = more == 0 ? 0 : 0xFF00U >> (more + 1) & 0xFF;
  out.push_back(static_cast<char>(mark | code >> 6 * more));
  for (std::uint32_t k = more; k-- > 0;) out.push_back(static_cast<char>(0x80 | (code >> 6 * k & 0x3F)));
}

bool is_every_other_empty(std::string_view line, std::size_t from) {
  for (std::size_t i = from; i < line.size(); i += 2)
    if (line[i] != '\0') return false;
  return line.size() > 3;
}

}  // namespace

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = static_cast<signed char>(text[i]) >= 0 ? 1 : io::utf8_length(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

bool LineSplitter::push_half(std::uint8_t byte) {
  if (!half_) {
    half_ = byte;
    return false;
  }
  const std::uint32_t first = *std::exchange(half_, {});
  const std::uint32_t second = byte;
  const std::uint32_t c = encoding_ == Encoding::utf16_le ? first | second << 8 : first << 8 | second;
  if (c == '\n') return finish();
  if (is_too_long()) return false;
  if (c >= 0xD800 && c < 0xDC00) {
    high_ = c;
  } else if (c >= 0xDC00 && c < 0xE000) {
    if (high_ != 0) append_utf8(line_, 0x10000 + ((high_ - 0xD800) << 10) + (c - 0xDC00));
    high_ = 0;
  } else {
    append_utf8(line_, c);
  }
  return false;
}

// The first line tells how all are written, by its mark or by empty halves.
bool LineSplitter::finish() {
  if (encoding_ == Encoding::unknown) {
    const bool is_marked = line_.starts_with("\xFF\xFE") || line_.starts_with("\xFE\xFF");
    const bool is_little = is_marked ? line_[0] == '\xFF' : is_every_other_empty(line_, 1);
    encoding_ = is_little                                     ? Encoding::utf16_le
                : is_marked || is_every_other_empty(line_, 0) ? Encoding::utf16_be
                                                              : Encoding::utf8;
    if (line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
    if (is_utf16()) {
      if (is_marked) line_.erase(0, 2);
      for (const char c : std::exchange(line_, {})) push_half(static_cast<std::uint8_t>(c));
      return push_half('\n');
    }
  }
  if (!is_utf8(line_)) {
    for (const char c : std::exchange(line_, {})) append_utf8(line_, static_cast<unsigned char>(c));
    saw_latin1_ = true;
  }
  while (line_.ends_with('\r')) line_.pop_back();
  return true;
}

bool LineSplitter::end() { return !line_.empty() && (finish() || !line_.empty()); }

int LineReader::byte() {
  try {
    const int c = stream_.rdbuf()->sbumpc();
    if (c != std::char_traits<char>::eof()) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * kFnvPrime;
    return c;
  } catch (const std::ios_base::failure&) {  // such as that of a directory
    throw io::InputError("{}: row {}: reading failed", source_, number_ + 1);
  }
}

// As std::getline, which would take a file without line ends whole into memory.
bool LineReader::next(std::string& line) {
  splitter_.cut();
  bool is_whole = false;
  for (int c = 0; !is_whole && c >= 0 && (is_live_ || !splitter_.is_too_long());) {
    c = byte();
    is_whole = c >= 0 && splitter_.push(static_cast<std::uint8_t>(c));
  }
  if (splitter_.is_too_long() && is_live_ && is_whole) splitter_.line() = "too_long";
  if (splitter_.is_too_long())
    throw io::InputError("{}: row {} does not end within a million bytes (\"{}\"): is this a log of text?",
                         source_, number_ + 1, io::start_of(splitter_.line(), 40));
  cut_off_ = !is_whole;
  if (!is_whole && !splitter_.end()) return false;
  std::swap(line, splitter_.line());
  ++number_;
  return true;
}

std::string LineReader::digest() const { return fmt::format("fnv1a64:{:016x}", hash_); }

}  // namespace flexor::recording
