#include "apps/live/glove_port.hpp"

#include <fmt/format.h>

#include <array>

#include "host/deploy/flash.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kMostColumns = 255;  // a message has their number in a byte
constexpr std::size_t kMostTried = 2;      // ports that nobody has named: a glove's and a hand's
constexpr double kNamedEvery_s = 5;        // ports that are named and silent

bool is_same_port(const std::string& a, const std::string& b) {
  std::error_code error;
  return a == b || std::filesystem::equivalent(a, b, error);
}

}  // namespace

DeviceState after(DeviceState state, DeviceEvent event) {
  using enum DeviceState;
  const bool has_source = state == glove || state == gone || state == replay || state == worn;
  switch (event) {
    case DeviceEvent::drops:
      return none;
    case DeviceEvent::leaves:
      return left;
    case DeviceEvent::listens:
      return has_source ? state : listening;
    case DeviceEvent::misunderstands:
      return state == listening ? doubtful : state;
    case DeviceEvent::ends:
      return state == listening ? none : state == doubtful ? misunderstood : state;
    case DeviceEvent::speaks:
      return glove;
    case DeviceEvent::goes:
      return state == glove ? gone : state;
    case DeviceEvent::returns:
      return state == gone ? glove : state;
    case DeviceEvent::plays:
      return replay;
    case DeviceEvent::wears:
      return worn;
  }
  return state;
}

const char* name_of(DeviceState state) {
  constexpr std::array kNames = {"none",  "none", "listening", "listening", "none",
                                 "glove", "gone", "replay",    "none"};
  return kNames.at(static_cast<std::size_t>(state));
}

GlovePort::GlovePort(Context& context, Calls calls)
    : context_(context), options_(context.options), calls_(std::move(calls)) {
  if (!options_.key.empty()) key_ = deploy::load_key(options_.key);
  context_.words.add(
      {{"device.connect",
        {{"job_runs", "recording_runs", "calibration_has_glove"},
         [this](io::JsonReader& parts) { connect(parts.text("port")); }}},
       {"device.leave",
        {{"job_runs", "calibration_is_open", "recording_runs"}, [this](io::JsonReader&) { leave(); }}},
       {"replay.open",
        {{"job_runs", "calibration_is_open", "recording_runs"},
         [this](io::JsonReader& parts) {
           const std::string name = parts.text("session") + "/" + parts.text("file");
           play(context_.sessions.file(name, kMostLogBytes), name);
         }}},
       {"replay.play", {{"no_replay"}, [this](io::JsonReader& parts) { replay()->pause(!is_on(parts)); }}}},
      {{"no_replay", [this] { return !replay(); }},
       // to which models are fitted
       {"no_readings", [this] { return source_ && source_->is_compensated(); }}});
}

listen::ReplaySource* GlovePort::replay() const {
  return state_ == DeviceState::replay ? static_cast<listen::ReplaySource*>(source_.get()) : nullptr;
}

std::string GlovePort::misfit() const {
  if (!source_ || is_gone() || !source_->tally().misfit) return "";
  return fmt::format(
      "Nothing is shown or recorded: {}. Mend the glove's program, or stop and choose the port again.",
      listen::misfit_in_words(*source_->tally().misfit));
}

std::string GlovePort::id(const std::vector<std::string>& columns) const {
  const bool is_named = port().find("/by-id/") != std::string::npos;
  std::string out = is_named                      ? std::filesystem::path(port()).filename().string()
                    : state_ == DeviceState::worn ? options_.worn->facts.name()
                                                  : "glove";
  for (const std::string& column : columns) out += " " + column;
  return out;
}

void GlovePort::write(Json& state) const {
  const bool is_worn = state_ == DeviceState::worn;
  std::string format = source_ ? source_->description() : "";
  if (source_ && source_->is_compensated()) format += ": angles, compensated on the glove";
  state["device"] = {{"status", is_worn ? options_.worn->facts.name() : name_of(state_)},
                     {"name", !is_worn                          ? "glove"
                              : options_.worn->facts.has_boards ? "both boards, simulated"
                                                                : "the twin's glove"},
                     {"port", port()},
                     {"format", format},
                     {"says", misfit().empty() ? status_ : misfit()}};
  if (hand) state["hand"] = hand->state(context_.now_s());
  if (const listen::ReplaySource* source = replay())
    state["replay"] = {{"file", replayed_},
                       {"t_s", source->position_s()},
                       {"of_s", source->duration_s()},
                       {"playing", source->is_playing()}};
}

