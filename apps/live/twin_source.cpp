#include "apps/live/twin_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>
#include <utility>

#include "host/deploy/hardware.hpp"
#include "host/study/bench.hpp"
#include "host/twin/glove.hpp"
#include "host/twin/radio.hpp"
#include "host/twin/random.hpp"
#include "host/twin/world.hpp"

namespace flexor::live {
namespace {

constexpr std::uint64_t kTrial = 0;
// From a reading to the hand that follows it, as `flexor twin record --rate 50 --set radio.frame_rate_hz=25` finds it.
constexpr double kLead_s = 0.064;
constexpr double kMostBehind_s = 0.05;  // as the simulated boards
constexpr double kMostFrames_hz = 25;   // what the radio carries beside a glove of 100 Hz

twin::TrialInput input_of(const TwinOptions& o) {
  constexpr std::uint64_t kSeed = 1;
  twin::TrialInput out{{}, study::short_motion(), study::compensator("published-hw", o.rate_hz).model, kSeed};
  if (out.parameters.frame_rate_hz == 0) out.parameters.frame_rate_hz = std::min(o.rate_hz, kMostFrames_hz);
  twin::check(out);
  return out;
}

}  // namespace

// From World::kStart_ms on, which is `begin_ms` on the source's clock.
struct TwinSource::Run {
  Run(twin::TrialInput trial, std::int64_t begin)
      : input(std::move(trial)), begin_ms(begin), period_s(input.compensator.sample_period_s) {
    chain.emplace(twin::glove_chain(input));
  }

  double sample_s() const { return static_cast<double>(samples) * period_s; }

  bool step(const WornChange& set, double drifted_deg) {
    for (int i = 0; i < twin::kFingers; ++i) world.shift_sensor(i, set.slip_deg + drifted_deg);
    const bool samples_now =
        static_cast<double>(world.now_ms() - twin::World::kStart_ms) >= 1000 * sample_s();
    if (samples_now) sample(set.noise_counts);
    if (world.now_ms() >= radio.next_arrival_ms()) {
      if (const twin::FrameAngles* angles = radio.receive(world.now_ms())) world.command(*angles);
    }
    world.step();
    return samples_now;
  }

  void sample(double noise_counts) {
    const double t_s = sample_s() + static_cast<double>(twin::World::kStart_ms) / 1000;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const auto noise = static_cast<int>(std::lround(noise_counts * random.normal()));
      counts[i] = std::clamp(world.glove_counts(static_cast<int>(i), t_s) + noise, 0, twin::kAdcTop);
    }
    const link::Frame& frame = chain->step(counts);
    const auto every = std::lround(1 / (period_s * input.parameters.frame_rate_hz));
    if (samples++ % every == 0) radio.send(world.now_ms(), std::to_array(frame.angle));
  }

  twin::TrialInput input;
  std::int64_t begin_ms;
  double period_s;
  twin::World world{input, kTrial};
  std::optional<model::HostChain> chain;
  twin::Radio radio{input.parameters, twin::seed_of(twin::seed_of(input.seed, kTrial), twin::Purpose::radio)};
  twin::Random random{twin::seed_of(input.seed, 1)};
  std::array<int, twin::kFingers> counts{};
  std::int64_t samples = 0;
};

TwinSource::TwinSource(TwinOptions options)
    : input_(input_of(options)),
      pace_(options.pace),
      wearer_(twin::draw_variation(input_.parameters, twin::seed_of(input_.seed, kTrial)), input_.motion),
      unit_(options.unit),
      reading_(twin::Divider(input_.parameters).reading(unit_, "of the glove")) {
  tally_.lost = 0;
  facts.why_not_written = "the twin has no board: start flexor live --boards";
  facts.rate_hz = options.rate_hz;
  facts.lead_s = kLead_s;
  begin_again();
  for (const std::string& finger : model::finger_names())
    columns_.push_back(finger + (unit_ == "deg" ? "_alpha_" : "_") + unit_);
  if (options.motion) play(std::move(options.motion));
}

TwinSource::~TwinSource() = default;

twin::TrialInput TwinSource::now_worn() const {
  twin::TrialInput out = input_;
  out.parameters.loss = std::min(1.0, out.parameters.loss + set_.loss);
  return out;
}

void TwinSource::set(const WornChange& c) {
  set_ = c;
  run_->input.parameters.loss = now_worn().parameters.loss;
}

