#include "cosim/trace.hpp"

#include "cosim/vcd.hpp"
#include "host/io/io.hpp"

namespace flexor::cosim {

void trace(const Images& images, const twin::TrialInput& input, const std::filesystem::path& path) {
  CoSimulation simulation(images, input, 0);
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
    const auto now = nanoseconds(CoSimulation::cycle_of(static_cast<double>(now_ms)));
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
