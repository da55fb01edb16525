#include "host/study/bench.hpp"

#include <fmt/format.h>

#include "host/io/process.hpp"
#include "host/study/boards.hpp"
#include "host/study/builtin.hpp"
#include "host/study/exact_json.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::study {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The bootloader of Nanos before 2018.

template <class T>
void put(Json& json, const char* name, const std::optional<T>& value) {
  if (value) json[name] = *value;
}

template <class T>
void get(const Json& json, const char* name, std::optional<T>& value) {
  if (json.contains(name)) value = json.at(name).get<T>();
}

// What may be left as it is, by name.
template <class Change, class Visit>
void each_value(Change& change, const Visit& visit) {
  visit("slip_deg", change.slip_deg);
  visit("drift_deg_per_min", change.drift_deg_per_min);
  visit("noise_counts", change.noise_counts);
  visit("loss", change.loss);
  visit("motion", change.motion);
  visit("unplugged", change.unplugged);
}

deploy::Glove glove_of(const BenchOptions& o) {
  std::vector<std::string> notes;
  deploy::Glove glove = glove_for(o.parameters, on_hand(o.model, o.parameters, notes));
  return glove;
}

}  // namespace

std::optional<twin::Motion> bench_motion(const std::string& name) {
  if (name == "rest") return std::nullopt;
  if (name == "calibration") return short_motion();
  if (name == "ordinary") return ordinary_motion();
  if (name == "protocol") return recommended_motion();
  if (name == "bends" || name == "held") {
    const std::string file = "gestures/" + name + ".json";
    return twin::Motion::from_json(builtin(file), file);
  }
  if (name.size() == 1 && name[0] >= '1' && name[0] <= '6') return motions(name).front();
  throw io::InputError(
      fmt::format("no motion \"{}\": rest, bends, calibration, held, ordinary, protocol, or 1 to 6 of the "
                  "published gestures",
                  name));
}

Json exact_json(const BenchChange& change) {
  Json json = {{"ms", change.ms}, {"restart", change.restart}};
  each_value(change, [&](const char* name, const auto& value) { put(json, name, value); });
  return json;
}

BenchChange bench_change_of(const Json& json) {
  BenchChange out;
  out.ms = json.at("ms").get<int>();
  out.restart = json.value("restart", false);
  each_value(out, [&](const char* name, auto& value) { get(json, name, value); });
  return out;
}

Json exact_json(const BenchView& view) {
  Json json = {{"now_ms", view.now_ms},
               {"port", view.port},
               {"is_open", view.is_open},
               {"motion", view.motion},
               {"finger_deg", view.finger_deg},
               {"joint_deg", view.joint_deg},
               {"duty", view.duty},
               {"fault", view.fault},
               {"counts", view.counts}};
  put(json, "motion_s", view.motion_s);
  return json;
}

BenchView bench_view_of(const Json& json) {
  BenchView out;
  json.at("now_ms").get_to(out.now_ms);
  json.at("port").get_to(out.port);
  json.at("is_open").get_to(out.is_open);
  json.at("motion").get_to(out.motion);
  json.at("finger_deg").get_to(out.finger_deg);
  json.at("joint_deg").get_to(out.joint_deg);
  json.at("duty").get_to(out.duty);
  json.at("fault").get_to(out.fault);
  json.at("counts").get_to(out.counts);
  get(json, "motion_s", out.motion_s);
  return out;
}

std::string why_no_bootloader(const fs::path& hex) {
  if (fs::exists(hex)) return "";
  return "the simulated glove has no bootloader, through which models and firmware are written, since "
         "Debian's package arduino-core-avr is not installed: install it, and start this command again";
}

Bench::Bench(fs::path program, const BenchOptions& options)
    : glove_(glove_of(options)), link_(options.port_link), worker_(std::move(program)) {
  has_bootloader_ = fs::exists(kBootloader);
  const twin::TrialInput input{options.parameters, short_motion(), options.model, options.seed};
  Json arguments = {{"glove", exact_json(glove_)}, {"input", twin::exact_json(input)}};
  if (has_bootloader_) arguments["bootloader"] = io::bytes_to_json(kBootloader);
  if (!link_.empty()) arguments["link"] = io::bytes_to_json(fs::absolute(link_).string());
  terminal_ = worker_.run("bench_open", arguments).at("port").get<std::string>();
}

Bench::~Bench() {
  try {
    const std::lock_guard lock(mutex_);
    if (worker_.is_usable()) (void)worker_.run("bench_close", Json::object());
  } catch (const std::exception&) {  // it has ended before
  }
}

std::string Bench::port() const {
  if (!link_.empty()) return link_.string();  // for good: nobody waits for the boards' turn
  const std::lock_guard lock(mutex_);
  return terminal_;
}

BenchView Bench::advance(const BenchChange& change) {
  const std::lock_guard lock(mutex_);
  BenchView view = bench_view_of(worker_.run("bench_advance", exact_json(change)));
  if (!view.port.empty()) {
    terminal_ = view.port;
    if (!link_.empty()) view.port = link_.string();
  }
  return view;
}

std::vector<double> Bench::score(const std::vector<int>& gestures, const io::JobProgress& progress) {
  const std::lock_guard lock(mutex_);
  return worker_.run("bench_score", {{"gestures", gestures}}, progress).get<std::vector<double>>();
}

}  // namespace flexor::study
