#include "cosim/engine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include "cosim/replay.hpp"
#include "cosim/vcd.hpp"
#include "firmware/markers.hpp"
#include "host/deploy/deploy.hpp"
#include "host/io/io.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;
using firmware::Marker;

// What decides about the images.
std::string identity(const twin::Setup& setup) {
  return deploy::glove_config(study::glove_for(setup.parameters, setup.compensator)) +
         deploy::hand_config(study::twin_hand(setup.parameters, setup.compensator));
}

// Which edge a frame tells of that the hand accepts: frames are known by their counters, since some never
// come.
class FrameWatch {
 public:
  explicit FrameWatch(const deploy::Key& key) : key_(*key), sent_(&key_), heard_(&key_) {}

  // The glove has sealed a frame, the first that tells of `edge`; -1: no news.
  void sealed(int edge) { sealed_.push_back(edge); }

  // A byte leaves the glove.
  void sent(std::uint8_t byte) {
    if (sent_.receive(byte) != link::Received::frame || sealed_.empty()) return;
    edge_[sent_.frame().counter] = sealed_.front();
    sealed_.pop_front();
  }

  // A byte reaches the hand at `end`.
  void arrived(Cycles end, std::uint8_t byte) {
    if (heard_.receive(byte) != link::Received::frame) return;
    waiting_.push_back({end, edge_.at(heard_.frame().counter)});
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
  link::Key key_;
  link::Receiver sent_;   // of everything
  link::Receiver heard_;  // of what the hand hears
  std::deque<int> sealed_;
  std::map<std::uint32_t, int> edge_;
  std::deque<Frame> waiting_;
};

}  // namespace

std::unique_ptr<Images> build_images(const deploy::Glove& glove, const deploy::Hand& hand) {
  const io::TemporaryFolder folder;
  const auto g = deploy::build_glove(glove, folder.path());
  const auto h = deploy::build_hand(hand, folder.path());
  return std::unique_ptr<Images>(new Images{Firmware(g.elf), Firmware(h.elf)});
}

void Engine::prepare(const twin::Setup& setup) {
  std::unique_ptr<Images>& images = images_[identity(setup)];
  if (images != nullptr) return;
  images = build_images(study::glove_for(setup.parameters, setup.compensator),
                        study::twin_hand(setup.parameters, setup.compensator));
}

const Images& Engine::images_of(const twin::Setup& setup) const { return *images_.at(identity(setup)); }

std::vector<twin::Trial> Engine::simulate(const twin::Setup& setup, std::uint64_t first, int count) const {
  const Images& images = images_of(setup);
  std::vector<twin::Trial> out;
  for (int t = 0; t < count; ++t) {
    Simulation simulation(images, setup, first + static_cast<std::uint64_t>(t));
    out.push_back(simulation.run());
  }
  return out;
}

study::GloveFigures Engine::run_glove(const fs::path& elf, const deploy::Glove& glove,
                                      const study::Counts& counts) const {
  const Firmware firmware(elf);
  return replay(firmware, glove, counts);
}

study::HandFigures Engine::run_hand(const fs::path& elf, const deploy::Glove& glove, double seconds) const {
  const Firmware firmware(elf);
  return measure_hand(firmware, glove, seconds);
}

