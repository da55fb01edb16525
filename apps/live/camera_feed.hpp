// Pictures to angles beside the server's thread: the page's webcam, or the twin's hand as it is drawn.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/camera.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::live {

// What one picture brought; of angles that are too unsure for a reference: NaN.
struct PictureSeen : Seen {
  std::vector<std::string> names;  // of the angles, NAME_deg
  std::string jpeg;                // what was drawn; empty: it was the page's
};

class CameraFeed {
 public:
  // `joints` of joint_files(); `drawn`: of the twin's hand, whose lengths are known. `came` is called from any thread when poll()
  // has something, or has in a moment.
  CameraFeed(std::string joints, bool drawn, std::function<void()> came)
      : joints_(std::move(joints)), drawn_(drawn), came_(std::move(came)) {}

  // Never waits; where four pictures wait already the oldest goes.
  void take(double t_s, std::string jpeg) { add({t_s, std::move(jpeg), {}}); }
  void draw(double t_s, const twin::PerFinger& mcp_deg) { add({t_s, "", mcp_deg}); }
  bool is_busy() const { return !waiting_.empty(); }  // a picture waits
  bool is_open() const { return camera_ != nullptr; }
  // What the next picture brought, once that is known; never waits. Throws io::InputError where it cannot be read and is left out,
  // and is_open(); else the camera's worker has gone, and nothing is seen any more.
  std::optional<PictureSeen> poll();

 private:
  struct Work {
    double t_s = 0;
    std::string jpeg;
    std::optional<twin::PerFinger> mcp_deg;
  };
  void add(Work work);
  void go_on();
  PictureSeen see(Work work);

  std::string joints_;
  bool drawn_;
  std::function<void()> came_;
  std::deque<Work> waiting_;
  std::unique_ptr<Camera> camera_;  // of what runs beside, and so is the frame
  std::uint64_t frame_ = 0;
  std::future<PictureSeen> coming_;  // last, so that it ends first
};

}  // namespace flexor::live
