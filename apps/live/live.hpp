// `flexor live`: a glove, its fingers, recordings, a guided calibration and the page that shows them, around one server. Each part adds
// its own words to those of the page, and writes its own part of the state; here samples, ticks and messages find their way.
//
// Samples, logs and sockets are of the server's thread. What takes long runs elsewhere and comes back through Context::post:
// finding a port (glove_port.hpp), pictures (camera_feed.hpp), and every job (jobs.hpp); or is looked at each tick: the whole hand
// (hand_view.hpp).
#pragma once

#include <atomic>

#include "apps/live/calibration_session.hpp"
#include "apps/live/demo.hpp"
#include "apps/live/recorder.hpp"

namespace flexor::live {

class Live {
 public:
  // Throws io::InputError.
  explicit Live(LiveOptions options);

  std::string url() const { return context_.server.url(); }
  // Until `stop`.
  void run(const std::atomic<bool>& stop);

 private:
  void welcome(Client client);
  void handle(Client client, std::string_view text);
  void listen(int parts = 8);  // of what a twin has ready; the rest at its next signal
  void receive_hand();
  void tick();
  void list();
  Json what_next() const;
  Json state();

  Context context_;
  // Those that have threads end before it.
  GlovePort glove_;
  Worn worn_;
  JobRunner jobs_;
  Recorder recorder_;
  CalibrationSession calibration_;
  Demo demo_;
  Json listed_ = Json::object();  // sessions, models and ports
};

}  // namespace flexor::live