std::vector<study::Latency> Engine::latency(const twin::Parameters& parameters, const model::Model& model,
                                            int edges, std::uint64_t seed) const {
  // A hand at rest and quiet strips, but for one, whose reading jumps to and fro.
  twin::Parameters p = parameters;
  for (double* effect : {&p.noise_deg, &p.flutter_deg, &p.burst_rate_per_s, &p.drift_deg_per_min})
    *effect = 0;
  constexpr double kApart_ms = 900;
  const double length_s = (edges + 1) * kApart_ms / 1000;
  std::array<std::vector<double>, twin::kFingers> still;
  for (std::size_t i = 0; i < twin::kFingers; ++i)
    still[i].assign(2, (p.hand_lower_deg[i] + p.hand_upper_deg[i]) / 2);
  const twin::Setup setup{p, twin::Motion::from_samples("still", {0, length_s}, still), model, seed, false};
  const auto images = build_images(study::glove_for(p, model), study::safe_hand(p, model));
  Simulation simulation(*images, setup, 0);
  twin::Random random(seed);
  std::vector<double> edge_ms;
  for (int k = 0; k < edges; ++k) edge_ms.push_back(kApart_ms * (k + 0.5 * random.uniform() + 0.25));

  FrameWatch frames(study::bench_key());
  std::vector<study::Latency> out;
  constexpr int kFinger = 1;
  int sampled_edge = -1;
  int told_edge = -1;  // by a frame
  Cycles conversion = 0;
  Cycles computed = 0;
  Cycles arrived = 0;
  Cycles accepted = 0;
  int accepted_edge = -1;
  std::map<int, std::array<Cycles, 3>> seen;  // edge -> conversion, computed, sealed
  simulation.on_strip = [&](std::int64_t, int finger, int counts) {
    if (finger != kFinger) return counts;
    const Cycles now = simulation.glove().now();
    const auto later =
        std::ranges::find_if(edge_ms, [&](double edge) { return Simulation::cycle_of(edge) > now; });
    const int newest = static_cast<int>(later - edge_ms.begin()) - 1;
    if (newest != sampled_edge) {
      sampled_edge = newest;
      conversion = now;
    }
    return counts + (newest % 2 == 0 ? 60 : 0) + static_cast<int>(now / kCyclesPerMs % 2);
  };
  simulation.on_glove_marker = [&](Cycles now, std::uint8_t value) {
    if (static_cast<Marker>(value) == Marker::step_end) computed = now;
    if (static_cast<Marker>(value) == Marker::step_end && sampled_edge >= 0 && !seen.contains(sampled_edge))
      seen[sampled_edge] = {conversion, computed, 0};
    if (static_cast<Marker>(value) != Marker::frame_sealed) return;
    const bool first = sampled_edge != told_edge;
    told_edge = sampled_edge;
    frames.sealed(first ? sampled_edge : -1);
    if (first && sampled_edge >= 0) seen[sampled_edge][2] = now;
  };
  simulation.on_air = [&](Cycles, std::uint8_t byte) { frames.sent(byte); };
  simulation.on_arrival = [&](Cycles end, std::uint8_t byte) { frames.arrived(end, byte); };
  simulation.on_hand_marker = [&](Cycles now, std::uint8_t value) {
    if (static_cast<Marker>(value) == Marker::frame_accepted) {
      accepted = now;
      const auto frame = frames.newest(now);
      accepted_edge = frame.edge;
      arrived = frame.arrived;
    }
    if (static_cast<Marker>(value) != Marker::tick_end || accepted_edge < 0) return;
    const auto& [at_conversion, at_computed, at_sealed] = seen.at(accepted_edge);
    const auto ms = [](Cycles from, Cycles to) {
      return static_cast<double>(static_cast<std::int64_t>(to - from)) / kCyclesPerMs;
    };
    const Cycles edge = Simulation::cycle_of(edge_ms[static_cast<std::size_t>(accepted_edge)]);
    out.push_back({ms(edge, at_conversion), ms(at_conversion, at_computed), ms(at_computed, at_sealed),
                   ms(at_sealed, arrived), ms(arrived, accepted), ms(accepted, now)});
    accepted_edge = -1;
  };
  (void)simulation.run();
  return out;
}

void Engine::trace(const twin::Setup& setup, const fs::path& path) {
  prepare(setup);
  Simulation simulation(images_of(setup), setup, 0);
  Vcd vcd;
  const auto glove_marker = vcd.integer("glove_marker", 8);
  const auto glove_byte = vcd.integer("glove_byte", 8);
  const auto hand_marker = vcd.integer("hand_marker", 8);
  const auto link = vcd.integer("hand_link", 2);
  struct Finger {
    Vcd::Signal strip;
    Vcd::Signal finger;
    Vcd::Signal setpoint;
    Vcd::Signal duty;
    Vcd::Signal joint;
  };
  std::vector<Finger> fingers;
  for (const std::string& name : model::finger_names()) {
    fingers.push_back({vcd.integer(name + "_counts", 10), vcd.real(name + "_finger_deg"),
                       vcd.real(name + "_setpoint_deg"), vcd.real(name + "_duty"),
                       vcd.real(name + "_joint_deg")});
  }
  const auto nanoseconds = [](Cycles cycle) { return cycle * 125 / 2; };
  simulation.on_glove_marker = [&](Cycles now, std::uint8_t value) {
    vcd.change(nanoseconds(now), glove_marker, value);
  };
  simulation.on_hand_marker = [&](Cycles now, std::uint8_t value) {
    vcd.change(nanoseconds(now), hand_marker, value);
  };
  simulation.on_air = [&](Cycles now, std::uint8_t value) {
    vcd.change(nanoseconds(now), glove_byte, value);
  };
  simulation.on_strip = [&](std::int64_t, int finger, int counts) {
    vcd.change(nanoseconds(simulation.glove().now()), fingers[static_cast<std::size_t>(finger)].strip,
               counts);
    return counts;
  };
  simulation.on_ms = [&](std::int64_t now_ms) {
    const auto now = nanoseconds(Simulation::cycle_of(static_cast<double>(now_ms)));
    const HandStatus status = simulation.hand_status();
    vcd.change(now, link, status.link);
    for (int i = 0; i < twin::kFingers; ++i) {
      const Finger& f = fingers[static_cast<std::size_t>(i)];
      vcd.change(now, f.finger, simulation.world().finger_deg(i));
      vcd.change(now, f.setpoint, status.setpoint[i] / 16.0);
      vcd.change(now, f.duty, simulation.hand().duty(i));
      vcd.change(now, f.joint, simulation.world().joint_deg(i));
    }
  };
  (void)simulation.run();
  io::write_file(path, vcd.text());
}

}  // namespace flexor::cosim
