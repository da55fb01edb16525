#include "cosim/latency.hpp"

#include <algorithm>
#include <deque>
#include <map>

#include "cosim/radio_ear.hpp"
#include "firmware/markers.hpp"
#include "host/twin/random.hpp"

namespace flexor::cosim {
namespace {

using firmware::Marker;

constexpr double kApart_ms = 900;  // of two edges, on average
constexpr int kFinger = 1;         // whose sensor jumps

// Which edge an accepted frame shows: frames are known by their counters, since some never
// come.
class FrameWatch {
 public:
  explicit FrameWatch(const deploy::Key& key) : key_(key), sent_(key_), received_(key_) {}

  // The glove has sealed a frame, the first that shows `edge`; -1: no news.
  void sealed(int edge) { sealed_.push_back(edge); }

  void hand_sent(std::uint8_t byte) {
    sent_.hand_sent(byte);
    received_.hand_sent(byte);
  }

  // A byte leaves the glove.
  void sent(std::uint8_t byte) {
    const link::Received result = sent_.glove_sent(byte);
    if (result != link::Received::frame && result != link::Received::not_trusted) return;
    if (sealed_.empty()) return;
    if (result == link::Received::frame) edge_[sent_.receiver().frame().counter] = sealed_.front();
    sealed_.pop_front();
  }

  // A byte reaches the hand at `end`.
  void arrived(Cycles end, std::uint8_t byte) {
    if (received_.glove_sent(byte) != link::Received::frame) return;
    waiting_.push_back({end, edge_.at(received_.receiver().frame().counter)});
  }

  struct Frame {
    Cycles arrived = 0;
    int edge = -1;
  };
  // The one that has arrived last.
  Frame newest(Cycles now) {
    Frame out;
    while (!waiting_.empty() && waiting_.front().arrived <= now) {
      out = waiting_.front();
      waiting_.pop_front();
    }
    return out;
  }

 private:
  deploy::Key key_;
  RadioEar sent_;      // of everything
  RadioEar received_;  // of what reaches the hand
  std::deque<int> sealed_;
  std::map<std::uint32_t, int> edge_;
  std::deque<Frame> waiting_;
};

// A hand at rest and quiet sensors.
twin::TrialInput still(const twin::Parameters& parameters, const model::Model& model, int edges,
                       std::uint64_t seed) {
  twin::Parameters p = parameters;
  for (double* effect : {&p.noise_deg, &p.flutter_deg, &p.burst_rate_per_s, &p.drift_deg_per_min})
    *effect = 0;
  const double length_s = (edges + 1) * kApart_ms / 1000;
  std::array<std::vector<double>, twin::kFingers> rest;
  for (std::size_t i = 0; i < twin::kFingers; ++i)
    rest[i].assign(2, (p.hand_lower_deg[i] + p.hand_upper_deg[i]) / 2);
  return {p, twin::Motion::from_samples("still", {0, length_s}, rest), model, seed, false};
}

double ms(Cycles from, Cycles to) {
  return static_cast<double>(static_cast<std::int64_t>(to - from)) / kCyclesPerMs;
}

// Follows each edge through both boards.
class EdgeWatch {
 public:
  EdgeWatch(CoSimulation& simulation, std::vector<double> edge_ms)
      : simulation_(simulation), edge_ms_(std::move(edge_ms)), frames_(study::bench_key()) {
    simulation.on_reading = [this](std::int64_t, int finger, int counts) { return read(finger, counts); };
    simulation.on_glove_marker = [this](Cycles now, std::uint8_t value) {
      glove_marker(now, static_cast<Marker>(value));
    };
    simulation.on_air = [this](Cycles, std::uint8_t byte) { frames_.sent(byte); };
    simulation.on_answer = [this](Cycles, std::uint8_t byte) { frames_.hand_sent(byte); };
    simulation.on_arrival = [this](Cycles end, std::uint8_t byte) { frames_.arrived(end, byte); };
    simulation.on_hand_marker = [this](Cycles now, std::uint8_t value) {
      hand_marker(now, static_cast<Marker>(value));
    };
  }

  const std::vector<study::Latency>& latencies() const { return out_; }

 private:
  int read(int finger, int counts) {
    if (finger != kFinger) return counts;
    const Cycles now = simulation_.glove().now();
    const auto later =
        std::ranges::find_if(edge_ms_, [&](double edge) { return CoSimulation::cycle_of(edge) > now; });
    const int newest = static_cast<int>(later - edge_ms_.begin()) - 1;
    if (newest != sampled_edge_) {
      sampled_edge_ = newest;
      conversion_ = now;
    }
    return counts + (newest % 2 == 0 ? 60 : 0) + static_cast<int>(now / kCyclesPerMs % 2);
  }

  void glove_marker(Cycles now, Marker marker) {
    if (marker == Marker::step_end) computed_ = now;
    if (marker == Marker::step_end && sampled_edge_ >= 0 && !seen_.contains(sampled_edge_))
      seen_[sampled_edge_] = {conversion_, computed_, 0};
    if (marker != Marker::frame_sealed) return;
    const bool first = sampled_edge_ != framed_edge_;
    framed_edge_ = sampled_edge_;
    frames_.sealed(first ? sampled_edge_ : -1);
    if (first && sampled_edge_ >= 0) seen_[sampled_edge_][2] = now;
  }

  void hand_marker(Cycles now, Marker marker) {
    if (marker == Marker::frame_accepted) {
      accepted_ = now;
      const auto frame = frames_.newest(now);
      accepted_edge_ = frame.edge;
      arrived_ = frame.arrived;
    }
    if (marker != Marker::tick_end || accepted_edge_ < 0) return;
    const auto& [conversion, computed, sealed] = seen_.at(accepted_edge_);
    const Cycles edge = CoSimulation::cycle_of(edge_ms_[static_cast<std::size_t>(accepted_edge_)]);
    out_.push_back({ms(edge, conversion), ms(conversion, computed), ms(computed, sealed),
                    ms(sealed, arrived_), ms(arrived_, accepted_), ms(accepted_, now)});
    accepted_edge_ = -1;
  }

  CoSimulation& simulation_;
  std::vector<double> edge_ms_;
  FrameWatch frames_;
  std::vector<study::Latency> out_;
  int sampled_edge_ = -1;
  int framed_edge_ = -1;
  int accepted_edge_ = -1;
  Cycles conversion_ = 0;
  Cycles computed_ = 0;
  Cycles arrived_ = 0;
  Cycles accepted_ = 0;
  std::map<int, std::array<Cycles, 3>> seen_;  // edge -> conversion, computed, sealed
};

}  // namespace

std::vector<study::Latency> latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                                    std::uint64_t seed) {
  const Images images(deploy::glove_for(parameters, model, study::bench_key()),
                      deploy::safe_hand(parameters, model, study::bench_key()));
  const twin::TrialInput input = still(parameters, model, edges, seed);
  CoSimulation simulation(images, input, 0);
  twin::Random random(seed);
  std::vector<double> edge_ms;
  for (int k = 0; k < edges; ++k) edge_ms.push_back(kApart_ms * (k + 0.5 * random.uniform() + 0.25));
  const EdgeWatch watch(simulation, std::move(edge_ms));
  (void)simulation.run();
  return watch.latencies();
}

}  // namespace flexor::cosim
