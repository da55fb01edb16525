#include "host/export/joint_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/export/little_endian.hpp"
#include "host/io/output.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/unit.hpp"

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

constexpr std::pair<const char*, double> kUnknownFrom[] = {{"_quality", 3}, {"_status", 1}};

// A joint's column: its angle is scale * value - zero_deg.
struct Column {
  std::size_t angle;
  double scale;
  double zero_deg;
  std::vector<std::pair<std::size_t, double>> unknown_from;  // a column beside it: from this value on
};

struct Columns {
  std::vector<std::string> joints;
  std::vector<Column> places;
};

// `reader` reads them from now on.
Columns columns_of(recording::CsvReader& reader, const std::string& source, const RecordedOptions& o) {
  Columns out;
  std::vector<std::string> read;
  for (std::size_t i = 0; i < reader.columns().size(); ++i) {
    const std::string& column = reader.columns()[i];
    const std::string& unit = reader.units()[i];
    const std::string joint = recording::without_unit(column);
    if ((unit != "deg" && unit != "rad") || joint.ends_with("_se")) continue;
    const double to_deg = unit == "rad" ? 180 / std::numbers::pi : 1;
    out.places.push_back({read.size(), to_deg, 0, {}});
    if (!o.ends_deg.empty()) {
      const auto ends = o.ends_deg.find(joint);
      if (ends == o.ends_deg.end())
        throw io::InputError(fmt::format("{}: --model has no joint {}: take its column out", source, joint));
      const auto [open_deg, fist_deg] = ends->second;
      const int sign = fist_deg > open_deg ? 1 : -1;
      out.places.back().scale *= sign;
      out.places.back().zero_deg = sign * open_deg;
    }
    out.joints.push_back(joint);
    read.push_back(column);
  }
  if (read.empty())
    throw io::InputError(fmt::format("{}: no column is called NAME_deg or NAME_rad; there are {}", source,
                                     recording::listed(reader.columns())));
  for (std::size_t i = 0; i < out.joints.size(); ++i) {
    for (const auto& [ending, from] : kUnknownFrom) {
      if (!reader.has(out.joints[i] + ending)) continue;
      out.places[i].unknown_from.emplace_back(read.size(), from);
      read.push_back(out.joints[i] + ending);
    }
  }
  reader.choose(read);
  return out;
}

void rename(std::vector<std::string>& joints, const std::vector<std::string>& names,
            const std::string& source) {
  const std::vector<std::string> before = joints;
  for (const std::string& pair : names) {
    const std::size_t at = pair.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == pair.size())
      throw io::InputError(
          fmt::format("--names {}: OLD=NEW is needed, such as index_mcp=finger_flexion", pair));
    const auto joint = std::ranges::find(before, pair.substr(0, at));
    if (joint == before.end())
      throw io::InputError(fmt::format("--names {}: {} has no joint {}; there are {}", pair, source,
                                       pair.substr(0, at), recording::listed(before)));
    joints[static_cast<std::size_t>(joint - before.begin())] = pair.substr(at + 1);
  }
  for (auto joint = joints.begin(); joint != joints.end(); ++joint) {
    if (std::find(joints.begin(), joint, *joint) != joint)
      throw io::InputError(
          fmt::format("{}: two columns are the joint {}: call one otherwise with --names", source, *joint));
  }
}

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

Written write_joint_states(const std::filesystem::path& recording, const RecordedOptions& options,
                           const std::filesystem::path& out) {
  const std::string source = recording == "-" ? "standard input" : recording.string();
  recording::CsvReader reader(recording, recording::TableOptions{{}, options.time, recording::Holes::all});
  Columns columns = columns_of(reader, source, options);
  rename(columns.joints, options.names, source);
  recording::Stream stream(reader, recording::Resets::follow);
  io::Output output(out);
  std::optional<JointStates> states;
  Written done{columns.joints, 0, 0, {}};
  double first_s = 0;
  double last_s = 0;
  std::size_t repeated = 0;
  std::size_t lost = 0;
  std::vector<double> angle_deg;
  for (recording::Row row; stream.next(row);) {
    if (states && row.t_s <= last_s) {
      ++repeated;
      continue;
    }
    last_s = row.t_s;
    ++done.rows;
    if (!states) {
      first_s = row.t_s;
      const auto start_s = reader.is_dated() && !options.start_s ? std::optional(row.t_s) : options.start_s;
      if (start_s && *start_s < 0)
        throw io::InputError(source + ": times before 1970 do not fit into MCAP: say --start");
      states.emplace([&](std::string_view bytes) { output.write(bytes); }, columns.joints, start_s);
    }
    angle_deg.clear();
    for (const Column& c : columns.places) {
      const bool is_lost = std::ranges::any_of(
          c.unknown_from, [&](const auto& one) { return row.value[one.first] >= one.second; });
      lost += is_lost ? 1 : 0;
      angle_deg.push_back(is_lost ? std::numeric_limits<double>::quiet_NaN()
                                  : c.scale * row.value[c.angle] - c.zero_deg);
    }
    states->add(row.t_s, angle_deg);
  }
  if (!states) throw io::InputError(source + ": no row with an angle");
  states->writer().close();
  output.commit();
  done.seconds = last_s - first_s;
  done.notes = stream.notes();
  if (repeated > 0)
    done.notes.push_back(
        fmt::format("{}: {} row(s) have the time of the row before and are left out", source, repeated));
  if (lost > 0)
    done.notes.push_back(
        fmt::format("{}: {} angle(s) were lost by the camera: they are written as not known", source, lost));
  return done;
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
