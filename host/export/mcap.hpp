// Angles as the ROS 2 message sensor_msgs/msg/JointState in MCAP, what ROS 2, Foxglove and Rerun open: header, chunks with a checksum
// and an index each, summary, footer.
//
// Radians; velocity and effort are empty. Nothing is compressed. Bytes are given out a whole chunk with its index at a time, so that
// what was given out can be read although the end never came. What is kept beside the chunk that is being filled is its entry in the
// summary, 60 bytes for each that was given out.
//
// Sources: the MCAP specification, version 0; sensor_msgs and std_msgs of ROS 2; OMG CDR (XCDR1, little endian), as Fast-CDR writes it.
#pragma once

#include <boost/crc.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexor::exports {

class JointStates {
 public:
  static constexpr std::size_t kChunk = 1 << 20;  // bytes, after which one is given out

  // The bytes, in order. What it throws passes through, and the writer is then of no more use.
  using Write = std::function<void(std::string_view)>;

  // `start_s`: of the first sample, since 1970; none: now.
  JointStates(Write write, const std::vector<std::string>& joints, std::optional<double> start_s);

  // t_s never decreases. Throws io::JobError after the year 2038, which a ROS 2 stamp ends with.
  void add(double t_s, std::span<const double> angle_deg);
  void flush();  // gives out the chunk that is being filled
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
  std::size_t joints_;
  std::string names_;  // of each message, between its stamp and its positions
  std::optional<double> start_s_;
  std::uint64_t start_ns_ = 0;
  double first_s_ = 0;
  std::string records_;                                          // of the chunk
  std::vector<std::pair<std::uint64_t, std::uint64_t>> places_;  // of its messages: time, offset
  std::vector<Chunk> chunks_;
  std::uint64_t offset_ = 0;
  boost::crc_32_type crc_;
  std::uint64_t messages_ = 0;
};

}  // namespace flexor::exports
