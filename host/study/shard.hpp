// A part of a run: of items 0, 1, 2, ... shard i of N has i - 1, i - 1 + N, i - 1 + 2 N, ...
#pragma once

#include <charconv>
#include <cstddef>
#include <string_view>

#include "host/io/io.hpp"
#include "host/io/pipe_json.hpp"

namespace flexor::study {

struct Shard {
  std::size_t index = 1;  // from 1
  std::size_t of = 1;

  std::size_t item(std::size_t number) const { return index - 1 + number * of; }  // its own number 0, 1, ...
  std::size_t count(std::size_t items) const { return (items + of - index) / of; }  // how many of them it has
  bool operator==(const Shard&) const = default;
};
FLEXOR_PIPE(Shard, index, of)

// "2/8". Throws io::InputError.
inline Shard parse_shard(std::string_view text) {
  constexpr std::size_t kMost = 1000;  // merge has a file of each open
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, error] = std::from_chars(text.data(), end, shard.index);
  const bool has_slash = error == std::errc() && slash < end && *slash == '/';
  const auto [stop, second] = std::from_chars(has_slash ? slash + 1 : end, end, shard.of);
  if (!has_slash || second != std::errc() || stop != end || shard.of > kMost || shard.index < 1 ||
      shard.index > shard.of)
    throw io::InputError("--shard {}: give it as i/N with i from 1 to N, as 2/8, N at most {}", text, kMost);
  return shard;
}

}  // namespace flexor::study
