// One prediction with its Jacobian, and one whole fit, on a synthetic recording of glove size.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"
#include "host/recording/align.hpp"

namespace {

using namespace flexor;
constexpr int kSamples = 3000;

identify::Data data() {
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  identify::Data d;
  d.channel = "index";
  d.period_s = 0.05;
  d.input.resize(kSamples);
  d.angle_deg.resize(kSamples);
  d.use.assign(kSamples, 1);
  double x = 0;
  for (int k = 0; k < kSamples; ++k) {
    const double u = 500 + 250 * std::sin(0.043 * k) + 150 * std::sin(0.117 * k + 1);
    const double w = 10 + 80 * std::pow((u - 100) / 800, 1.4);
    x = k == 0 ? w : x + 0.2 * (w - x);
    d.input(k) = u;
    d.angle_deg(k) = x + 0.5 * noise(random);
  }
  return d;
}

void prediction_with_jacobian(benchmark::State& state) {
  const identify::Data d = data();
  identify::Options options;
  options.only_start = 0;
  const identify::Summary s = identify::fit(identify::blocks_of("hw"), d, options);
  const identify::Predictor predictor(s.structure, s.knots, d.input, d.period_s);
  Eigen::MatrixXd jacobian;
  for (auto _ : state) benchmark::DoNotOptimize(predictor.predict(s.theta, &jacobian));
  state.counters["parameters"] = static_cast<double>(s.theta.size());
}
BENCHMARK(prediction_with_jacobian)->Name("identify/prediction_with_jacobian/hw/3000");

void fit(benchmark::State& state) {
  const identify::Data d = data();
  const identify::Structure structure = identify::blocks_of("hw");
  for (auto _ : state) benchmark::DoNotOptimize(identify::fit(structure, d));
}
BENCHMARK(fit)->Name("identify/fit/hw/3000")->Unit(benchmark::kMillisecond);

void align(benchmark::State& state) {
  const identify::Data d = data();
  std::vector<double> t;
  for (int k = 0; k < kSamples; ++k) t.push_back(k * d.period_s);
  const std::vector<double> u(d.input.begin(), d.input.end());
  const std::vector<double> y(d.angle_deg.begin(), d.angle_deg.end());
  for (auto _ : state) benchmark::DoNotOptimize(recording::align({t, u}, {t, y}));
}
BENCHMARK(align)->Name("recording/align/150s")->Unit(benchmark::kMillisecond);

}  // namespace
