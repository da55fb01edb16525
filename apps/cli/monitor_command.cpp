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

class View {
 public:
  explicit View(const listen::Source& source) : source_(source) {}

  void add(const std::vector<listen::Sample>& samples) {
    for (const listen::Sample& sample : samples) {
      ranges_.resize(sample.value.size());
      for (std::size_t i = 0; i < sample.value.size(); ++i) {
        ranges_[i].add(sample.value[i]);
        if (!sample.remark.empty()) ranges_[i].remark = sample.remark[i];
      }
    }
    samples_ += samples.size();
  }

  // The same place of the terminal again and again; in a pipe only the last.
  void draw(bool terminal, bool again) const {
    const char* clear = terminal ? "\033[K" : "";
    std::string out;
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      const Range& r = ranges_[i];
      const std::string& name = source_.columns()[i];
      if (name.ends_with("_quality")) continue;  // the remark says it
      const std::string ends =
          r.least > r.most ? "no reading" : fmt::format("{:.1f} to {:.1f}", r.least, r.most);
      out += fmt::format("{}{:<18} {:8.1f} {} {}{}{}\n", clear, io::one_line(name), r.now, bar(r), ends,
                         r.remark.empty() ? "" : "  ", io::one_line(r.remark));
    }
    const listen::Tally& tally = source_.tally();
    out += fmt::format("{}{:.1f} samples a second, {} malformed, {}{}\n", clear, rate_hz(), tally.torn,
                       listen::lost_in_words(tally), terminal ? "; Ctrl-C ends this" : "");
    if (again) out.insert(0, fmt::format("\033[{}A", std::ranges::count(out, '\n')));
    // A line that the terminal would break is cut off by it.
    print_as_it_is(terminal ? "\033[?7l" + out + "\033[?7h" : out);
  }

  bool has_rows() const { return !ranges_.empty(); }
  double rate_hz() const {
    return static_cast<double>(samples_) / std::max(source_.now_s() - begin_s_, 1e-3);
  }

  Json json() const {
    Json columns = Json::array();
    for (std::size_t i = 0; i < ranges_.size(); ++i)
      columns.push_back({{"name", source_.columns()[i]},
                         {"now", ranges_[i].now},
                         {"least", ranges_[i].least},
                         {"most", ranges_[i].most},
                         {"remark", ranges_[i].remark}});
    return columns;
  }

 private:
  const listen::Source& source_;
  double begin_s_ = source_.now_s();
  std::vector<Range> ranges_;
  std::uint64_t samples_ = 0;
};

void run(const Options& o) {
  const std::unique_ptr<listen::Source> source = open_glove(o.glove);
  io::StopOnSignal stop;
  View view(*source);
  const bool live = !o.json && isatty(STDOUT_FILENO) != 0;
  const double begin_s = source->now_s();
  double drawn_s = -1;
  bool drawn = false;
  while (!*stop.flag() && (o.for_s == 0 || source->now_s() - begin_s < o.for_s)) {
    std::vector<listen::Sample> samples;
    const listen::Event event = source->wait(kRefresh_s, samples);
    if (event == listen::Event::gone) log("the port has gone: plug the board in again");
    if (event == listen::Event::back) log("the port is back");
    if (event == listen::Event::ended) break;
    view.add(samples);
    if (!live || !view.has_rows() || source->now_s() - drawn_s < kRefresh_s) continue;
    view.draw(true, std::exchange(drawn, event != listen::Event::gone && event != listen::Event::back) &&
                        drawn_s >= 0);
    drawn_s = source->now_s();
  }
  if (o.json) {
    const listen::Tally& tally = source->tally();
    Json json = source_json(o.glove, *source);
    json.update({{"rate_hz", view.rate_hz()},
                 {"columns", view.json()},
                 {"torn", tally.torn},
                 {"lost", tally.lost ? Json(*tally.lost) : Json(nullptr)}});
    return print({json, ""}, true);
  }
  if (!live) view.draw(false, false);
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
