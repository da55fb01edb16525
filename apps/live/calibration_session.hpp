// A guided calibration in the page: its steps, the camera that each needs, and the jobs that follow.
#pragma once

#include "apps/live/calibration.hpp"
#include "apps/live/camera_feed.hpp"
#include "apps/live/job_runner.hpp"

namespace flexor::live {

class CalibrationSession {
 public:
  CalibrationSession(Context& context, GlovePort& glove, Worn& worn, JobRunner& jobs);  // adds its words

  void resume();  // one that was open when the program ended
  void take(const listen::Sample& sample);
  void take_picture(std::span<const std::uint8_t> message);  // of the page's camera
  // Without boards the twin stands meanwhile.
  bool waits_for_camera() const;
  Json state() const { return calibration_ ? calibration_->state() : Json(nullptr); }
  bool is_over() const { return !calibration_ || calibration_->is_sent(); }

 private:
  void start(io::JsonReader& parts);
  void next();
  void back();
  void cancel();
  void accept();
  void enter_step();
  void keep();
  void identify();
  void open_camera();
  void see(const PictureSeen& seen);
  void see_angles(io::JsonReader& parts);
  void draw();
  double since_begun_s(double host_s) const;
  double on_server_s(double page_s);
  bool is_drawn() const { return calibration_->setup().reference == Reference::drawn; }

  Context& context_;
  GlovePort& glove_;
  Worn& worn_;
  JobRunner& jobs_;
  std::optional<Calibration> calibration_;
  std::shared_ptr<void> held_;                  // its session, from other programs
  std::vector<std::string> markerless_angles_;  // the same each time
  struct {
    int number = 0;                  // the newest: what an older one reports of its end is forgotten
    double opened_s = 0;             // of wall_s()
    double newest_s = -1e9;          // picture, of the page
    std::optional<double> offset_s;  // the server's clock minus the page's
    double drawn_s = -1;
    double sent_s = -1;
  } pictures_;
  std::unique_ptr<CameraFeed> camera_;  // last, so that it ends first: it has a thread
};

}  // namespace flexor::live