Json GlovePort::wrong() const {
  if (is_gone()) return {{"kind", "gone"}};
  if (!misfit().empty()) return {{"kind", "misfit"}, {"why", misfit()}};
  return nullptr;
}

Json GlovePort::next() const {
  if (state_ == DeviceState::listening || state_ == DeviceState::doubtful) return {{"kind", "listening"}};
  if (state_ == DeviceState::misunderstood) return {{"kind", "misunderstood"}, {"why", status_}};
  return source_ ? Json(nullptr) : Json{{"kind", "plug_in"}};
}

void GlovePort::become(DeviceEvent event, std::string status) {
  state_ = after(state_, event);
  status_ = std::move(status);
}

void GlovePort::attach(std::shared_ptr<listen::Source> source, const std::string& port, DeviceEvent event) {
  if (source->columns().size() > kMostColumns)
    throw io::InputError("{} columns: the page shows {} at most", source->columns().size(), kMostColumns);
  detach();
  source_ = std::move(source);
  begin_s_ = context_.now_s() - source_->now_s();
  port_ = port;
  become(event, source_->description());
  watch(source_->descriptor());
}

void GlovePort::detach() {
  watch(-1);
  source_.reset();
  become(DeviceEvent::drops, "no glove");
  calls_.drops();
}

// A port that was plugged in again has another descriptor.
void GlovePort::watch(int descriptor) {
  if (descriptor == watched_) return;
  watched_ = descriptor;
  watch_.reset();
  if (watched_ >= 0) watch_ = context_.server.watch(watched_, calls_.is_readable);
}

bool GlovePort::receive(std::vector<listen::Sample>& out) {
  if (!source_) return false;
  const std::size_t before = out.size();
  listen::Event event = listen::Event::quiet;
  try {
    event = source_->wait(0, out);
  } catch (const std::exception& error) {  // not of a port: that would have gone
    const std::string why = error.what();
    detach();
    status_ = why;
    tried_ports_.clear();  // another glove that was plugged in is listened to again
    return false;
  }
  if (event == listen::Event::gone)
    become(DeviceEvent::goes, "the glove has gone: plug it in again, everything goes on");
  if (event == listen::Event::back) become(DeviceEvent::returns, source_->description());
  watch(source_->descriptor());
  for (std::size_t k = before; k < out.size(); ++k) out[k].host_s += begin_s_;
  return event == listen::Event::samples;
}

void GlovePort::let_go() {
  watch(-1);
  if (source_) source_->let_go();
  if (hand) hand->source->let_go();
}

void GlovePort::play(const std::filesystem::path& file, const std::string& name) {
  auto source = std::make_shared<listen::ReplaySource>(file, 1, options_.time);
  end_search();
  attach(std::move(source), std::string(port_), DeviceEvent::plays);
  replayed_ = name;
}

void GlovePort::leave() {
  end_search();
  const bool is_replay = replay() != nullptr;
  if (is_replay && options_.worn) return attach(options_.worn, options_.worn->facts.port, DeviceEvent::wears);
  detach();
  if (is_replay) {
    if (!port_.empty()) listen_to({port_}, false);
    return;
  }
  state_ = after(state_, DeviceEvent::leaves);
  port_.clear();
  hand.reset();
}

std::vector<std::string> GlovePort::named() const {
  std::vector<std::string> out;
  if (options_.port != "auto") out.push_back(options_.port);
  if (!options_.hand.empty()) out.push_back(options_.hand);
  return out;
}

void GlovePort::begin() {
  if (options_.worn) return connect("auto");
  if (!options_.recording.empty())
    return play(options_.recording, io::to_utf8(options_.recording.filename().string()));
  if (options_.port != "auto") options_.port = deploy::choose_port(options_.port);
  if (!options_.hand.empty()) options_.hand = deploy::choose_port(options_.hand);
  const std::vector<std::string> paths = named();
  if (paths.size() == 2 && is_same_port(paths.front(), paths.back()))
    throw io::InputError(options_.hand + ": --port and --hand name the same port");
  if (!paths.empty()) listen_to(paths, true);
}

void GlovePort::connect(const std::string& port) {
  if (options_.worn) {
    if (port != options_.worn->facts.port && port != "auto") throw Refusal("twin_wears");
    return attach(options_.worn, options_.worn->facts.port, DeviceEvent::wears);
  }
  if (port.empty()) throw io::InputError("no port is chosen: plug the glove in, and choose its port");
  const std::vector<std::string> ports = free(io::serial_ports(options_.devices));
  const bool any = port == "auto" && !ports.empty() && ports.size() <= kMostTried;
  listen_to(any ? ports : std::vector{deploy::choose_port(port, options_.devices)}, true);
}

