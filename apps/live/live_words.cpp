#include <algorithm>
#include <cmath>

#include "apps/live/live.hpp"
#include "host/io/beneath.hpp"

namespace flexor::live {
namespace {

constexpr double kOtherClock_s = 5;  // off by more is another page

bool is_on(io::JsonReader& parts) {
  const nlohmann::ordered_json& on = parts.member("on");
  if (!on.is_boolean()) parts.fail("\"on\" must be true or false");
  return on.get<bool>();
}

}  // namespace

// What a page may ask for, and what has to hold first.
const std::map<std::string, Live::Word>& Live::words() {
  static const std::map<std::string, Word> all = {
      {"device.connect", {&Live::device_connect, {"job_runs", "recording_runs"}}},
      {"device.leave", {&Live::device_leave, {"job_runs", "calibration_is_open", "recording_runs"}}},
      {"columns.name", {&Live::columns_name, {"recording_runs", "calibration_is_open"}}},
      {"model.choose", {&Live::model_choose, {}}},
      {"record.start", {&Live::record_start, {"recording_runs", "no_glove"}}},
      {"record.stop", {[](Live& live, io::JsonReader&) { live.stop_recording(); }, {"no_recording"}}},
      {"marker", {&Live::marker, {"no_recording"}}},
      {"tracking.set", {&Live::tracking_set, {}}},
      {"twin.set", {&Live::twin_set, {"no_twin"}}},
      {"score.run", {&Live::score_run, {"no_twin", "recording_runs", "job_runs"}}},
      {"experiment.run", {&Live::experiment_run, {"job_runs"}}},
      {"replay.open", {&Live::replay_open, {"job_runs", "calibration_is_open", "recording_runs"}}},
      {"replay.seek", {&Live::replay_seek, {"no_replay"}}},
      {"replay.play",
       {[](Live& live, auto& parts) { live.glove_->replay()->pause(!is_on(parts)); }, {"no_replay"}}},
      {"job.cancel", {[](Live& live, io::JsonReader&) { live.jobs_.cancel(); }, {}}},
      {"send", {&Live::send, {"no_model"}}},
      {"flash", {&Live::flash, {}}},
      {"angles", {&Live::angles, {}}},
      {"calibrate.start",
       {&Live::calibrate_start, {"calibration_is_open", "job_runs", "no_readings", "anew_waits"}}},
      {"calibrate.next", {&Live::calibrate_next, {"no_calibration"}}},
      {"calibrate.back", {&Live::calibrate_back, {"no_calibration"}}},
      {"calibrate.repeat",
       {[](Live& live, io::JsonReader&) {
          live.calibration_->repeat();
          live.entered_step();
        },
        {"job_runs", "no_calibration"}}},
      {"calibrate.cancel", {&Live::calibrate_cancel, {"no_calibration"}}},
      {"calibrate.accept", {&Live::calibrate_accept, {"no_calibration"}}},
      {"calibrate.plot",
       {[](Live& live, auto& parts) { live.calibration_->plot(parts.text("finger")); }, {"no_calibration"}}},
      {"anew.start",
       {&Live::anew_start, {"job_runs", "calibration_is_open", "no_model", "no_glove", "anew_waits"}}},
      {"anew.accept", {&Live::anew_accept, {}}},
      {"anew.keep", {&Live::anew_keep, {}}},
  };
  return all;
}

void Live::refuse(std::string_view refusal) {
  if (refusal == "job_runs") {
    jobs_.require_none();
    refusal = "anew_runs";
  }
  // A calibration that only waits for its model to be sent is over.
  if (refusal == "calibration_is_open" && calibration_ && calibration_->step() == Step::send)
    calibration_.reset();
  const std::map<std::string_view, bool> is_due = {
      {"anew_runs", anew_ && !anew_->is_over},
      {"anew_waits", anew_.has_value()},
      {"calibration_is_open", calibration_.has_value()},
      {"no_calibration", !calibration_},
      {"no_glove", !fingers_ || glove_->replay()},
      {"no_model", !model_},
      {"no_readings", glove_->source() && glove_->source()->is_compensated()},  // to which models are fitted
      {"no_recording", !recording_},
      {"no_replay", !glove_->replay()},
      {"no_twin", !options_.worn},
      {"recording_runs", recording_.has_value()}};
  if (is_due.at(refusal)) throw Refusal(refusal.data());
  if (refusal == "no_model" && !misfit_.empty()) throw Refusal("model_misfit", {{"why", misfit_}});
}

// Every message but one that says so is answered, whatever it holds.
void Live::hear(Client client, std::string_view text) {
  bool answers = true;
  Json answer = {{"id", nullptr}, {"ok", true}};
  try {
    const Json message = io::parse_json(std::string(text), "message");
    io::JsonReader parts(message, "message");
    if (parts.has("id")) answer["id"] = parts.member("id");
    const std::string word = parts.text("do");
    answers = word != "angles";
    const auto found = words().find(word);
    if (found == words().end()) throw io::InputError("\"{}\" is no word that is known", word);
    for (const std::string_view refusal : found->second.refusals) refuse(refusal);
    found->second.act(*this, parts);
  } catch (const std::exception& caught) {
    answer.update({{"ok", false}, {"error", io::one_line(caught.what())}});
    if (const auto* refusal = dynamic_cast<const Refusal*>(&caught)) answer.update(refusal->parts);
  }
  if (answers) send_state();  // first: whoever waits for the answer has the state that it led to
  if (answers || !answer["ok"].get<bool>()) server_->send(client, io::dump_line(answer));
}

// On the server's clock, from the page's, which begins anew when the page is opened anew.
double Live::camera_time_s(double page_s) {
  const double offset_s = now_s() - page_s;
  if (!camera_offset_s_ || std::abs(offset_s - *camera_offset_s_) > kOtherClock_s)
    camera_offset_s_ = offset_s;
  return page_s + *camera_offset_s_;
}

void Live::hear(std::span<const std::uint8_t> bytes) {
  const std::optional<PictureIn> picture = picture_of(bytes);
  const bool wanted = camera_ && calibration_ && calibration_->wants_pictures() &&
                      calibration_->setup().reference == Reference::marks;
  if (!picture || !wanted || picture->t_s == newest_picture_s_) return;
  newest_picture_s_ = picture->t_s;
  camera_->take(camera_time_s(picture->t_s), std::string(picture->jpeg));
}

void Live::device_connect(io::JsonReader& parts) {
  const std::string port = parts.text("port");
  if (!calibration_ || calibration_->step() != Step::glove) refuse("calibration_is_open");
  if (!options_.worn) return glove_->connect(port);
  if (port != options_.worn->facts.port && port != "auto") throw Refusal("twin_wears");
  attach_worn();
}

void Live::device_leave(io::JsonReader&) {
  if (options_.worn && glove_->replay()) return attach_worn();
  glove_->leave();
}

// Inside the sessions' folder, whatever the text holds.
std::filesystem::path Live::file_of(const std::string& relative, std::uint64_t most_bytes) const {
  (void)io::FileBeneath(sessions_.root(), relative, most_bytes);
  return sessions_.root() / relative;
}

Live::ChosenModel Live::load_model(const Session& session, const std::filesystem::path& path) const {
  if (session.name.empty()) return {model::load(path), path, {}};
  const std::string name = session.name + "/" + path.filename().string();
  const std::string text = io::FileBeneath(sessions_.root(), name, kMostModelBytes).all();
  return {model::from_json(text, path.string()), path, session};
}

// Of who wears the model, where one is worn.
Session Live::new_session(const char* what) {
  const Session of = model_ ? model_->session : Session();
  return sessions_.create(of.person, of.side, glove_id(), what);
}

void Live::wear_model(const Session& session, const std::filesystem::path& path) {
  const std::optional<ChosenModel> before = std::exchange(model_, load_model(session, path));
  try {
    wear();
  } catch (...) {
    model_ = before;
    if (model_ && misfit_.empty()) wear();
    throw;
  }
  misfit_.clear();
}

// Of a glove without names: a finger, or as it is. Kept for this glove.
void Live::columns_name(io::JsonReader& parts) {
  if (!fingers_) throw Refusal("no_glove");
  std::vector<std::string> names;
  for (const Json& name : parts.member("names"))
    names.push_back(name.is_string() ? name.get<std::string>() : "?");
  std::vector<std::string> columns = glove_->source()->columns();
  if (names.size() != columns.size())
    throw io::InputError("\"names\" has not one for each of {} columns", columns.size());
  columns_ = columns;
  const std::string glove = glove_id();
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (names[c].empty()) continue;
    if (std::ranges::find(model::finger_names(), names[c]) == model::finger_names().end())
      throw io::InputError("\"names\" has one that is no finger");
    if (std::ranges::count(names, names[c]) > 1) throw Refusal("finger_twice", {{"finger", names[c]}});
    columns[c] = names[c];
  }
  sessions_.name_columns(glove, columns);
  learn_columns();
  rows_.reset();
}

