// Pictures to angles beside the server's thread: the page's webcam, or the twin's hand as it is drawn.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
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
  // `joints` of joint_files(); `drawn`: of the twin's hand, whose lengths are known. All are called on this feed's thread: `failed` of a picture that cannot be read and is left out, `ended` where the camera's worker
  // has gone and nothing is seen any more.
  CameraFeed(std::string joints, bool drawn, std::function<void(PictureSeen)> seen,
             std::function<void(std::string)> failed, std::function<void(std::string)> ended);

  // Never waits; where four pictures wait already the oldest goes.
  void take(double t_s, std::string jpeg) { add({t_s, std::move(jpeg), {}}); }
  void draw(double t_s, const twin::PerFinger& mcp_deg) { add({t_s, "", mcp_deg}); }
  bool is_busy();  // a picture waits

 private:
  struct Work {
    double t_s = 0;
    std::string jpeg;
    std::optional<twin::PerFinger> mcp_deg;
  };
  void add(Work work);
  std::optional<Work> next(const std::stop_token& stop);  // none: it ends
  void run(const std::stop_token& stop);

  std::string joints_;
  bool drawn_;
  std::function<void(PictureSeen)> seen_;
  std::function<void(std::string)> failed_;
  std::function<void(std::string)> ended_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Work> waiting_;
  std::jthread thread_;  // last, so that it ends first
};

}  // namespace flexor::live
