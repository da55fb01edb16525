// The twin against real time: sixteen trials side by side, and the same trials one finger after another
// without vector instructions. Both run gesture 1 with all effects on, with the published Hammerstein-Wiener
// compensator at 10 Hz; both give the same bits (a test). `times_real_time` is simulated seconds of
// five-finger closed loop for each second.
#include <benchmark/benchmark.h>

#include "host/study/trials.hpp"

namespace {

using namespace flexor;

// The shipped laboratory with what it has switched off: loss, corruption, jitter, an outage and faults.
twin::Parameters everything() {
  twin::Parameters p;
  for (const char* assignment :
       {"radio.loss=0.05", "radio.corruption=0.01", "radio.jitter_s=0.05", "radio.outage_start_s=7",
        "radio.outage_s=0.5", "sensor.drift_deg_per_min=5"}) {
    twin::assign(p, assignment);
  }
  p.faults = {{1, twin::FaultKind::loose, 2, 1}, {4, twin::FaultKind::stuck, 6, 1}};
  return p;
}

twin::TrialInput input() {
  return {everything(), study::motions("1").front(), study::compensator("published-hw", 10).model, 1, false};
}

void report(benchmark::State& state, double trials_each) {
  const double simulated_s =
      input().motion.duration_s() * trials_each * static_cast<double>(state.iterations());
  state.counters["times_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}

void twin_vectors(benchmark::State& state) {
  const twin::TrialInput s = input();
  std::uint64_t first = 0;
  for (auto _ : state) benchmark::DoNotOptimize(twin::simulate(s, first += 16, 16));
  report(state, 16);
}
BENCHMARK(twin_vectors)->Unit(benchmark::kMillisecond);

void twin_scalar(benchmark::State& state) {
  const twin::TrialInput s = input();
  std::uint64_t first = 0;
  for (auto _ : state) benchmark::DoNotOptimize(twin::simulate_scalar(s, first += 16, 16));
  report(state, 16);
}
BENCHMARK(twin_scalar)->Unit(benchmark::kMillisecond);

}  // namespace
