// The bytes of a log as lines of UTF-8: UTF-8 with or without a mark, UTF-16 with or without one, and Latin-1
// for lines that are not UTF-8.
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>

namespace flexor::recording {

class LineReader {
 public:
  // The stream must outlive the reader.
  explicit LineReader(std::istream& stream) : stream_(stream) {}

  // The next line without its end; false when there is none.
  bool next(std::string& line);

  std::size_t number() const { return number_; }  // of the line that next() gave, counted from 1
  bool cut_off() const { return cut_off_; }       // that line had no end: it may be half written
  bool is_utf16() const { return encoding_ == Encoding::utf16_le || encoding_ == Encoding::utf16_be; }
  bool saw_latin1() const { return saw_latin1_; }
  std::string digest() const;  // of all bytes read so far, as io::digest

 private:
  enum class Encoding { unknown, utf8, utf16_le, utf16_be };

  void find_encoding();
  bool next_utf16(std::string& line);
  bool next_bytes(std::string& line);
  [[noreturn]] void too_long() const;
  int byte();

  std::istream& stream_;
  Encoding encoding_ = Encoding::unknown;
  std::uint64_t hash_ = 0;
  std::size_t number_ = 0;
  bool cut_off_ = false;
  bool saw_latin1_ = false;
};

bool is_utf8(std::string_view text);
std::string latin1_to_utf8(std::string_view text);

}  // namespace flexor::recording
