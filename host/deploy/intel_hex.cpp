#include "host/deploy/intel_hex.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <numeric>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

enum RecordType : std::uint8_t {
  kData = 0,
  kEnd = 1,
  kSegment = 2,
  kStart = 3,
  kLinear = 4,
  kLinearStart = 5
};

constexpr std::size_t kHeadBytes = 4;  // size, address, type
constexpr std::size_t kRecordBytes = 16;

class Parser {
 public:
  Parser(const std::string& name, std::size_t flash_bytes) : name_(name), flash_bytes_(flash_bytes) {}

  void add_line(std::string_view line) {
    ++line_;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line.empty()) return;
    if (ended_) fail("goes on after its end record");
    const std::vector<std::uint8_t> record = bytes_of(line);
    const std::size_t size = record[0];
    const unsigned address = record[1] * 256U + record[2];
    switch (record[3]) {
      case kData:
        for (std::size_t i = 0; i < size; ++i) put(base_ + address + i, record[kHeadBytes + i]);
        return;
      case kEnd:
        ended_ = true;
        return;
      case kSegment:
      case kLinear:
        if (size != 2) fail("has an address record of the wrong size");
        base_ = (record[4] * 256UL + record[5]) << (record[3] == kLinear ? 16 : 4);
        return;
      case kStart:
      case kLinearStart:
        return;  // where a program starts is fixed here
      default:
        fail(fmt::format("has a record of unknown type {}", record[3]));
    }
  }

  FlashContent finish() {
    if (!ended_) throw InputError(fmt::format("{}: is cut off: its end record is missing", name_));
    if (content_.bytes.empty()) throw InputError(fmt::format("{}: holds no program", name_));
    content_.begin = static_cast<std::size_t>(std::ranges::find(written_, true) - written_.begin());
    return std::move(content_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: line {} {}", name_, line_, what));
  }

  std::vector<std::uint8_t> bytes_of(std::string_view line) const {
    if (line.front() != ':' || line.size() % 2 == 0 || line.size() < 1 + 2 * (kHeadBytes + 1))
      fail("is no Intel HEX record");
    std::vector<std::uint8_t> out;
    for (std::size_t i = 1; i < line.size(); i += 2) {
      std::uint8_t byte = 0;
      const char* end = line.data() + i + 2;
      if (std::from_chars(line.data() + i, end, byte, 16).ptr != end) fail("is no Intel HEX record");
      out.push_back(byte);
    }
    if (out.size() != kHeadBytes + out[0] + 1) fail("has not the size that it says");
    if (std::accumulate(out.begin(), out.end(), 0U) % 256 != 0)
      fail("has a wrong checksum: the file is damaged, make it anew");
    return out;
  }

  void put(std::size_t address, std::uint8_t byte) {
    if (address >= flash_bytes_)
      fail(fmt::format("lies at 0x{:x}, beyond the {} bytes of flash", address, flash_bytes_));
    if (content_.bytes.size() <= address) {
      content_.bytes.resize(address + 1, 0xff);
      written_.resize(address + 1, false);
    }
    if (written_[address]) fail(fmt::format("writes address 0x{:x} a second time", address));
    written_[address] = true;
    content_.bytes[address] = byte;
  }

  const std::string& name_;
  std::size_t flash_bytes_;
  std::size_t line_ = 0;
  std::size_t base_ = 0;
  bool ended_ = false;
  FlashContent content_;
  std::vector<bool> written_;
};

std::string record(std::vector<std::uint8_t> bytes) {
  bytes.push_back(static_cast<std::uint8_t>(-std::accumulate(bytes.begin(), bytes.end(), 0)));
  std::string out = ":";
  for (const std::uint8_t byte : bytes) out += fmt::format("{:02X}", byte);
  return out + "\n";
}

}  // namespace

FlashContent parse_intel_hex(std::string_view text, const std::string& name, std::size_t flash_bytes) {
  Parser parser(name, flash_bytes);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    parser.add_line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parser.finish();
}

FlashContent read_intel_hex(const std::filesystem::path& path, std::size_t flash_bytes) {
  // What has no end is not read at all.
  constexpr std::uintmax_t kMost = 4 << 20;
  io::require_readable(path);
  if (!std::filesystem::is_regular_file(path))
    throw InputError(fmt::format("{}: is no plain file, as an image in Intel HEX is", path.string()));
  const std::uintmax_t size = std::filesystem::file_size(path);
  if (size > kMost)
    throw InputError(
        fmt::format("{}: has {} bytes: an image in Intel HEX has {} at most", path.string(), size, kMost));
  return parse_intel_hex(io::read_file(path), path.string(), flash_bytes);
}

std::string to_intel_hex(const FlashContent& content) {
  std::string out;
  for (std::size_t at = content.begin; at < content.bytes.size(); at += kRecordBytes) {
    const std::size_t size = std::min(kRecordBytes, content.bytes.size() - at);
    std::vector<std::uint8_t> bytes = {static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(at >> 8),
                                       static_cast<std::uint8_t>(at), kData};
    const auto first = content.bytes.begin() + static_cast<std::ptrdiff_t>(at);
    bytes.insert(bytes.end(), first, first + static_cast<std::ptrdiff_t>(size));
    out += record(std::move(bytes));
  }
  return out + record({0, 0, 0, kEnd});
}

}  // namespace flexor::deploy
