// Writes a small simulated recording, for trying Flexor without a glove. It is not a measurement: the columns
// say "simulated", and no figure of this project comes from it.
//
//   simulated_recording FOLDER      ->  simulated_glove.csv, simulated_camera.csv
//
// A finger goes to random angles and rests; the sensor sees it through slip (play), a curve, a slow tail and
// noise, is logged in bursts with pauses; the camera runs at 30 frames a second on another clock.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <vector>

#include "host/io/io.hpp"

namespace {

constexpr double kDuration_s = 90;
constexpr double kStep_s = 0.005;
constexpr double kCameraAhead_s = 7.4;

std::vector<double> finger_motion(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform;
  std::vector<double> angle;
  double from = 15;
  while (static_cast<double>(angle.size()) * kStep_s < kDuration_s) {
    const double to = 5 + 85 * uniform(random);
    const double move_s = 0.3 + std::abs(to - from) / (30 + 70 * uniform(random));
    for (double t = 0; t < move_s; t += kStep_s) {
      const double s = t / move_s;
      angle.push_back(from + (to - from) * s * s * (3 - 2 * s));
    }
    for (double t = 1.5 * uniform(random); t > 0; t -= kStep_s) angle.push_back(to);
    from = to;
  }
  return angle;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace flexor;
  if (argc != 2) {
    std::fprintf(stderr, "usage: simulated_recording FOLDER\n");
    return 2;
  }
  std::mt19937 random(2019);
  std::normal_distribution<double> noise;
  const std::vector<double> angle = finger_motion(random);

  fmt::memory_buffer glove;
  fmt::memory_buffer camera;
  const auto add = [](fmt::memory_buffer& out, const std::string& line) { out.append(line); };
  add(glove, "\xEF\xBB\xBFTime(ms),Phase,simulated_index_adc\n");
  add(camera, "Time(ms),∠simulated_index_deg\n");
  double slipped = angle[0];
  double tail = angle[0];
  double next_burst_s = 0;
  int frame = 0;
  for (std::size_t k = 0; k < angle.size(); ++k) {
    const double t = static_cast<double>(k) * kStep_s;
    slipped = std::clamp(slipped, angle[k] - 2.5, angle[k] + 2.5);
    tail += (slipped - tail) * kStep_s / 2.0;
    const double felt = slipped + 0.15 * (tail - slipped);
    const double adc = 240 + 420 * std::pow(std::max(felt, 0.0) / 90, 1.4);
    if (t >= next_burst_s) {
      for (int i = 0; i < 3; ++i) {
        add(glove, fmt::format("{:.0f},{},{:.0f}\n", 1000 * t + 17000 + 15 * i,
                               angle[k] > 45 ? "Flex" : "Extend", adc + 2 * noise(random)));
      }
      next_burst_s = t + (frame % 400 == 399 ? 0.9 : 0.11);  // the log pauses now and then
    }
    if (t >= frame / 30.0) {
      add(camera, fmt::format("{:.0f},{:.3f}\n", 1000 * (t + kCameraAhead_s) + 17000,
                              angle[k] + 0.4 * noise(random)));
      ++frame;
    }
  }
  try {
    const std::filesystem::path folder = argv[1];
    io::make_folder(folder);
    io::write_file(folder / "simulated_glove.csv", fmt::to_string(glove));
    io::write_file(folder / "simulated_camera.csv", fmt::to_string(camera));
  } catch (const io::InputError& error) {
    std::fprintf(stderr, "simulated_recording: %s\n", error.what());
    return 2;
  }
}
