#include "apps/live/recorder.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "host/recording/csv.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kLongestMarker = 200;
constexpr std::size_t kMostMarkers = 500;  // who opens the page gets them all
constexpr double kRedonning_s = 10;        // of a glove that was put on again
constexpr double kGlovePause_s = 0.5;      // of the glove: what is longer is not worn
constexpr double kPace = 3;                // of a twin: who watches a demo has seen it soon

// Lines on a sensor begin with its name.
std::string verdict_on(const std::string& sensor, const Json& report) {
  const Json& of = report.at("sensors").at(sensor);
  if (of.at("applied").get<bool>()) return "fitted";
  const Json& line = of.at("kept");
  std::string why = line.get<std::string>();
  if (why.starts_with(sensor + ": ")) why.erase(0, sensor.size() + 2);
  const auto is_among = [&](const char* lines) {
    return std::ranges::find(report.at(lines), line) != report.at(lines).end();
  };
  return (is_among("misfits") ? "does not fit: " : is_among("wanted") ? "wanted: " : "kept: ") + why;
}

std::string verdict_on(const std::vector<std::string>& sensors, const Json& report) {
  if (sensors.size() == 1) return verdict_on(sensors.front(), report);
  std::string out;
  for (const std::string& sensor : sensors)
    out += (out.empty() ? "" : "; ") + sensor + " " + verdict_on(sensor, report);
  return out;
}

}  // namespace

void SessionRecording::add(const listen::Sample& sample, const std::vector<std::string>& columns) {
  if (!log_) {
    log_ = std::make_unique<listen::Log>(log_file(), columns);
    columns_ = columns;
    begun_s_ = sample.host_s;
  }
  if (columns != columns_) throw io::JobError("another_glove");
  log_->add(sample);
  newest_s_ = sample.host_s;
}

void SessionRecording::add_hand(const listen::Sample& sample, const std::vector<std::string>& columns) {
  if (!hand_) hand_ = std::make_unique<listen::Log>(folder_ / "hand.csv", columns);
  hand_->add(sample);
}

void SessionRecording::mark(double host_s, const std::string& text) {
  if (text.size() > kLongestMarker) throw io::InputError("a marker has at most {} letters", kLongestMarker);
  if (markers_.size() >= kMostMarkers)
    throw io::InputError("a recording has at most {} markers", kMostMarkers);
  if (!marks_) {
    marks_ = std::make_unique<io::GrowingFile>(folder_ / "markers.csv");
    marks_->append("host_s,text\n");
  }
  marks_->append(fmt::format("{:.6f},{}\n", host_s, recording::quoted(io::one_line(text))));
  markers_.push_back({{"event", "marker"}, {"host_s", host_s}, {"text", text}});
}

bool SessionRecording::is_silent(double now_s) const {
  constexpr double kSilent_s = 1;
  return rows() > 0 && now_s - newest_s_ > kSilent_s;
}

std::string SessionRecording::in_words(double now_s) const {
  std::string out = fmt::format("{} rows in {}", rows(), log_file().string());
  if (left_out_ > 0)
    out += fmt::format("; {} rows that came were malformed or did not fit, and are left out", left_out_);
  if (is_silent(now_s)) out += fmt::format("; nothing was recorded in the last {:.0f} s", now_s - newest_s_);
  return out;
}

void SessionRecording::flush() {
  if (log_) log_->flush();
  if (hand_) hand_->flush();
}

void SessionRecording::flush_if_due(double host_s) {
  if (log_) log_->flush_if_due(host_s);
  if (hand_) hand_->flush_if_due(host_s);
}

RedonningResult result_of(const model::Model& old, const Json& report) {
  RedonningResult out;
  out.applied = report.at("applied").get<bool>();
  out.wanted = fmt::format("{}", fmt::join(report.at("wanted").get<std::vector<std::string>>(), "; "));
  out.misfits = fmt::format("{}", fmt::join(report.at("misfits").get<std::vector<std::string>>(), "; "));
  const model::Graph graph(old);
  for (std::size_t j = 0; j < old.joints.size(); ++j) {
    const std::string& joint = old.joints[j].name;
    std::vector<std::string> sensors;
    for (const std::size_t i : graph.inputs[graph.joint[j]]) sensors.push_back(old.inputs[i].name);
    const bool is_kept = std::ranges::none_of(sensors, [&](const std::string& sensor) {
      return report.at("sensors").at(sensor).at("applied").get<bool>();
    });
    const Json before = is_kept ? Json(nullptr) : report.at("change_rms_deg").at(joint);  // not 0: not known
    const Json& after = report.at("se_deg").at(joint);
    if (after.is_number() && before > after) out.is_off = true;  // null is the least
    out.fingers.push_back({{"name", joint},
                           {"before_deg", before},
                           {"after_deg", after},
                           {"verdict", verdict_on(sensors, report)}});
  }
  return out;
}

RedonningStep after(RedonningStep step, RedonningEvent event) {
  using enum RedonningStep;
  switch (event) {
    case RedonningEvent::starts:
      return step == none ? motion : step;
    case RedonningEvent::moved:
      return step == motion ? fits : step;
    case RedonningEvent::fitted:
      return step == fits ? answer : step;
    case RedonningEvent::ends:
      return none;
  }
  return step;
}

