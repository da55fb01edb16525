#include "cosim/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>

#include "firmware/markers.hpp"
#include "host/deploy/flash.hpp"
#include "host/score/trial.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kMostBehind(50);
constexpr std::int64_t kBenchSettled_ms = -300;  // as CoSimulation before a trial
constexpr std::int64_t kStill_ms = 2000;         // as a trial before its t = 0
constexpr double kAround_s = 4.5;                // to a gesture's beginning, and at rest there; about
constexpr int kInTouch_ms = 1000;
constexpr int kRestart_ms = 4000;          // through a bootloader that is in use
constexpr std::size_t kMostUnread = 4096;  // that a PC has not read

fs::path point(const fs::path& link, const std::string& terminal) {
  std::error_code error;
  if (fs::exists(link, error))
    throw io::InputError("{}: is no link, or its terminal is in use: choose another name for the port",
                         link.string());
  fs::remove(link, error);  // of one that was killed
  fs::create_symlink(terminal, link, error);
  if (error) throw io::InputError("{}: {}", link.string(), error.message());
  return link;
}

}  // namespace

Bench::Bench(BenchSetup setup)
    : setup_(std::move(setup)),
      images_(setup_.glove, deploy::unprotected_hand(setup_.input.parameters, setup_.input.compensator,
                                                     study::bench_key())),
      radio_loss_(setup_.input.parameters.loss),
      simulation_(images_, setup_.input, 0),
      wearer_(twin::draw_variation(setup_.input.parameters, twin::seed_of(setup_.input.seed, 0)),
              setup_.input.motion),
      noise_(twin::seed_of(setup_.input.seed, 1)),
      due_(Clock::now()) {
  if (!setup_.bootloader.empty())
    simulation_.glove().put_bootloader(
        deploy::read_intel_hex(setup_.bootloader, deploy::kAtmega328p.flash_bytes));
  connect();
  if (!setup_.link.empty()) link_.emplace(point(setup_.link, terminal()));
  while (simulation_.world().now_ms() < 0) step();
}

void Bench::connect() {
  simulation_.world().finger_at = [this](int finger, std::int64_t t_ms) {
    return wearer_.angle(finger, t_ms);
  };
  simulation_.on_air = [this](Cycles, std::uint8_t byte) {  // the glove's UART has begun to send it
    if (port_.is_open() && pc_listens_ && unread_.size() < kMostUnread)
      unread_ += static_cast<char>(port_.on_the_wire(byte, simulation_.glove().baud()));
  };
  simulation_.on_glove_air = [this](Cycles end, std::uint8_t byte) {
    if (program_runs_) radio_.push_back({end, byte});
  };
  simulation_.on_glove_marker = [this](Cycles cycle, std::uint8_t marker) {
    program_runs_ = true;
    if (marker == static_cast<std::uint8_t>(firmware::Marker::sampled)) sampled_ = cycle;
  };
  simulation_.glove().on_bite = [this](Cycles) { program_runs_ = false; };
  simulation_.on_reading = [this](std::int64_t, int finger, int counts) {
    if (worn_.noise_counts != 0)
      counts += static_cast<int>(std::lround(worn_.noise_counts * noise_.normal()));
    // Nothing is read of what a sensor has after the converter's end.
    return counts_[static_cast<std::size_t>(finger)] = std::clamp(counts, 0, twin::kAdcTop);
  };
}

void Bench::play(const std::string& motion) {
  const std::optional<twin::Motion> next = study::bench_motion(motion);
  motion_ = motion;
  // The world has asked for the fingers up to there.
  const std::int64_t blocks =
      (simulation_.world().now_ms() - twin::World::kStart_ms + twin::kBlock_ms - 1) / twin::kBlock_ms;
  const std::int64_t now_ms = blocks * twin::kBlock_ms + twin::World::kStart_ms;
  next ? wearer_.play(*next, now_ms) : wearer_.rest(now_ms);
}

void Bench::change(const study::BenchChange& c) {
  worn_ = c.worn;
  setup_.input.parameters.loss = std::min(1.0, radio_loss_ + worn_.loss);
  const std::string motion = c.motion.value_or(motion_);
  if (motion != motion_ || c.restart) play(motion);
}

study::BenchView Bench::advance(const study::BenchChange& c) {
  constexpr int kLasts_ms = 20;
  change(c);
  for (int ms = 0; ms < kLasts_ms; ++ms) {
    look_at_port();
    step();
    due_ = std::max(due_ + std::chrono::milliseconds(1), Clock::now() - kMostBehind);
    std::this_thread::sleep_until(due_);
  }
  return view();
}

void Bench::step() {
  drifted_deg_ += worn_.drift_deg_per_min / 60000;
  for (int i = 0; i < twin::kFingers; ++i) simulation_.world().shift_sensor(i, worn_.slip_deg + drifted_deg_);
  feed_glove();
  simulation_.glove_has_radio = program_runs_;
  simulation_.step();
}

