#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/cli/commands.hpp"
#include "apps/cli/glove_port.hpp"
#include "host/io/interrupt.hpp"

namespace flexor::cli::monitor_command {

struct Options {
  GlovePort glove;
  double for_s = 0;
  bool json = false;
};

constexpr double kRefresh_s = 0.1;

// What one column has shown so far.
struct Range {
  double least = INFINITY;
  double most = -INFINITY;
  double now = NAN;
  std::string remark;

  void add(double value) {
    now = value;
    if (std::isnan(value)) return;  // of a missing reading
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

std::string bar(const Range& range) {
  constexpr int kWidth = 32;
  const double span = range.most - range.least;
  const int filled = span > 0 && !std::isnan(range.now)
                         ? static_cast<int>(std::lround(kWidth * (range.now - range.least) / span))
                         : 0;
  std::string out;
  for (int i = 0; i < kWidth; ++i) out += i < filled ? "█" : "·";
  return out;
}

void add(std::vector<Range>& ranges, const listen::Sample& sample) {
  ranges.resize(sample.value.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    ranges[i].add(sample.value[i]);
    if (!sample.remark.empty()) ranges[i].remark = sample.remark[i];
  }
}

std::string text_of(const listen::Source& source, const std::vector<Range>& ranges, double rate_hz,
                    bool terminal) {
  const char* clear = terminal ? "\033[K" : "";
  std::string out;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const Range& r = ranges[i];
    const std::string& name = source.columns()[i];
    if (name.ends_with("_quality")) continue;  // the remark says it
    const std::string ends =
        r.least > r.most ? "no reading" : fmt::format("{:.1f} to {:.1f}", r.least, r.most);
    out += fmt::format("{}{:<18} {:8.1f} {} {}{}{}\n", clear, io::one_line(name), r.now, bar(r), ends,
                       r.remark.empty() ? "" : "  ", io::one_line(r.remark));
  }
  const listen::Tally& tally = source.tally();
  return out + fmt::format("{}{:.1f} samples a second, {} malformed, {}{}\n", clear, rate_hz, tally.malformed,
                           listen::lost_in_words(tally), terminal ? "; Ctrl-C ends this" : "");
}

// On a terminal in the same place again and again; in a pipe only the last.
void run(const Options& o) {
  const std::unique_ptr<listen::Source> source = open_glove(o.glove);
  io::StopOnSignal stop;
  const bool live = !o.json && isatty(STDOUT_FILENO) != 0;
  const double begin_s = source->now_s();
  std::vector<Range> ranges;
  double count = 0;  // of samples
  const auto rate_hz = [&] { return count / std::max(source->now_s() - begin_s, 1e-3); };
  double drawn_s = -1;
  bool drawn = false;
  while (!*stop.flag() && (o.for_s == 0 || source->now_s() - begin_s < o.for_s)) {
    std::vector<listen::Sample> samples;
    const listen::Event event = source->wait(kRefresh_s, samples);
    if (event == listen::Event::gone) log("the port has gone: plug the board in again");
    if (event == listen::Event::back) log("the port is back");
    if (event == listen::Event::ended) break;
    for (const listen::Sample& sample : samples) add(ranges, sample);
    count += static_cast<double>(samples.size());
    if (!live || ranges.empty() || source->now_s() - drawn_s < kRefresh_s) continue;
    std::string text = text_of(*source, ranges, rate_hz(), true);
    const bool is_over_last =
        std::exchange(drawn, event != listen::Event::gone && event != listen::Event::back) && drawn_s >= 0;
    if (is_over_last) text.insert(0, fmt::format("\033[{}A", std::ranges::count(text, '\n')));
    print_as_it_is("\033[?7l" + text + "\033[?7h");  // a line that the terminal would break is cut off by it
    drawn_s = source->now_s();
  }
  if (!o.json) return live ? void() : print_as_it_is(text_of(*source, ranges, rate_hz(), false));
  Json columns = Json::array();
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const auto& [least, most, now, remark] = ranges[i];
    columns.push_back(
        {{"name", source->columns()[i]}, {"now", now}, {"least", least}, {"most", most}, {"remark", remark}});
  }
  const listen::Tally& tally = source->tally();
  Json json = source_json(o.glove, *source);
  json.update({{"rate_hz", rate_hz()},
               {"columns", std::move(columns)},
               {"torn", tally.malformed},
               {"lost", tally.lost ? Json(*tally.lost) : Json(nullptr)}});
  print({json, ""}, true);
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "monitor",
                  "A glove in the terminal, as it moves: a bar for each finger; or a hand, with its duties "
                  "and faults; or, with --from, a recording, a simulated glove or a camera",
                  run, "one JSON object on standard output, at the end");
  add_options(*command, o->glove);
  add_speed(*command, o->glove);
  add_duration(*command, o->for_s);
}

}  // namespace flexor::cli::monitor_command
