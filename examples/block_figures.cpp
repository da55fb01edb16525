// The data behind docs/figures: each block of the compensator, the alignment, the resampler and one whole
// trial, from the libraries that flexor itself runs. script/figures draws them.
//
//   block_figures FOLDER MODELS   writes NAME.txt into it, columns for gnuplot; two empty lines part the curves
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <initializer_list>

#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/model/model.hpp"
#include "host/recording/align.hpp"
#include "host/recording/resample.hpp"
#include "host/twin/simulation.hpp"

namespace {

using namespace flexor;

constexpr double kGloveRate_hz = 10;
constexpr std::size_t kThumb = 0;
constexpr std::size_t kMiddle = 2;

class Table {
 public:
  void row(std::initializer_list<double> values) {
    for (const double v : values) text_ += fmt::format("{:.4f} ", v);
    text_ += '\n';
  }
  void next_curve() { text_ += "\n\n"; }
  void save(const std::filesystem::path& folder, const char* name) const {
    io::write_file(folder / fmt::format("{}.txt", name), text_);
  }

 private:
  std::string text_;
};

// A compensator of one finger that does nothing; each figure puts its block into it.
model::Channel plain() {
  model::Channel channel;
  channel.name = "index";
  channel.input_unit = "deg";
  channel.valid_min = -200;
  channel.valid_max = 400;
  channel.saturation = {-500, 500};
  return channel;
}

using Runner = model::Compensator<model::DoubleArithmetic>;

// The answer, started afresh, to a reading that stays as it is.
double settled(const model::Channel& channel, double u) {
  Runner runner(model::model_of(channel, 1 / kGloveRate_hz));
  double angle_deg = 0;
  for (int k = 0; k < 100; ++k) angle_deg = runner.step(u).angle_deg;
  return angle_deg;
}

// Static blocks: what comes out for each reading.
void draw_static(const std::filesystem::path& out) {
  model::Channel dead_zone = plain();
  dead_zone.dead_zone = {-10, 20};
  model::Channel curve = plain();
  curve.input_curve = {{0, 20, 50, 90, 120}, {28, 31, 70, 95, 113}};
  Table zone_table;
  Table curve_table;
  for (int u = -40; u <= 140; u += 1) {
    zone_table.row({double(u), settled(dead_zone, u)});
    curve_table.row({double(u), settled(curve, u)});
  }
  curve_table.next_curve();
  for (std::size_t k = 0; k < 5; ++k) curve_table.row({curve.input_curve->x[k], curve.input_curve->y[k]});
  zone_table.save(out, "dead_zone");
  curve_table.save(out, "curve");
}

// Both published compensators of the thumb at rest, from reading to angle.
void draw_saturation(const std::filesystem::path& out, const std::filesystem::path& models) {
  const model::Channel wiener = model::channels(model::load(models / "published_wiener.json"))[kThumb];
  const model::Channel hw = model::channels(model::load(models / "published_hw.json"))[kThumb];
  Table table;
  for (int u = 60; u <= 190; ++u) table.row({double(u), settled(wiener, u), settled(hw, u)});
  table.save(out, "saturation");
}

// Two plays under a reading that swings to and fro, less and less.
void draw_hysteresis(const std::filesystem::path& out) {
  model::Channel channel = plain();
  channel.hysteresis = {{4, 12}, {0.5, 0.5}};
  Runner runner(model::model_of(channel, 0.01));
  Table table;
  for (int k = 0; k <= 1500; ++k) {
    const double t_s = k / 100.0;
    const double u = 60 + (50 - 2.5 * t_s) * std::sin(2 * M_PI * t_s / 5 - M_PI / 2);
    table.row({t_s, u, runner.step(u).angle_deg});
  }
  table.save(out, "hysteresis");
}

// The published lag of the middle finger after a step: in continuous time, and every 0.1 s, exact and by
// Euler's rule, which is what the exact hold replaces.
void draw_lags(const std::filesystem::path& out) {
  const auto lagged = [](double rate_hz) {
    model::Channel channel = plain();
    channel.lti.poles_rad_s = {-19};
    return Runner(model::model_of(channel, 1 / rate_hz));
  };
  Table table;
  Runner fine = lagged(1000);
  fine.step(0.0);
  table.row({0, 0});
  for (int k = 1; k <= 600; ++k) table.row({k / 1000.0, fine.step(85.0).angle_deg});
  table.next_curve();
  Runner exact = lagged(kGloveRate_hz);
  exact.step(0.0);
  double euler_deg = 0;
  double before_deg = 0;
  table.row({0, 0, 0, 0});
  for (int k = 1; k <= 6; ++k) {
    const double after_deg = exact.step(85.0).angle_deg;
    euler_deg += 19 / kGloveRate_hz * (85 - euler_deg);
    table.row({k / kGloveRate_hz, after_deg, before_deg, euler_deg});
    before_deg = after_deg;
  }
  table.save(out, "lags");
}

// A finger that closes at the published speed, behind a lag of 19 rad/s, with tap c_0.
void draw_lead(const std::filesystem::path& out) {
  Table table;
  for (const double tap : {0.0, 1.0, 2.0}) {
    model::Channel channel = plain();
    channel.lti.poles_rad_s = {-19};
    if (tap != 0) channel.lti.taps = {tap};
    Runner runner(model::model_of(channel, 0.01));
    for (int k = 0; k <= 160; ++k) {
      const double t_s = k / 100.0;
      const double angle_deg = std::clamp(28 + 83 * (t_s - 0.2), 28.0, 113.0);
      table.row({t_s, angle_deg, runner.step(angle_deg).angle_deg});
    }
    table.next_curve();
  }
  table.save(out, "lead");
}

// Rows that come in bursts of three, with a pause, on the grid of a compensator of 10 Hz.
void draw_resampler(const std::filesystem::path& out) {
  const auto angle = [](double t_s) { return 60 + 30 * std::sin(2 * M_PI * t_s / 1.6); };
  std::vector<double> t_s;
  std::vector<double> value;
  for (int burst = 0; burst < 17; ++burst) {
    if (burst > 6 && burst < 11) continue;
    for (int i = 0; i < 3; ++i) {
      t_s.push_back(0.11 * burst + 0.012 * i);
      value.push_back(angle(t_s.back()) + (i - 1) * 4);
    }
  }
  Table table;
  for (std::size_t k = 0; k < t_s.size(); ++k) table.row({t_s[k], value[k]});
  table.next_curve();
  const recording::Samples samples = recording::resample({t_s, value}, 1 / kGloveRate_hz, 0.3);
  for (std::size_t k = 0; k < samples.t_s.size(); ++k)
    if (samples.pause[k] == 0) table.row({samples.t_s[k], samples.value[k]});
  table.next_curve();
  for (std::size_t k = 0; k < samples.t_s.size(); ++k)
    if (samples.pause[k] != 0) table.row({samples.t_s[k], samples.value[k]});
  table.save(out, "resampler");
}

twin::Trial trial(const std::filesystem::path& models, const char* compensator, const char* gesture) {
  const std::filesystem::path motion = models / "gestures" / gesture;
  const twin::TrialInput input{
      .parameters = twin::Parameters(),
      .motion = twin::Motion::from_json(io::read_file(motion), motion.string()),
      .compensator = model::load(models / compensator),
      .seed = 1,
      .record_samples = true,
  };
  twin::check(input);
  return twin::simulate(input, 0, 1).front();
}

// A log and a camera whose clock runs 3.7 s ahead: how much of the angle each offset lets the reading explain.
void draw_alignment(const std::filesystem::path& out, const std::filesystem::path& models) {
  constexpr double kOffset_s = 3.7;
  const twin::Trial played = trial(models, "published_hw.json", "calibration.json");
  std::vector<double> camera_s;
  std::vector<double> angle_deg;
  const double rate_hz = twin::Parameters().camera_rate_hz;
  for (const float angle : played.glove_deg[kMiddle]) {
    camera_s.push_back(static_cast<double>(camera_s.size()) / rate_hz + kOffset_s);
    angle_deg.push_back(static_cast<double>(angle));
  }
  const recording::Alignment found =
      recording::align({played.sample_s, played.alpha_deg[kMiddle]}, {camera_s, angle_deg});
  Table table;
  for (std::size_t k = 0; k < found.scan_offset_s.size(); ++k)
    table.row({found.scan_offset_s[k], found.scan_eta_squared[k]});
  table.next_curve();
  table.row({kOffset_s, 0});
  table.row({kOffset_s, 1});
  table.save(out, "alignment");
}

// One trial of gesture 1, the thumb, with each published compensator.
void draw_trial(const std::filesystem::path& out, const std::filesystem::path& models) {
  const double rate_hz = twin::Parameters().camera_rate_hz;
  Table table;
  for (const char* compensator : {"published_wiener.json", "published_hw.json"}) {
    const twin::Trial played = trial(models, compensator, "1.json");
    for (std::size_t k = 0; k < played.hand_deg[kThumb].size(); ++k)
      table.row({static_cast<double>(k) / rate_hz, double(played.glove_deg[kThumb][k]),
                 double(played.hand_deg[kThumb][k])});
    table.next_curve();
    for (std::size_t k = 0; k < played.sample_s.size(); ++k)
      table.row({played.sample_s[k], played.alpha_deg[kThumb][k], played.beta_deg[kThumb][k]});
    table.next_curve();
  }
  table.save(out, "trial");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: block_figures FOLDER MODELS\n", stderr);
    return 2;
  }
  try {
    const std::filesystem::path out = argv[1];
    const std::filesystem::path models = argv[2];
    draw_static(out);
    draw_hysteresis(out);
    draw_lags(out);
    draw_saturation(out, models);
    draw_lead(out);
    draw_resampler(out);
    draw_alignment(out, models);
    draw_trial(out, models);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "block_figures: {}\n", error.what());
    return 1;
  }
}
