#include "apps/live/live.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::live {
namespace {

constexpr double kTick_s = 0.004;
constexpr double kState_s = 0.2;
constexpr double kLook_s = 1;
constexpr double kTogether_s = 0.002;  // samples that come closer go in one message
constexpr double kGlovePause_s = 0.5;  // of the glove: what is longer is not worn
constexpr double kDrawEvery_s = 1.0 / 15;

}  // namespace

Live::Live(LiveOptions options) : options_(std::move(options)), sessions_(options_.sessions) {
  options_.server.files = sessions_.root();
  Handlers handlers;
  handlers.opened = [this](Client client) { guard("page", [&] { welcome(client); }); };
  handlers.text = [this](Client client, std::string_view text) {
    guard("page", [&] { hear(client, text); });
  };
  handlers.binary = [this](Client, std::span<const std::uint8_t> bytes) {
    guard("page", [&] { hear(bytes); });
  };
  server_.emplace(options_.server, std::move(handlers));
  glove_.emplace(
      options_, *server_,
      GlovePort::Calls{[this] { return now_s(); }, [this] { guard("glove", [this] { listen(); }); },
                       [this] { glove_dropped(); },
                       [this](const std::string& why) { ended("port", false, why); },
                       [this](std::function<void()> work) { post("port", std::move(work)); }});
  if (!options_.model.empty()) wear_model({}, options_.model);
  if (options_.worn) {
    attach_worn();
  } else if (!options_.recording.empty()) {
    play_again(options_.recording, io::to_utf8(options_.recording.filename().string()));
  } else {
    glove_->connect_named();
  }
  model_is_chosen_ = !options_.model.empty();
  resume_calibration();
  server_->every(kTick_s, [this] { guard("glove", [this] { tick(); }); });
  server_->every(kLook_s, [this] {
    guard("port", [this] {
      // A board that is being written comes and goes: nobody takes its port meanwhile.
      if (!options_.worn && !jobs_.is_running()) glove_->look();
    });
  });
  server_->every(kState_s, [this] { guard("state", [this] { send_state(); }); });
}

void Live::welcome(Client client) {
  server_->send(client, io::dump_line({{"event", "hello"}, {"schema", 1}, {"version", FLEXOR_VERSION}}));
  server_->send(client, io::dump_line(state()));
  for (const Json& marker : recording_ ? recording_->markers() : std::vector<Json>())
    server_->send(client, io::dump_line(marker));
}

void Live::run(const std::atomic<bool>& stop) {
  server_->every(0.05, [this, &stop] {
    if (stop) server_->stop();
  });
  server_->run();
  if (recording_) stop_recording();
}

void Live::post(const char* what, std::function<void()> work) {
  server_->post([this, what, work = std::move(work)] { guard(what, work); });
}

double Live::now_s() const { return options_.worn ? options_.worn->now_s() : wall_s(); }

double Live::wall_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void Live::glove_dropped() {
  fingers_.reset();
  hand_.reset();
  columns_.clear();
  rows_.reset();
  link_ = {};
}

void Live::listen(int parts) {
  if (!glove_->source() || is_port_lent() || waits_for_camera()) return;
  std::vector<listen::Sample> samples;
  const std::uint64_t torn = glove_->source()->tally().torn;
  const bool goes_on = glove_->hear(samples);
  if (!glove_->source()) return;
  if (recording_) recording_->leave_out(glove_->source()->tally().torn - torn);
  for (const listen::Sample& sample : samples) take(sample);
  if (rows_ && !rows_->is_empty() && now_s() - sent_s_ >= kTogether_s) send_rows();
  if (options_.worn && goes_on && parts > 1) listen(parts - 1);
}

void Live::hear_hand() {
  if (!glove_->hand || is_port_lent()) return;
  const std::vector<listen::Sample> samples = glove_->hand->poll();
  if (samples.empty()) return;
  Rows rows(Kind::hand, twin::kFingers);
  for (const listen::Sample& sample : samples) {  // its joints' angles, then its motors' duty
    const std::span values(sample.value);
    rows.add(sample.host_s, values.subspan(twin::kFingers, twin::kFingers), values.first(twin::kFingers));
  }
  server_->send_all(rows.bytes());
  guard_recording([&] {
    for (const listen::Sample& sample : samples)
      recording_->add_hand(sample, glove_->hand->source->columns());
  });
}

// What the model needs is known once the first sample is there. A recording that is played again keeps the model that is worn.
void Live::learn_columns() {
  columns_ = glove_->source()->columns();
  guard("columns", [this] {
    const std::vector<std::string> names = sessions_.column_names(glove_id());
    if (names.size() == columns_.size()) columns_ = names;
  });
  fingers_.emplace(columns_);
  guard("model", [this] {
    if (!model_is_chosen_ && !glove_->replay()) {
      model_.reset();
      if (const std::optional<Session> known = sessions_.newest_with_model(glove_id()))
        model_ = load_model(*known, sessions_.folder(*known) / *known->model);
    }
    misfit_.clear();
    try {
      if (model_) wear();
    } catch (const io::InputError& error) {
      misfit_ = error.what();
      throw;
    }
  });
}

void Live::wear() {
  if (!fingers_) return;
  if (glove_->source()->is_compensated())
    throw io::InputError(
        "this glove sends angles that it has compensated itself: no model is worn over them");
  fingers_->wear(*model_, tracked_);
  rows_.reset();
  outs_.wear(*model_);
  hand_.emplace(*model_);
}

