// Real sessions of one glove over 4.5 months, without angles: what its readings say of the start and the peak of gestures, from
// stretches of a session that was left out; the others' means are what it should read. Only where the recordings are.
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
const fs::path kDonnings = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/donning";
using Reading = std::array<double, 3>;
constexpr std::array kRealShares = {0.02, 0.1, 0.5, 0.9, 0.98};
constexpr double kRealRate_Hz = 10;
constexpr double kRange = 241;  // counts: the mean of three fingers, 1st to 99th percentile of all sessions
constexpr double kRange_deg = 90;  // that a finger's readings are taken to span

struct RealSession {
  std::map<std::string, std::vector<std::vector<Reading>>> trials;  // by gesture
  std::vector<Reading> row;                                         // all of them, in the file's order
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
    std::erase(gesture, '-');
    if (number + " " + gesture != trial) out.trials[gesture].emplace_back();
    trial = number + " " + gesture;
    out.trials[gesture].back().push_back(r);
    out.row.push_back(r);
  }
  return out;
}

void summarise(RealSession& s, bool transitions) {
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> all;
    for (const auto& [gesture, trials] : s.trials) {
      for (const auto& trial : trials) {
        double peak = trial[0][c];
        for (const Reading& r : trial) {
          all.push_back(r[c]);
          if (std::abs(r[c] - trial[0][c]) > std::abs(peak - trial[0][c])) peak = r[c];
        }
        if (gesture.size() > 1 && !transitions) continue;
        s.point[c][gesture + " start"] += trial[0][c] / static_cast<double>(trials.size());
        s.point[c][gesture + " peak"] += peak / static_cast<double>(trials.size());
      }
    }
    std::ranges::sort(all);
    for (const double share : kRealShares) s.quantile[c].push_back(quantile_of(all, share));
  }
}

