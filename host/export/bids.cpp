#include "host/export/bids.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

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

constexpr const char* kStaging = ".flexor-export-";
constexpr const char* kSet = "set";  // all that is in it

// One process at a time. Where the disk knows no locks, nobody waits.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder, std::chrono::seconds longest = {})
      : file_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)) {
    constexpr std::chrono::milliseconds kStep(20);
    if (file_ < 0) return;
    for (std::chrono::milliseconds waited{}; !is_held_ && waited <= longest; waited += kStep) {
      if (waited.count() > 0) std::this_thread::sleep_for(kStep);
      is_held_ = flock(file_, LOCK_EX | LOCK_NB) == 0;
      if (!is_held_ && errno != EWOULDBLOCK) return;
      is_busy_ = !is_held_;
    }
  }
  ~FolderLock() {
    if (file_ >= 0) close(file_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  bool is_held() const { return is_held_; }
  bool is_busy() const { return is_busy_; }  // another process holds it

 private:
  int file_;
  bool is_held_ = false;
  bool is_busy_ = false;
};

bool is_staging(const fs::path& folder) {
  std::error_code error;
  const auto is_ours = [](const fs::directory_entry& entry) { return entry.path().filename() == kSet; };
  return folder.filename().string().starts_with(kStaging) &&
         std::all_of(fs::directory_iterator(folder, error), fs::directory_iterator{}, is_ours) && !error;
}

// What exports that were killed have left there: whoever lives holds the lock of their own.
void remove_left(const fs::path& parent) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(parent, error)) {
    if (!is_staging(entry.path())) continue;
    const FolderLock lock(entry.path());
    if (lock.is_held()) fs::remove_all(entry.path(), error);
  }
}

// A new folder in `parent`, locked and removed with all that is in it.
class Staging {
 public:
  explicit Staging(const fs::path& parent, const fs::path& folder)
      : temporary_([&] { return make(parent, folder); }), lock_(temporary_.path()) {}
  fs::path set() const { return temporary_.path() / kSet; }
  // Not where another export has taken it for one that was left, before it was locked.
  bool is_there() const { return !lock_.is_busy() && fs::exists(temporary_.path()); }

 private:
  static fs::path make(const fs::path& parent, const fs::path& folder) {
    std::string pattern = (parent / (std::string(kStaging) + "XXXXXX")).string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw InputError(fmt::format("{}: cannot be written: {}", folder.string(), std::strerror(errno)));
    return pattern;
  }

  io::Temporary temporary_;
  FolderLock lock_;
};

// Beside the dataset, or inside of one that is there: on the same disk.
std::unique_ptr<Staging> make_staging(const fs::path& folder, bool is_dataset_there) {
  const fs::path beside = folder.has_parent_path() ? folder.parent_path() : ".";
  remove_left(beside);
  if (is_dataset_there) remove_left(folder);
  for (;;) {
    auto staging = std::make_unique<Staging>(is_dataset_there ? folder : beside, folder);
    if (staging->is_there()) return staging;
  }
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
  // In this order: another export may make a dataset of an empty folder meanwhile.
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

// False where there is a dataset by now, which another export has made meanwhile.
bool becomes(const fs::path& set, const fs::path& folder) {
  std::error_code error;
  fs::rename(set, folder, error);
  if (error && !is_dataset(folder)) cannot_write(folder, error);
  return !error;
}

// The new files in one step: by renaming the subject's folder, or its folder of motions, or by exchanging the latter for one
// that also has links to what is there. Only a disk that cannot exchange or link gets them one by one.
void publish(const std::vector<std::string>& files, const fs::path& set, const fs::path& folder,
             const std::string& subject) {
  const fs::path motion = fs::path(subject) / "motion";
  std::error_code error;
  for (const fs::path& level : {fs::path(subject), motion}) {
    if (fs::exists(folder / level, error)) continue;
    fs::rename(set / level, folder / level, error);
    if (error) cannot_write(folder / level, error);
    return;
  }
  const auto links =
      fs::copy_options::recursive | fs::copy_options::create_hard_links | fs::copy_options::copy_symlinks;
  fs::copy(folder / motion, set / motion, links, error);
  if (!error) fs::permissions(set / motion, fs::status(folder / motion).permissions(), error);
  const fs::path from = set / motion;
  const fs::path to = folder / motion;
  if (!error && renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0) return;
  move_all(files, from, to);
}

// The dataset's own files first: a repeat finds them as they are to be.
void add(const std::vector<std::string>& files, const fs::path& set, const fs::path& folder,
         const std::string& subject) {
  const FolderLock lock(folder, std::chrono::seconds(30));
  if (lock.is_busy())
    throw io::JobError(
        fmt::format("{}: another program holds this folder: try again when it is done", folder.string()));
  require_new(folder / subject / "motion", files);
  add_participant(folder / kParticipants, subject);
  publish(files, set, folder, subject);
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
  const auto staging = make_staging(folder, adds);
  for (std::size_t i = 0; i < recordings.size(); ++i)
    require_new(folder / motion, files_of(name_of(o, i, recordings.size())));
  const fs::path set = staging->set();
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
  if (adds || !becomes(set, folder)) add(all.files, set, folder, subject);
  for (std::string& file : all.files) file = (folder / motion / file).string();
  return all;
}

}  // namespace flexor::exports
