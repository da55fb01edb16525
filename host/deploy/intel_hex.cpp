#include "host/deploy/intel_hex.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <numeric>
#include <sstream>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

enum RecordType : std::uint8_t { kData, kEnd, kSegment, kStart, kLinear, kLinearStart };  // 0 to 5

constexpr std::size_t kHeadBytes = 4;  // size, address, type
constexpr std::size_t kRecordBytes = 16;

struct Place {
  const std::string& file;
  std::size_t line = 0;
  [[noreturn]] void fail(const std::string& what) const {
    throw io::InputError("{}: line {} {}", file, line, what);
  }
};

Bytes record_of(std::string_view line, const Place& place) {
  if (line.front() != ':' || line.size() % 2 == 0 || line.size() < 1 + 2 * (kHeadBytes + 1))
    place.fail("is no Intel HEX record");
  Bytes out;
  for (std::size_t i = 1; i < line.size(); i += 2) {
    const char* end = line.data() + i + 2;
    if (std::from_chars(line.data() + i, end, out.emplace_back(), 16).ptr != end)
      place.fail("is no Intel HEX record");
  }
  if (out.size() != kHeadBytes + out[0] + 1) place.fail("has not the size that it states");
  if (std::accumulate(out.begin(), out.end(), 0U) % 256 != 0)
    place.fail("has a wrong checksum: the file is damaged, make it again");
  return out;
}

std::string to_line(Bytes bytes) {
  bytes.push_back(static_cast<std::uint8_t>(-std::accumulate(bytes.begin(), bytes.end(), 0)));
  return fmt::format(":{:02X}\n", fmt::join(bytes, ""));
}

}  // namespace

FlashContent parse_intel_hex(const std::string& text, const std::string& name, std::size_t flash_bytes) {
  FlashContent out{{}, flash_bytes};
  std::vector<bool> written(flash_bytes);
  std::size_t base = 0;
  bool ended = false;
  Place place{name};
  const auto put = [&](std::size_t address, std::uint8_t byte) {
    if (address >= flash_bytes)
      place.fail(fmt::format("lies at 0x{:x}, beyond the {} bytes of flash", address, flash_bytes));
    if (written[address]) place.fail(fmt::format("writes address 0x{:x} a second time", address));
    written[address] = true;
    out.bytes.resize(std::max(out.bytes.size(), address + 1), 0xff);
    out.bytes[address] = byte;
    out.begin = std::min(out.begin, address);
  };
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    ++place.line;
    line.erase(line.find_last_not_of(" \r") + 1);
    if (line.empty()) continue;
    if (ended) place.fail("goes on after its end record");
    const Bytes record = record_of(line, place);
    const std::size_t type = record[3];
    ended = type == kEnd;
    if (type == kData) {
      const std::size_t at = base + record[1] * 256U + record[2];
      for (std::size_t i = 0; i < record[0]; ++i) put(at + i, record[kHeadBytes + i]);
    } else if (type == kSegment || type == kLinear) {
      if (record[0] != 2) place.fail("has an address record of the wrong size");
      base = (record[4] * 256UL + record[5]) << (type == kLinear ? 16 : 4);
    } else if (type > kLinearStart) {  // where a program starts is fixed here
      place.fail(fmt::format("has a record of unknown type {}", type));
    }
  }
  if (!ended) throw io::InputError("{}: is cut off: its end record is missing", name);
  if (out.bytes.empty()) throw io::InputError("{}: holds no program", name);
  return out;
}

FlashContent read_intel_hex(const std::filesystem::path& path, std::size_t flash_bytes) {
  constexpr std::size_t kMost = 4 << 20;
  return parse_intel_hex(io::read_file(path, kMost), path.string(), flash_bytes);
}

std::string to_intel_hex(const FlashContent& content) {
  std::string out;
  for (std::size_t at = content.begin; at < content.bytes.size(); at += kRecordBytes) {
    const std::size_t size = std::min(kRecordBytes, content.bytes.size() - at);
    Bytes bytes = {static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(at >> 8),
                   static_cast<std::uint8_t>(at), kData};
    const auto first = content.bytes.begin() + static_cast<std::ptrdiff_t>(at);
    bytes.insert(bytes.end(), first, first + static_cast<std::ptrdiff_t>(size));
    out += to_line(std::move(bytes));
  }
  return out + to_line({0, 0, 0, kEnd});
}

}  // namespace flexor::deploy
