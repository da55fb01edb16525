#include "apps/live/worn.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/io/beneath.hpp"

namespace flexor::live {
namespace {

constexpr double kWindow_s = 2;
constexpr const char* kNotTracked = "not_tracked";

}  // namespace

void Stream::add(double host_s, const Fingers& fingers) {
  if (begun_s_ < 0) begun_s_ = host_s;
  if (rows_.is_full()) send();
  if (rows_.is_empty()) rows_ = Rows(Kind::samples, fingers.size());
  arrival_s_.push_back(host_s);
  rows_.add(host_s, fingers.raw(), fingers.angle_deg());
}

void Stream::send(double after_s) {
  const double now = context_->now_s();
  if (rows_.is_empty() || now - sent_s_ < after_s) return;
  context_->server.send_all(rows_.bytes());
  sent_s_ = now;
  latency_s_ += 0.05 * (sent_s_ - arrival_s_.back() - latency_s_);
  restart();
}

void Stream::forget_old() {
  const double from_s = context_->now_s() - kWindow_s;
  while (!arrival_s_.empty() && arrival_s_.front() < from_s) arrival_s_.pop_front();
}

double Stream::rate_hz() const {
  const double worn_s = std::min(kWindow_s, context_->now_s() - begun_s_);
  return arrival_s_.size() > 1 && worn_s > 0 ? static_cast<double>(arrival_s_.size()) / worn_s : 0;
}

Json Stream::state(const listen::Source* source) const {
  const std::size_t n = arrival_s_.size();
  double jitter_s = 0;
  if (n > 2) {
    const double step_s = (arrival_s_.back() - arrival_s_.front()) / static_cast<double>(n - 1);
    for (std::size_t i = 1; i < n; ++i) jitter_s += std::pow(arrival_s_[i] - arrival_s_[i - 1] - step_s, 2);
    jitter_s = std::sqrt(jitter_s / static_cast<double>(n - 1));
  }
  return {{"rate_hz", rate_hz()},
          {"torn", source ? source->tally().malformed : 0},
          {"lost", source ? Json(source->tally().lost) : Json(nullptr)},
          {"jitter_ms", 1000 * jitter_s},
          {"latency_ms", 1000 * latency_s_}};
}

Json model_state(const Session& session, const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  return {{"path", session.name.empty() ? file : session.name + "/" + file},
          {"name", !session.person.empty() ? session.person + ", " + session.side
                   : session.name.empty()  ? file
                                           : session.name},
          {"person", session.person},
          {"side", session.side}};
}

Worn::Worn(Context& context, GlovePort& glove)
    : stream(context),
      context_(context),
      glove_(glove),
      is_chosen_(!context.options.model.empty()),
      outs_(std::move(context.options.outs),
            [&context](const std::exception& error) { context.ended("out", false, error.what()); }) {
  const auto track = [this](io::JsonReader& parts) {
    const bool on = is_on(parts);
    if (on) context_.words.refuse("no_model");
    if (on && !can_be_tracked(*model_)) throw Refusal(kNotTracked);
    is_tracked_ = on;
    if (model_) put_on();
  };
  const auto seek = [this](io::JsonReader& parts) {
    glove_.replay()->seek(parts.number_within("t_s", 0, 1e7));
    if (fingers_ && fingers_->is_worn()) fingers_->wear(*model_, is_tracked_);  // its past is another now
  };
  context_.words.add({{"columns.name",
                       {{"recording_runs", "calibration_is_open"},
                        [this](io::JsonReader& parts) { name_columns(parts.member("names")); }}},
                      {"model.choose", {{}, [this](io::JsonReader& parts) { choose(parts); }}},
                      {"tracking.set", {{}, track}},
                      {"replay.seek", {{"no_replay"}, seek}}},
                     {{"no_glove", [this] { return !fingers_ || glove_.replay(); }},
                      {"no_model", [this] {
                         if (model_ && !misfit_.empty()) throw Refusal("model_misfit", {{"why", misfit_}});
                         return !model_;
                       }}});
}

void Worn::drop() {
  fingers_.reset();
  hand_.reset();
  columns_.clear();
  stream.drop();
}

// What the model needs is known once the first sample is there. A recording that is played again keeps the model that is worn.
void Worn::learn_columns() {
  columns_ = glove_.source()->columns();
  context_.guard("columns", [this] {
    const std::vector<std::string> names = context_.sessions.column_names(glove_.id(columns_));
    if (names.size() == columns_.size()) columns_ = names;
  });
  fingers_.emplace(columns_);
  context_.guard("model", [this] {
    if (!is_chosen_ && !glove_.replay()) {
      model_.reset();
      if (const std::optional<Session> known = context_.sessions.newest_with_model(glove_.id(columns_)))
        model_ = load(*known, context_.sessions.folder(*known) / *known->model);
    }
    misfit_.clear();
    try {
      if (model_) put_on();
    } catch (const io::InputError& error) {
      misfit_ = error.what();
      throw;
    }
  });
}

void Worn::put_on() {
  if (!fingers_) return;
  if (glove_.source()->is_compensated())
    throw io::InputError(
        "this glove sends angles that it has compensated itself: no model is worn over them");
  fingers_->wear(*model_, is_tracked_);
  stream.restart();
  outs_.wear(*model_);
  hand_.emplace(*model_);
}

void Worn::take(const listen::Sample& sample) {
  if (!fingers_) learn_columns();
  fingers_->add(sample);
  if (model_ && fingers_->is_worn()) {
    outs_.add(sample.host_s, fingers_->joints_deg());
    if (hand_) hand_->add(sample.host_s, fingers_->joints_deg());
  }
  stream.add(sample.host_s, *fingers_);
}

void Worn::tick() {
  stream.send();
  stream.forget_old();
  const auto look = [this] {
    const std::optional<WholeHand> hand = hand_ ? hand_->poll() : std::nullopt;
    if (!hand) return;
    Rows rows(Kind::posture, posture::kJoints);
    rows.add(hand->host_s, hand->se_deg, hand->angle_deg);
    context_.server.send_all(rows.bytes());
  };
  context_.guard("hand", look, [this] { hand_.reset(); });
}

ChosenModel Worn::load(const Session& session, const std::filesystem::path& path) const {
  if (session.name.empty()) return {model::load(path), path, {}};
  const std::string name = session.name + "/" + path.filename().string();
  const std::string text = io::FileBeneath(context_.sessions.root(), name, kMostModelBytes).all();
  return {model::from_json(text, path.string()), path, session};
}

Session Worn::new_session(const char* what, const std::string& person, const std::string& side) const {
  return context_.sessions.create(person, side, glove_.id(columns_), what);
}

Session Worn::new_session(const char* what) const {
  const Session of = model_ ? model_->session : Session();
  return new_session(what, of.person, of.side);
}

void Worn::wear(const Session& session, const std::filesystem::path& path) {
  const std::optional<ChosenModel> before = std::exchange(model_, load(session, path));
  try {
    put_on();
  } catch (...) {
    model_ = before;
    if (model_ && misfit_.empty()) put_on();
    throw;
  }
  misfit_.clear();
}

// Of a glove without names: a finger, or as it is. Kept for this glove.
void Worn::name_columns(const Json& given) {
  if (!fingers_) throw Refusal("no_glove");
  std::vector<std::string> columns = glove_.source()->columns();
  if (given.size() != columns.size())
    throw io::InputError("\"names\" has not one for each of {} columns", columns.size());
  std::vector<std::string> names;
  for (const Json& name : given) names.push_back(name.is_string() ? name.get<std::string>() : "?");
  const std::string glove = glove_.id(columns);
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (names[c].empty()) continue;
    if (std::ranges::find(model::finger_names(), names[c]) == model::finger_names().end())
      throw io::InputError("\"names\" has one that is no finger");
    if (std::ranges::count(names, names[c]) > 1) throw Refusal("finger_twice", {{"finger", names[c]}});
    columns[c] = names[c];
  }
  context_.sessions.name_columns(glove, columns);
  learn_columns();
  stream.restart();
}

