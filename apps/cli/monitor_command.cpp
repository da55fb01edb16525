#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/cli/commands.hpp"
#include "apps/cli/glove_port.hpp"
#include "apps/cli/stop.hpp"
#include "host/io/json.hpp"

namespace flexor::cli {
namespace {

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
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

std::string bar(const Range& range) {
  constexpr int kWidth = 40;
  const double span = range.most - range.least;
  const int filled = span > 0 ? static_cast<int>(std::lround(kWidth * (range.now - range.least) / span)) : 0;
  std::string out;
  for (int i = 0; i < kWidth; ++i) out += i < filled ? "█" : "·";
  return out;
}

class View {
 public:
  explicit View(const listen::Listener& listener) : listener_(listener) {}

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
    std::string out = again ? fmt::format("\033[{}A", ranges_.size() + 1) : "";
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      const Range& r = ranges_[i];
      out +=
          fmt::format("{}{:<18} {:8.1f} {} {:.1f} to {:.1f}{}{}\n", clear, listener_.decoder().columns()[i],
                      r.now, bar(r), r.least, r.most, r.remark.empty() ? "" : "  ", r.remark);
    }
    const listen::Tally& tally = listener_.decoder().tally();
    out += fmt::format("{}{:.1f} samples a second, {} torn, {} lost{}\n", clear, rate_hz(), tally.torn,
                       tally.lost, terminal ? "; Ctrl-C ends this" : "");
    print(out);
  }

  bool has_rows() const { return !ranges_.empty(); }
  double rate_hz() const {
    return static_cast<double>(samples_) / std::max(listener_.now_s() - begin_s_, 1e-3);
  }

  nlohmann::ordered_json json() const {
    nlohmann::ordered_json columns = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      columns.push_back({{"name", listener_.decoder().columns()[i]},
                         {"now", ranges_[i].now},
                         {"least", ranges_[i].least},
                         {"most", ranges_[i].most},
                         {"remark", ranges_[i].remark}});
    }
    return columns;
  }

 private:
  const listen::Listener& listener_;
  double begin_s_ = listener_.now_s();
  std::vector<Range> ranges_;
  std::uint64_t samples_ = 0;
};

void run(const Options& o) {
  const std::unique_ptr<listen::Listener> listener = open_glove(o.glove);
  StopOnSignal stop;
  View view(*listener);
  const bool live = !o.json && isatty(STDOUT_FILENO) != 0;
  const double begin_s = listener->now_s();
  double drawn_s = -1;
  bool drawn = false;
  while (!*stop.flag() && (o.for_s == 0 || listener->now_s() - begin_s < o.for_s)) {
    std::vector<listen::Sample> samples;
    const listen::Event event = listener->wait(kRefresh_s, samples);
    if (event == listen::Event::gone) log("the port has gone: plug the board in again");
    if (event == listen::Event::back) log("the port is back");
    view.add(samples);
    if (!live || !view.has_rows() || listener->now_s() - drawn_s < kRefresh_s) continue;
    view.draw(true, std::exchange(drawn, event != listen::Event::gone && event != listen::Event::back) &&
                        drawn_s >= 0);
    drawn_s = listener->now_s();
  }
  if (o.json) {
    const listen::Tally& tally = listener->decoder().tally();
    return print(io::dump({{"port", o.glove.port},
                           {"format", listen::name_of(listener->format())},
                           {"baud", listener->baud()},
                           {"rate_hz", view.rate_hz()},
                           {"columns", view.json()},
                           {"torn", tally.torn},
                           {"lost", tally.lost},
                           {"version", FLEXOR_VERSION}}));
  }
  if (!live) view.draw(false, false);
}

}  // namespace

void add_monitor(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "monitor",
      "A glove in the terminal, as it moves: a bar for each finger; or a hand, with its duties and faults");
  add_options(*command, o->glove);
  command->add_option("--for", o->for_s, "seconds (default: until Ctrl-C)")->check(CLI::PositiveNumber);
  command->add_flag("--json", o->json, "one JSON object on standard output, at the end");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
