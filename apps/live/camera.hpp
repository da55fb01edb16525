// The camera worker flexor-camera (apps/camera/live_jobs.hpp) as a class: pictures in, angles out, a few pictures later.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/io/pipe_json.hpp"
#include "host/io/worker.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::live {

// The joint files that the program carries with it: "green_markers", "paper_hand", "printed_finger".
const std::vector<std::string>& joint_files();
void require_carried(const std::string& joints);  // throws io::InputError, listing them

struct SeenRow {
  double t_s = 0;
  std::vector<double> deg;     // in the order of Camera::angles()
  std::vector<double> se_deg;  // likewise
  std::vector<int> quality;    // 0 good, 1 doubtful, 2 hidden, kLost: the angle means nothing
};
inline constexpr int kLost = 3;
FLEXOR_PIPE(SeenRow, t_s, deg, se_deg, quality)

struct Seen {
  std::vector<SeenRow> rows;  // that have become final
  int marks_found = 0;
  std::vector<std::array<double, 2>> marks_at;  // those, as shares of the picture's width and height
  int marks = 0;
  int width = 0;
  int height = 0;
};
FLEXOR_PIPE(Seen, rows, marks_found, marks_at, marks, width, height)

struct Grabbed : Seen {
  double t_s = 0;      // of the picture
  bool ended = false;  // there was none
};

// Every call waits for the worker: milliseconds, but grab(), which waits for a picture. For one thread at a time.
class Camera {
 public:
  // Throws io::InputError when there is no such program.
  explicit Camera(const std::filesystem::path& program = io::program_beside("flexor-camera"));

  // `joints` is one of joint_files(), or a path; `lens` a path, or empty. `drawn`: of the hand that draw() draws. A watch
  // that was open ends. Throws io::InputError.
  void open(const std::string& joints, const std::string& lens = {}, bool drawn = false);
  const std::vector<std::string>& angles() const { return angles_; }

  // Throws io::InputError, and the watch goes on: no JPEG, too large or too small, another size than before, a time that
  // is not a millisecond after the one before.
  Seen picture(double t_s, std::string_view jpeg);
  // The next picture of a camera, or of a video file at its own speed.
  Grabbed grab(const std::string& device);
  std::vector<SeenRow> close();  // those that were still on their way

  // The twin's hand as it is: a JPEG of 960 x 540 pixels.
  std::string draw(const twin::PerFinger& mcp_deg, std::uint64_t frame);

 private:
  io::Worker worker_;
  std::vector<std::string> angles_;
};

}  // namespace flexor::live
