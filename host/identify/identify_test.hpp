// For this room's tests: recordings that are made, the real ones, and what a job says of them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <random>
#include <tuple>

#include "host/identify/identify.hpp"
#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {

inline bool has(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

inline bool warned(const Result& r, const std::string& what) {
  return std::ranges::any_of(r.warnings, [&](const std::string& w) { return has(w, what); });
}

// Of one sensor: its reading and the angle at each sample, in their order.
template <class At>
Session sampled(Eigen::Index samples, At at) {
  Session out;
  out.input.resize(samples, 1);
  out.angle_deg.resize(samples);
  out.use.assign(static_cast<std::size_t>(samples), 1);
  for (Eigen::Index k = 0; k < samples; ++k) std::tie(out.input(k, 0), out.angle_deg(k)) = at(k);
  return out;
}

inline constexpr char kIndex[] = "index=a_adc:index_deg";
inline constexpr char kBoth[] = "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg";

struct Drawn {
  double seconds;
  unsigned seed;
  double rate_hz = 40;
  double noise = 1;  // counts
  bool pauses = false;
  bool bursts = false;  // three readings in ten milliseconds
};

// A hand of two joints and two sensors. The first sensor feels the first joint through a bent curve and the cloth's
// play; the second feels the sum of both joints. The camera's clock is 1.37 s behind.
class Hand : public testing::Test {
 protected:
  static constexpr double kOffset_s = -1.37;

  // Poses held for a while, then smooth moves, other ones for each joint.
  static std::vector<double> motion(std::size_t rows, double rate_hz, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> pose(5, 95);
    std::uniform_real_distribution<double> hold_s(0.5, 2.5);
    std::vector<double> out;
    double now = 20;
    while (out.size() < rows) {
      const double next = pose(random);
      const double move_s = 0.3 + std::abs(next - now) / 60;
      const auto moving = static_cast<int>(move_s * rate_hz);
      for (int k = 0; k < moving; ++k)
        out.push_back(now + (next - now) * (1 - std::cos(M_PI * k / moving)) / 2);
      now = next;
      out.resize(out.size() + static_cast<std::size_t>(hold_s(random) * rate_hz), now);
    }
    out.resize(rows);
    return out;
  }

  PairFiles write(const std::string& name, const Drawn& take,
                  const std::function<void(std::vector<double>&)>& change_angle = {}) const {
    constexpr std::size_t kFine_hz = 1200, kCamera_hz = 30;
    const auto rows = static_cast<std::size_t>(take.seconds * kFine_hz);
    const std::vector<double> index = motion(rows, kFine_hz, take.seed);
    const std::vector<double> thumb = motion(rows, kFine_hz, take.seed + 1000);
    std::mt19937 random(take.seed);
    std::normal_distribution<double> noise;
    std::uniform_real_distribution<double> uniform;
    recording::Recording glove, camera;
    glove.columns = {{"a_adc", {}}, {"b_adc", {}}};
    camera.columns = {{"index_deg", {}}, {"thumb_deg", {}}};
    double slipped = index.front();
    double next_s = 0;
    for (std::size_t k = 0; k < rows; ++k) {
      const double t = static_cast<double>(k) / kFine_hz;
      slipped = std::clamp(slipped, index[k] - 4, index[k] + 4);
      if (t < next_s - 1e-9) continue;
      for (int i = 0; i < (take.bursts ? 3 : 1); ++i) {
        const double a = 300 + 2 * slipped + 0.02 * slipped * slipped;
        glove.t_s.push_back(t + 10 + 0.005 * i);  // both clocks start anywhere
        glove.columns[0].value.push_back(std::round(a + take.noise * noise(random)));
        glove.columns[1].value.push_back(
            std::round(250 + 2 * index[k] + 3 * thumb[k] + take.noise * noise(random)));
      }
      next_s = t + 1 / take.rate_hz;
      if (take.pauses && uniform(random) < 0.1 / take.rate_hz) next_s += 0.5 + 3 * uniform(random);
      if (take.pauses && t > 50 && t < 50.6) next_s = t + 14;  // longer than the grid goes on
    }
    for (std::size_t k = 0; k < rows; k += kFine_hz / kCamera_hz) {
      camera.t_s.push_back(static_cast<double>(k) / kFine_hz + kOffset_s + 10);
      camera.columns[0].value.push_back(index[k] + 0.3 * noise(random));
      camera.columns[1].value.push_back(thumb[k] + 0.3 * noise(random));
    }
    if (change_angle) change_angle(camera.columns[0].value);
    const PairFiles out{folder_ / (name + "_glove.csv"), folder_ / (name + "_camera.csv")};
    io::write_file(out.sensor, recording::to_csv(glove));
    io::write_file(out.reference, recording::to_csv(camera));
    return out;
  }

  static Request request(std::vector<PairFiles> pairs, const std::string& map = kIndex) {
    Request r;
    r.pairs = std::move(pairs);
    r.map = parse_map(map);
    return r;
  }

  static Result found(std::vector<PairFiles> pairs, const std::string& map = kIndex) {
    return identify_files(request(std::move(pairs), map), {});
  }

  static double rmse_deg(std::vector<PairFiles> pairs, const std::string& map = kIndex) {
    return found(std::move(pairs), map).joints[0].holdout.rmse_deg;
  }

  // Writes the log again as `how` changes it, and returns it.
  static recording::Recording change(const std::filesystem::path& file,
                                     const std::function<void(recording::Recording&)>& how) {
    recording::Recording log = recording::read_csv(file, {}, "");
    how(log);
    io::write_file(file, recording::to_csv(log));
    return log;
  }

  // The first column's readings, each as `how` makes it.
  static void change_readings(const std::filesystem::path& file, const std::function<double(double)>& how) {
    change(file, [&](recording::Recording& log) {
      std::ranges::transform(log.columns[0].value, log.columns[0].value.begin(), how);
    });
  }

  // The second column's likewise, a share of which the first one feels.
  static void change_second(const std::filesystem::path& file, double share,
                            const std::function<double(std::size_t, double)>& how) {
    change(file, [&](recording::Recording& log) {
      for (std::size_t k = 0; k < log.t_s.size(); ++k) {
        double& second = log.columns[1].value[k];
        log.columns[0].value[k] = std::round(log.columns[0].value[k] + share * second);
        second = how(k, second);
      }
    });
  }

  static std::string refusal(const Request& r) {
    return io::refusal_of([&] { identify_files(r, {}); });
  }

  const io::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

// A glove of three fingers that bend between 0 and 90 degrees.
constexpr double kTestPeriod_s = 0.05;
constexpr double kTestStraight = 300;  // counts
constexpr double kTestFist = 600;

// Its curves bend, as sensors' do.
inline model::Model test_glove() {
  model::Model m;
  m.sample_period_s = kTestPeriod_s;
  for (const std::string name : {"thumb", "index", "middle"}) {
    m.inputs.push_back({name, name, "count", name, 1, 1022});
    m.inputs.back().poses = model::Poses{kTestStraight, kTestFist};
    m.inputs.back().readings = model::Spread{{0.02, 0.1, 0.5, 0.9, 0.98}, {302, 310, 450, 590, 598}};
    m.blocks.push_back(
        {{name}, name + "_curve", model::Curve{{200, 300, 450, 600, 700}, {-20, 0, 55, 90, 105}}});
    m.blocks.push_back({{name + "_curve"}, name + "_angle", model::Saturation{-30, 110}});
    m.joints.push_back({name, name + "_angle", 0});
  }
  return m;
}

// Of recordings that are not part of the repository.
class RealRecordings : public testing::Test {
 protected:
  static inline const std::filesystem::path kData =
      std::filesystem::path(FLEXOR_SOURCE_DIR) / "../shared/data";

  void SetUp() override {
    if (!std::filesystem::exists(kData)) GTEST_SKIP() << "needs the recordings in ../shared/data";
  }

  // A folder of two logs, or one file that is both.
  static Request request(const std::string& name, const std::string& map) {
    Request out;
    out.pairs = {{kData / name / "sensor_log.csv", kData / name / "camera_angles.csv"}};
    if (name.ends_with(".csv")) out.pairs = {{kData / name, kData / name}};
    out.map = parse_map(map);
    out.input_unit = "count";
    return out;
  }
};

}  // namespace flexor::identify