void Live::model_choose(io::JsonReader& parts) {
  const Json& path = parts.member("path");
  if (path.is_null()) {
    model_.reset();
    hand_.reset();
    misfit_.clear();
    if (fingers_) fingers_->take_off();
    model_is_chosen_ = true;
    return rows_.reset();
  }
  const std::string name = parts.text("path");
  const bool is_of_options = !name.empty() && name == std::filesystem::path(options_.model).filename();
  const std::filesystem::path file =
      is_of_options ? std::filesystem::path(options_.model) : file_of(name, kMostModelBytes);
  Session of;
  for (const Session& session : sessions_.list()) {
    if (name.starts_with(session.name + "/")) of = session;
  }
  wear_model(of, file);
  model_is_chosen_ = true;
}

void Live::record_start(io::JsonReader&) {
  const Session session = new_session("recording");
  recording_.emplace(session, sessions_.folder(session));
}

void Live::stop_recording() {
  SessionRecording recording = std::move(*recording_);
  recording_.reset();
  recording.session.seconds = recording.seconds();
  sessions_.save(recording.session);  // before what may find no room
  recording.flush();
  const std::string why = misfit();
  ended("record", why.empty() && !recording.is_silent(now_s()),
        recording.in_words(now_s()) + (why.empty() ? "" : ". " + why));
}