void Live::look_at_hand() {
  const std::optional<WholeHand> hand = hand_ ? hand_->poll() : std::nullopt;
  if (!hand) return;
  Rows rows(Kind::posture, posture::kJoints);
  rows.add(hand->host_s, hand->se_deg, hand->angle_deg);
  server_->send_all(rows.bytes());
}

void Live::take(const listen::Sample& sample) {
  if (!fingers_) learn_columns();
  fingers_->add(sample);
  if (link_.begun_s < 0) link_.begun_s = sample.host_s;
  link_.arrival_s.push_back(sample.host_s);
  write(sample);
  if (model_ && fingers_->is_worn()) {
    outs_.add(sample.host_s, fingers_->joints_deg());
    if (hand_) hand_->add(sample.host_s, fingers_->joints_deg());
  }
  if (!rows_ || rows_->is_full()) send_rows();
  rows_->add(sample.host_s, fingers_->raw(), fingers_->angle_deg());
}

void Live::write(const listen::Sample& sample) {
  guard_recording([&] { recording_->add(sample, columns_); });
  if (options_.worn) {
    if (!options_.worn->begun_s()) return;
    draw_worn();
  }
  const auto calibrate = [&] {
    listen::Sample taken = sample;
    if (draws()) taken.host_s = since_begun_s(sample.host_s);
    calibration_->add(taken, columns_);
  };
  if (calibration_) guard("calibration", calibrate, [this] { calibration_->back(); });
  const auto put_on = [&] {
    const double before_s = anew_->recording.seconds();
    anew_->recording.add(sample, columns_);
    anew_->worn_s += std::min(anew_->recording.seconds() - before_s, kGlovePause_s);
    if (anew_->worn_s >= kAnew_s) finish_anew();
  };
  if (anew_ && !anew_->is_over) guard("put on anew", put_on, [this] { anew_.reset(); });
}

void Live::send_rows() {
  if (rows_ && !rows_->is_empty()) {
    server_->send_all(rows_->bytes());
    sent_s_ = now_s();
    link_.latency_s += 0.05 * (sent_s_ - link_.arrival_s.back() - link_.latency_s);
  }
  rows_.emplace(Kind::samples, fingers_ ? fingers_->size() : 0);
}

void Live::tick() {
  listen();
  if (rows_ && !rows_->is_empty()) send_rows();
  const double now = now_s();
  while (!link_.arrival_s.empty() && link_.arrival_s.front() < now - kLinkWindow_s)
    link_.arrival_s.pop_front();
  if (options_.worn) look_at_worn();
  guard("hand", [this] { hear_hand(); });
  guard(
      "hand", [this] { look_at_hand(); }, [this] { hand_.reset(); });
  guard_recording([&] { recording_->flush_if_due(now); });
}

// The bionic hand of a twin, thirty times a second.
void Live::look_at_worn() {
  const double now = now_s();
  if (now - worn_sent_s_ < kDrawEvery_s / 2) return;
  worn_sent_s_ = now;
  const study::BenchView worn = options_.worn->now();
  Rows rows(Kind::hand, twin::kFingers);
  rows.add(now, std::vector<double>(twin::kFingers, NAN), worn.joint_deg);
  server_->send_all(rows.bytes());
}

// On the motion's own clock, to the microsecond: the same in each calibration.
double Live::since_begun_s(double host_s) const {
  return std::round((host_s - *options_.worn->begun_s()) * 1e6) / 1e6;
}

// Pictures of the twin's hand for a calibration, at times that do not depend on how quick the machine is.
void Live::draw_worn() {
  const double now = since_begun_s(now_s());
  if (!draws() || !camera_ || !calibration_->wants_pictures()) return;
  if (now >= drawn_s_ && now - drawn_s_ < kDrawEvery_s) return;
  drawn_s_ = now;
  camera_->draw(now, options_.worn->now().finger_deg);
}

// Without boards the twin stands meanwhile.
bool Live::waits_for_camera() const {
  return options_.worn && !options_.worn->facts.has_boards && camera_ && camera_->is_busy();
}

std::string Live::glove_id() const {
  const std::string port = glove_->port();
  const bool is_named = port.find("/by-id/") != std::string::npos;
  std::string out = is_named                               ? std::filesystem::path(port).filename().string()
                    : glove_->state() == DeviceState::worn ? worn_name()
                                                           : "glove";
  for (const std::string& column : columns_) out += " " + column;
  return out;
}

// What comes, over the last two seconds: bursts and all.
double Live::link_rate_hz() const {
  const double worn_s = std::min(kLinkWindow_s, now_s() - link_.begun_s);
  return link_.arrival_s.size() > 1 && worn_s > 0 ? static_cast<double>(link_.arrival_s.size()) / worn_s : 0;
}

// Of a glove that gives so many samples a second.
double Live::model_rate_hz(double glove_hz) const {
  if (options_.worn) return options_.worn->facts.rate_hz;
  if (options_.rate_hz > 0) return options_.rate_hz;
  for (const double rate_hz : {100.0, 50.0, 20.0}) {
    if (glove_hz > 0.9 * rate_hz) return rate_hz;
  }
  return 10;
}

}  // namespace flexor::live