void TwinSource::load(const model::Model& model) {
  std::vector<std::string> notes;
  run_on_glove(deploy::on_hand(model, {}, notes));
}

void TwinSource::run_on_glove(model::Model compensator) {
  compensator.sample_period_s = input_.compensator.sample_period_s;
  twin::TrialInput next = input_;
  next.compensator = std::move(compensator);
  twin::check(next);
  input_ = std::move(next);
  run_->chain.emplace(twin::glove_chain(input_));
}

void TwinSource::play(std::optional<twin::Motion> motion) {
  // The world has asked for the fingers up to the end of the block that it is in.
  const std::int64_t next_ms = (now_ms_ + twin::kBlock_ms - 1) / twin::kBlock_ms * twin::kBlock_ms;
  is_joining_ = motion.has_value();
  if (!motion) return wearer_.rest(next_ms);
  input_.motion = *motion;
  wearer_.play(*std::move(motion), next_ms);
  wearer_.postpone(-twin::World::kStart_ms - twin::Wearer::kBefore_ms);
}

void TwinSource::begin_again() {
  run_ = std::make_unique<Run>(now_worn(), now_ms_);
  run_->world.finger_at = [this, ahead_ms = now_ms_ - twin::World::kStart_ms](int finger, std::int64_t t_ms) {
    return wearer_.angle(finger, t_ms + ahead_ms);
  };
  is_joining_ = false;
}

std::optional<double> TwinSource::begun_s() const {
  if (is_joining_) return std::nullopt;
  return static_cast<double>(run_->begin_ms) / 1000;
}

bool TwinSource::step() {
  if (is_joining_ && now_ms_ == *wearer_.start_ms() + twin::World::kStart_ms) begin_again();
  drifted_deg_ += set_.drift_deg_per_min / 60000;
  ++now_ms_;
  return run_->step(set_, drifted_deg_);
}

double TwinSource::wall_s() const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
  return start_s_ + pace_ * passed.count();
}

void TwinSource::play(const std::string& motion, double pace) {
  play(study::bench_motion(motion));
  start_s_ = wall_s();
  start_ = std::chrono::steady_clock::now();
  pace_ = pace;
}

std::string TwinSource::description() const {
  return fmt::format("the twin's glove at {:g} Hz, in {}", 1 / input_.compensator.sample_period_s, unit_);
}

// Of the next sample.
double TwinSource::due_s() const { return static_cast<double>(run_->begin_ms) / 1000 + run_->sample_s(); }

listen::Event TwinSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  if (pace_ > 0) {
    start_s_ -= std::max(0.0, wall_s() - due_s() - kMostBehind_s);
    const double wait_s = std::min(timeout_s, (due_s() - wall_s()) / pace_);
    if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    if (wall_s() < due_s()) return listen::Event::quiet;
  }
  while (!step()) {
  }
  const double t_s = due_s() - run_->period_s;
  if (run_->random.uniform() < set_.loss) {
    ++*tally_.lost;
    return listen::Event::quiet;
  }
  ++tally_.samples;
  out.push_back({t_s, t_s, {}, {}});
  std::ranges::transform(run_->counts, std::back_inserter(out.back().value), reading_);
  return listen::Event::samples;
}

study::BenchView TwinSource::now() const {
  study::BenchView out;
  for (int i = 0; i < twin::kFingers; ++i) {
    out.finger_deg[static_cast<std::size_t>(i)] = run_->world.finger_deg(i);
    out.joint_deg[static_cast<std::size_t>(i)] = run_->world.joint_deg(i);
  }
  return out;
}

std::function<double(const twin::Motion&)> TwinSource::score_on() const {
  return [input = now_worn(), set = set_, drifted_deg = drifted_deg_](const twin::Motion& motion) mutable {
    input.motion = motion;
    Run run(input, 0);
    while (run.world.now_ms() <= run.world.end_ms()) run.step(set, drifted_deg);
    const twin::PerFinger error_deg_s = run.world.finish().error_deg_s;
    return std::accumulate(error_deg_s.begin(), error_deg_s.end(), 0.0);
  };
}

WornGlove::Score TwinSource::score() {
  return [on = score_on()](const Jobs::Goes& goes) {
    std::vector<double> out;
    for (const twin::Motion& gesture : study::motions("1-6")) {
      out.push_back(on(gesture));
      if (!goes({"six gestures", out.size(), 6})) throw io::Cancelled("stopped");
    }
    return out;
  };
}

}  // namespace flexor::live
