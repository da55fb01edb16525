#include "host/export/mcap.hpp"

#include <bit>
#include <cassert>
#include <chrono>
#include <cmath>
#include <numbers>

#include "host/io/io.hpp"

namespace flexor::exports {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::uint16_t kId = 1;         // of the schema and of the channel
constexpr std::uint32_t kOneEntry = 10;  // bytes of a map with one entry: a channel's id and a number
constexpr std::uint64_t kSecond_ns = 1'000'000'000;
constexpr std::string_view kCdr("\x00\x01\x00\x00", 4);  // little endian

// sensor_msgs/msg/JointState with the definitions that it needs, as the schema encoding ros2msg has them; their comments are
// in ROS.
constexpr const char* kSchema =
    "std_msgs/Header header\n"
    "string[] name\n"
    "float64[] position\n"
    "float64[] velocity\n"
    "float64[] effort\n"
    "================================================================================\n"
    "MSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\n"
    "string frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\n"
    "int32 sec\n"
    "uint32 nanosec\n";

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

// Numbers with the lowest byte first.
template <class Integer>
void put(std::string& out, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xff);
}

void put(std::string& out, double value) { put(out, std::bit_cast<std::uint64_t>(value)); }

// Length, then bytes.
void put(std::string& out, const std::string& text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

// Bytes whose length does not precede them.
void put(std::string& out, std::string_view bytes) { out += bytes; }

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

void put_schema(std::string& out) {
  put_record(out, Op::schema, kId, std::string("sensor_msgs/msg/JointState"), std::string("ros2msg"),
             std::string(kSchema));
}

void put_channel(std::string& out) {
  constexpr std::uint32_t kMetadata = 0;
  put_record(out, Op::channel, kId, kId, std::string("/flexor/joint_states"), std::string("cdr"), kMetadata);
}

// A message's frame_id, names and number of positions. The stamp before them ends at a multiple of 8, from which they are aligned.
std::string names_of(const std::vector<std::string>& joints) {
  std::string out;
  const auto align = [&](std::size_t to) { out.resize((out.size() + to - 1) / to * to); };
  const auto count = static_cast<std::uint32_t>(joints.size());
  put(out, std::string(1, '\0'));  // frame_id
  align(4);
  put(out, count);
  for (const std::string& joint : joints) {
    put(out, joint + '\0');
    align(4);
  }
  put(out, count);
  if (count > 0) align(8);
  return out;
}

}  // namespace

JointStates::JointStates(Write write, const std::vector<std::string>& joints, std::optional<double> start_s)
    : write_(std::move(write)), joints_(joints.size()), names_(names_of(joints)), start_s_(start_s) {
  std::string bytes(kMagic);
  put_record(bytes, Op::header, std::string("ros2"), std::string("flexor " FLEXOR_VERSION));
  give(bytes);
  put_schema(records_);
  put_channel(records_);
}

void JointStates::give(std::string_view bytes) {
  write_(bytes);
  offset_ += bytes.size();
  crc_.process_bytes(bytes.data(), bytes.size());
}

void JointStates::add(double t_s, std::span<const double> angle_deg) {
  assert(angle_deg.size() == joints_);
  if (messages_ == 0) {
    first_s_ = t_s;
    const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
    // A double resolves microseconds of times since 1970.
    start_ns_ = static_cast<std::uint64_t>(std::llround(start_s_.value_or(now.count()) * 1e6)) * 1000;
  }
  const std::uint64_t time_ns = start_ns_ + static_cast<std::uint64_t>(std::llround((t_s - first_s_) * 1e9));
  if (time_ns / kSecond_ns > INT32_MAX)
    throw io::JobError("times after the year 2038 do not fit into a ROS 2 stamp: choose another --start");
  std::string message(kCdr);
  put(message, static_cast<std::uint32_t>(time_ns / kSecond_ns));
  put(message, static_cast<std::uint32_t>(time_ns % kSecond_ns));
  message += names_;
  for (const double angle : angle_deg) put(message, angle * (std::numbers::pi / 180));
  put(message, std::uint32_t{0});  // velocity
  put(message, std::uint32_t{0});  // effort
  places_.emplace_back(time_ns, records_.size());
  put_record(records_, Op::message, kId, static_cast<std::uint32_t>(messages_), time_ns, time_ns,
             std::string_view(message));
  ++messages_;
  if (records_.size() >= kChunk) flush();
}

void JointStates::flush() {
  if (places_.empty()) return;
  Chunk chunk{places_.front().first, places_.back().first, offset_, 0, 0, records_.size()};
  const std::string uncompressed;
  std::string bytes;
  put_record(bytes, Op::chunk, chunk.first_ns, chunk.last_ns, chunk.size, crc32(records_), uncompressed,
             chunk.size, std::string_view(records_));
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
std::string JointStates::summary() const {
  std::string out;
  std::string offsets;
  auto end_group = [&, begin = std::size_t{0}](Op op) mutable {
    if (out.size() == begin) return;
    put_record(offsets, Op::summary_offset, op, offset_ + begin, out.size() - begin);
    begin = out.size();
  };
  put_schema(out);
  end_group(Op::schema);
  put_channel(out);
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

void JointStates::close() {
  flush();
  std::string bytes;
  put_record(bytes, Op::data_end, static_cast<std::uint32_t>(crc_.checksum()));
  give(bytes);
  give(summary());
  give(kMagic);
}

}  // namespace flexor::exports
