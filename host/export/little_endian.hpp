// Numbers as bytes, the lowest first.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace flexor::exports {

template <class Integer>
void put(std::string& out, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xff);
}

inline void put(std::string& out, double value) { put(out, std::bit_cast<std::uint64_t>(value)); }

// Length, then bytes.
inline void put(std::string& out, const std::string& text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

// Bytes whose length does not precede them.
struct Bytes {
  std::string_view all;
};
inline void put(std::string& out, const Bytes& bytes) { out += bytes.all; }

}  // namespace flexor::exports
