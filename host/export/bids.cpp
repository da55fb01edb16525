#include "host/export/bids.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/io/json.hpp"
#include "host/io/output.hpp"

namespace flexor::exports {
namespace {

namespace fs = std::filesystem;
using io::InputError;

constexpr double kUneven = 0.15;  // of the mean step
constexpr double kAstray = 1;     // mean steps between a sample and its place at an even rate
constexpr const char* kLatency = "latency";
constexpr const char* kParticipants = "participants.tsv";
constexpr const char* kDescription = "dataset_description.json";

constexpr const char* kReadme =
    R"(# Joint angles of a hand

Angles of finger joints, in degrees, as a flex-sensor glove measured them and Flexor exported them. Each sample is a row
of a motion.tsv, each joint a column; channels.tsv beside it names the columns, motion.json has the rate. The last
column, latency, has the seconds from the first sample on.

An angle that is not known, as in a pause of the log, is n/a.
)";

void require_label(const char* option, const std::string& label) {
  const auto good = [](unsigned char c) { return std::isalnum(c) != 0 && c < 0x80; };
  if (!label.empty() && std::ranges::all_of(label, good)) return;
  throw InputError(fmt::format("{} {}: BIDS takes letters and digits alone", option, label));
}

std::string cell(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '_');
  return text;
}

// A new folder beside the dataset, on the same disk; removed with all that is left in it.
fs::path make_staging(const fs::path& folder) {
  const fs::path beside = folder.has_parent_path() ? folder.parent_path() : ".";
  std::string pattern = (beside / ".flexor-export-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw InputError(fmt::format("{}: cannot be written: {}", folder.string(), std::strerror(errno)));
  return pattern;
}

// A line for each row; how many seconds after the first each is. The latency has the form that BIDS wants: whole seconds, up
// to six decimals.
std::vector<double> write_samples(Angles& angles, const fs::path& path) {
  io::Output output(path);
  AngleRow row;
  std::optional<double> first_s;
  std::vector<double> latency_s;
  while (angles.next(row)) {
    if (!first_s) first_s = row.t_s;
    latency_s.push_back(row.t_s - *first_s);
    std::string line;
    for (const double angle : row.angle_deg)
      line += (std::isnan(angle) ? "n/a" : fmt::format("{}", angle)) + "\t";
    output.write(line + fmt::format("{:.6f}\n", latency_s.back()));
  }
  output.commit();
  return latency_s;
}

double rate_of(const std::vector<double>& latency_s, const std::string& source) {
  if (latency_s.size() < 2)
    throw InputError(fmt::format("{}: one row has no sampling rate: say it with --rate", source));
  const double mean_s = latency_s.back() / static_cast<double>(latency_s.size() - 1);
  double least_s = mean_s;
  double most_s = mean_s;
  double astray_s = 0;  // from its place at an even rate, at most
  for (std::size_t k = 1; k < latency_s.size(); ++k) {
    least_s = std::min(least_s, latency_s[k] - latency_s[k - 1]);
    most_s = std::max(most_s, latency_s[k] - latency_s[k - 1]);
    astray_s = std::max(astray_s, std::abs(latency_s[k] - static_cast<double>(k) * mean_s));
  }
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: unevenly sampled, {}: BIDS needs an even rate, such as --rate {:.3g}",
                                 source, why, 1 / mean_s));
  };
  if (most_s > (1 + kUneven) * mean_s || least_s < (1 - kUneven) * mean_s)
    refuse(fmt::format("its steps are {:.4g} to {:.4g} s", least_s, most_s));
  if (astray_s > kAstray * mean_s)
    refuse(fmt::format("a sample is {:.3g} s from its place at an even rate", astray_s));
  return 1 / mean_s;
}

// BIDS knows a column by its name.
void require_no_latency(const std::vector<std::string>& joints, const std::string& source) {
  if (std::ranges::find(joints, kLatency) == joints.end()) return;
  throw InputError(
      fmt::format("{}: a joint is called {}, as the column of times is: call it otherwise with --names",
                  source, kLatency));
}

