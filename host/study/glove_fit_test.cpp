#include "host/study/glove_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/model/formats.hpp"
#include "host/recording/csv.hpp"

namespace flexor::study {
namespace {

class Glove : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    recordings_ = new std::vector<GloveRecording>(record_glove(request_));
    fit_ = new GloveFit(fit_glove(request_, *recordings_));
  }
  static void TearDownTestSuite() {
    delete fit_;
    delete recordings_;
  }

  static const model::Model& baseline(const std::string& name) {
    return std::ranges::find(fit_->baselines, name, &Compensator::name)->model;
  }

  inline static GloveRequest request_;
  inline static std::vector<GloveRecording>* recordings_ = nullptr;
  inline static GloveFit* fit_ = nullptr;
};

TEST_F(Glove, EachDonningIsTwoMinutesAndAnotherDrawWithACameraClockOfItsOwn) {
  GloveRequest two = request_;
  two.donnings = 2;
  const std::vector<GloveRecording> both = record_glove(two);
  ASSERT_EQ(both.size(), 2U);
  EXPECT_NEAR(both[1].glove.t_s.back() - both[1].glove.t_s.front(), 120, 1.5);
  EXPECT_EQ(both[0].glove.columns[0].value, recordings_->front().glove.columns[0].value);
  EXPECT_NE(both[1].glove.columns[0].value, both[0].glove.columns[0].value);
  EXPECT_NE(both[1].camera.t_s.front(), both[0].camera.t_s.front());
}

TEST_F(Glove, FilesHoldWhatWasRecordedToTheBit) {
  const io::TemporaryFolder folder;
  write_recordings(*recordings_, folder.path());
  const GloveRecording& one = recordings_->front();
  for (const auto& [file, recording] :
       {std::pair{"glove-1.csv", one.glove}, {"camera-1.csv", one.camera}, {"hand-1.csv", one.hand}}) {
    const recording::Recording back =
        recording::read_csv(folder.path() / file, {recording.columns[2].name}, "");
    EXPECT_EQ(back.t_s, recording.t_s);
    EXPECT_EQ(back.columns[0].value, recording.columns[2].value);
  }
}

TEST_F(Glove, EveryModelFitsAMicrocontroller) {
  EXPECT_NO_THROW(model::check_fixed(fit_->identified));
  for (const Compensator& c : fit_->baselines) {
    EXPECT_NO_THROW(model::check(c.model)) << c.name;
    EXPECT_NO_THROW(model::check_fixed(c.model)) << c.name;
  }
}

TEST_F(Glove, TheRefittedModelIsThePublishedOneButForGainAndEdge) {
  const std::vector<model::Channel> published = model::channels(compensator("published-hw", 10).model);
  const std::vector<model::Channel> ours = model::channels(baseline("published-hw-refitted"));
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_EQ(ours[i].lti.poles_rad_s, published[i].lti.poles_rad_s);
    EXPECT_EQ(ours[i].saturation, published[i].saturation);
    EXPECT_NE(ours[i].lti.gain, published[i].lti.gain);
    EXPECT_NE(ours[i].dead_zone->upper, published[i].dead_zone->upper);
  }
}

// Angles of a model where all readings rest at `alpha_deg`.
double at_rest(const model::Model& m, double alpha_deg) {
  model::Compensator<model::DoubleArithmetic> compensator(m);
  const std::vector<double> readings(m.inputs.size(), alpha_deg);
  double angle = 0;
  for (int k = 0; k < 100; ++k) angle = compensator.step(readings)[1].angle_deg;
  return angle;
}

TEST_F(Glove, TheBaselinesAreWhatTheyClaim) {
  ASSERT_TRUE(fit_->lead_s);
  EXPECT_GT(*fit_->lead_s, 0);
  const model::Model& line = baseline("line");
  const model::Model& lead = baseline("line-lead");
  EXPECT_EQ(line.training.at("lead_s"), 0);
  EXPECT_EQ(lead.training.at("lead_s"), *fit_->lead_s);
  EXPECT_EQ(fit_->identified.training.at("lead_s"), *fit_->lead_s);
  for (const model::Model* m : {&line, &lead}) {
    EXPECT_NEAR(at_rest(*m, 60) - at_rest(*m, 50), at_rest(*m, 90) - at_rest(*m, 80), 1e-6) << "a line";
    EXPECT_NEAR((at_rest(*m, 90) - at_rest(*m, 50)) / 40, 0.9, 0.2);
  }
}

}  // namespace
}  // namespace flexor::study
