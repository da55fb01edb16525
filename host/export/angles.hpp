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
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace flexor::exports {

// What an export has made.
struct Written {
  std::vector<std::string> joints;
  std::uint64_t rows = 0;
  double seconds = 0;              // from the first row to the last
  std::vector<std::string> notes;  // what was assumed or left out
};

struct AngleOptions {
  std::vector<std::string> columns;  // none: every one whose name says deg or rad
  std::vector<std::string> names;    // OLD=NEW: joints that are to be called otherwise
  recording::TimeOptions time;       // of a time column that states none
  double rate_hz = 0;                // 0: rows as they are
  // Of joints by name: angles at the open hand and at the fist. Where there are any, angles become flexion, 0 at the open
  // hand and growing towards the fist.
  std::map<std::string, std::pair<double, double>> ends_deg = {};
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
  bool next(AngleRow& row);  // throws at the end where there was none
  // Once a row was read: its times are dates, in seconds since 1970.
  bool is_dated() const { return reader_.is_dated(); }
  std::uint64_t rows() const { return rows_; }  // so far
  std::vector<std::string> notes() const;
  // Of the rows so far.
  Written written() const;

 private:
  struct Joint {
    std::size_t column;
    double to_deg;
    std::optional<std::size_t> quality;  // column
    double sign = 1;
    double zero_deg = 0;
  };

  void choose();
  void find_joints();
  void turn(const std::map<std::string, std::pair<double, double>>& ends_deg);
  void rename(const std::vector<std::string>& names);
  bool read(AngleRow& row);    // the next that has a time of its own
  bool sample(AngleRow& row);  // the next of the grid
  void resample(const AngleRow& row);

  std::string source_;
  recording::CsvReader reader_;
  recording::Stream stream_;
  std::vector<std::string> joints_;
  std::vector<Joint> places_;
  std::vector<std::string> notes_;
  double period_s_;  // 0: rows as they are
  std::optional<recording::Resampler> resampler_;
  std::deque<AngleRow> ready_;
  double grid_s_ = 0;         // its first point
  std::uint64_t points_ = 0;  // of the grid so far
  std::optional<double> read_s_;
  double first_s_ = 0;
  double last_s_ = 0;
  std::uint64_t rows_ = 0;
  std::size_t bursts_ = 0;
  std::size_t lost_ = 0;
  std::size_t paused_ = 0;
};

}  // namespace flexor::exports
