#include "cosim/co_simulation.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/markers.hpp"
#include "host/deploy/images.hpp"

namespace flexor::cosim {
namespace {

constexpr std::int64_t kSettled_ms = -300;  // by then the hand is where its first commands sent it
constexpr double kBoot_ms = 1;              // the glove's, until its sample timer starts
constexpr int kSensors = twin::kFingers;

bool is(std::uint8_t marker, firmware::Marker which) { return marker == static_cast<std::uint8_t>(which); }

}  // namespace

Images::Images(const deploy::Glove& on_glove, const deploy::Hand& on_hand)
    : glove{deploy::glove_flash(on_glove), deploy::glove_image().symbols},
      hand{deploy::hand_flash(on_hand), deploy::hand_image().symbols} {}

CoSimulation::CoSimulation(const Images& images, const twin::TrialInput& input, std::uint64_t trial,
                           ByteFaults faults)
    : images_(images),
      input_(input),
      world_(input, trial),
      glove_(images.glove),
      hand_(images.hand),
      radio_{ByteRadio(input.parameters, twin::seed_of(input.seed, trial, twin::Purpose::radio), faults,
                       cycle_of(0)),
             ByteRadio(input.parameters, twin::seed_of(input.seed, trial, twin::Purpose::radio, 1), faults,
                       cycle_of(0))} {
  const double period_ms = 1000 * input.compensator.sample_period_s;
  const double phase_ms = 1000 * world_.sample_phase_s() - kBoot_ms;
  const double start_ms = phase_ms - period_ms * std::floor(phase_ms / period_ms);
  glove_.power_off(static_cast<Cycles>(start_ms * kCyclesPerMs) + 1);
  glove_.on_sample = [this](Cycles cycle, int pin) {
    const auto& pins = input_.parameters.pins.strip;
    const auto channel = static_cast<int>(std::ranges::find(pins, pin) - pins.begin());
    if (channel >= kSensors) return 0;
    const auto now_ms = static_cast<std::int64_t>(time_ms(cycle));
    const int counts = world_.glove_counts(channel, time_ms(cycle) / 1000);
    return on_reading ? on_reading(now_ms, channel, counts) : counts;
  };
  glove_.on_byte = [this](Cycles cycle, std::uint8_t byte) {
    if (on_air) on_air(cycle, byte);
    if (glove_has_radio) on_the_air(From::glove, cycle, byte);
  };
  hand_.on_byte = [this](Cycles cycle, std::uint8_t byte) {
    if (on_answer) on_answer(cycle, byte);
    on_the_air(From::hand, cycle, byte);
  };
  glove_.on_marker = [this](Cycles cycle, std::uint8_t marker) {
    sent_ += is(marker, firmware::Marker::frame_sealed);
    if (on_glove_marker) on_glove_marker(cycle, marker);
  };
  hand_.on_marker = [this](Cycles cycle, std::uint8_t marker) {
    if (is(marker, firmware::Marker::tick_end))
      ticked_ = hand_.peek<HandStatus>(images_.hand.address("hand_status"));
    if (on_hand_marker) on_hand_marker(cycle, marker);
  };
}

void CoSimulation::on_the_air(From from, Cycles begin, std::uint8_t byte) {
  const auto end = radio_[static_cast<std::size_t>(from)].pass(begin, byte);
  if (collides(from, begin) || !end || !radio_on) return;
  if (from == From::hand) return on_glove_air ? on_glove_air(*end, byte) : glove_.receive(*end, byte);
  // Two who speak at once come one after the other, a byte at a time.
  const Cycles at = *end > injected_until_ ? * end : injected_until_ += byte_cycles();
  if (on_arrival) on_arrival(at, byte);
  hand_.receive(at, byte);
}

// A byte takes the air while it is sent: what it waits in the modules does not.
bool CoSimulation::collides(From from, Cycles begin) {
  Burst& mine = air_[static_cast<std::size_t>(from)];
  const Burst& other = air_[1 - static_cast<std::size_t>(from)];
  if (begin > mine.end + byte_cycles()) mine.begin = begin;
  mine.end = begin + byte_cycles();
  if (mine.begin < other.end && other.begin < mine.end) collided_until_ = std::max(mine.end, other.end);
  return begin < collided_until_;
}

void CoSimulation::step() {
  const std::int64_t now = world_.now_ms();
  if (on_ms) on_ms(now);
  if (now == kSettled_ms) wind_up();
  for (int i = 0; i < twin::kFingers; ++i) {
    const int counts = world_.potentiometer_counts(i);
    hand_.set_counts(i, on_potentiometer ? on_potentiometer(now, i, counts) : counts);
  }
  // The glove first: what it sends within this millisecond may arrive within it.
  const Cycles end = cycle_of(static_cast<double>(now + 1));
  glove_.run_until(end);
  hand_.run_until(end);
  std::array<std::int16_t, twin::kFingers> duty{};
  for (int i = 0; i < twin::kFingers; ++i) {
    duty[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(std::lround(hand_.duty(i) * hand::kFullDuty));
  }
  world_.step(duty);
}

twin::Trial CoSimulation::run() {
  while (world_.now_ms() <= world_.end_ms()) step();
  twin::Trial trial = world_.finish();
  trial.frames_sent = sent_;
  const link::LinkStatistics link = link_statistics();
  // Gaps in the sequence; where few were believed at all, all others.
  const bool few = 2 * static_cast<int>(link.received) < sent_;
  trial.frames_lost = few ? sent_ - static_cast<int>(link.received) : static_cast<int>(link.lost);
  return trial;
}

HandStatus CoSimulation::hand_status() const {
  HandStatus out = hand_.peek<HandStatus>(images_.hand.address("hand_status"));
  // Numbers of two bytes may be half written now.
  for (int i = 0; i < twin::kFingers && out.finger_bytes == ticked_.finger_bytes; ++i)
    out.setpoint[i] = ticked_.setpoint[i];
  return out;
}

void CoSimulation::inject(const std::vector<std::uint8_t>& bytes) {
  injected_until_ = std::max(injected_until_, hand_.now());
  for (const std::uint8_t byte : bytes) hand_.receive(injected_until_ += byte_cycles(), byte);
}

void CoSimulation::inject_to_glove(const std::vector<std::uint8_t>& bytes) {
  Cycles at = glove_.now() + byte_cycles();
  for (const std::uint8_t byte : bytes) glove_.receive(at += byte_cycles(), byte);
}

link::LinkStatistics CoSimulation::link_statistics() const {
  return hand_.peek<link::LinkStatistics>(images_.hand.address("hand_link"));
}

// The minute of rest before a recording is not run but computed, as in simulate(): a loop whose command lies
// behind an end stop has wound up by then.
void CoSimulation::wind_up() {
  const HandStatus status = hand_status();
  const std::uint16_t fingers = images_.hand.address("hand_finger");
  for (int i = 0; i < twin::kFingers; ++i) {
    const std::int32_t integral = world_.settled_integral(i, status.setpoint[i]);
    constexpr int kIntegralAt = 4;  // of hand::LoopState, the first member of hand::Finger
    for (int byte = 0; byte < 4; ++byte) {
      hand_.write(static_cast<std::uint16_t>(fingers + i * status.finger_bytes + kIntegralAt + byte),
                  static_cast<std::uint8_t>(static_cast<std::uint32_t>(integral) >> (8 * byte)));
    }
  }
}

}  // namespace flexor::cosim