void Worn::choose(io::JsonReader& parts) {
  if (parts.member("path").is_null()) {
    model_.reset();
    hand_.reset();
    misfit_.clear();
    if (fingers_) fingers_->take_off();
    stream.restart();
  } else {
    const std::string name = parts.text("path");
    const std::filesystem::path first = context_.options.model;
    const bool is_first = !name.empty() && name == first.filename();
    Session of;
    for (const Session& session : context_.sessions.list())
      if (name.starts_with(session.name + "/")) of = session;
    wear(of, is_first ? first : context_.sessions.file(name, kMostModelBytes));
  }
  is_chosen_ = true;
}

void Worn::write(Json& state) const {
  state["fingers"] = fingers_ ? Json(fingers_->view(context_.now_s())) : Json::array();
  state["link"] = stream.state(glove_.source());
  if (hand_) state["posture"] = {{"names", posture::kJointNames}};
  const bool can_track = model_ && can_be_tracked(*model_);
  state["tracking"] = is_tracked_ && can_track;
  state["tracking_remark"] = model_ && !can_track ? kNotTracked : "";
  if (!model_) return;
  state["model"] = model_state(model_->session, model_->path);
  for (const model::Joint& joint : model_->joints) state["model"]["joints"].push_back(joint.name);
}

Json Worn::next() const {
  if (!fingers_) return {{"kind", "wait"}};
  const std::vector<FingerView> fingers = fingers_->view(context_.now_s());
  const auto any = [&](auto&& holds) { return std::ranges::any_of(fingers, holds); };
  const bool is_named = std::ranges::any_of(model::finger_names(), [&](const std::string& name) {
    return any([&](const FingerView& f) { return f.name.starts_with(name); });
  });
  if (!is_named) return {{"kind", "name"}};
  if (glove_.replay()) return {{"kind", "replay"}};
  if (glove_.source()->is_compensated()) return {{"kind", "compensated"}};
  if (!model_) {
    const bool moves =
        any([](const FingerView& f) { return f.most - f.least > kMoves_counts || f.unit != "count"; });
    return {{"kind", moves ? "calibrate" : "move"}};
  }
  if (!misfit_.empty()) return {{"kind", "model_misfit"}, {"why", misfit_}};
  for (const FingerView& f : fingers) {
    if (f.quality == "poor" && !f.remark.empty())
      return {{"kind", "look_at"}, {"finger", f.name}, {"why", f.remark}};
  }
  const bool has_slipped =
      fingers_->has_slipped() || any([](const FingerView& f) { return !f.remark.empty(); });
  return {{"kind", has_slipped ? "slipped" : "wear"}};
}

}  // namespace flexor::live