void write_channels(const std::vector<std::string>& joints, const fs::path& path) {
  std::string text = "name\tcomponent\ttype\ttracked_point\tunits\n";
  for (const std::string& joint : joints) text += fmt::format("{0}\tn/a\tJNTANG\t{0}\tdeg\n", joint);
  text += fmt::format("{}\tn/a\tLATENCY\tn/a\ts\n", kLatency);
  io::write_file(path, text);
}

void write_sidecar(const BidsOptions& o, const Written& run, bool resampled, const fs::path& path) {
  nlohmann::ordered_json json = {{"TaskName", o.task},
                                 {"TaskDescription", "Motion of the fingers of one hand"},
                                 {"SamplingFrequency", run.rate_hz},
                                 {"TrackingSystemName", "glove"},
                                 {"TrackedPointsCount", run.joints.size()},
                                 {"MotionChannelCount", run.joints.size() + 1},
                                 {"JNTANGChannelCount", run.joints.size()},
                                 {"LATENCYChannelCount", 1},
                                 {"RecordingDuration", static_cast<double>(run.rows) / run.rate_hz},
                                 {"MissingValues", "n/a"},
                                 {"SoftwareVersions", "Flexor " FLEXOR_VERSION}};
  if (resampled)
    json["SamplingNote"] =
        "Uneven readings were put onto an even grid: each sample is the mean of the readings since the one "
        "before, and "
        "without any it stays as it was.";
  io::write_file(path, io::dump(json));
}

void write_description(const fs::path& folder, const std::string& subject) {
  const nlohmann::ordered_json json = {{"Name", "Joint angles of a hand"},
                                       {"BIDSVersion", "1.10.0"},
                                       {"DatasetType", "raw"},
                                       {"GeneratedBy", {{{"Name", "Flexor"}, {"Version", FLEXOR_VERSION}}}}};
  io::write_file(folder / kDescription, io::dump(json));
  io::write_file(folder / "README.md", kReadme);
  io::write_file(folder / kParticipants, "participant_id\n" + subject + "\n");
}

// A line for the subject, where it has none.
void add_participant(const fs::path& path, const std::string& subject) {
  std::error_code error;
  std::string text = fs::exists(path, error) ? io::read_file(path) : "participant_id\n";
  if (text.back() != '\n') text += '\n';
  for (const char* end : {"\t", "\n", "\r"}) {
    if (text.find("\n" + subject + end) != std::string::npos) return;
  }
  const std::size_t first_line = text.find('\n');
  text += subject;
  for (std::size_t i = 0; i < first_line; ++i) text += text[i] == '\t' ? "\tn/a" : "";
  io::write_file(path, text + "\n");
}

// What was said of the folder in which the dataset is made, said of the dataset.
std::string as_if_in(const fs::path& folder, const fs::path& made, std::string text) {
  const std::size_t at = text.find(made.string());
  if (at != std::string::npos) text.replace(at, made.string().size(), folder.string());
  return text;
}

std::vector<std::string> files_of(const std::string& name) {
  return {name + "_motion.tsv", name + "_motion.json", name + "_channels.tsv"};
}

// Writes one recording's three files into `folder`, which are called NAME_motion.tsv and so on.
Written write_run(const fs::path& recording, const AngleOptions& angle_options, const BidsOptions& o,
                  const fs::path& folder, const std::string& name) {
  Angles angles(recording, angle_options);
  std::vector<std::string> joints;
  for (const std::string& joint : angles.joints()) joints.push_back(cell(joint));
  require_no_latency(joints, angles.source());
  const std::string stem = (folder / name).string();
  const std::vector<double> latency_s = write_samples(angles, stem + "_motion.tsv");
  Written done = angles.written(files_of(name));
  done.joints = joints;
  const double wanted_hz = angle_options.rate_hz;
  done.rate_hz = wanted_hz > 0 ? wanted_hz : rate_of(latency_s, angles.source());
  write_channels(joints, stem + "_channels.tsv");
  write_sidecar(o, done, wanted_hz > 0, stem + "_motion.json");
  return done;
}

