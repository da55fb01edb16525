// A recording that is played again, at its own speed: rows as samples when their time has come.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/listen/source.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/time.hpp"

namespace flexor::listen {

class ReplaySource : public Source {
 public:
  // CSV as host/recording reads it; a column host_s, this machine's clock of that time, is left out; an empty cell
  // or nan is a missing reading. `speed` 2: in half the
  // time. Throws io::InputError: what read_csv() throws, a speed that is not from 0.01 to 1000.
  explicit ReplaySource(const std::filesystem::path& file, double speed = 1,
                        const recording::TimeOptions& time = {});

  // ended: every row was given; wait() does not wait then. host_s is the instant at which a row was due.
  Event wait(double timeout_s, std::vector<Sample>& out) override;
  std::string description() const override;

  // Where it is, from 0 at the first row to duration_s() at the last.
  double position_s() const;
  double duration_s() const { return recording_.t_s.back(); }
  bool is_playing() const { return !paused_ && next_ < recording_.t_s.size(); }
  // Rows from there on are given, those before it are not; out of bounds: the nearest end.
  void seek(double t_s);
  void pause(bool on);

  const std::vector<std::string>& warnings() const { return recording_.warnings; }  // of reading the file

 private:
  void go_on_from(double t_s);
  bool take(std::vector<Sample>& out);

  std::string name_;
  double speed_;
  recording::Recording recording_;  // since its first row
  std::size_t next_ = 0;
  bool paused_ = false;
  double from_s_ = 0;      // the position ...
  double from_now_s_ = 0;  // ... at this time of now_s()
};

}  // namespace flexor::listen