Recorder::Recorder(Context& context, Worn& worn, GlovePort& glove, JobRunner& jobs)
    : context_(context), worn_(worn), glove_(glove), jobs_(jobs) {
  const auto start = [this](io::JsonReader&) {
    const Session session = worn_.new_session("recording");
    recording_.emplace(session, context_.sessions.folder(session));
  };
  const auto mark = [this](io::JsonReader& parts) {
    recording_->mark(context_.now_s(), parts.text("text"));
    context_.server.send_all(io::dump_line(recording_->markers().back()));
  };
  const auto accept = [this](io::JsonReader&) {
    if (redonning_.step != RedonningStep::answer) throw Refusal("nothing_to_accept");
    end_redonning(true);
  };
  const auto keep = [this](io::JsonReader&) {
    if (redonning_.step == RedonningStep::none) throw Refusal("no_anew");
    if (jobs_.is_running("recalibrate")) jobs_.cancel();
    end_redonning(false);
    context_.play("ordinary");
  };
  context_.words.add({{"record.start", {{"recording_runs", "no_glove"}, start}},
                      {"record.stop", {{"no_recording"}, [this](io::JsonReader&) { stop(); }}},
                      {"marker", {{"no_recording"}, mark}},
                      {"anew.start",
                       {{"job_runs", "calibration_is_open", "no_model", "no_glove", "anew_waits"},
                        [this](io::JsonReader&) { start_redonning(); }}},
                      {"anew.accept", {{}, accept}},
                      {"anew.keep", {{}, keep}}},
                     {{"recording_runs", [this] { return recording_.has_value(); }},
                      {"no_recording", [this] { return !recording_; }},
                      {"anew_runs", [this] { return redonning_.step == RedonningStep::motion; }},
                      {"anew_waits", [this] { return redonning_.step != RedonningStep::none; }}});
}

// A disk that is full ends what wrote to it, and nothing else; what came before is kept.
void Recorder::guard(const std::function<void()>& work) {
  if (recording_) context_.guard("record", work, [this] { context_.guard("record", [this] { stop(); }); });
}

void Recorder::end() {
  if (recording_) stop();
}

void Recorder::take(const listen::Sample& sample) {
  guard([&] { recording_->add(sample, worn_.columns()); });
  const auto add = [&] {
    const double before_s = redonning_.recording->seconds();
    redonning_.recording->add(sample, worn_.columns());
    redonning_.worn_s += std::min(redonning_.recording->seconds() - before_s, kGlovePause_s);
    if (redonning_.worn_s >= kRedonning_s) fit_redonning();
  };
  if (redonning_.step == RedonningStep::motion && context_.has_begun())
    context_.guard("put on again", add, [this] { end_redonning(false); });
}

void Recorder::take_hand(const std::vector<listen::Sample>& samples,
                         const std::vector<std::string>& columns) {
  guard([&] {
    for (const listen::Sample& sample : samples) recording_->add_hand(sample, columns);
  });
}

void Recorder::leave_out(std::uint64_t rows) {
  if (recording_) recording_->leave_out(rows);
}

void Recorder::tick() {
  guard([this] { recording_->flush_if_due(context_.now_s()); });
}

void Recorder::stop() {
  SessionRecording recording = std::move(*recording_);
  recording_.reset();
  recording.session.seconds = recording.seconds();
  context_.sessions.save(recording.session);  // before what may find no room
  recording.flush();
  const std::string why = glove_.misfit();
  const double now = context_.now_s();
  context_.ended("record", why.empty() && !recording.is_silent(now),
                 recording.in_words(now) + (why.empty() ? "" : ". " + why));
}

// Ten seconds of opening and closing.
void Recorder::start_redonning() {
  const Session session = worn_.new_session("anew");
  redonning_.recording.emplace(session, context_.sessions.folder(session));
  redonning_.step = after(redonning_.step, RedonningEvent::starts);
  context_.play("bends", kPace);
}

void Recorder::fit_redonning() {
  if (!worn_.model()) throw Refusal("no_model");
  Session& session = redonning_.recording->session;
  redonning_.step = after(redonning_.step, RedonningEvent::moved);
  session.seconds = redonning_.worn_s;
  redonning_.recording->flush();
  context_.sessions.save(session);
  context_.play("ordinary");
  jobs_.start("recalibrate",
              {{"model", worn_.model()->path.string()},
               {"recording", redonning_.recording->log_file().string()},
               {"out", (context_.sessions.folder(session) / "model.json").string()}},
              [this, old = *worn_.model()](const JobResult& result) {
                if (!result.ok) return end_redonning(false);
                if (redonning_.step == RedonningStep::fits) redonning_.result = result_of(old, result.json);
                redonning_.step = after(redonning_.step, RedonningEvent::fitted);
              });
}

void Recorder::end_redonning(bool is_accepted) {
  if (is_accepted && redonning_.result.applied) {
    Session& session = redonning_.recording->session;
    worn_.wear(session, context_.sessions.folder(session) / "model.json");
    context_.sessions.accept(session, "model.json");
  }
  redonning_ = {after(redonning_.step, RedonningEvent::ends)};
  context_.listed_s = -1e9;
}

void Recorder::write(Json& state) const {
  if (recording_)
    state["recording"] = {{"file", recording_->session.name + "/log.csv"},
                          {"rows", recording_->rows()},
                          {"seconds", recording_->seconds()}};
  if (redonning_.step != RedonningStep::none)
    state["anew"] = {
        {"seconds", redonning_.worn_s}, {"of_seconds", kRedonning_s}, {"fingers", redonning_.result.fingers}};
}

Json Recorder::next() const {
  if (redonning_.step == RedonningStep::none) return nullptr;
  if (redonning_.step == RedonningStep::motion) return {{"kind", "bend"}};
  if (redonning_.step == RedonningStep::fits) return {{"kind", "fits"}};
  const auto& [applied, is_off, fingers, wanted, misfits] = redonning_.result;
  const char* kind = !applied ? "keep" : !is_off ? "as_it_was" : "take";
  return {{"kind", kind}, {"why", applied ? "" : wanted}, {"misfits", misfits}};
}

}  // namespace flexor::live
