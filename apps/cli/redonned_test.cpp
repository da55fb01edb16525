// A real finger with angles, its sensor moved as a real glove moved from session to session: what flexor recalibrate makes of
// one to three whole bends without a camera, from open hand to open hand and from fist to fist. Fitted on the first half of a recording, bends from and score on the second.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/cli/command_test.hpp"
#include "host/identify/estimator.hpp"
#include "host/identify/recalibrate_files.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace redonned_test {

const fs::path kRealData = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data";

// Of a sensor against the mean of all sessions, shares of its span.
struct Moved {
  double shift;
  double gain;
};

constexpr double kTurn_deg = 30;
constexpr double kBeside_s = 1;  // a recording begins before the finger turns and ends after it

struct Finger {
  std::string name;
  std::string sensor;
};

struct Bends {
  double begin_s;
  double end_s;
};

// Root mean squares over all sessions and all bends of a kind, degrees.
struct Errors {
  double raw = 0;     // put on anew, nothing done
  double middle = 0;  // the middle of the bends' 2nd and 98th percentile mapped to the first half's
  double flexor = 0;
  double worse = 0;  // percent that flexor makes worse by more than 5 %
};

model::Spread ends(std::vector<double> of) {
  return identify::spread_of(std::move(of), std::array{0.02, 0.98});
}

class Redonned : public Command {
 protected:
  void SetUp() override {
    if (!fs::exists(kRealData / "donning"))
      GTEST_SKIP() << "needs ../shared/data, which is not part of the repository";
  }

  // Of one glove between its sessions.
  void read_moves() {
    const fs::path moves = folder_ / "moves.json";
    const std::string command = fmt::format(
        "PYTHONPATH=python:build/release/python/package build/python/bin/python -c \"import glob, pandas; "
        "from flexor.donning import compare; compare({{file: pandas.read_csv(file) for file in "
        "glob.glob('{}/donning/P6*.csv')}}).to_json('{}', orient='records')\"",
        kRealData.string(), moves.string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    for (const auto& one : nlohmann::json::parse(io::read_file(moves)))
      moved_.push_back({one.at("shift").get<double>(), std::exp(one.at("log_gain").get<double>())});
  }

  void identify(const Finger& finger) {
    const fs::path file = kRealData / "glove" / finger.name / "realigned_20hz.csv";
    const auto log = recording::read_csv(file, {finger.sensor, "angle_ABC_deg", "adc_gap"});
    t_s_.clear();
    reading_.clear();
    angle_deg_.clear();
    std::string csv = "t_s,index_adc,index_deg\n";
    for (std::size_t i = 0; i < log.t_s.size(); ++i) {
      if (log.columns[2].value[i] != 0) continue;
      t_s_.push_back(log.t_s[i]);
      reading_.push_back(log.columns[0].value[i]);
      angle_deg_.push_back(log.columns[1].value[i]);
      csv += fmt::format("{},{},{}\n", t_s_.back(), reading_.back(), angle_deg_.back());
    }
    half_s_ = t_s_.back() / 2;
    write("log.csv", csv);
    const Finished r =
        run("identify --sensor log.csv --reference log.csv --input index_adc --output index_deg "
            "--clock-offset 0 --model model.json");
    ASSERT_EQ(r.exit, 0) << r.err;
    model_ = model::load(folder_ / "model.json");
    first_half_ =
        ends({reading_.begin(), reading_.begin() + static_cast<std::ptrdiff_t>(reading_.size() / 2)});
  }

  // Whole bends of the second half, each from a turn of the finger to the `count`-th of the same kind after it.
  std::vector<Bends> bends(std::size_t count) const {
    std::vector<double> turned_s[2];
    int way = 0;
    const auto half = static_cast<std::size_t>(std::ranges::lower_bound(t_s_, half_s_) - t_s_.begin());
    std::size_t low = half;
    std::size_t high = half;
    for (std::size_t i = half; i < t_s_.size(); ++i) {
      if (angle_deg_[i] < angle_deg_[low]) low = i;
      if (angle_deg_[i] > angle_deg_[high]) high = i;
      const bool falls = way >= 0 && angle_deg_[i] < angle_deg_[high] - kTurn_deg;
      const bool rises = way <= 0 && angle_deg_[i] > angle_deg_[low] + kTurn_deg;
      if (!falls && !rises) continue;
      turned_s[falls ? 1 : 0].push_back(t_s_[falls ? high : low]);
      way = falls ? -1 : 1;
      low = high = i;
    }
    std::vector<Bends> out;
    for (const auto& kind : turned_s) {
      for (std::size_t i = 0; i + count < kind.size(); ++i)
        out.push_back({kind[i] - kBeside_s, kind[i + count] + kBeside_s});
    }
    return out;
  }

  // Mean square on the second half, but for its first second.
  double mean_square_deg2(const model::Model& model, const std::vector<double>& reading,
                          bool tracked = false) const {
    identify::Estimator<model::DoubleArithmetic> estimator(model);
    if (tracked) estimator.track({});
    double sum = 0;
    double count = 0;
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      estimator.push(t_s_[i], std::span(&reading[i], 1), [&](const identify::Estimate& e) {
        if (e.t_s < half_s_ + 1) return;
        const auto at = std::ranges::upper_bound(t_s_, e.t_s + 1e-6) - t_s_.begin() - 1;
        sum += std::pow(e.angle_deg[0] - angle_deg_[static_cast<std::size_t>(at)], 2);
        ++count;
      });
    }
    return sum / count;
  }

