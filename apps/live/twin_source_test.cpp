#include "apps/live/twin_source.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "host/io/io.hpp"

namespace flexor::live {
namespace {

using listen::Event;
using listen::Sample;

std::vector<Sample> play(TwinSource& source, double seconds) {
  std::vector<Sample> out;
  const double begin_s = source.now_s();
  while (source.now_s() - begin_s < seconds) source.wait(0.05, out);
  return out;
}

double mean(const std::vector<Sample>& samples, std::size_t finger) {
  double sum = 0;
  for (const Sample& s : samples) sum += s.value[finger];
  return sum / static_cast<double>(samples.size());
}

double sd(const std::vector<Sample>& samples, std::size_t finger) {
  const double centre = mean(samples, finger);
  double squares = 0;
  for (const Sample& s : samples) squares += std::pow(s.value[finger] - centre, 2);
  return std::sqrt(squares / static_cast<double>(samples.size()));
}

TwinOptions still() {
  TwinOptions out;
  out.motion.reset();
  return out;
}

TEST(TwinSource, SamplesInRealTime) {
  TwinSource source(still());
  const std::vector<Sample> samples = play(source, 0.5);
  EXPECT_GE(samples.size(), 40U);
  EXPECT_LE(samples.size(), 56U);
  EXPECT_EQ(source.columns().size(), 5U);
  EXPECT_EQ(source.columns()[1], "index_count");
  for (std::size_t i = 1; i < samples.size(); ++i) {
    EXPECT_NEAR(samples[i].host_s - samples[i - 1].host_s, 0.01, 1e-9);
    EXPECT_NEAR(*samples[i].board_s, 0.01 * static_cast<double>(i), 1e-9);
  }
  EXPECT_LE(samples.back().host_s, source.now_s());
  EXPECT_EQ(source.tally().samples, samples.size());
}

// Bent fingers bend their strips: counts rise with the angle.
TEST(TwinSource, FollowsTheFinger) {
  TwinOptions options;
  options.motion = study::motions("1").front();
  TwinSource source(options);
  double sxy = 0, sx = 0, sy = 0, sxx = 0, syy = 0, n = 0, least = 1e9, most = -1e9;
  std::vector<Sample> out;
  while (source.now_s() < 5) {
    out.clear();
    source.wait(0.02, out);
    if (out.empty()) continue;
    const double x = source.finger_deg()[1];
    const double y = out.back().value[1];
    ASSERT_TRUE(std::isfinite(x) && std::isfinite(y)) << x << ' ' << y << " at " << *out.back().board_s;
    sxy += x * y, sx += x, sy += y, sxx += x * x, syy += y * y, n += 1;
    least = std::min(least, x);
    most = std::max(most, x);
  }
  EXPECT_GT(most - least, 20);
  EXPECT_LT(most - least, 120);
  const double r = (n * sxy - sx * sy) / std::sqrt((n * sxx - sx * sx) * (n * syy - sy * sy));
  EXPECT_GT(r, 0.9);
  EXPECT_LT(r, 0.99999);
}

TEST(TwinSource, SlipsDriftsAndIsNoisyAsItIsTold) {
  TwinSource source(still());
  const std::vector<Sample> before = play(source, 0.4);
  source.set({.slip_deg = 20});
  const std::vector<Sample> slipped = play(source, 0.4);
  const double step = mean(slipped, 1) - mean(before, 1);
  EXPECT_GT(std::abs(step), 5);
  EXPECT_LT(std::abs(step), 400);
  source.set({.drift_deg_per_min = 600});
  play(source, 1);
  const std::vector<Sample> drifted = play(source, 0.2);
  EXPECT_GT((mean(drifted, 1) - mean(before, 1)) / step, 0.2);  // about 11 of 20 degrees
  EXPECT_LT((mean(drifted, 1) - mean(before, 1)) / step, 1.2);
  source.set({.noise_counts = 15});
  const std::vector<Sample> noisy = play(source, 1);
  EXPECT_NEAR(sd(noisy, 1), 15, 6);
  EXPECT_LT(sd(before, 1), 5);
}

TEST(TwinSource, LosesTheShareThatItIsTold) {
  TwinOptions options = still();
  options.rate_hz = 500;
  TwinSource source(options);
  source.set({.loss = 0.3});
  const auto kept = static_cast<double>(play(source, 1).size());
  const auto lost = static_cast<double>(source.tally().lost.value());
  EXPECT_NEAR(lost / (lost + kept), 0.3, 0.1);
  source.set({.loss = 1});
  EXPECT_TRUE(play(source, 0.2).empty());
}

TEST(TwinSource, GoesToAnotherMotionWithoutAJump) {
  TwinSource source;
  std::vector<Sample> out;
  twin::PerFinger last{};
  double worst = 0;
  bool changed = false;
  while (source.now_s() < 3) {
    if (!changed && source.now_s() > 1.5) {
      source.play(study::motions("2").front());
      changed = true;
    }
    out.clear();
    source.wait(0.02, out);
    if (out.size() != 1) {
      last = source.finger_deg();
      continue;  // more than one sample apart
    }
    if (last[0] != 0) worst = std::max(worst, std::abs(source.finger_deg()[1] - last[1]));
    last = source.finger_deg();
  }
  EXPECT_LT(worst, 3);
}

TEST(TwinSource, WaitsForWhoeverDoesNotAsk) {
  TwinSource source(still());
  std::this_thread::sleep_for(std::chrono::milliseconds(2600));
  std::vector<Sample> out;
  source.wait(0.05, out);
  EXPECT_GE(out.size(), 1U);
  EXPECT_LT(out.size(), 20U);
  EXPECT_GT(out.front().host_s, 2.5);
  EXPECT_LT(*out.front().board_s, 0.5);
}

TEST(TwinSource, RefusesWhatIsNone) {
  TwinOptions options;
  options.rate_hz = 0;
  EXPECT_THROW(TwinSource{options}, io::InputError);
  TwinSource source(still());
  EXPECT_THROW(source.set({.slip_deg = std::numeric_limits<double>::quiet_NaN()}), io::InputError);
  EXPECT_THROW(source.set({.noise_counts = -1}), io::InputError);
  EXPECT_THROW(source.set({.loss = 1.1}), io::InputError);
}

}  // namespace
}  // namespace flexor::live
