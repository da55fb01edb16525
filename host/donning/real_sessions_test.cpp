// Real sessions of one glove over 4.5 months, without angles: what its readings say of the start and the peak of gestures, from
// 20 s drawn across these. Each session is left out in turn; the others' means are what it should read. Only where the
// recordings are.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "host/donning/recalibrate.hpp"

namespace flexor::donning {
namespace {

namespace fs = std::filesystem;
using Reading = std::array<double, 3>;
constexpr std::array kRealShares = {0.02, 0.1, 0.5, 0.9, 0.98};
constexpr double kRange_deg = 90;  // that a finger's readings are taken to span

struct RealSession {
  std::map<std::string, std::vector<std::vector<Reading>>> trials;  // by gesture
  std::array<std::vector<double>, 3> quantile;
  std::array<std::map<std::string, double>, 3>
      point;  // "1 start", "1 peak": means over the trials of one gesture
};

RealSession load_real(const fs::path& path) {
  RealSession out;
  std::ifstream file(path);
  std::string line;
  std::string trial;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream cells(line);
    std::string number;
    std::string gesture;
    double t_s = 0;
    Reading r{};
    cells >> number >> gesture >> t_s >> r[0] >> r[1] >> r[2];
    if (number + " " + gesture != trial) out.trials[gesture].emplace_back();
    trial = number + " " + gesture;
    out.trials[gesture].back().push_back(r);
  }
  return out;
}

void summarise(RealSession& s) {
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> all;
    for (const auto& [gesture, trials] : s.trials) {
      for (const auto& trial : trials) {
        double peak = trial[0][c];
        for (const Reading& r : trial) {
          all.push_back(r[c]);
          if (std::abs(r[c] - trial[0][c]) > std::abs(peak - trial[0][c])) peak = r[c];
        }
        if (gesture.size() > 1) continue;  // a transition
        s.point[c][gesture + " start"] += trial[0][c] / static_cast<double>(trials.size());
        s.point[c][gesture + " peak"] += peak / static_cast<double>(trials.size());
      }
    }
    std::ranges::sort(all);
    for (const double share : kRealShares) s.quantile[c].push_back(quantile_of(all, share));
  }
}

model::Model model_of_others(const std::vector<RealSession>& all, std::size_t left_out) {
  model::Model m;
  m.sample_period_s = 0.1;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> mean(kRealShares.size(), 0);
    for (std::size_t s = 0; s < all.size(); ++s) {
      for (std::size_t i = 0; i < mean.size() && s != left_out; ++i)
        mean[i] += all[s].quantile[c][i] / static_cast<double>(all.size() - 1);
    }
    const std::string name(1, static_cast<char>('a' + c));
    const double span = mean.back() - mean.front();
    m.inputs.push_back({name, name, "count", "", 1, 1022});
    m.inputs.back().readings = model::Spread{{kRealShares.begin(), kRealShares.end()}, mean};
    m.blocks.push_back(
        {{name},
         name + "c",
         model::Curve{{mean.front() - span, mean.back() + span}, {-kRange_deg, 2 * kRange_deg}}});
    m.blocks.push_back({{name + "c"}, name + "s", model::Saturation{-kRange_deg, 2 * kRange_deg}});
    m.joints.push_back({name, name + "s", 0});
  }
  return m;
}

// Whole trials, a gesture after the other in an order of chance.
Motion drawn(const RealSession& s, double seconds, std::mt19937& random) {
  std::vector<std::string> order;
  for (const auto& [gesture, trials] : s.trials) order.push_back(gesture);
  std::ranges::shuffle(order, random);
  Motion out{std::vector<std::vector<double>>(3)};
  for (std::size_t k = 0; static_cast<double>(out.reading[0].size()) < 10 * seconds; ++k) {
    const auto& trials = s.trials.at(order[k % order.size()]);
    for (const Reading& r : trials[random() % trials.size()]) {
      for (std::size_t c = 0; c < 3; ++c) out.reading[c].push_back(r[c]);
    }
  }
  return out;
}

struct Squares {
  double raw = 0;
  double after = 0;
  int count = 0;
};

void add_points(const std::vector<RealSession>& all, std::size_t left_out, std::size_t c,
                const model::Correction& correction, double range, Squares& out) {
  for (const auto& [name, reading] : all[left_out].point[c]) {
    double wanted = 0;
    int others = 0;
    for (std::size_t s = 0; s < all.size(); ++s) {
      const auto there = all[s].point[c].find(name);
      if (s == left_out || there == all[s].point[c].end()) continue;
      wanted += there->second;
      ++others;
    }
    if (others == 0) continue;
    wanted /= others;
    out.raw += std::pow((reading - wanted) / range, 2);
    out.after += std::pow((correction(reading) - wanted) / range, 2);
    ++out.count;
  }
}

TEST(RealSessions, StartAndPeakOfGesturesFromTwentySecondsAcrossThem) {
  const fs::path folder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/donning";
  if (!fs::exists(folder))
    GTEST_SKIP() << "needs ../shared/data/donning, which is not part of the repository";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("P6_")) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<RealSession> all;
  for (const fs::path& file : files) summarise(all.emplace_back(load_real(file)));
  constexpr std::array kRange = {225.0, 248.0, 250.0};  // 1st to 99th percentile of all sessions
  std::mt19937 random(1);
  std::array<Squares, 3> squares{};
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (all[s].point[0].empty()) continue;
    for (int draw = 0; draw < 40; ++draw) {
      Request request;
      request.model = model_of_others(all, s);
      request.motion = drawn(all[s], 20, random);
      const Recalibration r = recalibrate(request);
      for (std::size_t c = 0; c < 3; ++c)
        add_points(all, s, c, r.sensors[c].correction, kRange[c], squares[c]);
    }
  }
  double raw = 0;
  double after = 0;
  for (const Squares& one : squares) {
    raw += 100 * std::sqrt(one.raw / one.count) / 3;
    after += 100 * std::sqrt(one.after / one.count) / 3;
  }
  std::printf("start and peak, %% of the range: as they come %.1f, recalibrated %.1f\n", raw, after);
  EXPECT_NEAR(raw, 18.4, 1) << "the measure itself";
  EXPECT_LT(after, 10.5);
  EXPECT_GT(after, 6) << "too good to be true";
}

}  // namespace
}  // namespace flexor::donning
