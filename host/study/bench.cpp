#include "host/study/bench.hpp"

#include "host/study/boards.hpp"
#include "host/study/builtin.hpp"
#include "host/study/exact_json.hpp"

namespace flexor::study {
namespace {

namespace fs = std::filesystem;

deploy::Glove glove_of(const BenchOptions& o) {
  std::vector<std::string> notes;
  return deploy::glove_for(o.parameters, deploy::on_hand(o.model, o.parameters, notes), bench_key());
}

}  // namespace

std::optional<twin::Motion> bench_motion(const std::string& name) {
  if (name == "rest") return std::nullopt;
  if (builtin().contains("gestures/" + name + ".json")) return carried_motion(name);
  throw io::InputError(
      "no motion \"{}\": rest, bends, calibration, held, ordinary, protocol, or 1 to 6 of the "
      "published gestures",
      name);
}

std::string why_no_bootloader() {
  if (fs::exists(kBootloader)) return "";
  return "the simulated glove has no bootloader, through which models and firmware are written, since "
         "Debian's package arduino-core-avr is not installed: install it, and start this command again";
}

Bench::Bench(const fs::path& program, const BenchOptions& options)
    : glove_(glove_of(options)), worker_(program) {
  const twin::TrialInput input{options.parameters, short_motion(), options.model, options.seed};
  Json arguments = {{"glove", glove_}, {"input", input}};
  if (why_no_bootloader().empty()) arguments["bootloader"] = io::bytes_to_json(kBootloader);
  const fs::path& link = options.port_link;
  if (!link.empty()) arguments["link"] = io::bytes_to_json(fs::absolute(link).string());
  const Json opened = worker_.run("bench_open", arguments);
  port_ = link.empty() ? opened.at("port").get<std::string>() : link.string();
}

Bench::~Bench() {
  try {
    const std::lock_guard lock(mutex_);
    if (worker_.is_usable()) (void)worker_.run("bench_close", Json::object());
  } catch (const std::exception&) {  // it has ended before
  }
}

BenchView Bench::advance(const BenchChange& change) {
  const std::lock_guard lock(mutex_);
  return worker_.run("bench_advance", change).get<BenchView>();
}

std::vector<double> Bench::score(const std::vector<int>& gestures, const io::JobProgress& progress) {
  const std::lock_guard lock(mutex_);
  return worker_
      .run("bench_score", {{"gestures", gestures}},
           [&](const io::Progress& p) { return progress(p.done, p.of); })
      .get<std::vector<double>>();
}

}  // namespace flexor::study
