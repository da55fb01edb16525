// The bytes of a log as lines of UTF-8, ended by LF, CR LF or CR: UTF-8 with or without a mark, UTF-16 with or without one, and Latin-1
// for lines that are not UTF-8.
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace flexor::recording {

// Bytes to lines, as they come.
class LineSplitter {
 public:
  explicit LineSplitter(std::size_t longest) : longest_(longest) {}

  // True: a line is whole. The next byte begins another.
  bool push(std::uint8_t byte) {
    if (is_utf16()) return push_half(byte);
    const bool after_return = std::exchange(after_return_, byte == '\r' && !may_be_utf16());
    if (byte == '\n' && after_return) return false;
    if (byte == '\n' || after_return_) return finish();
    if (!is_too_long()) line_.push_back(static_cast<char>(byte));
    return false;
  }
  // The last line, which has no end; false: there is none.
  bool end();
  void cut() {
    line_.clear();
    half_.reset();
  }

  std::string& line() { return line_; }                         // to be taken or cleared
  bool is_too_long() const { return line_.size() > longest_; }  // of which no more is kept
  bool is_utf16() const { return encoding_ == Encoding::utf16_le || encoding_ == Encoding::utf16_be; }
  bool saw_latin1() const { return saw_latin1_; }

 private:
  enum class Encoding { unknown, utf8, utf16_le, utf16_be };

  // Of the first line, as far as it came.
  bool may_be_utf16() const {
    return encoding_ == Encoding::unknown &&
           line_.find_first_of(std::string_view("\0\xFF\xFE", 3)) != line_.npos;
  }
  bool push_half(std::uint8_t byte);
  bool finish();

  std::size_t longest_;
  std::string line_;
  Encoding encoding_ = Encoding::unknown;
  std::optional<std::uint8_t> half_;  // of a unit of UTF-16
  std::uint32_t high_ = 0;            // the first unit of two
  bool after_return_ = false;  // which ended a line, as on an old Mac; a line feed behind it ends no other
  bool saw_latin1_ = false;
};

// The lines of a file or pipe.
class LineReader {
 public:
  // The stream must outlive the reader; errors name `source`. `is_live`: no line of it ends the reader.
  LineReader(std::istream& stream, std::string source, bool is_live)
      : stream_(stream), source_(std::move(source)), is_live_(is_live) {}

  // The next line without its end; false when there is none. In place of one that is too long a live log has a word.
  bool next(std::string& line);

  std::size_t number() const { return number_; }  // of the line that next() gave, counted from 1
  bool cut_off() const { return cut_off_; }       // that line had no end: it may be half written
  bool is_utf16() const { return splitter_.is_utf16(); }
  bool saw_latin1() const { return splitter_.saw_latin1(); }
  std::string digest() const;  // of all bytes read so far, as io::digest

 private:
  int byte();

  std::istream& stream_;
  std::string source_;
  bool is_live_;
  LineSplitter splitter_{1'000'000};
  std::uint64_t hash_ = 0xcbf29ce484222325;  // FNV-1a
  std::size_t number_ = 0;
  bool cut_off_ = false;
};

bool is_utf8(std::string_view text);

}  // namespace flexor::recording
