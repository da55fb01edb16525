// `flexor live`: a glove, its fingers, recordings, a guided calibration and the page that shows them, around one server.
//
// Samples, logs and sockets are of the server's thread. What takes long runs elsewhere and comes back through Server::post:
// finding a port (glove_port.hpp), pictures (camera_feed.hpp), and every job (jobs.hpp); or is looked at each tick: the whole hand
// (hand_view.hpp).
#pragma once

#include "apps/live/anew.hpp"
#include "apps/live/calibration.hpp"
#include "apps/live/camera_feed.hpp"
#include "apps/live/fingers.hpp"
#include "apps/live/glove_port.hpp"
#include "apps/live/hand_view.hpp"
#include "apps/live/jobs.hpp"
#include "apps/live/messages.hpp"
#include "apps/live/outs.hpp"
#include "apps/live/refusal.hpp"
#include "apps/live/server.hpp"
#include "apps/live/session_recording.hpp"
#include "apps/live/sessions.hpp"
#include "apps/live/worn_glove.hpp"
#include "host/io/json.hpp"

namespace flexor::live {

inline constexpr const char* kNotTracked = "not_tracked";

struct LiveOptions : PortOptions {
  ServerOptions server;
  std::filesystem::path sessions;
  std::filesystem::path program;  // flexor itself
  std::string model;              // worn from the start; empty: the one that was accepted for this glove
  double rate_hz = 0;             // of models; 0: what suits the glove
  double lead_s = 0;  // of models that are identified: by which what follows the glove comes after it
  std::shared_ptr<WornGlove> worn;
  std::filesystem::path recording;  // played again at first, instead of a port
  // What hears the angles of a model's joints, opened when it is worn.
  std::vector<Outs::Open> outs;
};

inline constexpr double kAnew_s = 10;
// So long of a glove that was put on anew, and what came of it.
struct Anew {
  SessionRecording recording;
  bool is_over = false;  // kAnew_s
  double worn_s = 0;     // of samples, without pauses
  std::optional<AnewResult> result = {};
};

class Live {
 public:
  // Throws io::InputError.
  explicit Live(LiveOptions options);

  std::string url() const { return server_->url(); }
  // Until `stop`.
  void run(const std::atomic<bool>& stop);

 private:
  using Json = nlohmann::ordered_json;

  static constexpr double kLinkWindow_s = 2;
  struct Link {
    double begun_s = -1;
    std::deque<double> arrival_s;  // of the last two seconds
    double latency_s = 0;          // smoothed
  };

  struct ChosenModel : model::Model {
    std::filesystem::path path;
    Session session;  // none of its own: without a name
  };

  // live.cpp: device and samples
  void hear_hand();
  void glove_dropped();
  double wall_s() const;
  double now_s() const;  // of what is worn; where it is no glove of the twin's, the wall's
  double camera_time_s(double page_s);
  void listen(int parts = 8);  // of what a twin has ready; the rest at its next signal
  // Whatever fails is said, and ends nothing else.
  void guard(const char* what, const std::function<void()>& work,
             const std::function<void()>& otherwise = {}) {
    try {
      work();
    } catch (const std::exception& error) {
      if (otherwise) otherwise();
      ended(what, false, error.what());
    }
  }
  // A disk that is full ends what wrote to it, and nothing else; what came before is kept.
  void guard_recording(const std::function<void()>& work) {
    if (recording_) guard("record", work, [this] { guard("record", [this] { stop_recording(); }); });
  }
  void post(const char* what, std::function<void()> work);
  void take(const listen::Sample& sample);
  void learn_columns();
  void wear();
  void look_at_hand();
  void write(const listen::Sample& sample);
  void send_rows();
  void tick();
  void attach_worn() { glove_->attach(options_.worn, options_.worn->facts.port, DeviceEvent::wears); }
  bool is_port_lent() const { return jobs_.is_running("send") || jobs_.is_running("flash"); }
  const char* worn_name() const { return options_.worn->facts.has_boards ? "boards" : "twin"; }
  void look_at_worn();
  bool draws() const { return calibration_ && calibration_->setup().reference == Reference::drawn; }
  void draw_worn();
  double since_begun_s(double host_s) const;
  bool waits_for_camera() const;
  std::string glove_id() const;
  double link_rate_hz() const;
  double model_rate_hz(double glove_hz) const;