// The ports there are, also when they are plugged in later. One that sent nothing that is known is tried again when others
// come; one that is named, every few seconds: where nothing was sent, something may be later.
void GlovePort::look() {
  if (state_ == DeviceState::replay || state_ == DeviceState::left || (source_ && hand) || search_stops_)
    return;
  std::vector<std::string> silent;
  if (context_.now_s() - named_tried_s_ >= kNamedEvery_s) {
    named_tried_s_ = context_.now_s();
    silent = free(named());
    std::erase_if(silent, [this](const std::string& path) {
      const bool has_place = path == options_.hand ? !hand : !source_;
      return !has_place || !io::is_there(path);
    });
  }
  if (silent.empty() && options_.port == "auto") {
    const std::vector<std::string> ports = io::serial_ports(options_.devices);
    if (ports == tried_ports_) return;
    tried_ports_ = ports;
    silent = free(ports);
    if (silent.size() > kMostTried) return;
  }
  if (!silent.empty()) listen_to(std::move(silent), false);
}

std::vector<std::string> GlovePort::free(std::vector<std::string> ports) const {
  std::erase_if(ports, [this](const std::string& path) {
    return (source_ && is_same_port(path, port())) || (hand && is_same_port(path, hand->path));
  });
  return ports;
}

// One after the other. The glove and the hand stay until another one is found, but at a port that is listened to again.
void GlovePort::listen_to(std::vector<std::string> paths, bool is_chosen) {
  listen::ListenerOptions options;
  options.baud = options_.baud;
  options.readings = true;
  options.any_will_do = true;
  // Of a file it may be another by now; standard input is read once.
  if (std::filesystem::is_regular_file(options_.key)) key_ = deploy::load_key(options_.key);
  options.key = key_;
  end_search();
  for (const std::string& path : paths) {
    const bool is_over = is_chosen && (replay() || state_ == DeviceState::gone);
    if (source_ && (is_over || is_same_port(path, port()))) detach();
    if (hand && is_same_port(path, hand->path)) hand.reset();
  }
  if (!source_) {
    port_ = paths.front();
    become(DeviceEvent::listens, port_ + ": listening");
  }
  search(std::move(paths), std::move(options), is_chosen);
}

void GlovePort::search(std::vector<std::string> paths, listen::ListenerOptions options, bool is_chosen) {
  options.stop = search_stops_ = std::make_shared<std::atomic<bool>>(false);
  // What an older search posted is forgotten.
  const auto post = [this, stops = search_stops_](std::function<void()> work) {
    context_.post("port", [this, stops, work = std::move(work)] {
      if (stops == search_stops_) work();
    });
  };
  search_ =
      std::jthread([this, post, is_chosen, paths = std::move(paths), options = std::move(options)]() mutable {
        for (const std::string& path : paths) {
          options.port = path;
          try {
            auto listener = std::make_shared<listen::Listener>(options, [&](const std::string& what) {
              post([this, path, what] {
                if (!source_) status_ = fmt::format("{}: {}", path, what);
              });
            });
            post([this, path, listener, is_chosen] { found(path, listener, is_chosen); });
          } catch (const std::exception& error) {
            post([this, why = std::string(error.what()), is_chosen] { found_nothing(why, is_chosen); });
          }
        }
        post([this] { searched(); });
      });
}

void GlovePort::end_search() {
  if (search_stops_) *search_stops_ = true;
  search_stops_.reset();
  search_ = {};  // which waits for it
}

void GlovePort::searched() {
  search_stops_.reset();
  if (source_ || state_ == DeviceState::left) return;
  port_.clear();
  state_ = after(state_, DeviceEvent::ends);
  if (state_ == DeviceState::none) status_ = "no glove";
}

void GlovePort::found_nothing(const std::string& why, bool is_chosen) {
  if (!source_) return become(DeviceEvent::misunderstands, why);
  if (is_chosen) context_.ended("port", false, why);
}

// What is chosen takes the place of who is there.
void GlovePort::found(const std::string& path, std::shared_ptr<listen::Listener> listener, bool is_chosen) {
  if (listener->format() == listen::Format::hand) {
    if (is_chosen || !hand) hand.emplace(listener, path, context_.now_s() - listener->now_s());
  } else if (path == options_.hand) {
    if (is_chosen) context_.ended("port", false, path + ": --hand names a glove's port");
  } else if (is_chosen || !source_) {
    attach(std::move(listener), path, DeviceEvent::speaks);
  }
}

}  // namespace flexor::live
