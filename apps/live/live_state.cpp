// The state that a page shows.

#include <algorithm>
#include <cmath>

#include "apps/live/camera.hpp"
#include "apps/live/live.hpp"
#include "host/deploy/flash.hpp"

namespace flexor::live {
namespace {

constexpr double kListEvery_s = 2;
constexpr std::size_t kMostListed = 200;  // sessions, the newest

}  // namespace

void Live::send_state() {
  if (server_->clients() > 0) server_->send_all(io::dump_line(state()));
}

Live::Json Live::device_state() const {
  const listen::Source* source = glove_->source();
  const bool is_worn = glove_->state() == DeviceState::worn;
  std::string format = source ? source->says() : "";
  if (source && source->is_compensated()) format += ": angles, compensated on the glove";
  return {{"status", is_worn ? worn_name() : name_of(glove_->state())},
          {"name", !is_worn                          ? "glove"
                   : options_.worn->facts.has_boards ? "both boards, simulated"
                                                     : "the twin's glove"},
          {"port", glove_->port()},
          {"format", format},
          {"says", misfit().empty() ? glove_->says() : misfit()}};
}

// Why nothing of what comes is taken; "": it is.
std::string Live::misfit() const {
  const std::optional<listen::Misfit> found = glove_->misfit();
  if (!found) return "";
  return fmt::format(
      "Nothing is shown or recorded: {}. Mend the glove's program, or stop and choose the port again.",
      listen::misfit_in_words(*found));
}

Live::Json Live::link_state() const {
  const std::deque<double>& arrival = link_.arrival_s;
  const std::size_t n = arrival.size();
  double jitter_s = 0;
  if (n > 2) {
    const double step_s = (arrival.back() - arrival.front()) / static_cast<double>(n - 1);
    for (std::size_t i = 1; i < n; ++i) jitter_s += std::pow(arrival[i] - arrival[i - 1] - step_s, 2);
    jitter_s = std::sqrt(jitter_s / static_cast<double>(n - 1));
  }
  const listen::Source* source = glove_->source();
  return {{"rate_hz", link_rate_hz()},
          {"torn", source ? source->tally().torn : 0},
          {"lost", source ? Json(source->tally().lost) : Json(nullptr)},
          {"jitter_ms", 1000 * jitter_s},
          {"latency_ms", 1000 * link_.latency_s}};
}

// By whom it was made, or its file.
Live::Json Live::model_state(const Session& session, const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  return {{"path", session.name.empty() ? file : session.name + "/" + file},
          {"name", !session.person.empty() ? session.person + ", " + session.side
                   : session.name.empty()  ? file
                                           : session.name},
          {"person", session.person},
          {"side", session.side}};
}

// Listing reads the disk: not at every state.
Live::Json Live::sessions_state() const {
  if (wall_s() - listed_s_ < kListEvery_s) return listed_;
  listed_s_ = wall_s();
  Json sessions = Json::array();
  Json models = Json::array();
  if (!options_.model.empty()) models.push_back(model_state({}, options_.model));
  for (const Session& s : sessions_.list()) {
    if (sessions.size() == kMostListed) break;
    sessions.push_back({{"name", s.name},
                        {"person", s.person},
                        {"side", s.side},
                        {"files", s.files},
                        {"seconds", s.seconds}});
    if (s.model) models.push_back(model_state(s, *s.model));
  }
  Json ports = Json::array();
  if (options_.worn) {
    ports.push_back({{"path", options_.worn->facts.port}, {"name", "the twin's glove"}});
  } else {
    for (const std::string& port : io::serial_ports(options_.devices))
      ports.push_back({{"path", port}, {"name", std::filesystem::path(port).filename().string()}});
  }
  listed_ = {{"sessions", std::move(sessions)}, {"models", std::move(models)}, {"ports", std::move(ports)}};
  return listed_;
}

Live::Json Live::what_next_anew() const {
  if (!anew_->is_over) return {{"kind", "bend"}};
  if (!anew_->result) return {{"kind", "fits"}};
  const AnewResult& result = *anew_->result;
  const char* kind = !result.applied ? "keep" : !result.is_off ? "as_it_was" : "take";
  return {{"kind", kind}, {"why", result.applied ? "" : result.wanted}, {"misfits", result.misfits}};
}

// What to do: a kind, and what there is to say of it.
Live::Json Live::what_next() const {
  using enum DeviceState;
  if (jobs_.is_running()) return {{"kind", "job"}};
  const DeviceState device = glove_->state();
  if (device == gone) return {{"kind", "gone"}};
  if (!misfit().empty()) return {{"kind", "misfit"}, {"why", misfit()}};
  if (calibration_ && !calibration_->is_sent()) return {{"kind", "calibration"}};
  if (anew_) return what_next_anew();
  if (device == listening || device == doubtful) return {{"kind", "listening"}};
  if (device == misunderstood) return {{"kind", "misunderstood"}, {"why", glove_->says()}};
  if (!glove_->source()) return {{"kind", "plug_in"}};
  if (!fingers_) return {{"kind", "wait"}};
  const std::vector<FingerView> fingers = fingers_->view(now_s());
  const bool is_named = std::ranges::any_of(model::finger_names(), [&](const std::string& name) {
    return std::ranges::any_of(fingers, [&](const FingerView& f) { return f.name.starts_with(name); });
  });
  if (!is_named) return {{"kind", "name"}};
  if (device == replay) return {{"kind", "replay"}};
  if (glove_->source()->is_compensated()) return {{"kind", "compensated"}};
  if (!model_) {
    const bool moves = std::ranges::any_of(
        fingers, [](const FingerView& f) { return f.most - f.least > kMoves_counts || f.unit != "count"; });
    return {{"kind", moves ? "calibrate" : "move"}};
  }
  if (!misfit_.empty()) return {{"kind", "model_misfit"}, {"why", misfit_}};
  for (const FingerView& f : fingers) {
    if (f.quality == "poor" && !f.remark.empty())
      return {{"kind", "look_at"}, {"finger", f.name}, {"why", f.remark}};
  }
  const bool slipped = fingers_->has_slipped() ||
                       std::ranges::any_of(fingers, [](const FingerView& f) { return !f.remark.empty(); });
  return {{"kind", slipped ? "slipped" : "wear"}};
}

Live::Json Live::state() const {
  const Json none = nullptr;
  const listen::ReplaySource* replay = glove_->replay();
  Json out = {{"event", "state"},
              {"device", device_state()},
              {"next", what_next()},
              {"fingers", fingers_ ? Json(fingers_->view(now_s())) : Json::array()},
              {"model", model_ ? model_state(model_->session, model_->path) : none},
              {"recording", !recording_ ? none
                                        : Json{{"file", recording_->session.name + "/log.csv"},
                                               {"rows", recording_->rows()},
                                               {"seconds", recording_->seconds()}}},
              {"job", none},
              {"last", last_},
              {"link", link_state()},
              {"calibration", calibration_ ? calibration_->state() : none},
              {"tracking", tracked_ && model_ && can_be_tracked(*model_)},
              {"tracking_remark", model_ && !can_be_tracked(*model_) ? kNotTracked : ""},
              {"anew", !anew_ ? none
                              : Json{{"seconds", anew_->worn_s},
                                     {"of_seconds", kAnew_s},
                                     {"fingers", anew_->result ? anew_->result->fingers : Json::array()}}},
              {"twin", options_.worn ? Json(worn_change_) : none},
              {"hand", hand_state()},
              {"posture", hand_ ? Json{{"names", posture::kJointNames}} : none},
              {"scores", scores_},
              {"experiment", experiment_},
              {"joint_files", joint_files()},
              {"replay", !replay ? none
                                 : Json{{"file", replayed_},
                                        {"t_s", replay->position_s()},
                                        {"of_s", replay->duration_s()},
                                        {"playing", replay->is_playing()}}}};
  for (std::size_t j = 0; model_ && j < model_->joints.size(); ++j)
    out["model"]["joints"].push_back(model_->joints[j].name);
  if (jobs_.is_running()) {
    out["job"] = io::to_json(jobs_.progress());
    out["job"]["name"] = jobs_.name();
  }
  out.update(sessions_state());
  return out;
}

// Of the simulated boards, or at a port.
Live::Json Live::hand_state() const {
  const std::optional<HandPort>& hand = glove_->hand;
  if (!hand && !options_.worn) return nullptr;
  std::array<std::string, twin::kFingers> faults;
  if (hand) faults = hand->faults();
  for (std::size_t f = 0; !hand && f < faults.size(); ++f) {
    const int fault = options_.worn->now().fault[f];
    if (fault != 0) faults[f] = fmt::format("fault {}", fault);
  }
  return {{"names", model::finger_names()},
          {"open_deg", twin::Parameters().hand_lower_deg},
          {"status", hand ? hand->status(now_s()) : "simulated"},
          {"port", hand ? Json(hand->path) : Json(nullptr)},
          {"faults", faults},
          {"board", hand ? hand->board_faults() : ""}};
}

}  // namespace flexor::live