  // live_words.cpp: what a page may ask for. Each throws io::InputError or io::JobError: the answer, one line with the mend.
  void welcome(Client client);
  void hear(Client client, std::string_view text);
  void hear(std::span<const std::uint8_t> bytes);
  struct Word {
    std::function<void(Live&, io::JsonReader&)> act;
    std::vector<std::string_view> refusals;  // that there may be
  };
  static const std::map<std::string, Word>& words();
  void refuse(std::string_view refusal);  // throws it where it is due
  void device_connect(io::JsonReader& parts);
  void device_leave(io::JsonReader& parts);
  void columns_name(io::JsonReader& parts);
  void model_choose(io::JsonReader& parts);
  void record_start(io::JsonReader& parts);
  void marker(io::JsonReader& parts);
  void tracking_set(io::JsonReader& parts);
  void twin_set(io::JsonReader& parts);
  void score_run(io::JsonReader& parts);
  void experiment_run(io::JsonReader& parts);
  void replay_open(io::JsonReader& parts);
  void play_again(const std::filesystem::path& file, const std::string& name);
  void replay_seek(io::JsonReader& parts);
  void send(io::JsonReader& parts);
  void flash(io::JsonReader& parts);
  void angles(io::JsonReader& parts);

  // live_calibration.cpp
  void calibrate_start(io::JsonReader& parts);
  void calibrate_next(io::JsonReader& parts);
  void calibrate_back(io::JsonReader& parts);
  void calibrate_cancel(io::JsonReader& parts);
  void calibrate_accept(io::JsonReader& parts);
  void entered_step();
  void keep_calibration();
  void resume_calibration();
  void open_camera();
  void see(const PictureSeen& seen);
  void identify();
  void anew_start(io::JsonReader& parts);
  void anew_accept(io::JsonReader& parts);
  void anew_keep(io::JsonReader& parts);
  void finish_anew();

  Session new_session(const char* what);
  void wear_model(const Session& session, const std::filesystem::path& path);
  void play(const std::string& motion, double pace = 1);
  void stop_recording();
  std::filesystem::path file_of(const std::string& relative, std::uint64_t most_bytes) const;
  ChosenModel load_model(const Session& session, const std::filesystem::path& path) const;

  // live_jobs.cpp
  void start(const std::string& name, const Json& request, Jobs::Done done);
  void start_without_glove(const std::string& name, const Json& request, Jobs::Done done);
  Jobs::Done ending(const std::string& name, Jobs::Done done);
  void ended(const std::string& name, bool ok, const std::string& text);

  // live_state.cpp
  void send_state();
  Json state() const;
  Json device_state() const;
  Json link_state() const;
  Json sessions_state() const;
  Json hand_state() const;
  std::string misfit() const;
  Json what_next() const;
  Json what_next_anew() const;
  static Json model_state(const Session& session, const std::filesystem::path& path);

  LiveOptions options_;
  Sessions sessions_;
  std::optional<Server> server_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();

  std::vector<std::string> columns_;
  std::optional<Fingers> fingers_;
  std::optional<ChosenModel> model_;
  bool model_is_chosen_ = false;  // by a person: it stays when another glove comes
  std::string misfit_;            // why it is not worn on this one
  bool tracked_ = false;
  Link link_;
  std::optional<Rows> rows_;
  double sent_s_ = 0;

  std::optional<SessionRecording> recording_;
  std::optional<Calibration> calibration_;
  std::shared_ptr<void> calibration_held_;
  double camera_opened_s_ = 0;
  int camera_number_ = 0;                  // the newest: what an older one says of its end is forgotten
  double newest_picture_s_ = -1e9;         // of the page
  std::optional<double> camera_offset_s_;  // the server's clock minus the page's
  double picture_sent_s_ = -1;
  double drawn_s_ = -1;
  double worn_sent_s_ = -1;
  std::optional<Anew> anew_;
  Json last_ = nullptr;
  WornChange worn_change_;
  Json scores_ = Json::array();
  Json experiment_ = nullptr;
  std::string replayed_;  // by what is replayed
  std::vector<std::string> markerless_names_;
  Outs outs_{std::move(options_.outs),
             [this](const std::exception& error) { ended("out", false, error.what()); }};
  mutable Json listed_;  // sessions; listing reads the disk
  mutable double listed_s_ = -1e9;

  // Last, so that they end first: they have threads.
  Jobs jobs_{options_.program, [this](std::function<void()> work) { post("job", std::move(work)); }};
  std::optional<GlovePort> glove_;
  std::optional<HandView> hand_;
  std::unique_ptr<CameraFeed> camera_;
};

}  // namespace flexor::live
