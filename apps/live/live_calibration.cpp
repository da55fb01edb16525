// A guided calibration, and a glove that was put on anew.

#include <cmath>

#include "apps/live/camera.hpp"
#include "apps/live/live.hpp"

namespace flexor::live {
namespace {

constexpr double kPreviewEvery_s = 0.2;
constexpr double kTwinMoves_s = 62;   // two of rest, and half the motion
constexpr double kTwinPace = 3;       // who watches a demo has seen it soon
constexpr double kCameraLives_s = 3;  // one that ended sooner is not opened again by itself

}  // namespace

void Live::calibrate_start(io::JsonReader& parts) {
  if (glove_->replay()) throw Refusal("replay_is_open");
  CalibrationSetup setup;
  const std::string person = parts.text("person");
  const std::string side = parts.text("side");
  if (side != "left" && side != "right") parts.fail("\"side\" must be left or right");
  setup.reference = reference_of(parts.text("reference"));
  if (setup.reference == Reference::drawn) refuse("no_twin");
  if (setup.reference == Reference::marks || setup.reference == Reference::drawn) {
    setup.joints = setup.reference == Reference::drawn ? "paper_hand" : parts.text_or_empty("joints");
    if (setup.joints.empty()) setup.joints = options_.worn ? "paper_hand" : "green_markers";
    require_carried(setup.joints);
  }
  const Session session = sessions_.create(person, side, glove_id(), "calibration");
  calibration_.emplace(setup, session, sessions_.folder(session));
  calibration_held_ = sessions_.hold(session);
  markerless_names_.clear();
  camera_offset_s_.reset();
  keep_calibration();
  if (fingers_ && glove_->state() != DeviceState::gone)
    calibrate_next(parts);  // a glove that is heard needs no step of its own
  listed_s_ = -1e9;
}

// After the program was killed, or the machine was, it goes on with the same step. Where the disk is full it goes on
// without that.
void Live::keep_calibration() {
  guard("calibration", [this] {
    calibration_->session().calibration = calibration_->kept();
    sessions_.save(calibration_->session());
  });
}

void Live::resume_calibration() {
  for (const Session& session : sessions_.list()) {
    if (session.calibration.is_null()) continue;
    calibration_held_ = sessions_.hold(session);
    if (!calibration_held_) continue;  // another program's
    try {
      calibration_.emplace(Calibration::resumed(session, sessions_.folder(session)));
      return entered_step();
    } catch (const std::exception& error) {
      calibration_.reset();
      ended("calibration", false, error.what());
    }
  }
}

void Live::open_camera() {
  const CalibrationSetup& setup = calibration_->setup();
  if (setup.joints.empty()) return;
  camera_opened_s_ = wall_s();
  const auto on_server = [this](auto act) {
    return [this, act](auto what) { post("camera", [act, what = std::move(what)] { act(what); }); };
  };
  camera_ = std::make_unique<CameraFeed>(
      setup.joints, options_.worn != nullptr, on_server([this](const PictureSeen& seen) { see(seen); }),
      on_server([this](const std::string& why) { ended("camera", false, why); }),
      on_server([this, number = ++camera_number_](const std::string& why) {
        if (number != camera_number_) return;
        ended("camera", false, why);
        camera_.reset();
        if (!calibration_ || !calibration_->wants_pictures()) return;
        calibration_->saw_no_camera();
        if (wall_s() - camera_opened_s_ > kCameraLives_s) open_camera();
      }));
}

void Live::see(const PictureSeen& seen) {
  if (!calibration_ || !calibration_->wants_pictures()) return;
  calibration_->saw(seen.marks_found, seen.marks, seen.marks_at);
  guard(
      "calibration",
      [&] {
        for (const SeenRow& row : seen.rows) calibration_->add(row, seen.names);
      },
      [this] { calibration_->back(); });
  if (seen.jpeg.empty() || now_s() - picture_sent_s_ < kPreviewEvery_s) return;
  picture_sent_s_ = now_s();
  server_->send_all(picture_message(picture_sent_s_, seen.jpeg));
}

// What a step needs is there as soon as it begins. The twin's wearer does what the page says.
void Live::entered_step() {
  const Step step = calibration_->step();
  if (!calibration_->wants_pictures()) camera_.reset();
  if (step == Step::reference) {
    open_camera();
    play("ordinary");
  }
  if (step == Step::motion) {
    const CalibrationSetup& setup = calibration_->setup();
    if (setup.reference == Reference::drawn) {  // what it saw so far is another each time
      camera_.reset();
      drawn_s_ = INFINITY;
    }
    if (!camera_) open_camera();
    const bool poses = setup.reference == Reference::poses;
    play(poses ? "held" : "protocol", setup.reference == Reference::drawn ? kTwinPace : 1);
    if (options_.worn && !poses) calibration_->end_after(kTwinMoves_s);
  }
  if (step == Step::identify) {
    camera_.reset();
    play("ordinary");
    if (calibration_->glove_hz() > 0) calibration_->set_rate(model_rate_hz(calibration_->glove_hz()));
  }
  keep_calibration();
  if (step == Step::identify) identify();
}

void Live::calibrate_next(io::JsonReader&) {
  if (calibration_->step() == Step::send) return calibration_.reset();
  if (calibration_->step() == Step::motion) refuse("job_runs");
  if (calibration_->step() == Step::glove) refuse("no_readings");
  calibration_->next(fingers_.has_value() && glove_->state() != DeviceState::gone);
  entered_step();
}

void Live::calibrate_back(io::JsonReader&) {
  if (calibration_->step() == Step::identify) refuse("job_runs");
  calibration_->back();
  entered_step();
}

// What was recorded stays in its session; without anything it goes.
void Live::calibrate_cancel(io::JsonReader&) {
  Session session = calibration_->session();
  if (jobs_.is_running("identify")) jobs_.cancel();
  camera_.reset();
  calibration_.reset();
  play("ordinary");
  listed_s_ = -1e9;
  session.calibration = nullptr;
  if (session.seconds == 0 && !std::filesystem::exists(sessions_.folder(session) / "log.csv"))
    return sessions_.remove(session);
  sessions_.save(session);
}

void Live::identify() {
  const double lead_s = options_.worn ? options_.worn->facts.lead_s : options_.lead_s;
  const Json pose_angles = options_.worn ? options_.worn->pose_angles() : Json::array();
  start("identify", calibration_->identify_request(lead_s, pose_angles), [this](const JobResult& result) {
    if (!calibration_ || calibration_->step() != Step::identify) return;
    if (!result.ok) return calibration_->failed(result.text);
    calibration_->identified(result.json, result.warnings());
  });
}

void Live::calibrate_accept(io::JsonReader&) {
  if (calibration_->step() != Step::result) throw Refusal("nothing_to_accept");
  Session session = calibration_->session();
  wear_model(session, calibration_->model());
  sessions_.accept(session, calibration_->model().filename().string());
  calibration_->session() = session;
  calibration_->accepted();
  listed_s_ = -1e9;
}

// Ten seconds of opening and closing.
void Live::anew_start(io::JsonReader&) {
  const Session session = new_session("anew");
  anew_.emplace(Anew{SessionRecording(session, sessions_.folder(session))});
  play("bends", kTwinPace);
}

void Live::finish_anew() {
  if (!model_) throw Refusal("no_model");
  Session& session = anew_->recording.session;
  anew_->is_over = true;
  session.seconds = anew_->worn_s;
  anew_->recording.flush();
  sessions_.save(session);
  play("ordinary");
  const std::filesystem::path folder = sessions_.folder(session);
  start("recalibrate",
        {{"model", model_->path.string()},
         {"recording", anew_->recording.log_file().string()},
         {"out", (folder / "model.json").string()}},
        [this, old = *model_](const JobResult& result) {
          if (!result.ok) anew_.reset();
          if (anew_) anew_->result = anew_result(old, result.json);
        });
}

void Live::anew_accept(io::JsonReader&) {
  if (!anew_ || !anew_->result) throw Refusal("nothing_to_accept");
  if (anew_->result->applied) {
    Session session = anew_->recording.session;
    wear_model(session, sessions_.folder(session) / "model.json");
    sessions_.accept(session, "model.json");
  }
  anew_.reset();
  listed_s_ = -1e9;
}

void Live::anew_keep(io::JsonReader&) {
  if (!anew_) throw Refusal("no_anew");
  if (jobs_.is_running("recalibrate")) jobs_.cancel();
  anew_.reset();
  play("ordinary");
}

}  // namespace flexor::live
