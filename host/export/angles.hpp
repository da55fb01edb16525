// A recording's angle columns as rows of degrees, one joint for each column.
//
// A joint is called like its column without the unit: index_mcp_deg and index_mcp_rad are index_mcp. What is no unit's
// is left out where nobody names columns, and so are standard errors (NAME_se_deg). Where NAME_quality stands beside
// NAME_deg, as a camera writes it, an angle that was lost there (3) is NaN.
//
// Times rise strictly: a row with the time of the one before is left out. With a rate the rows are those of the causal
// resampler (host/recording/resample.hpp), and where the log pauses NaN stands at each of its grid's points.
//
// Errors are io::InputError, one line.
#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace flexor::exports {

struct AngleOptions {
  std::vector<std::string> columns;  // none: every one whose name says deg or rad
  std::vector<std::string> names;    // OLD=NEW: joints that are to be called otherwise
  recording::TimeOptions time;       // of a time column that states none
  double rate_hz = 0;                // 0: rows as they are
};

struct AngleRow {
  double t_s = 0;
  std::vector<double> angle_deg;
};

class Angles {
 public:
  // "-" is standard input.
  Angles(const std::filesystem::path& path, const AngleOptions& options);
  Angles(const Angles&) = delete;
  Angles& operator=(const Angles&) = delete;

  const std::string& source() const { return source_; }
  const std::vector<std::string>& joints() const { return joints_; }
  bool next(AngleRow& row);
  // Once a row was read: its times are dates, in seconds since 1970.
  bool is_dated() const { return reader_->is_dated(); }
  std::vector<std::string> notes() const;

 private:
  struct Joint {
    std::size_t column;
    double to_deg;
    std::optional<std::size_t> quality;  // column
  };

  void choose();
  void find_joints();
  void rename(const std::vector<std::string>& names);
  void require_different() const;
  bool read(AngleRow& row);  // the next that has a time of its own
  void resample(const AngleRow& row);
  double due() const { return *first_s_ + static_cast<double>(points_) * period_s_; }
  void put(std::vector<double> angle_deg);
  void fill(double until_s);

  std::string source_;
  std::unique_ptr<recording::CsvReader> reader_;
  std::unique_ptr<recording::Stream> stream_;
  std::vector<std::string> joints_;
  std::vector<Joint> places_;
  std::vector<std::string> notes_;
  std::optional<double> last_s_;
  std::size_t bursts_ = 0;
  std::size_t lost_ = 0;
  double period_s_ = 0;  // 0: rows as they are
  std::optional<recording::Resampler> resampler_;
  std::deque<AngleRow> ready_;
  std::optional<double> first_s_;  // of the grid
  std::uint64_t points_ = 0;       // of it so far
  std::size_t paused_ = 0;
};

}  // namespace flexor::exports