void Bench::look_at_port() {
  if (port_.was_opened()) {
    simulation_.glove().reset();
    program_runs_ = false;
    typed_.clear();
    unread_.clear();
    radio_.clear();
  }
  const double baud = simulation_.glove().baud();
  if (typed_.empty()) typed_until_ = std::max(typed_until_, simulation_.glove().now());
  for (const std::uint8_t byte : port_.read()) typed_.push_back(port_.on_the_wire(byte, baud));
  unread_.erase(0, port_.write(unread_));
}

// What is complete at the glove's pin in the next millisecond, in order.
void Bench::feed_glove() {
  const Cycles end = CoSimulation::cycle_of(static_cast<double>(simulation_.world().now_ms() + 1));
  const auto byte_cycles =
      static_cast<Cycles>(10 * 1000.0 * static_cast<double>(kCyclesPerMs) / simulation_.glove().baud());
  const auto next = [&](Cycles at, std::uint8_t byte) {
    if (at < line_busy_until_ + byte_cycles) return;  // it began before the one before was over
    line_busy_until_ = at;
    simulation_.glove().receive(at, byte);
  };
  while (true) {
    const Cycles typed = typed_.empty() ? end + 1 : typed_until_ + byte_cycles;
    const Cycles received = radio_.empty() ? end + 1 : radio_.front().end;
    if (std::min(typed, received) > end) return;
    if (typed <= received) {
      typed_until_ = typed;
      next(typed, typed_.front());
      typed_.pop_front();
    } else {
      next(received, radio_.front().byte);
      radio_.pop_front();
    }
  }
}

// How much later the motion has to begin for the glove to sample it when a trial's does: a sample takes part of the lag
// with it, up to a period.
std::int64_t Bench::until_phase_ms() const {
  const double period_ms = 1000 * setup_.input.compensator.sample_period_s;
  const double sample_ms = CoSimulation::time_ms(sampled_);
  const double phase_ms =
      sample_ms - static_cast<double>(*wearer_.start_ms()) - 1000 * simulation_.world().sample_phase_s();
  const double later_ms = phase_ms - period_ms * std::floor(phase_ms / period_ms);
  return twin::kBlock_ms * std::lround(later_ms / twin::kBlock_ms);
}

double Bench::score_one(int gesture, const std::function<void()>& each) {
  play(fmt::format("{}", gesture));
  wearer_.postpone(kStill_ms);
  wearer_.postpone(until_phase_ms());
  const twin::Motion motion = *study::bench_motion(motion_);
  const std::int64_t start_ms = *wearer_.start_ms();
  const std::int64_t end_ms = start_ms + std::lround(motion.duration_s() * 1000);
  twin::World& world = simulation_.world();
  world.film(start_ms, motion.duration_s());
  while (world.now_ms() <= end_ms) {
    const std::int64_t t_ms = world.now_ms() - start_ms;
    if (t_ms == -kStill_ms) world.settle();
    if (t_ms == kBenchSettled_ms) simulation_.wind_up();
    step();
    each();
  }
  const double period_s = 1 / setup_.input.parameters.camera_rate_hz;
  return score::score_trial(world.seen().glove_deg, world.seen().hand_deg, period_s).total_error_deg_s;
}

std::vector<double> Bench::score(const std::vector<int>& gestures, const io::JobProgress& progress) {
  // Out of real time: nobody listens to the glove, and what was sent to it is forgotten.
  pc_listens_ = false;
  const std::shared_ptr<void> listens_again(nullptr, [this, motion = motion_](void*) {
    pc_listens_ = true;
    (void)port_.read();
    due_ = Clock::now();
    play(motion);
  });
  double all_s = 0;
  for (const int gesture : gestures)
    all_s += kAround_s + study::bench_motion(fmt::format("{}", gesture))->duration_s();
  std::size_t done_ms = 0;
  const auto each = [&] {
    constexpr std::size_t kApart_ms = 100;
    const auto of_ms = static_cast<std::size_t>(1000 * all_s);
    if (++done_ms % kApart_ms == 0 && !progress(std::min(done_ms, of_ms), of_ms))
      throw io::Cancelled("stopped");
  };
  // Somebody may just have opened the port.
  for (int ms = 0; ms < kInTouch_ms || (!program_runs_ && ms < kRestart_ms); ++ms) step();
  std::vector<double> out;
  for (const int gesture : gestures) out.push_back(score_one(gesture, each));
  return out;
}

study::BenchView Bench::view() const {
  study::BenchView out;
  const twin::World& world = simulation_.world();
  const HandStatus status = simulation_.hand_status();
  out.now_ms = world.now_ms();
  for (int i = 0; i < twin::kFingers; ++i) {
    const auto finger = static_cast<std::size_t>(i);
    out.finger_deg[finger] = world.finger_deg(i);
    out.joint_deg[finger] = world.joint_deg(i);
    out.fault[finger] = status.fault[i];
  }
  out.counts = counts_;
  return out;
}

}  // namespace flexor::cosim
