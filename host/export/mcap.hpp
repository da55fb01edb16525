// MCAP files with one channel: header, chunks with a checksum and an index each, summary, footer.
//
// Nothing is compressed. Bytes are given out a whole chunk with its index at a time, so that what was given out can be
// read although the end never came. What is kept beside the chunk that is being filled is its entry in the summary, 60
// bytes for each that was given out.
//
// Source: the MCAP specification, version 0.
#pragma once

#include <boost/crc.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexor::exports {

struct McapChannel {
  std::string topic;
  std::string message_encoding;
  std::string schema_name;
  std::string schema_encoding;
  std::string schema;
};

class McapWriter {
 public:
  static constexpr std::size_t kChunk = 1 << 20;  // bytes, after which one is given out

  // The bytes, in order. What it throws passes through, and the writer is then of no more use.
  using Write = std::function<void(std::string_view)>;

  McapWriter(Write write, std::string_view profile, McapChannel channel);

  void add(std::uint64_t time_ns, std::string_view message);  // times never decrease
  void flush();                                               // gives out the chunk that is being filled
  void close();  // the rest and the summary; nothing can be added after it

  std::uint64_t messages() const { return messages_; }

 private:
  struct Chunk {
    std::uint64_t first_ns;
    std::uint64_t last_ns;
    std::uint64_t offset;
    std::uint64_t length;
    std::uint64_t index_length;
    std::uint64_t size;  // of what is in it
  };

  void give(std::string_view bytes);
  std::string summary() const;

  Write write_;
  McapChannel channel_;
  std::string records_;                                          // of the chunk
  std::vector<std::pair<std::uint64_t, std::uint64_t>> places_;  // of its messages: time, offset
  std::vector<Chunk> chunks_;
  std::uint64_t offset_ = 0;
  boost::crc_32_type crc_;
  std::uint64_t messages_ = 0;
};

}  // namespace flexor::exports
