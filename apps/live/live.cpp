#include "apps/live/live.hpp"

#include "host/deploy/flash.hpp"

namespace flexor::live {
namespace {

constexpr double kTick_s = 0.004;
constexpr double kState_s = 0.2;
constexpr double kLook_s = 1;
constexpr double kTogether_s = 0.002;     // samples that come closer go in one message
constexpr double kListEvery_s = 2;        // listing reads the disk
constexpr std::size_t kMostListed = 200;  // sessions, the newest

}  // namespace

Live::Live(LiveOptions options)
    : context_(std::move(options),
               {[this](Client client) { context_.guard("page", [&] { welcome(client); }); },
                [this](Client client, std::string_view text) {
                  context_.guard("page", [&] { handle(client, text); });
                },
                [this](Client, std::span<const std::uint8_t> bytes) {
                  context_.guard("page", [&] { calibration_.take_picture(bytes); });
                }}),
      glove_(context_, {[this] { context_.guard("glove", [this] { listen(); }); }, [this] { worn_.drop(); }}),
      worn_(context_, glove_),
      jobs_(context_, glove_, worn_),
      recorder_(context_, worn_, glove_, jobs_),
      calibration_(context_, glove_, worn_, jobs_),
      demo_(context_) {
  if (!context_.options.model.empty()) worn_.wear({}, context_.options.model);
  glove_.begin();
  calibration_.resume();
  const auto every = [this](double period_s, const char* what, const std::function<void()>& act) {
    context_.server.every(period_s, [this, what, act] { context_.guard(what, act); });
  };
  every(kTick_s, "glove", [this] { tick(); });
  // A board that is being written comes and goes: nobody takes its port meanwhile.
  every(kLook_s, "port", [this] {
    if (!context_.options.worn && !jobs_.is_running()) glove_.look();
  });
  every(kState_s, "state", [this] {
    if (context_.server.clients() > 0) context_.server.send_all(io::dump_line(state()));
  });
}

void Live::run(const std::atomic<bool>& stop) {
  Server& server = context_.server;
  server.every(0.05, [&] {
    if (stop) server.stop();
  });
  server.run();
  recorder_.end();
}

void Live::welcome(Client client) {
  const auto send = [&](const Json& json) { context_.server.send(client, io::dump_line(json)); };
  send({{"event", "hello"}, {"schema", 1}, {"version", FLEXOR_VERSION}});
  send(state());
  for (const Json& marker : recorder_.markers()) send(marker);
}

void Live::handle(Client client, std::string_view text) {
  const auto [answer, is_silent] = context_.words.answer(text);
  // First: whoever waits for the answer has the state that it led to.
  if (!is_silent) context_.server.send_all(io::dump_line(state()));
  if (!is_silent || !answer["ok"].get<bool>()) context_.server.send(client, io::dump_line(answer));
}

void Live::listen(int parts) {
  if (!glove_.source() || jobs_.has_port() || calibration_.waits_for_camera()) return;
  std::vector<listen::Sample> samples;
  const std::uint64_t malformed = glove_.source()->tally().malformed;
  const bool goes_on = glove_.receive(samples);
  if (!glove_.source()) return;
  recorder_.leave_out(glove_.source()->tally().malformed - malformed);
  for (const listen::Sample& sample : samples) {
    worn_.take(sample);
    recorder_.take(sample);
    calibration_.take(sample);
  }
  worn_.stream.send(kTogether_s);
  if (context_.options.worn && goes_on && parts > 1) listen(parts - 1);
}

void Live::receive_hand() {
  if (!glove_.hand || jobs_.has_port()) return;
  const std::vector<listen::Sample> samples = glove_.hand->poll();
  if (samples.empty()) return;
  Rows rows(Kind::hand, twin::kFingers);
  for (const listen::Sample& sample : samples) {  // its joints' angles, then its motors' duty
    const std::span values(sample.value);
    rows.add(sample.host_s, values.subspan(twin::kFingers, twin::kFingers), values.first(twin::kFingers));
  }
  context_.server.send_all(rows.bytes());
  recorder_.take_hand(samples, glove_.hand->source->columns());
}

void Live::tick() {
  listen();
  worn_.tick();
  demo_.tick();
  context_.guard("hand", [this] { receive_hand(); });
  recorder_.tick();
}

Json Live::what_next() const {
  if (jobs_.is_running()) return {{"kind", "job"}};
  if (Json wrong = glove_.wrong(); !wrong.is_null()) return wrong;
  if (!calibration_.is_over()) return {{"kind", "calibration"}};
  for (const Json& next : {recorder_.next(), glove_.next()}) {
    if (!next.is_null()) return next;
  }
  return worn_.next();
}

// Not at every state.
void Live::list() {
  if (context_.wall_s() - context_.listed_s < kListEvery_s) return;
  context_.listed_s = context_.wall_s();
  const LiveOptions& options = context_.options;
  Json sessions = Json::array();
  Json models = Json::array();
  Json ports = Json::array();
  if (!options.model.empty()) models.push_back(model_state({}, options.model));
  for (const Session& s : context_.sessions.list()) {
    if (sessions.size() == kMostListed) break;
    sessions.push_back({{"name", s.name},
                        {"person", s.person},
                        {"side", s.side},
                        {"files", s.files},
                        {"seconds", s.seconds}});
    if (s.model) models.push_back(model_state(s, *s.model));
  }
  if (options.worn) {
    ports.push_back({{"path", options.worn->facts.port}, {"name", "the twin's glove"}});
  } else {
    for (const std::string& port : io::serial_ports(options.devices))
      ports.push_back({{"path", port}, {"name", std::filesystem::path(port).filename().string()}});
  }
  listed_ = {{"sessions", std::move(sessions)}, {"models", std::move(models)}, {"ports", std::move(ports)}};
}

// In SOCKET.md's order; what no part writes is null.
Json Live::state() {
  Json out = {{"event", "state"}};
  for (const char* part : {"device", "next", "fingers", "model", "recording", "job", "last", "link",
                           "calibration", "tracking", "tracking_remark", "anew", "twin", "hand", "posture",
                           "scores", "experiment", "joint_files", "replay"})
    out[part] = nullptr;
  out["next"] = what_next();
  out["last"] = context_.last;
  out["calibration"] = calibration_.state();
  out["joint_files"] = joint_files();
  demo_.write(out);
  glove_.write(out);
  worn_.write(out);
  jobs_.write(out);
  recorder_.write(out);
  list();
  out.update(listed_);
  return out;
}

}  // namespace flexor::live
