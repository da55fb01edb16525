#include "apps/live/calibration_session.hpp"

#include <cmath>

namespace flexor::live {
namespace {

constexpr double kOtherClock_s = 5;  // off by more is another page
constexpr double kPreviewEvery_s = 0.2;
constexpr double kDrawEvery_s = 1.0 / 15;
constexpr double kTwinMoves_s = 62;   // two of rest, and half the motion
constexpr double kTwinPace = 3;       // who watches a demo has seen it soon
constexpr double kCameraLives_s = 3;  // one that ended sooner is not opened again by itself

}  // namespace

CalibrationSession::CalibrationSession(Context& context, GlovePort& glove, Worn& worn, JobRunner& jobs)
    : context_(context), glove_(glove), worn_(worn), jobs_(jobs) {
  const auto send = [this](io::JsonReader&) {
    jobs_.send([this] {
      if (calibration_) calibration_->sent();
    });
  };
  const auto repeat = [this](io::JsonReader&) {
    calibration_->repeat();
    enter_step();
  };
  const auto plot = [this](io::JsonReader& parts) { calibration_->plot(parts.text("finger")); };
  const auto does = [this](void (CalibrationSession::*act)()) {
    return Word{{"no_calibration"}, [this, act](io::JsonReader&) { (this->*act)(); }};
  };
  context_.words.add(
      {{"calibrate.start",
        {{"calibration_is_open", "job_runs", "no_readings", "anew_waits"},
         [this](io::JsonReader& parts) { start(parts); }}},
       {"calibrate.next", does(&CalibrationSession::next)},
       {"calibrate.back", does(&CalibrationSession::back)},
       {"calibrate.repeat", {{"job_runs", "no_calibration"}, repeat}},
       {"calibrate.cancel", does(&CalibrationSession::cancel)},
       {"calibrate.accept", does(&CalibrationSession::accept)},
       {"calibrate.plot", {{"no_calibration"}, plot}},
       {"send", {{"no_model"}, send}},
       {"angles", {{}, [this](io::JsonReader& parts) { see_angles(parts); }, true}}},
      {{"no_calibration", [this] { return !calibration_; }},
       {"motion_runs", [this] { return calibration_ && calibration_->step() == Step::motion; }},
       // One that only waits for its model to be sent is over.
       {"calibration_is_open",
        [this] {
          if (calibration_ && calibration_->step() == Step::send) calibration_.reset();
          return calibration_.has_value();
        }},
       {"calibration_has_glove", [this] {
          if (calibration_ && calibration_->step() != Step::glove)
            context_.words.refuse("calibration_is_open");
          return false;
        }}});
}

void CalibrationSession::start(io::JsonReader& parts) {
  if (glove_.replay()) throw Refusal("replay_is_open");
  CalibrationSetup setup;
  const std::string person = parts.text("person");
  const std::string side = parts.text("side");
  if (side != "left" && side != "right") parts.fail("\"side\" must be left or right");
  setup.reference = reference_of(parts.text("reference"));
  if (setup.reference == Reference::drawn) context_.words.refuse("no_twin");
  if (setup.reference == Reference::marks || setup.reference == Reference::drawn) {
    setup.joints = setup.reference == Reference::drawn ? "paper_hand" : parts.text_or_empty("joints");
    if (setup.joints.empty()) setup.joints = context_.options.worn ? "paper_hand" : "green_markers";
    require_carried(setup.joints);
  }
  const Session session = worn_.new_session("calibration", person, side);
  calibration_.emplace(setup, session, context_.sessions.folder(session));
  held_ = context_.sessions.hold(session);
  markerless_angles_.clear();
  pictures_.offset_s.reset();
  keep();
  if (worn_.is_connected()) next();  // a glove that is connected needs no step of its own
  context_.listed_s = -1e9;
}

// After the program was killed, or the machine was, it goes on with the same step. Where the disk is full it goes on
// without that.
void CalibrationSession::keep() {
  context_.guard("calibration", [this] {
    calibration_->session().calibration = calibration_->kept();
    context_.sessions.save(calibration_->session());
  });
}

void CalibrationSession::resume() {
  for (const Session& session : context_.sessions.list()) {
    if (session.calibration.is_null()) continue;
    held_ = context_.sessions.hold(session);
    if (!held_) continue;  // another program's
    const auto go_on = [&] {
      calibration_.emplace(Calibration::resumed(session, context_.sessions.folder(session)));
      enter_step();
    };
    context_.guard("calibration", go_on, [this] { calibration_.reset(); });
    if (calibration_) return;
  }
}

void CalibrationSession::open_camera() {
  const CalibrationSetup& setup = calibration_->setup();
  if (setup.joints.empty()) return;
  pictures_.opened_s = context_.wall_s();
  const auto on_server = [this](auto act) {
    return [this, act](auto what) { context_.post("camera", [act, what = std::move(what)] { act(what); }); };
  };
  camera_ = std::make_unique<CameraFeed>(
      setup.joints, context_.options.worn != nullptr,
      on_server([this](const PictureSeen& seen) { see(seen); }),
      on_server([this](const std::string& why) { context_.ended("camera", false, why); }),
      on_server([this, number = ++pictures_.number](const std::string& why) {
        if (number != pictures_.number) return;
        context_.ended("camera", false, why);
        camera_.reset();
        if (!calibration_ || !calibration_->wants_pictures()) return;
        calibration_->saw_no_camera();
        if (context_.wall_s() - pictures_.opened_s > kCameraLives_s) open_camera();
      }));
}

void CalibrationSession::see(const PictureSeen& seen) {
  if (!calibration_ || !calibration_->wants_pictures()) return;
  calibration_->saw(seen.marks_found, seen.marks, seen.marks_at);
  const auto add = [&] {
    for (const SeenRow& row : seen.rows) calibration_->add(row, seen.names);
  };
  context_.guard("calibration", add, [this] { calibration_->back(); });
  if (seen.jpeg.empty() || context_.now_s() - pictures_.sent_s < kPreviewEvery_s) return;
  pictures_.sent_s = context_.now_s();
  context_.server.send_all(picture_message(pictures_.sent_s, seen.jpeg));
}

// From the page's clock, which starts again when the page is opened again.
double CalibrationSession::on_server_s(double page_s) {
  std::optional<double>& offset_s = pictures_.offset_s;
  const double now_offset_s = context_.now_s() - page_s;
  if (!offset_s || std::abs(now_offset_s - *offset_s) > kOtherClock_s) offset_s = now_offset_s;
  return page_s + *offset_s;
}

void CalibrationSession::take_picture(std::span<const std::uint8_t> message) {
  const std::optional<PictureIn> picture = picture_of(message);
  const bool wanted = camera_ && calibration_ && calibration_->wants_pictures() &&
                      calibration_->setup().reference == Reference::marks;
  if (!picture || !wanted || picture->t_s == pictures_.newest_s) return;
  pictures_.newest_s = picture->t_s;
  camera_->take(on_server_s(picture->t_s), std::string(picture->jpeg));
}

// What a markerless tracker in the page saw; without angles: no hand.
void CalibrationSession::see_angles(io::JsonReader& parts) {
  if (!calibration_ || calibration_->setup().reference != Reference::markerless ||
      !calibration_->wants_pictures())
    throw Refusal("no_angles_wanted");
  const double page_s = parts.number_within("t_s", -1e9, 1e9);
  const Json seen = parts.object_or_empty("angles");
  std::vector<std::string> names;
  SeenRow row;
  row.t_s = on_server_s(page_s);
  for (const auto& [name, value] : seen.items()) {
    if (!value.is_number() || names.size() > 30)
      throw io::InputError("\"angles\" must be numbers, of thirty joints at most");
    names.push_back(model::joint_name(name) + "_deg");
    row.deg.push_back(value.get<double>());
  }
  if (markerless_angles_.empty()) markerless_angles_ = names;
  const bool has_hand = !names.empty() && names == markerless_angles_;
  calibration_->saw(has_hand ? 1 : 0, 1);
  if (has_hand) calibration_->add(row, names);
}

void CalibrationSession::take(const listen::Sample& sample) {
  if (!calibration_ || !context_.has_begun()) return;
  draw();
  const auto add = [&] {
    listen::Sample taken = sample;
    if (is_drawn()) taken.host_s = since_begun_s(sample.host_s);
    calibration_->add(taken, worn_.columns());
  };
  context_.guard("calibration", add, [this] { calibration_->back(); });
}

// On the motion's own clock, to the microsecond: the same in each calibration.
double CalibrationSession::since_begun_s(double host_s) const {
  return std::round((host_s - *context_.options.worn->begun_s()) * 1e6) / 1e6;
}

// Pictures of the twin's hand, at times that do not depend on how quick the machine is.
void CalibrationSession::draw() {
  if (!is_drawn() || !camera_ || !calibration_->wants_pictures()) return;
  const double now = since_begun_s(context_.now_s());
  if (now >= pictures_.drawn_s && now - pictures_.drawn_s < kDrawEvery_s) return;
  pictures_.drawn_s = now;
  camera_->draw(now, context_.options.worn->now().finger_deg);
}

bool CalibrationSession::waits_for_camera() const {
  const auto& worn = context_.options.worn;
  return worn && !worn->facts.has_boards && camera_ && camera_->is_busy();
}

// What a step needs is there as soon as it begins. The twin's wearer does what the page asks.
void CalibrationSession::enter_step() {
  const Step step = calibration_->step();
  const Reference reference = calibration_->setup().reference;
  if (!calibration_->wants_pictures()) camera_.reset();
  if (step == Step::reference) {
    open_camera();
    context_.play("ordinary");
  }
  if (step == Step::motion) {
    if (is_drawn()) {  // what it saw so far is another each time
      camera_.reset();
      pictures_.drawn_s = INFINITY;
    }
    if (!camera_) open_camera();
    const bool poses = reference == Reference::poses;
    context_.play(poses ? "held" : "protocol", is_drawn() ? kTwinPace : 1);
    if (context_.options.worn && !poses) calibration_->end_after(kTwinMoves_s);
  }
  if (step == Step::identify) {
    context_.play("ordinary");
    const double glove_hz = calibration_->glove_hz();
    if (glove_hz > 0) calibration_->set_rate(context_.model_rate_hz(glove_hz));
  }
  keep();
  if (step == Step::identify) identify();
}

void CalibrationSession::next() {
  if (calibration_->step() == Step::send) return calibration_.reset();
  if (calibration_->step() == Step::motion) context_.words.refuse("job_runs");
  if (calibration_->step() == Step::glove) context_.words.refuse("no_readings");
  calibration_->next(worn_.is_connected());
  enter_step();
}

void CalibrationSession::back() {
  if (calibration_->step() == Step::identify) context_.words.refuse("job_runs");
  calibration_->back();
  enter_step();
}

// What was recorded stays in its session; without anything it goes.
void CalibrationSession::cancel() {
  Session session = calibration_->session();
  if (jobs_.is_running("identify")) jobs_.cancel();
  camera_.reset();
  calibration_.reset();
  context_.play("ordinary");
  context_.listed_s = -1e9;
  session.calibration = nullptr;
  if (session.seconds == 0 && !std::filesystem::exists(context_.sessions.folder(session) / "log.csv"))
    return context_.sessions.remove(session);
  context_.sessions.save(session);
}

void CalibrationSession::identify() {
  const LiveOptions& options = context_.options;
  const double lead_s = options.worn ? options.worn->facts.lead_s : options.lead_s;
  const Json pose_angles = options.worn ? options.worn->pose_angles() : Json::array();
  jobs_.start("identify", calibration_->identify_request(lead_s, pose_angles),
              [this](const JobResult& result) {
                if (!calibration_ || calibration_->step() != Step::identify) return;
                if (!result.ok) return calibration_->failed(result.text);
                calibration_->identified(result.json, result.warnings());
              });
}

void CalibrationSession::accept() {
  if (calibration_->step() != Step::result) throw Refusal("nothing_to_accept");
  Session session = calibration_->session();
  worn_.wear(session, calibration_->model());
  context_.sessions.accept(session, calibration_->model().filename().string());
  calibration_->session() = session;
  calibration_->accepted();
  context_.listed_s = -1e9;
}

}  // namespace flexor::live
