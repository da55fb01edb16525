// Channel-samples per second of the compensator, beside a dense Eigen state-space step in the same run.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"

namespace {

using namespace flexor;
constexpr int kChannels = 5;
constexpr std::size_t kSamples = 4096;

// Readings that wander over the whole range, as `Number` (Q5 where it is an integer).
template <class Number>
std::vector<Number> readings() {
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  std::vector<Number> out(kSamples * kChannels);
  double value[kChannels] = {80, 80, 80, 80, 80};
  for (std::size_t i = 0; i < out.size(); ++i) {
    double& v = value[i % kChannels];
    v = std::clamp(v + 4 * noise(random), 10.0, 150.0);
    out[i] = static_cast<Number>(std::is_integral_v<Number> ? v * 32 : v);
  }
  return out;
}

model::Model published() { return model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json"); }

template <class Arithmetic>
void run(benchmark::State& state) {
  model::Compensator<Arithmetic> glove(published());
  const std::vector<double> in = readings<double>();
  std::vector<double> out(in.size());
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      const auto samples = glove.step({&in[k * kChannels], kChannels});
      for (std::size_t i = 0; i < kChannels; ++i) out[k * kChannels + i] = samples[i].angle_deg;
    }
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.counters["channel_samples/s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * kSamples * kChannels), benchmark::Counter::kIsRate);
}

BENCHMARK(run<model::FloatArithmetic>)->Name("compensator/hammerstein_wiener/float");
BENCHMARK(run<model::FixedArithmetic>)->Name("compensator/hammerstein_wiener/fixed");

// x = A x + B phi(u), y = sat(x): the same compensator as a matrix library would write it.
void eigen_dense(benchmark::State& state) {
  const model::Model m = published();
  const std::vector<model::Channel> channels = model::channels(m);
  using Vector = Eigen::Matrix<float, kChannels, 1>;
  using Matrix = Eigen::Matrix<float, kChannels, kChannels>;
  Matrix a = Matrix::Zero();
  Matrix b = Matrix::Zero();
  Vector low;
  Vector high;
  Vector from;
  Vector to;
  for (int i = 0; i < kChannels; ++i) {
    const model::Channel& c = channels[static_cast<std::size_t>(i)];
    const auto pole = static_cast<float>(std::exp(c.lti.poles_rad_s[0] * m.sample_period_s));
    a(i, i) = pole;
    b(i, i) = (1 - pole) * static_cast<float>(c.lti.gain);
    low(i) = static_cast<float>(c.dead_zone->lower);
    high(i) = static_cast<float>(c.dead_zone->upper);
    from(i) = static_cast<float>(c.saturation.lower_deg);
    to(i) = static_cast<float>(c.saturation.upper_deg);
  }
  const std::vector<float> in = readings<float>();
  std::vector<float> out(in.size());
  benchmark::DoNotOptimize(a.data());  // dense: the zeros are not known to the compiler
  benchmark::DoNotOptimize(b.data());
  Vector x = Vector::Zero();
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      const Eigen::Map<const Vector> u(&in[k * kChannels]);
      const Vector v = u - u.cwiseMax(low).cwiseMin(high);
      x = a * x + b * v;
      Eigen::Map<Vector> y(&out[k * kChannels]);
      y = x.cwiseMax(from).cwiseMin(to);
    }
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.counters["channel_samples/s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * kSamples * kChannels), benchmark::Counter::kIsRate);
}
BENCHMARK(eigen_dense)->Name("compensator/peer_eigen_dense/float");

}  // namespace
