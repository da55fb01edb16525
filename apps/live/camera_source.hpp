// A camera, or a video of a hand at its own speed, as a source of angles.
//
// Columns: NAME_deg of every angle of the joint file, then NAME_quality of each (0 good, 1 doubtful, 2 hidden, 3 lost), as
// flexor track writes them: a lost angle keeps its last value. Rows come camera::kLag pictures late; their host_s is when
// the picture was taken.
#pragma once

#include <filesystem>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "apps/live/camera.hpp"
#include "host/listen/source.hpp"

namespace flexor::live {

class CameraSource : public listen::Source {
 public:
  // `device` is /dev/videoN or a video file; `joints` and `lens` as of Camera::open(). Takes the first picture. Throws
  // io::InputError.
  CameraSource(std::string device, const std::string& joints, const std::string& lens,
               const std::filesystem::path& program = io::program_beside("flexor-camera"),
               std::function<double()> clock = {});  // asked when a picture has come; none: the machine's

  // Throws what went wrong with the camera meanwhile. ended: of a file.
  listen::Event wait(double timeout_s, std::vector<listen::Sample>& out) override;
  double now_s() const override { return clock_ ? clock_() : Source::now_s(); }
  std::string description() const override { return description_; }

 private:
  struct Came {
    Grabbed picture;
    double at_s = 0;  // by now_s()
  };
  Came next();
  listen::Sample sample_of(const SeenRow& row);

  std::string device_;
  std::string description_;
  Camera camera_;
  std::function<double()> clock_;
  std::vector<double> last_deg_;
  double behind_s_;  // the host's clock less the pictures', by the picture that came soonest
  double last_host_s_ = 0;
  std::future<Came> coming_;  // none at the end; last, so that it ends first: within the time of a picture
};

}  // namespace flexor::live
