#include <fmt/format.h>

#include <memory>

#include "apps/cli/commands.hpp"
#include "apps/cli/glove_port.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/stop.hpp"
#include "host/io/json.hpp"
#include "host/listen/log.hpp"

namespace flexor::cli {
namespace {

struct Options {
  std::string out;
  GlovePort glove;
  double for_s = 0;
  bool json = false;
};

constexpr double kPatience_s = 10;  // without a sample since the port was opened

void take(std::vector<listen::Sample>& samples, const listen::Listener& listener, const std::string& out,
          std::unique_ptr<listen::Log>& log) {
  if (!log && !samples.empty()) log = std::make_unique<listen::Log>(out, listener.decoder().columns());
  for (const listen::Sample& sample : samples) log->add(sample);
  samples.clear();
}

std::string how_it_goes(const listen::Listener& listener, const listen::Log& log, double for_s) {
  const listen::Tally& tally = listener.decoder().tally();
  std::string text = fmt::format("{:.0f} s, {} rows", log.duration_s(), log.rows());
  if (tally.torn > 0) text += fmt::format(", {} torn", tally.torn);
  if (tally.lost > 0) text += fmt::format(", {} lost", tally.lost);
  return text + (for_s > 0 ? fmt::format(", {:.0f} s left", std::max(0.0, for_s - log.duration_s()))
                           : ", Ctrl-C ends it");
}

// Until the time is over, or a signal.
std::unique_ptr<listen::Log> record(const Options& o, listen::Listener& listener,
                                    const std::atomic<bool>& stop) {
  std::unique_ptr<listen::Log> log;
  std::vector<listen::Sample> samples;
  ProgressLine line;
  while (!stop && !(log && o.for_s > 0 && log->duration_s() >= o.for_s)) {
    switch (listener.wait(0.1, samples)) {
      case listen::Event::gone:
        cli::log("the port has gone: plug the board in again, the recording goes on");
        break;
      case listen::Event::back:
        cli::log("the port is back");
        break;
      default:
        take(samples, listener, o.out, log);
    }
    if (!log && listener.now_s() > kPatience_s)
      throw io::JobError("no sample came: the glove is heard but says nothing that can be recorded");
    if (log) line.show(how_it_goes(listener, *log, o.for_s));
  }
  if (log) log->flush();
  return log;
}

void run(const Options& o) {
  io::require_writable(o.out);
  if (std::filesystem::exists(o.out))
    throw io::InputError(o.out + ": is there already: a recording is never written over, name another");
  const std::unique_ptr<listen::Listener> listener = open_glove(o.glove);
  StopOnSignal stop;
  const std::unique_ptr<listen::Log> log = record(o, *listener, *stop.flag());
  if (!log) stop.end();
  const listen::Tally& tally = listener->decoder().tally();
  if (o.json) {
    return print(io::dump({{"out", o.out},
                           {"format", listen::name_of(listener->format())},
                           {"baud", listener->baud()},
                           {"columns", listener->decoder().columns()},
                           {"rows", log->rows()},
                           {"duration_s", log->duration_s()},
                           {"torn", tally.torn},
                           {"lost", tally.lost},
                           {"board_restarts", log->restarts()},
                           {"unplugged", listener->times_gone()},
                           {"version", FLEXOR_VERSION}}));
  }
  print(fmt::format(
      "{}: {} rows in {:.1f} s, {} torn, {} lost, {} restarts of the board, {} times unplugged\n", o.out,
      log->rows(), log->duration_s(), tally.torn, tally.lost, log->restarts(), listener->times_gone()));
}

}  // namespace

void add_record(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "record", "What a glove says, as a recording: wide CSV with the board's clock and this machine's");
  command->add_option("OUT", o->out, "CSV file, whole lines at any instant; Ctrl-C ends the recording")
      ->required();
  add_options(*command, o->glove);
  command->add_option("--for", o->for_s, "seconds (default: until Ctrl-C)")->check(CLI::PositiveNumber);
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