void Live::marker(io::JsonReader& parts) {
  const std::string text = parts.text("text");
  recording_->mark(now_s(), text);
  server_->send_all(io::dump_line(recording_->markers().back()));
}

void Live::tracking_set(io::JsonReader& parts) {
  const bool on = is_on(parts);
  if (on) refuse("no_model");
  if (on && !can_be_tracked(*model_)) throw Refusal(kNotTracked);
  tracked_ = on;
  if (model_) wear();
}

void Live::play(const std::string& motion, double pace) {
  if (options_.worn) options_.worn->play(motion, pace);
}

void Live::twin_set(io::JsonReader& parts) {
  WornChange change = worn_change_;
  const auto set = [&](const char* key, double& value, double low, double high) {
    if (parts.has(key)) value = parts.number_within(key, low, high);
  };
  set("slip_deg", change.slip_deg, -30, 30);
  set("drift_deg_per_min", change.drift_deg_per_min, -30, 30);
  set("noise_counts", change.noise_counts, 0, 50);
  set("loss", change.loss, 0, 1);
  options_.worn->set(worn_change_ = change);
}

void Live::replay_open(io::JsonReader& parts) {
  const std::string name = parts.text("session") + "/" + parts.text("file");
  const std::filesystem::path file = file_of(name, kMostLogBytes);
  play_again(file, name);
}

void Live::play_again(const std::filesystem::path& file, const std::string& name) {
  glove_->play(std::make_shared<listen::ReplaySource>(file));
  replayed_ = name;
}

void Live::replay_seek(io::JsonReader& parts) {
  glove_->replay()->seek(parts.number_within("t_s", 0, 1e7));
  if (fingers_ && fingers_->is_worn()) fingers_->wear(*model_, tracked_);  // its past is another now
}

// What a markerless tracker in the page saw; without angles: no hand.
void Live::angles(io::JsonReader& parts) {
  if (!calibration_ || calibration_->setup().reference != Reference::markerless ||
      !calibration_->wants_pictures())
    throw Refusal("no_angles_wanted");
  const double page_s = parts.number_within("t_s", -1e9, 1e9);
  const Json seen = parts.object_or_empty("angles");
  std::vector<std::string> names;
  SeenRow row;
  row.t_s = camera_time_s(page_s);
  for (const auto& [name, value] : seen.items()) {
    if (!value.is_number() || names.size() > 30)
      throw io::InputError("\"angles\" must be numbers, of thirty joints at most");
    names.push_back(model::joint_name(name) + "_deg");
    row.deg.push_back(value.get<double>());
  }
  if (markerless_names_.empty()) markerless_names_ = names;
  calibration_->saw(names == markerless_names_ && !names.empty() ? 1 : 0, 1);
  if (names == markerless_names_ && !names.empty()) calibration_->add(row, names);
}

}  // namespace flexor::live