  std::vector<double> put_on_anew(const Moved& moved) const {
    std::vector<double> out;
    for (const double u : reading_) {
      out.push_back(std::clamp(
          first_half_.middle() + moved.gain * (u - first_half_.middle()) + moved.shift * first_half_.span(),
          0.0, 1023.0));
    }
    return out;
  }

  void add(const Moved& moved, const Bends& seen, Errors& sums) const {
    const std::vector<double> now = put_on_anew(moved);
    recording::Recording bends;
    bends.source = "bends";
    bends.columns.emplace_back().name = "index_adc";
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      if (t_s_[i] < seen.begin_s || t_s_[i] > seen.end_s) continue;
      bends.t_s.push_back(t_s_[i]);
      bends.columns[0].value.push_back(now[i]);
    }
    const double off = first_half_.middle() - ends(bends.columns[0].value).middle();
    std::vector<double> middle = now;
    for (double& u : middle) u += off;
    identify::RecalibrationFiles request;
    request.model = model_;
    request.recording = recording::Log(bends);
    const double raw = mean_square_deg2(model_, now);
    const double flexor = mean_square_deg2(identify::recalibrate_files(request).model, now);
    sums.raw += raw;
    sums.middle += mean_square_deg2(model_, middle);
    sums.flexor += flexor;
    sums.worse += std::sqrt(flexor / raw) > 1.05 ? 100 : 0;
  }

  Errors errors(std::size_t count) {
    Errors out;
    const std::vector<Bends> all = bends(count);
    EXPECT_FALSE(all.empty());
    for (const Bends& one : all) {
      for (const Moved& moved : moved_) add(moved, one, out);
    }
    const auto n = static_cast<double>(all.size() * moved_.size());
    for (double Errors::*of : {&Errors::raw, &Errors::middle, &Errors::flexor})
      out.*of = std::sqrt(out.*of / n);
    out.worse /= n;
    return out;
  }

  std::vector<Moved> moved_;
  std::vector<double> t_s_;
  std::vector<double> reading_;
  std::vector<double> angle_deg_;
  double half_s_ = 0;
  model::Spread first_half_;
  model::Model model_;
};

const std::vector<Finger> kRealFingers = {{"index_ind2", "adc_A1"}, {"middle_mid1", "adc_A2"}};

// The glove stayed on the hand: there is nothing to follow.
TEST_F(Redonned, TrackingCostsAGloveThatWasNotPutOnAnewAtMostThreePercent) {
  for (const Finger& finger : kRealFingers) {
    identify(finger);
    const double plain = std::sqrt(mean_square_deg2(model_, reading_));
    const double tracked = std::sqrt(mean_square_deg2(model_, reading_, true));
    std::printf("%-11s worn on: %.2f deg, tracked %.2f\n", finger.name.c_str(), plain, tracked);
    EXPECT_LE(tracked, 1.03 * plain);
  }
}

TEST_F(Redonned, WholeBendsBringARealFingerBack) {
  read_moves();
  ASSERT_GE(moved_.size(), 27U);
  const std::vector<std::vector<double>> most = {{6.8, 3.6, 2.9}, {7.6, 5, 4.7}};  // degrees
  for (std::size_t f = 0; f < kRealFingers.size(); ++f) {
    identify(kRealFingers[f]);
    const double before = std::sqrt(mean_square_deg2(model_, reading_));
    for (std::size_t count = 1; count <= 3; ++count) {
      const Errors e = errors(count);
      std::printf(
          "%-11s %zu bends: before %.2f deg, put on anew %.2f, middle mapped %.2f, flexor %.2f; worse %.0f "
          "%%\n",
          kRealFingers[f].name.c_str(), count, before, e.raw, e.middle, e.flexor, e.worse);
      EXPECT_LT(e.flexor, most[f][count - 1]);
      EXPECT_LE(e.worse, 5);
      EXPECT_GT(e.flexor, 0.9 * before) << "too good to be true";
      if (count > 1) {
        EXPECT_LT(e.flexor, e.middle);
      }
    }
  }
}

}  // namespace redonned_test
}  // namespace flexor::cli
