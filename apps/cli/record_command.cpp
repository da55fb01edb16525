#include <chrono>
#include <memory>

#include "apps/cli/commands.hpp"
#include "apps/cli/glove_port.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/interrupt.hpp"
#include "host/listen/log.hpp"

namespace flexor::cli::record_command {

struct Options {
  std::string out;
  GlovePort glove;
  double for_s = 0;
  bool json = false;
};

constexpr double kPatience_s = 10;  // without a sample since the port was opened
constexpr double kSilence_s = 3;    // of a glove that spoke before

std::string how_it_goes(const listen::Source& source, const listen::Log& log, double left_s) {
  const listen::Tally& tally = source.tally();
  std::string text = fmt::format("{:.0f} s, {} rows", log.duration_s(), log.rows());
  if (tally.malformed > 0) text += fmt::format(", {} malformed", tally.malformed);
  if (tally.lost.value_or(0) > 0) text += ", " + listen::lost_in_words(tally);
  return text + (left_s > 0 ? fmt::format(", {:.0f} s left", left_s) : ", Ctrl-C ends it");
}

std::string why_silent(const listen::Tally& tally) {
  if (tally.malformed_since == 0) return "the glove fell silent: is it still running?";
  const std::string example = io::start_of(tally.malformed_line, 80);  // frames have none
  return fmt::format("{} malformed rows came last{}", tally.malformed_since,
                     example.empty() ? "" : ", such as \"" + example + "\"");
}

struct Recorded {
  std::unique_ptr<listen::Log> log;
  int unplugged = 0;    // times
  double silent_s = 0;  // at its end
};

// Until the time is over, the source is at its end, or a signal.
Recorded record(const Options& o, listen::Source& source, const std::atomic<bool>& stop) {
  Recorded out;
  std::vector<listen::Sample> samples;
  ProgressLine line;
  std::unique_ptr<listen::Log>& log = out.log;
  listen::Event event = listen::Event::quiet;
  listen::Span span(o.for_s);
  bool is_silent = false;
  // What is simulated or played again has a clock of its own.
  const bool is_real = o.glove.from.empty() || std::filesystem::is_character_file(o.glove.from);
  const std::chrono::duration<double> now = std::chrono::steady_clock::now().time_since_epoch();
  // Of this machine's clock, where the source's is zero.
  const double begin_s = is_real ? now.count() - source.now_s() : 0;
  while (!stop && event != listen::Event::ended && !span.is_over(source.now_s()) &&
         !(log && o.for_s > 0 && log->duration_s() >= o.for_s)) {
    event = source.wait(0.1, samples);
    if (event == listen::Event::gone) {
      cli::log("the port has gone: plug the board in again, the recording goes on");
      ++out.unplugged;
    }
    if (event == listen::Event::back) cli::log("the port is back");
    if (!samples.empty()) span.add_sample(source.now_s());
    if (!log && !samples.empty()) log = std::make_unique<listen::Log>(o.out, source.columns());
    for (listen::Sample& sample : samples) {
      sample.host_s += begin_s;
      log->add(sample);
    }
    samples.clear();
    out.silent_s = event == listen::Event::ended ? 0 : span.silent_s(source.now_s());
    if (!std::exchange(is_silent, out.silent_s >= kSilence_s) && is_silent)
      cli::log_warning(
          fmt::format("no sample has come for {:g} s: {}", kSilence_s, why_silent(source.tally())));
    if (log) log->flush_if_due(begin_s + source.now_s());
    if (!log && (event == listen::Event::ended || source.now_s() > kPatience_s))
      throw io::JobError("no sample came: the glove sends, but nothing that can be recorded");
    if (log) line.show(how_it_goes(source, *log, span.left_s(source.now_s())));
  }
  if (log) log->flush();
  return out;
}

void run(const Options& o) {
  io::require_writable(o.out);
  if (std::filesystem::exists(o.out))
    throw io::InputError(o.out + ": is there already: a recording is never written over, name another");
  const std::unique_ptr<listen::Source> source = open_glove(o.glove);
  io::StopOnSignal stop;
  const auto [log, unplugged, silent_s] = record(o, *source, *stop.flag());
  if (!log) throw io::Cancelled("interrupted");
  const listen::Tally& tally = source->tally();
  Json json = {{"out", o.out}};
  json.update(source_json(o.glove, *source));
  json.update({{"columns", source->columns()},
               {"rows", log->rows()},
               {"duration_s", log->duration_s()},
               {"torn", tally.malformed},
               {"late", tally.late},
               {"lost", tally.lost ? Json(*tally.lost) : Json(nullptr)},
               {"board_restarts", log->restarts()},
               {"unplugged", unplugged}});
  print(
      {json, fmt::format(
                 "{}: {} rows in {:.1f} s, {} malformed, {}, {} restarts of the board, {} times unplugged\n",
                 o.out, log->rows(), log->duration_s(), tally.malformed, listen::lost_in_words(tally),
                 log->restarts(), unplugged)},
      o.json);
  if (silent_s >= kSilence_s)
    throw io::Doubt("{}: no sample came in the last {:.0f} s: {}", o.out, silent_s, why_silent(tally));
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(app, "record",
                                        "What a glove says, or with --from a simulated one or a camera, as a "
                                        "recording: wide CSV with the board's clock and this machine's",
                                        run);
  command->add_option("OUT", o->out, "CSV file, whole lines at any instant; Ctrl-C ends the recording")
      ->required();
  add_options(*command, o->glove);
  add_duration(*command, o->for_s);
}

}  // namespace flexor::cli::record_command
