#include "host/export/mcap.hpp"

#include "host/export/little_endian.hpp"

namespace flexor::exports {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::uint16_t kId = 1;         // of the schema and of the channel
constexpr std::uint32_t kOneEntry = 10;  // bytes of a map with one entry: a channel's id and a number

enum class Op : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0b,
  summary_offset = 0x0e,
  data_end = 0x0f
};

std::uint32_t crc32(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return static_cast<std::uint32_t>(crc.checksum());
}

template <class... Fields>
void put_record(std::string& out, Op op, const Fields&... fields) {
  std::string content;
  (put(content, fields), ...);
  put(out, op);
  put(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

void put_schema(std::string& out, const McapChannel& channel) {
  put_record(out, Op::schema, kId, channel.schema_name, channel.schema_encoding, channel.schema);
}

void put_channel(std::string& out, const McapChannel& channel) {
  constexpr std::uint32_t kMetadata = 0;
  put_record(out, Op::channel, kId, kId, channel.topic, channel.message_encoding, kMetadata);
}

}  // namespace

McapWriter::McapWriter(Write write, std::string_view profile, McapChannel channel)
    : write_(std::move(write)), channel_(std::move(channel)) {
  std::string bytes(kMagic);
  put_record(bytes, Op::header, std::string(profile), std::string("flexor " FLEXOR_VERSION));
  give(bytes);
  put_schema(records_, channel_);
  put_channel(records_, channel_);
}

void McapWriter::give(std::string_view bytes) {
  write_(bytes);
  offset_ += bytes.size();
  crc_.process_bytes(bytes.data(), bytes.size());
}

void McapWriter::add(std::uint64_t time_ns, std::string_view message) {
  places_.emplace_back(time_ns, records_.size());
  const auto sequence = static_cast<std::uint32_t>(messages_);
  put_record(records_, Op::message, kId, sequence, time_ns, time_ns, Bytes{message});
  ++messages_;
  if (records_.size() >= kChunk) flush();
}

void McapWriter::flush() {
  if (places_.empty()) return;
  Chunk chunk{places_.front().first, places_.back().first, offset_, 0, 0, records_.size()};
  const std::string uncompressed;
  std::string bytes;
  put_record(bytes, Op::chunk, chunk.first_ns, chunk.last_ns, chunk.size, crc32(records_), uncompressed,
             chunk.size, Bytes{records_});
  chunk.length = bytes.size();
  std::string index;
  for (const auto& [time_ns, offset] : places_) {
    put(index, time_ns);
    put(index, offset);
  }
  put_record(bytes, Op::message_index, kId, index);
  chunk.index_length = bytes.size() - chunk.length;
  give(bytes);
  chunks_.push_back(chunk);
  records_.clear();
  places_.clear();
}

// Groups of records, then where each group lies.
std::string McapWriter::summary() const {
  std::string out;
  std::string offsets;
  auto end_group = [&, begin = std::size_t{0}](Op op) mutable {
    if (out.size() == begin) return;
    put_record(offsets, Op::summary_offset, op, offset_ + begin, out.size() - begin);
    begin = out.size();
  };
  put_schema(out, channel_);
  end_group(Op::schema);
  put_channel(out, channel_);
  end_group(Op::channel);
  constexpr std::uint16_t kSchemas = 1;
  constexpr std::uint32_t kChannels = 1, kAttachments = 0, kMetadata = 0;
  const std::uint64_t first_ns = chunks_.empty() ? 0 : chunks_.front().first_ns;
  const std::uint64_t last_ns = chunks_.empty() ? 0 : chunks_.back().last_ns;
  put_record(out, Op::statistics, messages_, kSchemas, kChannels, kAttachments, kMetadata,
             static_cast<std::uint32_t>(chunks_.size()), first_ns, last_ns, kOneEntry, kId, messages_);
  end_group(Op::statistics);
  for (const Chunk& chunk : chunks_) {
    const std::string uncompressed;
    put_record(out, Op::chunk_index, chunk.first_ns, chunk.last_ns, chunk.offset, chunk.length, kOneEntry,
               kId, chunk.offset + chunk.length, chunk.index_length, uncompressed, chunk.size, chunk.size);
  }
  end_group(Op::chunk_index);
  std::string end;  // the footer, but for the checksum of all this
  put(end, Op::footer);
  put(end, std::uint64_t{20});
  put(end, offset_);
  put(end, offset_ + out.size());
  out += offsets + end;
  put(out, crc32(out));
  return out;
}

void McapWriter::close() {
  flush();
  std::string bytes;
  put_record(bytes, Op::data_end, static_cast<std::uint32_t>(crc_.checksum()));
  give(bytes);
  give(summary());
  give(kMagic);
}

}  // namespace flexor::exports
