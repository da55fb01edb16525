#include "host/study/glove_fit.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/formats.hpp"
#include "host/recording/csv.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

constexpr model::Saturation kWide = {-1e4, 1e4};

struct Points {
  std::vector<double> alpha;
  std::vector<double> angle_deg;
};

// 0.8 alpha + 5 and noise; every tenth angle far off.
Points points(int count, double noise_deg, double outlier_deg) {
  twin::Random random(3);
  Points out;
  for (int k = 0; k < count; ++k) {
    out.alpha.push_back(20 + 100 * random.uniform());
    out.angle_deg.push_back(0.8 * out.alpha.back() + 5 + noise_deg * random.normal() +
                            (k % 10 == 0 ? outlier_deg : 0));
  }
  return out;
}

double absolute_error(const Points& p, const Line& line) {
  double sum = 0;
  for (std::size_t k = 0; k < p.alpha.size(); ++k) {
    sum += std::abs(line.gain * p.alpha[k] + line.offset_deg - p.angle_deg[k]);
  }
  return sum;
}

// A line of least absolute error goes through two of the points.
Line least_absolute(const Points& p) {
  Line best;
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < p.alpha.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double gain = (p.angle_deg[i] - p.angle_deg[j]) / (p.alpha[i] - p.alpha[j]);
      const Line line{gain, p.angle_deg[i] - gain * p.alpha[i]};
      const double error = absolute_error(p, line);
      if (error >= least) continue;
      least = error;
      best = line;
    }
  }
  return best;
}

TEST(Line, OfResidualsFarAboveTheLossIsThatOfLeastAbsoluteError) {
  const Points p = points(80, 5, 60);
  const Line exact = least_absolute(p);
  const Line ours = fit_line(p.alpha, p.angle_deg, kWide);
  EXPECT_LT(absolute_error(p, ours), 1.002 * absolute_error(p, exact));
  for (const double alpha : {20, 120}) {
    EXPECT_NEAR(ours.gain * alpha + ours.offset_deg, exact.gain * alpha + exact.offset_deg, 0.8);
  }
}

TEST(Line, OfResidualsFarBelowTheLossIsLeastSquares) {
  const Points p = points(80, 0.01, 0);
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (std::size_t k = 0; k < p.alpha.size(); ++k) {
    sx += p.alpha[k];
    sy += p.angle_deg[k];
    sxx += p.alpha[k] * p.alpha[k];
    sxy += p.alpha[k] * p.angle_deg[k];
  }
  const auto n = static_cast<double>(p.alpha.size());
  const double gain = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  const Line ours = fit_line(p.alpha, p.angle_deg, kWide);
  EXPECT_NEAR(ours.gain, gain, 1e-4);
  EXPECT_NEAR(ours.offset_deg, (sy - gain * sx) / n, 5e-3);
}

TEST(Line, WhatTheLimitsCutOffDoesNotBendIt) {
  Points p = points(200, 0.2, 0);
  constexpr model::Saturation kLimits = {40, 80};
  for (double& angle : p.angle_deg) angle = std::clamp(angle, kLimits.lower_deg, kLimits.upper_deg);
  const Line ours = fit_line(p.alpha, p.angle_deg, kLimits);
  EXPECT_NEAR(ours.gain, 0.8, 0.01);
  EXPECT_NEAR(ours.offset_deg, 5, 0.8);
  EXPECT_LT(fit_line(p.alpha, p.angle_deg, kWide).gain, 0.75) << "a line that knows no limits is bent";
}

class Glove : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    request_.parameters = shipped_parameters();
    recording_ = new GloveRecording(record_glove(request_));
    fit_ = new GloveFit(fit_glove(request_, *recording_, true, {}));
  }
  static void TearDownTestSuite() {
    delete fit_;
    delete recording_;
  }

  static const FittedModel& baseline(const std::string& name) {
    return *std::ranges::find(fit_->baselines, name, &FittedModel::name);
  }

  inline static GloveRequest request_;
  inline static GloveRecording* recording_ = nullptr;
  inline static GloveFit* fit_ = nullptr;
};

TEST_F(Glove, OneDonningIsTheDefault) {
  EXPECT_EQ(GloveRequest().rounds, 1);
  EXPECT_LT(recording_->glove.t_s.back() - recording_->glove.t_s.front(), 31);
}

TEST_F(Glove, FilesHoldWhatWasFittedToTheBit) {
  const fs::path folder = fs::temp_directory_path() / ("flexor_glove_fit" + std::to_string(::getpid()));
  write_recording(*recording_, folder);
  for (const auto& [file, recording] :
       {std::pair{"glove.csv", recording_->glove}, {"camera.csv", recording_->camera}}) {
    const recording::Recording back = recording::read_csv(folder / file, {recording.columns[2].name}, "");
    EXPECT_EQ(back.t_s, recording.t_s);
    EXPECT_EQ(back.columns[0].value, recording.columns[2].value);
  }
  fs::remove_all(folder);
}

TEST_F(Glove, EveryModelFitsAMicrocontroller) {
  for (const auto* models : {&fit_->steps, &fit_->baselines}) {
    for (const FittedModel& m : *models) {
      EXPECT_NO_THROW(model::check(m.model)) << m.name;
      EXPECT_NO_THROW(model::check_fixed(m.model)) << m.name;
    }
  }
}

TEST_F(Glove, TheRefittedModelIsThePublishedOneButForGainAndEdge) {
  const std::vector<model::Channel> published = model::channels(compensator("published-hw", 10).model);
  const model::Model& model = baseline("published-hw-refitted").model;
  const std::vector<model::Channel> ours = model::channels(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_EQ(ours[i].lti.poles_rad_s, published[i].lti.poles_rad_s);
    EXPECT_EQ(ours[i].saturation, published[i].saturation);
    EXPECT_NE(ours[i].lti.gain, published[i].lti.gain);
    EXPECT_FALSE(ours[i].input_curve || ours[i].hysteresis);
    EXPECT_LT(model.fit.at(ours[i].name).at("fitted_rmse_deg").get<double>(), 4);
  }
}

TEST_F(Glove, TheBaselinesAreWhatTheySay) {
  ASSERT_TRUE(fit_->lag_s);
  const model::Model& line = baseline("line").model;
  const model::Model& lead = baseline("line-lead").model;
  EXPECT_EQ(lead.training.at("lead_s"), fit_->identified().training.at("lead_s"));
  const std::vector<model::Channel> lines = model::channels(line);
  const std::vector<model::Channel> leads = model::channels(lead);
  const std::vector<model::Channel> first = model::channels(fit_->steps.front().model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_TRUE(lines[i].lti.poles_rad_s.empty() && !lines[i].input_curve);
    EXPECT_EQ(leads[i].lti.poles_rad_s.size(), 1U);
    EXPECT_GT(leads[i].lti.taps.at(0), 1) << "it leads";
    EXPECT_EQ(lines[i].saturation, first[i].saturation);
  }
}

}  // namespace
}  // namespace flexor::study