model::Model model_of_others(const std::vector<RealSession>& fold) {
  model::Model m;
  m.sample_period_s = 1 / kRealRate_Hz;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> mean(kRealShares.size(), 0);
    for (std::size_t s = 1; s < fold.size(); ++s) {
      for (std::size_t i = 0; i < mean.size(); ++i)
        mean[i] += fold[s].quantile[c][i] / static_cast<double>(fold.size() - 1);
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

using Random = std::mt19937;

const std::vector<Reading>& any(const std::vector<std::vector<Reading>>& trials, Random& random) {
  return trials[random() % trials.size()];
}

Motion motion_of(const std::vector<Reading>& readings) {
  Motion out{std::vector<std::vector<double>>(3)};
  for (const Reading& r : readings) {
    for (std::size_t c = 0; c < 3; ++c) out.reading[c].push_back(r[c]);
  }
  return out;
}

// Whole trials, a gesture after the other in an order of chance.
Motion across_gestures(const RealSession& s, double seconds, Random& random) {
  std::vector<std::string> order;
  for (const auto& [gesture, trials] : s.trials) order.push_back(gesture);
  std::ranges::shuffle(order, random);
  std::vector<Reading> out;
  for (std::size_t k = 0; static_cast<double>(out.size()) < kRealRate_Hz * seconds; ++k) {
    const auto& trial = any(s.trials.at(order[k % order.size()]), random);
    out.insert(out.end(), trial.begin(), trial.end());
  }
  return motion_of(out);
}

// Two seconds from each of as many parts of the file.
Motion pieces(const RealSession& s, double seconds, Random& random) {
  const std::vector<Reading>& all = s.row;
  const auto piece = static_cast<std::size_t>(2 * kRealRate_Hz);
  const auto parts = static_cast<std::size_t>(seconds / 2);
  std::vector<Reading> out;
  for (std::size_t p = 0; p < parts; ++p) {
    const auto begin =
        static_cast<std::ptrdiff_t>(p * all.size() / parts + random() % (all.size() / parts - piece));
    out.insert(out.end(), all.begin() + begin, all.begin() + begin + static_cast<std::ptrdiff_t>(piece));
  }
  return motion_of(out);
}

Motion window_in_file_order(const RealSession& s, double seconds, Random& random) {
  const std::vector<Reading>& all = s.row;
  const auto size = static_cast<std::size_t>(kRealRate_Hz * seconds);
  const std::size_t begin = random() % (all.size() - size);
  const auto from = all.begin() + static_cast<std::ptrdiff_t>(begin);
  return motion_of({from, from + static_cast<std::ptrdiff_t>(size)});
}

using Draw = Motion (*)(const RealSession&, double, Random&);

// The first is recalibrated, the others are what the model was made from.
using Fold = std::vector<RealSession>;

std::vector<RealSession> sessions_of(const std::string& person, bool transitions) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kDonnings)) {
    if (entry.path().filename().string().starts_with(person)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<RealSession> out;
  for (const fs::path& file : files) summarise(out.emplace_back(load_real(file)), transitions);
  return out;
}

// With transitions all nine sessions of the first wearer have points to score, without them four.
std::vector<Fold> each_against_the_others(const std::string& person, bool transitions) {
  const auto all = sessions_of(person, transitions);
  std::vector<Fold> out;
  for (std::size_t s = 0; s < all.size(); ++s) {
    out.push_back(all);
    std::swap(out.back().front(), out.back()[s]);
  }
  return out;
}

std::vector<Fold> each_against_each(const std::string& person) {
  const auto all = sessions_of(person, true);
  std::vector<Fold> out;
  for (std::size_t s = 0; s < all.size(); ++s) {
    for (std::size_t o = 0; o < all.size(); ++o) {
      if (o != s) out.push_back({all[s], all[o]});
    }
  }
  return out;
}

// Every other trial against the rest of the same session: a glove that was not put on anew.
std::vector<Fold> trials_against_trials(const std::string& person) {
  std::vector<Fold> out;
  for (const RealSession& all : sessions_of(person, true)) {
    Fold fold(2);
    for (const auto& [gesture, trials] : all.trials) {
      for (std::size_t i = 0; i < trials.size(); ++i) {
        RealSession& half = fold[i % 2];
        half.trials[gesture].push_back(trials[i]);
        half.row.insert(half.row.end(), trials[i].begin(), trials[i].end());
      }
    }
    for (RealSession& half : fold) summarise(half, true);
    out.push_back(std::move(fold));
  }
  return out;
}

struct Points {
  std::vector<double> reading;
  std::vector<double> wanted;
};

Points points_of(const Fold& fold, std::size_t c) {
  Points out;
  for (const auto& [name, reading] : fold.front().point[c]) {
    double wanted = 0;
    int others = 0;
    for (std::size_t s = 1; s < fold.size(); ++s) {
      const auto there = fold[s].point[c].find(name);
      if (there == fold[s].point[c].end()) continue;
      wanted += there->second;
      ++others;
    }
    if (others == 0) continue;
    out.reading.push_back(reading);
    out.wanted.push_back(wanted / others);
  }
  return out;
}

// Percent of the range.
double mean_square(const Points& points, const model::Correction& correction) {
  double out = 0;
  for (std::size_t i = 0; i < points.reading.size(); ++i) {
    const double off = 100 * (correction(points.reading[i]) - points.wanted[i]) / kRange;
    out += off * off / static_cast<double>(points.reading.size());
  }
  return out;
}

// The line, of least squares, that knows the answer; of gain one where only the shift is known.
model::Correction knowing(const Points& points, bool gain) {
  const auto n = static_cast<double>(points.reading.size());
  double reading = 0;
  double wanted = 0;
  for (const double u : points.reading) reading += u / n;
  for (const double u : points.wanted) wanted += u / n;
  double square = 0;
  double both = 0;
  for (std::size_t i = 0; i < points.reading.size(); ++i) {
    square += std::pow(points.reading[i] - reading, 2);
    both += (points.reading[i] - reading) * (points.wanted[i] - wanted);
  }
  const double slope = gain && square > 0 ? both / square : 1;
  return {slope, wanted - slope * reading};
}

// Root mean squares of start and peak readings against what they should be, percent of the range, means of three fingers.
struct Scored {
  double raw = 0;
  double after = 0;
  double mean_shift = 0;   // of a shift by the mean difference of five quantiles, always
  double knows_shift = 0;  // what the best shift leaves
  double knows_line = 0;
  double worse = 0;    // percent of the stretches that put them 2 % of the range or more farther off
  double applied = 0;  // percent of the stretches
};

// What anybody would do first.
model::Correction by_mean_quantile(const model::Spread& made, std::vector<double> readings) {
  std::ranges::sort(readings);
  double shift = 0;
  for (std::size_t i = 0; i < made.share.size(); ++i)
    shift +=
        (made.reading[i] - quantile_of(readings, made.share[i])) / static_cast<double>(made.share.size());
  return {1, shift};
}

Scored scored(const std::vector<Fold>& folds, Draw draw, double seconds, int draws) {
  Random random(1);
  Scored out;
  std::array<std::array<double, 5>, 3> squares{};
  double count = 0;
  for (const Fold& fold : folds) {
    std::array<Points, 3> points;
    for (std::size_t c = 0; c < 3; ++c) points[c] = points_of(fold, c);
    if (points[0].reading.empty()) continue;
    Request request;
    request.model = model_of_others(fold);
    for (int i = 0; i < draws; ++i, ++count) {
      request.motion = {draw(fold.front(), seconds, random)};
      const Recalibration r = recalibrate(request);
      double lost = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::array now = {mean_square(points[c], {}), mean_square(points[c], r.sensors[c].correction),
                                mean_square(points[c], knowing(points[c], false)),
                                mean_square(points[c], knowing(points[c], true)),
                                mean_square(points[c], by_mean_quantile(*request.model.inputs[c].readings,
                                                                        request.motion[0].reading[c]))};
        for (std::size_t k = 0; k < now.size(); ++k) squares[c][k] += now[k];
        lost += (std::sqrt(now[1]) - std::sqrt(now[0])) / 3;
      }
      out.worse += lost > 2;
      out.applied += r.applied;
    }
  }
  for (const auto& of : squares) {
    double Scored::*const where[] = {&Scored::raw, &Scored::after, &Scored::knows_shift, &Scored::knows_line,
                                     &Scored::mean_shift};
    for (std::size_t k = 0; k < of.size(); ++k) out.*where[k] += std::sqrt(of[k] / count) / 3;
  }
  out.worse *= 100 / count;
  out.applied *= 100 / count;
  return out;
}