void take(Written& all, Written run, const std::string& source) {
  if (!all.joints.empty() && all.joints != run.joints)
    throw InputError(fmt::format(
        "{}: has other joints than the recordings before: export it with a --task of its own", source));
  all.joints = run.joints;
  all.rate_hz = run.rate_hz;
  all.rows += run.rows;
  all.seconds += run.seconds;
  std::ranges::move(run.files, std::back_inserter(all.files));
  std::ranges::move(run.notes, std::back_inserter(all.notes));
}

[[noreturn]] void cannot_write(const fs::path& path, const std::error_code& error) {
  throw io::JobError(fmt::format("{}: cannot be written: {}", path.string(), error.message()));
}

// Files from there to here, all or none of them.
void move_all(const std::vector<std::string>& files, const fs::path& from, const fs::path& to) {
  std::vector<fs::path> moved;
  for (const std::string& file : files) {
    std::error_code error;
    fs::rename(from / file, to / file, error);
    if (!error) {
      moved.push_back(to / file);
      continue;
    }
    std::error_code ignored;
    for (const fs::path& path : moved) fs::remove(path, ignored);
    cannot_write(to / file, error);
  }
}

bool is_dataset(const fs::path& folder) {
  std::error_code error;
  if (fs::symlink_status(folder, error).type() == fs::file_type::not_found) return false;
  if (!fs::is_directory(folder, error))
    throw InputError(fmt::format("{}: is a file: BIDS needs a folder", folder.string()));
  if (fs::is_empty(folder, error)) return false;
  if (fs::exists(folder / kDescription, error)) return true;
  throw InputError(
      fmt::format("{}: is there already and is no BIDS dataset ({} is missing): choose another folder",
                  folder.string(), kDescription));
}

std::string name_of(const BidsOptions& o, std::size_t index, std::size_t count) {
  std::string name = fmt::format("sub-{}_task-{}_tracksys-glove", o.subject, o.task);
  if (o.run > 0 || count > 1)
    name += fmt::format("_run-{}", static_cast<std::size_t>(std::max(o.run, 1)) + index);
  return name;
}

void require_new(const fs::path& folder, const std::vector<std::string>& files) {
  std::error_code error;
  for (const std::string& file : files) {
    if (fs::exists(folder / file, error))
      throw InputError(fmt::format("{}: is there already: choose another --subject, --task or --run",
                                   (folder / file).string()));
  }
}

}  // namespace

Written write_bids(const std::vector<fs::path>& recordings, const AngleOptions& angles, const BidsOptions& o,
                   const fs::path& folder_as_given) {
  require_label("--subject", o.subject);
  require_label("--task", o.task);
  const fs::path folder = folder_as_given.has_filename() ? folder_as_given : folder_as_given.parent_path();
  const bool adds = is_dataset(folder);
  const std::string subject = "sub-" + o.subject;
  const fs::path motion = fs::path(subject) / "motion";
  for (std::size_t i = 0; i < recordings.size(); ++i)
    require_new(folder / motion, files_of(name_of(o, i, recordings.size())));
  const io::Temporary staging([&] { return make_staging(folder); });
  const fs::path set = staging.path() / "set";
  Written all;
  try {
    io::make_folder(set / motion);
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      take(all, write_run(recordings[i], angles, o, set / motion, name_of(o, i, recordings.size())),
           recordings[i].string());
    }
    if (!adds) write_description(set, subject);
  } catch (const io::JobError& error) {
    throw io::JobError(as_if_in(folder, set, error.what()));
  }
  if (adds) {
    add_participant(folder / kParticipants, subject);
    io::make_folder(folder / motion);
    move_all(all.files, set / motion, folder / motion);
  } else {
    std::error_code error;
    fs::rename(set, folder, error);
    if (error) cannot_write(folder, error);
  }
  for (std::string& file : all.files) file = (folder / motion / file).string();
  return all;
}

}  // namespace flexor::exports
