#include "host/export/mcap.hpp"

#include <algorithm>

#include "host/export/little_endian.hpp"

namespace flexor::exports {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::uint16_t kId = 1;  // of the schema and of the channel

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

void put_record(std::string& out, Op op, std::string_view content) {
  put(out, static_cast<std::uint8_t>(op));
  put(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

void put_schema(std::string& out, const McapChannel& channel) {
  std::string content;
  put(content, kId);
  put_text(content, channel.schema_name);
  put_text(content, channel.schema_encoding);
  put_text(content, channel.schema);
  put_record(out, Op::schema, content);
}

void put_channel(std::string& out, const McapChannel& channel) {
  std::string content;
  put(content, kId);
  put(content, kId);
  put_text(content, channel.topic);
  put_text(content, channel.message_encoding);
  put(content, std::uint32_t{0});  // no metadata
  put_record(out, Op::channel, content);
}

}  // namespace

McapWriter::McapWriter(Write write, std::string_view profile, McapChannel channel)
    : write_(std::move(write)), channel_(std::move(channel)) {
  std::string bytes(kMagic);
  std::string content;
  put_text(content, profile);
  put_text(content, "flexor " FLEXOR_VERSION);
  put_record(bytes, Op::header, content);
  give(bytes);
  put_schema(records_, channel_);
  put_channel(records_, channel_);
}

void McapWriter::give(std::string_view bytes) {
  write_(bytes);
  offset_ += bytes.size();
  crc_ = crc32(bytes, crc_);
}

void McapWriter::add(std::uint64_t time_ns, std::string_view message) {
  places_.emplace_back(time_ns, records_.size());
  std::string content;
  content.reserve(22 + message.size());
  put(content, kId);
  put(content, static_cast<std::uint32_t>(messages_));
  put(content, time_ns);
  put(content, time_ns);
  content += message;
  put_record(records_, Op::message, content);
  first_ns_ = messages_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = std::max(last_ns_, time_ns);
  chunk_.first_ns = places_.size() == 1 ? time_ns : std::min(chunk_.first_ns, time_ns);
  chunk_.last_ns = places_.size() == 1 ? time_ns : std::max(chunk_.last_ns, time_ns);
  ++messages_;
  if (records_.size() >= kChunk) flush();
}

void McapWriter::flush() {
  if (places_.empty()) return;
  chunk_.offset = offset_;
  chunk_.size = records_.size();
  std::string content;
  put(content, chunk_.first_ns);
  put(content, chunk_.last_ns);
  put(content, chunk_.size);
  put(content, crc32(records_));
  put_text(content, "");  // not compressed
  put(content, chunk_.size);
  content += records_;
  std::string bytes;
  put_record(bytes, Op::chunk, content);
  chunk_.length = bytes.size();
  content.clear();
  put(content, kId);
  put(content, static_cast<std::uint32_t>(16 * places_.size()));
  for (const auto& [time_ns, offset] : places_) {
    put(content, time_ns);
    put(content, offset);
  }
  put_record(bytes, Op::message_index, content);
  chunk_.index_length = bytes.size() - chunk_.length;
  give(bytes);
  chunks_.push_back(chunk_);
  records_.clear();
  places_.clear();
}

// Groups of records, then where each group lies. `start`: of the summary.
std::string McapWriter::summary(std::uint64_t start) const {
  std::string out;
  std::string offsets;
  auto end_group = [&, begin = std::size_t{0}](Op op) mutable {
    if (out.size() == begin) return;
    std::string content;
    put(content, static_cast<std::uint8_t>(op));
    put(content, start + begin);
    put(content, static_cast<std::uint64_t>(out.size() - begin));
    put_record(offsets, Op::summary_offset, content);
    begin = out.size();
  };
  put_schema(out, channel_);
  end_group(Op::schema);
  put_channel(out, channel_);
  end_group(Op::channel);
  std::string content;
  put(content, messages_);
  put(content, std::uint16_t{1});  // schemas
  put(content, std::uint32_t{1});  // channels
  put(content, std::uint32_t{0});  // attachments
  put(content, std::uint32_t{0});  // metadata
  put(content, static_cast<std::uint32_t>(chunks_.size()));
  put(content, first_ns_);
  put(content, last_ns_);
  put(content, std::uint32_t{10});  // bytes that follow: messages of each channel
  put(content, kId);
  put(content, messages_);
  put_record(out, Op::statistics, content);
  end_group(Op::statistics);
  for (const Chunk& chunk : chunks_) {
    content.clear();
    put(content, chunk.first_ns);
    put(content, chunk.last_ns);
    put(content, chunk.offset);
    put(content, chunk.length);
    put(content, std::uint32_t{10});  // bytes that follow: where each channel's index is
    put(content, kId);
    put(content, chunk.offset + chunk.length);
    put(content, chunk.index_length);
    put_text(content, "");
    put(content, chunk.size);
    put(content, chunk.size);
    put_record(out, Op::chunk_index, content);
  }
  end_group(Op::chunk_index);
  std::string end;  // the footer, but for the checksum of all this
  put(end, static_cast<std::uint8_t>(Op::footer));
  put(end, std::uint64_t{20});
  put(end, start);
  put(end, start + out.size());
  out += offsets + end;
  put(out, crc32(out));
  return out;
}

void McapWriter::close() {
  flush();
  std::string bytes;
  std::string content;
  put(content, crc_);
  put_record(bytes, Op::data_end, content);
  give(bytes);
  give(summary(offset_));
  give(kMagic);
}

}  // namespace flexor::exports