class RealSessions : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kDonnings))
      GTEST_SKIP() << "needs ../shared/data/donning, which is not part of the repository";
  }

  static Scored shown(const char* what, const std::vector<Fold>& folds, Draw draw, double seconds,
                      int draws) {
    const Scored s = scored(folds, draw, seconds, draws);
    std::printf(
        "%-28s %2.0f s: %4.1f -> %4.1f, mean quantile %4.1f, the best shift %4.1f, line %4.1f; applied %3.0f "
        "%%, worse %4.1f %%\n",
        what, seconds, s.raw, s.after, s.mean_shift, s.knows_shift, s.knows_line, s.applied, s.worse);
    return s;
  }
};

TEST_F(RealSessions, StartAndPeakOfGesturesFromSecondsAcrossThem) {
  const auto folds = each_against_the_others("P6_", false);
  const Scored some = shown("across gestures", folds, across_gestures, 20, 40);
  EXPECT_NEAR(some.raw, 18.4, 1) << "the measure itself";
  EXPECT_LT(some.after, 9.5);
  EXPECT_GT(some.after, some.knows_shift) << "too good to be true";
  const Scored more = shown("across gestures", folds, across_gestures, 60, 40);
  EXPECT_LT(more.after, 8.6);
  EXPECT_GT(more.after, more.knows_shift);
  EXPECT_LT(shown("pieces of two seconds", folds, pieces, 20, 40).after, 10.9);
  EXPECT_LT(shown("pieces of two seconds", folds, pieces, 60, 40).after, 9.7);
}

