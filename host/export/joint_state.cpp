#include "host/export/joint_state.hpp"

#include <fmt/format.h>

#include <cassert>
#include <chrono>
#include <cmath>
#include <numbers>

#include "host/export/little_endian.hpp"
#include "host/io/output.hpp"

namespace flexor::exports {
namespace {

constexpr double kFlush_s = 1;
constexpr std::size_t kEncapsulation = 4;  // bytes, which alignment does not count
constexpr std::uint64_t kSecond_ns = 1'000'000'000;

void align(std::string& out, std::size_t to) {
  while ((out.size() - kEncapsulation) % to != 0) out += '\0';
}

void put_string(std::string& out, const std::string& text) {
  align(out, 4);
  put(out, text + '\0');
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

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

}  // namespace

JointStateMessage::JointStateMessage(const std::vector<std::string>& joints, const std::string& frame_id)
    : joints_(joints.size()) {
  bytes_ = std::string("\x00\x01\x00\x00", kEncapsulation);  // CDR, little endian
  put(bytes_, std::uint64_t{0});                             // the stamp
  put_string(bytes_, frame_id);
  align(bytes_, 4);
  put(bytes_, static_cast<std::uint32_t>(joints_));
  for (const std::string& joint : joints) put_string(bytes_, joint);
  align(bytes_, 4);
  put(bytes_, static_cast<std::uint32_t>(joints_));
  if (joints_ > 0) align(bytes_, 8);
  positions_ = bytes_.size();
}

const std::string& JointStateMessage::encode(std::uint64_t time_ns, std::span<const double> angle_deg) {
  assert(angle_deg.size() == joints_);
  if (time_ns / kSecond_ns > INT32_MAX)
    throw io::JobError("times after the year 2038 do not fit into a ROS 2 stamp: choose another --start");
  bytes_.resize(positions_);
  for (std::size_t i = 0; i < joints_; ++i) put(bytes_, angle_deg[i] * (std::numbers::pi / 180));
  put(bytes_, std::uint32_t{0});  // velocity
  put(bytes_, std::uint32_t{0});  // effort
  std::string stamp;
  put(stamp, static_cast<std::uint32_t>(time_ns / kSecond_ns));
  put(stamp, static_cast<std::uint32_t>(time_ns % kSecond_ns));
  bytes_.replace(kEncapsulation, stamp.size(), stamp);
  return bytes_;
}

JointStates::JointStates(McapWriter::Write write, const std::vector<std::string>& joints,
                         std::optional<double> start_s)
    : message_(joints, ""),
      writer_(std::move(write), "ros2",
              {"/flexor/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", kSchema}),
      start_s_(start_s) {}

void JointStates::add(double t_s, std::span<const double> angle_deg) {
  if (writer_.messages() == 0) {
    first_s_ = t_s;
    // A double tells microseconds of times since 1970.
    start_ns_ = static_cast<std::uint64_t>(std::llround(start_s_.value_or(now_s()) * 1e6)) * 1000;
  }
  const std::uint64_t time_ns = start_ns_ + static_cast<std::uint64_t>(std::llround((t_s - first_s_) * 1e9));
  writer_.add(time_ns, message_.encode(time_ns, angle_deg));
}

Written write_joint_states(const std::filesystem::path& recording, const AngleOptions& options,
                           std::optional<double> start_s, const std::filesystem::path& out) {
  Angles angles(recording, options);
  io::Output output(out);
  AngleRow row;
  bool more = angles.next(row);
  if (angles.is_dated() && !start_s) start_s = row.t_s;
  if (start_s && *start_s < 0)
    throw io::InputError(angles.source() + ": times before 1970 do not fit into MCAP: say --start");
  JointStates states([&](std::string_view bytes) { output.write(bytes); }, angles.joints(), start_s);
  for (; more; more = angles.next(row)) states.add(row.t_s, row.angle_deg);
  states.writer().close();
  output.commit();
  return angles.written();
}

JointStateFile::JointStateFile(const std::filesystem::path& path, const std::vector<std::string>& joints)
    : file_(path) {
  try {
    states_.emplace([this](std::string_view bytes) { write(bytes); }, joints, std::nullopt);
  } catch (...) {
    file_.remove();
    throw;
  }
}

JointStateFile::~JointStateFile() {
  if (!failure_.empty()) return;
  try {
    states_->writer().close();
  } catch (const std::exception&) {  // its chunks are whole without an end, too
  }
}

void JointStateFile::write(std::string_view chunk) {
  try {
    file_.append(chunk);
  } catch (const io::JobError& error) {
    failure_ = error.what();
    throw;
  }
}

void JointStateFile::add(double t_s, std::span<const double> angle_deg) {
  if (!failure_.empty()) throw io::JobError(failure_);
  if (states_->writer().messages() == 0) flushed_s_ = t_s;
  states_->add(t_s, angle_deg);
  if (t_s - flushed_s_ < kFlush_s) return;
  flushed_s_ = t_s;
  states_->writer().flush();
}

}  // namespace flexor::exports
