// Angles into MCAP files (mcap.hpp). That of a recording is written whole or not at all; the live one grows by a chunk each second, and
// what was given out can be read whatever happens then.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/export/mcap.hpp"
#include "host/export/sink.hpp"
#include "host/io/growing_file.hpp"
#include "host/recording/time.hpp"

namespace flexor::exports {

struct RecordedOptions {
  std::vector<std::string> names;  // OLD=NEW: joints that are to be called otherwise
  recording::TimeOptions time;     // of a time column that states none
  // Of joints by name: angles at the open hand and at the fist. Where there are any, angles become flexion, 0 at the open
  // hand and growing towards the fist.
  std::map<std::string, std::pair<double, double>> ends_deg = {};
  std::optional<double> start_s =
      {};  // of the first row, since 1970; none: its own where times are dates, else now
};

struct Written {
  std::vector<std::string> joints;
  std::uint64_t rows = 0;
  double seconds = 0;              // from the first row to the last
  std::vector<std::string> notes;  // what was assumed or left out
};

// A whole file, as the recording comes: "-" is standard input. Its columns NAME_deg and NAME_rad, but for standard errors
// (NAME_se_deg), are the joints NAME; where NAME_quality is 3 (a camera lost the angle) or NAME_status is not 0 (a model holds it): NaN. A row with the time of the one
// before is left out. Throws io::InputError, one line, and io::JobError.
Written write_joint_states(const std::filesystem::path& recording, const RecordedOptions& options,
                           const std::filesystem::path& out);

// A file that grows while samples come.
class JointStateFile : public Sink {
 public:
  // Throws io::InputError: there is such a file, no such folder, no permission.
  JointStateFile(const std::filesystem::path& path, const std::vector<std::string>& joints);
  ~JointStateFile() override;  // closes it, errors or not
  JointStateFile(const JointStateFile&) = delete;
  JointStateFile& operator=(const JointStateFile&) = delete;

  // Throws io::JobError, one line: the disk is full or gone. What came before is whole, and nothing comes after.
  void add(double t_s, std::span<const double> angle_deg) override;

 private:
  void write(std::string_view chunk);

  io::GrowingFile file_;
  std::string failure_;
  double flushed_s_ = 0;
  std::optional<JointStates> states_;
};

}  // namespace flexor::exports