// Many of these windows show one gesture, or one state of a glove that has another half an hour later.
TEST_F(RealSessions, WindowsInTheFilesOrderSeldomMakeASessionWorse) {
  const auto folds = each_against_the_others("P6_", false);
  for (const double seconds : {20.0, 60.0}) {
    const Scored s = shown("windows in file order", folds, window_in_file_order, seconds, 100);
    EXPECT_LE(s.worse, 5);
    EXPECT_GE(s.applied, 60);
    EXPECT_LT(s.after, 0.85 * s.raw);
  }
}

// Five of the nine hold transitions alone, and fewer points that others have as well.
TEST_F(RealSessions, AllSessionsOfEachWearer) {
  const auto folds = each_against_the_others("P6_", true);
  for (const double seconds : {20.0, 60.0}) {
    const Scored across = shown("P6, across gestures", folds, across_gestures, seconds, 40);
    EXPECT_LT(across.after, 0.77 * across.raw);
    EXPECT_LT(across.after, across.mean_shift + 0.1);
    EXPECT_GT(across.after, across.knows_shift);
    EXPECT_LE(across.worse, 5);
    const Scored window = shown("P6, windows in file order", folds, window_in_file_order, seconds, 100);
    EXPECT_LT(window.after, 0.92 * window.raw);
    EXPECT_LT(window.after, window.mean_shift);
    EXPECT_LE(window.worse, 9);
  }
  // Of the second wearer's three sessions no shift takes much: there is little to gain, and nothing is gained.
  const auto few = each_against_the_others("P2_", true);
  for (const double seconds : {20.0, 60.0}) {
    for (const Draw draw : {&across_gestures, &window_in_file_order}) {
      const Scored s = shown("P2", few, draw, seconds, 40);
      EXPECT_LT(s.after, 1.05 * s.raw);
      EXPECT_LT(s.after, s.mean_shift);
      EXPECT_LE(s.worse, 12);
    }
  }
}

TEST_F(RealSessions, ASessionAgainstOneOther) {
  for (const char* person : {"P6_", "P2_"}) {
    const auto folds = each_against_each(person);
    for (const double seconds : {20.0, 60.0}) {
      const Scored s = shown(person, folds, across_gestures, seconds, 10);
      EXPECT_LE(s.worse, 5) << person;
      EXPECT_LT(s.after, (person[1] == '6' ? 0.75 : 1.05) * s.raw);
      EXPECT_GT(s.after, s.knows_shift);
      EXPECT_LE(shown(person, folds, window_in_file_order, seconds, 10).worse, 5) << person;
    }
  }
}

// There is nothing to gain. A window of one gesture cannot be told from a glove that sits otherwise.
TEST_F(RealSessions, WhatAGloveLosesThatWasNotPutOnAnew) {
  for (const char* person : {"P1_", "P2_", "P4_", "P6_"}) {
    const auto folds = trials_against_trials(person);
    for (const double seconds : {20.0, 60.0}) {
      const Scored s = shown(person, folds, across_gestures, seconds, 20);
      EXPECT_LE(s.worse, 10) << person;
      EXPECT_LT(s.after, s.raw + 1);
      const Scored window = shown(person, folds, window_in_file_order, seconds, 20);
      EXPECT_LE(window.worse, 22) << person;
      EXPECT_LT(window.after, window.raw + 1.5);
    }
  }
}

}  // namespace
}  // namespace flexor::donning
