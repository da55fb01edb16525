#include "host/recording/lines.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325;
constexpr std::uint64_t kFnvPrime = 0x100000001b3;
constexpr std::size_t kLongest = 1'000'000;  // bytes of a line

void append_utf8(std::string& out, std::uint32_t code) {
  const auto put = [&](std::uint32_t bits) { out.push_back(static_cast<char>(bits)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0 | code >> 6);
    put(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    put(0xE0 | code >> 12);
    put(0x80 | (code >> 6 & 0x3F));
    put(0x80 | (code & 0x3F));
  } else {
    put(0xF0 | code >> 18);
    put(0x80 | (code >> 12 & 0x3F));
    put(0x80 | (code >> 6 & 0x3F));
    put(0x80 | (code & 0x3F));
  }
}

// Length of the UTF-8 sequence at the start of `text`; 0 where there is none.
std::size_t sequence_length(std::string_view text) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = at(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((at(i) & 0xC0) != 0x80) return 0;
  }
  // Overlong forms, surrogates, beyond the last code point.
  if (first == 0xE0 && at(1) < 0xA0) return 0;
  if (first == 0xED && at(1) > 0x9F) return 0;
  if (first == 0xF0 && at(1) < 0x90) return 0;
  if (first == 0xF4 && at(1) > 0x8F) return 0;
  return length;
}

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string latin1_to_utf8(std::string_view text) {
  std::string out;
  for (const char c : text) append_utf8(out, static_cast<unsigned char>(c));
  return out;
}

int LineReader::byte() {
  const int c = [&] {
    try {
      return stream_.rdbuf()->sbumpc();
    } catch (const std::ios_base::failure&) {  // such as that of a directory
      throw io::InputError(fmt::format("line {}: reading failed", number_ + 1));
    }
  }();
  if (c != std::char_traits<char>::eof()) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * kFnvPrime;
  return c;
}

void LineReader::find_encoding() {
  hash_ = kFnvOffset;
  encoding_ = Encoding::utf8;
  const int first = stream_.peek();
  if (first == 0xFF || first == 0xFE) {
    encoding_ = first == 0xFF ? Encoding::utf16_le : Encoding::utf16_be;
    byte();
    byte();
  } else if (first == 0) {  // UTF-16 without a mark starts with a letter's empty half
    encoding_ = Encoding::utf16_be;
  }
}

bool LineReader::next_utf16(std::string& line) {
  line.clear();
  std::uint32_t high = 0;
  const auto unit = [&]() -> std::int32_t {
    const int a = byte();
    const int b = byte();
    if (a < 0 || b < 0) return -1;
    return encoding_ == Encoding::utf16_le ? a | b << 8 : a << 8 | b;
  };
  for (;;) {
    const std::int32_t code = unit();
    if (code < 0) {
      cut_off_ = true;
      return !line.empty();
    }
    if (code == '\n') return true;
    if (line.size() > kLongest) too_long();
    const auto c = static_cast<std::uint32_t>(code);
    if (c >= 0xD800 && c < 0xDC00) {
      high = c;
    } else if (c >= 0xDC00 && c < 0xE000) {
      if (high != 0) append_utf8(line, 0x10000 + ((high - 0xD800) << 10) + (c - 0xDC00));
      high = 0;
    } else {
      append_utf8(line, c);
    }
  }
}

void LineReader::too_long() const {
  throw io::InputError(
      fmt::format("line {} does not end within a million bytes: is this a log of text?", number_ + 1));
}

// As std::getline, which would take a file without line ends whole into memory.
bool LineReader::next_bytes(std::string& line) {
  line.clear();
  for (;;) {
    const int c = byte();
    cut_off_ = c == std::char_traits<char>::eof();
    if (cut_off_) return !line.empty();
    if (c == '\n') return true;
    if (line.size() > kLongest) too_long();
    line.push_back(static_cast<char>(c));
  }
}

bool LineReader::next(std::string& line) {
  if (encoding_ == Encoding::unknown) find_encoding();
  cut_off_ = false;
  if (is_utf16()) {
    if (!next_utf16(line)) return false;
  } else {
    if (!next_bytes(line)) return false;
    // UTF-16 without a mark: every other byte is empty.
    if (number_ == 0 && line.size() > 3 && line[1] == '\0' && line[3] == '\0') {
      encoding_ = Encoding::utf16_le;
      std::string rest;
      for (std::size_t i = 0; i + 1 < line.size(); i += 2) rest.push_back(line[i]);
      byte();  // the other half of the line's end
      line = latin1_to_utf8(rest);
    }
    if (number_ == 0 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (!is_utf8(line)) {
      line = latin1_to_utf8(line);
      saw_latin1_ = true;
    }
  }
  ++number_;
  while (line.ends_with('\r')) line.pop_back();
  return true;
}

std::string LineReader::digest() const { return fmt::format("fnv1a64:{:016x}", hash_); }

}  // namespace flexor::recording
