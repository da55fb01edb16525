#include "host/study/journal.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "host/io/json.hpp"
#include "host/model/model.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

constexpr const char* kSeal = "rows_digest";
// Of anything in a row, and at least 0 but for a lag; more was written by somebody else.
constexpr double kMost = 1e9;

fs::path settings_file(const fs::path& folder) { return folder / "run.json"; }

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

std::string seal_of(const fs::path& folder) {
  const fs::path path = settings_file(folder);
  return io::parse_json(io::read_document(path), path.string()).value(kSeal, "");
}

[[noreturn]] void refuse(const fs::path& path, const char* why) {
  throw io::InputError("{}{}", path.string(), why);
}

// The columns' names, a whole line.
std::string header_of_rows() {
  std::string out = "motion,compensator,trial,total_error_deg_s,lag_removed_deg_s,lag_s";
  for (const char* what : {"error_deg_s", "swing_deg", "impact_deg_s", "pressed_s"}) {
    for (const std::string& finger : model::finger_names()) out += fmt::format(",{}_{}", finger, what);
  }
  return out + ",frames_sent,frames_lost\n";
}

}  // namespace

bool is_same_run(Json there, const Json& settings) {
  if (there.is_object()) there.erase(kSeal);
  return io::dump(there) == io::dump(settings);
}

bool is_same_run(const fs::path& folder, const Json& settings) {
  if (size_of(settings_file(folder)) == 0) return false;
  if (is_same_run(Json::parse(io::read_file(settings_file(folder)), nullptr, false), settings)) return true;
  refuse(folder,
         " holds the results of other settings (see run.json there): choose another folder or remove it");
}

void seal(const fs::path& folder, Json settings, const std::string& digest) {
  if (is_sealed(folder)) return require_sealed(folder, digest);
  settings[kSeal] = digest;
  io::write_file(settings_file(folder), io::dump(settings));
}

bool is_sealed(const fs::path& folder) { return !seal_of(folder).empty(); }

void require_sealed(const fs::path& folder, const std::string& digest) {
  const std::string there = seal_of(folder);
  if (there.empty())
    refuse(folder, ": its run has not ended: give that shard's command once more, it goes on from there");
  if (there != digest)
    refuse(folder, ": its rows are not those that its run ended with: give its command into a new folder");
}

std::string text_of_row(const std::string& motion, const std::string& compensator, int trial,
                        const TrialRow& row) {
  std::string out = fmt::format("{},{},{},{}", motion, compensator, trial, row.total_deg_s);
  out += row.lag_removed ? fmt::format(",{},{}", row.lag_removed->total_error_deg_s, row.lag_removed->lag_s)
                         : ",,";
  for (const auto* values : {&row.finger_deg_s, &row.swing_deg, &row.impact_deg_s, &row.pressed_s}) {
    out += fmt::format(",{}", fmt::join(*values, ","));
  }
  return out + fmt::format(",{},{}\n", row.sent, row.lost);
}

bool parse_row(const std::string& line, const std::string& motion, const std::string& compensator, int trial,
               TrialRow& row) {
  const std::string start = fmt::format("{},{},{},", motion, compensator, trial);
  if (!line.starts_with(start)) return false;
  const char* at = line.data() + start.size();
  const char* const end = line.data() + line.size();
  const auto number = [&](auto& value) {
    const auto [stop, error] = std::from_chars(at, end, value);
    at = stop;
    return error == std::errc() && std::abs(static_cast<double>(value)) < kMost;
  };
  const auto any_next = [&](auto& value) { return number(value) && at < end && *at++ == ','; };
  const auto next = [&](auto& value) { return any_next(value) && value >= 0; };
  bool good = next(row.total_deg_s);
  row.lag_removed.reset();
  if (good && std::string_view(at, end).starts_with(",,")) {
    at += 2;
  } else {
    row.lag_removed.emplace();
    good = good && next(row.lag_removed->total_error_deg_s) && any_next(row.lag_removed->lag_s);
  }
  for (auto* values : {&row.finger_deg_s, &row.swing_deg, &row.impact_deg_s, &row.pressed_s}) {
    for (double& value : *values) good = good && next(value);
  }
  return good && next(row.sent) && number(row.lost) && at == end && row.sent >= 0 && row.lost >= 0;
}

Journal::Journal(const fs::path& folder, const Json& settings) : path_(folder / "trials.csv") {
  const std::string header = header_of_rows();
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_regular_file(path_, error))
    refuse(path_, ": is no ordinary file; choose another folder");
  old_.open(path_, std::ios::binary);
  std::string line;
  const bool whole = old_.is_open() && std::getline(old_, line) && !old_.eof();
  if (whole && line + "\n" != header)
    refuse(path_,
           ": its columns are not those of this version of Flexor: choose another folder or remove it");
  if (!is_same_run(folder, settings)) {
    // run.json is written first: rows without it are somebody else's.
    if (size_of(path_) > header.size())
      refuse(path_, ": no run.json beside it names what these rows are: choose another folder or remove it");
    io::write_file(settings_file(folder), io::dump(settings));
  }
  if (whole) kept_bytes_ = header.size();
}

bool Journal::next(std::string& row) {
  if (kept_bytes_ == 0 || !std::getline(old_, row) || old_.eof()) return false;
  batch_ += row + "\n";
  return true;
}

void Journal::keep() {
  kept_bytes_ += batch_.size();
  digest_ = io::digest(digest_ + std::exchange(batch_, ""));
}

void Journal::start() {
  old_.close();
  file_.emplace(path_, kept_bytes_);
  if (kept_bytes_ == 0) file_->append(header_of_rows());
}

void Journal::append(const std::string& rows) {
  file_->append(rows);
  digest_ = io::digest(digest_ + rows);
}

}  // namespace flexor::study
