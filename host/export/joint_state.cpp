#include "host/export/joint_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "host/io/output.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/unit.hpp"

namespace flexor::exports {
namespace {

constexpr double kFlush_s = 1;

// A joint's column: its angle is scale * value - zero_deg.
struct Column {
  std::size_t angle;
  double scale;
  double zero_deg;
  std::vector<std::pair<std::size_t, const recording::Unknown*>> unknown;  // by a column beside it
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
        throw io::InputError("{}: --model has no joint {}: take its column out", source, joint);
      const auto [open_deg, fist_deg] = ends->second;
      const int sign = fist_deg > open_deg ? 1 : -1;
      out.places.back().scale *= sign;
      out.places.back().zero_deg = sign * open_deg;
    }
    out.joints.push_back(joint);
    read.push_back(column);
  }
  if (read.empty())
    throw io::InputError("{}: no column is called NAME_deg or NAME_rad; there are {}", source,
                         recording::listed(reader.columns()));
  for (std::size_t i = 0; i < out.joints.size(); ++i) {
    for (const recording::Unknown& unknown : recording::kUnknown) {
      if (!reader.has(out.joints[i] + unknown.ending)) continue;
      out.places[i].unknown.emplace_back(read.size(), &unknown);
      read.push_back(out.joints[i] + unknown.ending);
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
      throw io::InputError("--names {}: OLD=NEW is needed, such as index_mcp=finger_flexion", pair);
    const auto joint = std::ranges::find(before, pair.substr(0, at));
    if (joint == before.end())
      throw io::InputError("--names {}: {} has no joint {}; there are {}", pair, source, pair.substr(0, at),
                           recording::listed(before));
    joints[static_cast<std::size_t>(joint - before.begin())] = pair.substr(at + 1);
  }
  for (auto joint = joints.begin(); joint != joints.end(); ++joint) {
    if (std::find(joints.begin(), joint, *joint) != joint)
      throw io::InputError("{}: two columns are the joint {}: call one otherwise with --names", source,
                           *joint);
  }
}

}  // namespace

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
  std::map<std::string, std::size_t> unknown;  // why
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
        throw io::InputError(source + ": times before 1970 do not fit into MCAP: give --start");
      states.emplace([&](std::string_view bytes) { output.write(bytes); }, columns.joints, start_s);
    }
    angle_deg.clear();
    for (const Column& c : columns.places) {
      const auto by = std::ranges::find_if(
          c.unknown, [&](const auto& one) { return row.value[one.first] >= one.second->from; });
      if (by != c.unknown.end()) ++unknown[by->second->why];
      angle_deg.push_back(by != c.unknown.end() ? std::numeric_limits<double>::quiet_NaN()
                                                : c.scale * row.value[c.angle] - c.zero_deg);
    }
    states->add(row.t_s, angle_deg);
  }
  if (!states) throw io::InputError(source + ": no row with an angle");
  states->close();
  output.commit();
  done.seconds = last_s - first_s;
  done.notes = stream.notes();
  if (repeated > 0)
    done.notes.push_back(
        fmt::format("{}: {} row(s) have the time of the row before and are left out", source, repeated));
  for (const auto& [why, count] : unknown)
    done.notes.push_back(
        fmt::format("{}: {} angle(s) were {}: they are written as not known", source, count, why));
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
    states_->close();
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
  if (states_->messages() == 0) flushed_s_ = t_s;
  states_->add(t_s, angle_deg);
  if (t_s - flushed_s_ < kFlush_s) return;
  flushed_s_ = t_s;
  states_->flush();
}

}  // namespace flexor::exports
