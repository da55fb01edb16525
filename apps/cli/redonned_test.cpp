// A real finger with angles, its sensor moved as a real glove moved from session to session: what flexor recalibrate makes of
// one to three whole bends without a camera. Fitted on the first half of a recording, bends from and score on the second.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace {

namespace fs = std::filesystem;
const fs::path kRealData = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data";

// Of a sensor against the mean of all sessions, shares of its span.
struct Moved {
  double shift;
  double gain;
};

struct Finger {
  std::string name;
  std::string sensor;
  std::vector<double>
      bend_ends_s;  // of one, two and three bends that begin at kBendsBegin_s, open hand to open hand
};
constexpr double kBendsBegin_s = 111;

// Root mean squares over all sessions, degrees.
struct Errors {
  double before;  // not put on anew
  double raw;     // put on anew, nothing done
  double mapped;  // the middle of the bends' 2nd and 98th percentile mapped to the first half's
  double flexor;
};

class Redonned : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kRealData / "donning"))
      GTEST_SKIP() << "needs ../shared/data, which is not part of the repository";
    std::string sessions;
    for (const auto& entry : fs::directory_iterator(kRealData / "donning")) {
      if (entry.path().filename().string().starts_with("P6"))
        sessions += fmt::format(" '{}'", fs::absolute(entry.path()).string());
    }
    const auto said = nlohmann::json::parse(run("donning --json" + sessions));
    for (const auto& session : said.at("sessions")) {
      for (const auto& sensor : session.at("sensors")) {
        moved_.push_back({sensor.at("shift").at("value").get<double>(),
                          std::exp(sensor.at("log_gain").at("value").get<double>())});
      }
    }
  }

  std::string run(const std::string& arguments) {
    const std::string command = fmt::format("cd '{}' && '{}' {} > out 2> err", folder_.path().string(),
                                            fs::absolute(FLEXOR_PROGRAM).string(), arguments);
    const int status = std::system(command.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 0) << arguments << "\n" << io::read_file(folder_.path() / "err");
    return io::read_file(folder_.path() / "out");
  }

  void write(const std::string& name, const std::vector<double>& reading, double from_s, double to_s) {
    std::ofstream out(folder_.path() / name);
    out << "t_s,index_adc\n";
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      if (t_s_[i] >= from_s && t_s_[i] <= to_s) out << fmt::format("{},{}\n", t_s_[i], reading[i]);
    }
  }

  void identify(const Finger& finger) {
    const fs::path file = kRealData / "glove" / finger.name / "realigned_20hz.csv";
    const auto log = recording::read_csv(file, {finger.sensor, "angle_ABC_deg", "adc_gap"});
    t_s_.clear();
    reading_.clear();
    angle_deg_.clear();
    std::string reference = "t_s,index_deg\n";
    for (std::size_t i = 0; i < log.t_s.size(); ++i) {
      if (log.columns[2].value[i] != 0) continue;
      t_s_.push_back(log.t_s[i]);
      reading_.push_back(log.columns[0].value[i]);
      angle_deg_.push_back(log.columns[1].value[i]);
      reference += fmt::format("{},{}\n", t_s_.back(), angle_deg_.back());
    }
    half_s_ = t_s_.back() / 2;
    io::write_file(folder_.path() / "reference.csv", reference);
    write("sensor.csv", reading_, 0, t_s_.back());
    run("identify --sensor sensor.csv --reference reference.csv --clock-offset 0 --model model.json");
    const auto half = static_cast<std::ptrdiff_t>(reading_.size() / 2);
    std::tie(middle_, span_) = ends({reading_.begin(), reading_.begin() + half});
  }

  static std::pair<double, double> ends(std::vector<double> of) {
    std::ranges::sort(of);
    const auto at = [&](double share) {
      return of[static_cast<std::size_t>(share * static_cast<double>(of.size() - 1))];
    };
    return {(at(0.02) + at(0.98)) / 2, at(0.98) - at(0.02)};
  }

  // Mean square on the second half, but for its first second.
  double mean_square_deg2(const std::string& model, const std::vector<double>& reading) {
    write("now.csv", reading, 0, t_s_.back());
    io::write_file(folder_.path() / "angles.csv", run("apply " + model + " now.csv"));
    const auto out = recording::read_csv(folder_.path() / "angles.csv", {"index_deg"});
    double sum = 0;
    double count = 0;
    for (std::size_t i = 0, k = 0; i < out.t_s.size(); ++i) {
      while (k + 1 < t_s_.size() && t_s_[k + 1] <= out.t_s[i] + 1e-6) ++k;
      if (out.t_s[i] < half_s_ + 1) continue;
      sum += std::pow(out.columns[0].value[i] - angle_deg_[k], 2);
      ++count;
    }
    return sum / count;
  }

  Errors errors(double bends_end_s) {
    Errors out{mean_square_deg2("model.json", reading_), 0, 0, 0};
    const auto n = static_cast<double>(moved_.size());
    for (const Moved& moved : moved_) {
      std::vector<double> now;
      std::vector<double> bends;
      for (std::size_t i = 0; i < t_s_.size(); ++i) {
        now.push_back(
            std::clamp(middle_ + moved.gain * (reading_[i] - middle_) + moved.shift * span_, 0.0, 1023.0));
        if (t_s_[i] >= kBendsBegin_s && t_s_[i] <= bends_end_s) bends.push_back(now.back());
      }
      out.raw += mean_square_deg2("model.json", now) / n;
      std::vector<double> mapped = now;
      for (double& u : mapped) u += middle_ - ends(bends).first;
      out.mapped += mean_square_deg2("model.json", mapped) / n;
      write("bends.csv", now, kBendsBegin_s, bends_end_s);
      run("recalibrate model.json --recording bends.csv --out today.json");
      out.flexor += mean_square_deg2("today.json", now) / n;
    }
    return {std::sqrt(out.before), std::sqrt(out.raw), std::sqrt(out.mapped), std::sqrt(out.flexor)};
  }

  io::TemporaryFolder folder_;
  std::vector<Moved> moved_;
  std::vector<double> t_s_;
  std::vector<double> reading_;
  std::vector<double> angle_deg_;
  double half_s_ = 0;
  double middle_ = 0;
  double span_ = 0;
};

TEST_F(Redonned, WholeBendsBringARealFingerBack) {
  ASSERT_GE(moved_.size(), 27U);
  const std::vector<Finger> fingers = {{"index_ind2", "adc_A1", {143, 174, 205}},
                                       {"middle_mid1", "adc_A2", {147, 177, 205}}};
  const std::vector<std::vector<double>> most = {{4.3, 3.8, 2.95}, {6.1, 5.3, 4.6}};  // degrees
  for (std::size_t f = 0; f < fingers.size(); ++f) {
    identify(fingers[f]);
    for (std::size_t bends = 1; bends <= 3; ++bends) {
      const Errors e = errors(fingers[f].bend_ends_s[bends - 1]);
      std::printf("%-11s %zu bends: before %.2f deg, put on anew %.2f, middle mapped %.2f, flexor %.2f\n",
                  fingers[f].name.c_str(), bends, e.before, e.raw, e.mapped, e.flexor);
      EXPECT_LT(e.flexor, most[f][bends - 1]);
      EXPECT_LT(e.flexor, e.mapped);
      EXPECT_GT(e.flexor, 0.9 * e.before) << "too good to be true";
    }
  }
}

}  // namespace
}  // namespace flexor::cli
