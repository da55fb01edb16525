#include "apps/live/twin_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "host/io/io.hpp"
#include "host/twin/random.hpp"

namespace flexor::live {
namespace {

constexpr std::uint64_t kTrial = 0;
constexpr double kMostBehind_s = 2;

// The motion is only how the hand rests before the first one.
twin::TrialInput input_of(const TwinOptions& o) {
  if (!(o.rate_hz >= 1 && o.rate_hz <= twin::kMaxRate_hz)) {
    throw io::InputError(
        fmt::format("a rate of {:g} Hz: the twin's glove has 1 to {:g}", o.rate_hz, twin::kMaxRate_hz));
  }
  twin::TrialInput out{o.parameters, study::short_motion(),
                       study::compensator("raw", study::kPublishedRate_hz).model, o.seed};
  twin::check(out);
  out.compensator.sample_period_s = 1 / o.rate_hz;  // of which the world takes how often strips are read
  return out;
}

void require_within(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return;
  throw io::InputError(fmt::format("{} {:g}: must lie between {:g} and {:g}", name, value, least, most));
}

}  // namespace

TwinSource::TwinSource(TwinOptions options)
    : input_(input_of(options)),
      rate_hz_(options.rate_hz),
      world_(input_, kTrial),
      wearer_(twin::draw_variation(input_.parameters, twin::seed_of(input_.seed, kTrial)), input_.motion),
      random_(twin::seed_of(input_.seed, 1)) {
  for (const std::string& finger : model::finger_names()) columns_.push_back(finger + "_count");
  while (world_.now_ms() < 0) step();  // at rest, where the wearer is
  world_.finger_at = [this](int finger, std::int64_t t_ms) { return wearer_.angle(finger, t_ms); };
  if (options.motion) play(std::move(options.motion));
  start_ = std::chrono::steady_clock::now();
}

void TwinSource::set(const WornChange& c) {
  constexpr double kFar = 1000;
  require_within("slip", c.slip_deg, -kFar, kFar);
  require_within("drift", c.drift_deg_per_min, -kFar, kFar);
  require_within("noise", c.noise_counts, 0, kFar);
  require_within("loss", c.loss, 0, 1);
  set_ = c;
}

void TwinSource::play(std::optional<twin::Motion> motion) {
  // The world has asked for the fingers up to the end of the block that it is in.
  const std::int64_t since_start = world_.now_ms() - twin::World::kStart_ms;
  const std::int64_t next_ms =
      (since_start + twin::kBlock_ms - 1) / twin::kBlock_ms * twin::kBlock_ms + twin::World::kStart_ms;
  if (motion) return wearer_.play(*std::move(motion), next_ms);
  wearer_.rest(next_ms);
}

void TwinSource::step() {
  drifted_deg_ += set_.drift_deg_per_min / 60000;
  for (int i = 0; i < twin::kFingers; ++i) world_.shift_strip(i, set_.slip_deg + drifted_deg_);
  world_.step({});
}

double TwinSource::now_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

std::string TwinSource::says() const { return fmt::format("the twin's glove at {:g} Hz", rate_hz_); }

// Of the next sample, on the simulation's clock.
double TwinSource::due_s() const { return static_cast<double>(samples_) / rate_hz_; }

void TwinSource::sample(std::vector<listen::Sample>& out) {
  const double t_s = due_s();
  while (static_cast<double>(world_.now_ms()) < 1000 * t_s) step();
  ++samples_;
  listen::Sample now{t_s + waited_s_, t_s, {}, {}};
  for (int i = 0; i < twin::kFingers; ++i) {
    const double noise = set_.noise_counts * random_.normal();
    const double counts = world_.glove_counts(i, t_s) + std::round(noise);
    now.value.push_back(std::clamp(counts, 0.0, static_cast<double>(twin::kAdcTop)));
    finger_deg_[static_cast<std::size_t>(i)] = world_.finger_deg(i);
  }
  if (random_.uniform() < set_.loss) {
    ++*tally_.lost;
    return;
  }
  ++tally_.samples;
  out.push_back(std::move(now));
}

listen::Event TwinSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  const double behind_s = now_s() - waited_s_ - due_s();
  if (behind_s > kMostBehind_s) waited_s_ += behind_s;
  const double wait_s = std::min(timeout_s, due_s() + waited_s_ - now_s());
  if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
  const std::size_t before = out.size();
  for (const double here_s = now_s() - waited_s_; due_s() <= here_s;) sample(out);
  return out.size() > before ? listen::Event::samples : listen::Event::quiet;
}

}  // namespace flexor::live
