#include "host/identify/identify_files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <ostream>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {
namespace fs = std::filesystem;

// The real recordings, raw logs in, against the figures that this project promises for them; both bounds
// count: a figure that is too good means that held-out data leaked.
struct RealCase {
  const char* folder;
  const char* input;
  const char* output;
  const char* channel;
  double line_low, line_high;  // straight line, held-out RMSE in degrees
  double auto_low, auto_high;  // structure auto

  friend std::ostream& operator<<(std::ostream& out, const RealCase& c) {
    return out << c.folder << '/' << c.output;
  }
};

class RealFigures : public testing::TestWithParam<RealCase> {
 protected:
  void SetUp() override {
    if (!fs::exists(folder())) {
      GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
    }
    fs::create_directories(scratch());
  }
  void TearDown() override { fs::remove_all(scratch()); }

  static fs::path folder() {
    return fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove" / GetParam().folder;
  }
  static fs::path scratch() {
    return fs::path(testing::TempDir()) / ("flexor_real_" + std::to_string(::getpid()));
  }

  static FileRequest request(const char* structure) {
    FileRequest r;
    r.files = {folder() / "sensor_log.csv", folder() / "camera_angles.csv", GetParam().input,
               GetParam().output};
    r.structure = structure;
    r.channel = GetParam().channel;
    return r;
  }

  // A copy of one file with its clock shifted, its ends cut or its values scaled.
  static fs::path changed(const fs::path& file, const std::string& column, double shift_s, double cut_start_s,
                          double cut_end_s, double scale) {
    const auto original = recording::read_csv(file, {column});
    recording::Recording r;
    r.columns = {{column, {}}};
    for (std::size_t k = 0; k < original.t_s.size(); ++k) {
      const double t = original.t_s[k];
      if (t < original.t_s.front() + cut_start_s || t > original.t_s.back() - cut_end_s) continue;
      r.t_s.push_back(t + shift_s);
      r.columns[0].value.push_back(scale * original.columns[0].value[k]);
    }
    const fs::path out = scratch() / file.filename();
    io::write_file(out, recording::to_csv(r));
    return out;
  }
};

TEST_P(RealFigures, AutoReachesThePromisedHeldOutErrors) {
  const Identification r = identify_files(request("auto"), {});
  const RealCase& c = GetParam();
  EXPECT_GT(r.baseline.rmse_deg, c.line_low);
  EXPECT_LT(r.baseline.rmse_deg, c.line_high);
  EXPECT_GT(r.holdout.rmse_deg, c.auto_low);
  EXPECT_LT(r.holdout.rmse_deg, c.auto_high);
  EXPECT_EQ(r.holdout_begin, (r.aligned.overlap_begin + r.aligned.size()) / 2);
  EXPECT_EQ(std::ranges::count_if(r.rows, &TableRow::chosen), 1);
  EXPECT_EQ(r.structure, "additive");
  for (const TableRow& row : r.rows) {
    EXPECT_TRUE(row.refusal.empty()) << row.name;
    EXPECT_TRUE(row.cross_validated_deg || !row.chosen) << row.name;
  }
}

TEST_P(RealFigures, WhatIsHeldOutCannotMoveTheModel) {
  const FileRequest whole = request("hw");
  const Identification before = identify_files(whole, {});
  // Other angles in the held-out part: the clock offset is given, so that only the fit could notice.
  FileRequest spoilt = whole;
  spoilt.clock_offset_s = before.aligned.clock_offset_s;
  auto camera = recording::read_csv(whole.files.reference, {whole.files.output});
  const double split_s = before.aligned.t_s[before.holdout_begin] + before.aligned.clock_offset_s + 1;
  for (std::size_t k = 0; k < camera.t_s.size(); ++k) {
    if (camera.t_s[k] > split_s) camera.columns[0].value[k] = 40 - 0.3 * camera.columns[0].value[k];
  }
  spoilt.files.reference = scratch() / "spoilt.csv";
  io::write_file(spoilt.files.reference, recording::to_csv(camera));
  const Identification after = identify_files(spoilt, {});
  EXPECT_EQ(after.model.blocks, before.model.blocks);
  EXPECT_GT(after.holdout.rmse_deg, 2 * before.holdout.rmse_deg);
}

TEST_P(RealFigures, ShiftedClocksAndFlippedAnglesGiveTheSameResult) {
  const FileRequest plain = request("hw");
  const Identification before = identify_files(plain, {});
  for (const double shift : {-300.0, 300.0}) {
    FileRequest moved = plain;
    moved.files.sensor = changed(plain.files.sensor, plain.files.input, shift, 0, 0, 1);
    EXPECT_NEAR(identify_files(moved, {}).holdout.rmse_deg, before.holdout.rmse_deg, 1e-6);
    moved = plain;
    moved.files.reference = changed(plain.files.reference, plain.files.output, shift, 0, 0, 1);
    EXPECT_NEAR(identify_files(moved, {}).holdout.rmse_deg, before.holdout.rmse_deg, 1e-6);
  }
  FileRequest flipped = plain;
  flipped.files.reference = changed(plain.files.reference, plain.files.output, 0, 0, 0, -1);
  EXPECT_NEAR(identify_files(flipped, {}).holdout.rmse_deg, before.holdout.rmse_deg, 0.02);
}

TEST_P(RealFigures, CutRecordingsStillGiveTheSameOffsetAndBeatTheLine) {
  const FileRequest plain = request("hw");
  const double offset_s = identify_files(plain, {}).aligned.clock_offset_s;
  const auto expect_same = [&](const FileRequest& r) {
    const Identification cut = identify_files(r, {});
    EXPECT_NEAR(cut.aligned.clock_offset_s, offset_s, 0.15);
    EXPECT_LT(cut.holdout.rmse_deg, 0.85 * cut.baseline.rmse_deg);
  };
  for (const auto& [start, end] : {std::pair(30.0, 0.0), std::pair(0.0, 30.0)}) {
    FileRequest r = plain;
    r.files.sensor = changed(plain.files.sensor, plain.files.input, 0, start, end, 1);
    expect_same(r);
    r = plain;
    r.files.reference = changed(plain.files.reference, plain.files.output, 0, start, end, 1);
    expect_same(r);
  }
}

TEST_P(RealFigures, AWrongUserOffsetIsCalledOut) {
  FileRequest r = request("linear");
  r.clock_offset_s = identify_files(r, {}).aligned.clock_offset_s + 2.5;
  const auto warnings = identify_files(r, {}).warnings;
  EXPECT_TRUE(std::ranges::any_of(warnings, [](const std::string& w) {
    return w.find("disagrees with the signals by +2.50 s") != std::string::npos;
  }));
}

INSTANTIATE_TEST_SUITE_P(
    Glove, RealFigures,
    testing::Values(RealCase{"index_ind2", "SensorA1", "∠ABC_smooth", "index", 5.2, 5.5, 0.8, 1.6},
                    RealCase{"index_ind2", "SensorA1", "∠BCD_smooth", "index", 4.6, 4.9, 0.7, 1.2},
                    RealCase{"middle_mid1", "SensorA2", "∠ABC_smooth", "middle", 5.0, 5.3, 2.8, 4.1},
                    RealCase{"middle_mid1", "SensorA2", "∠BCD_smooth", "middle", 5.9, 6.3, 3.0, 4.7}));

class Simulated : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / ("flexor_identification_test_" + std::to_string(::getpid()));
    ASSERT_EQ(std::system(("'" FLEXOR_SIMULATE "' '" + folder_.string() + "'").c_str()), 0);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static FileRequest request(const char* structure) {
    FileRequest r;
    r.files = {folder_ / "simulated_glove.csv", folder_ / "simulated_camera.csv", "", ""};
    r.structure = structure;
    return r;
  }

  static inline fs::path folder_;
};

TEST_F(Simulated, FindsColumnsFingerOffsetAndABetterCurve) {
  FileRequest chain = request("hw-hysteresis");
  const Identification found = identify_files(chain, {});
  EXPECT_EQ(found.model.joints[0].name, "index");  // from the columns' names
  EXPECT_NEAR(found.aligned.clock_offset_s, 7.4, 0.06);
  // This chain cannot lead: the clock that the velocities alone would give, late by the sensor's lag.
  ASSERT_TRUE(found.aligned.alignment && found.aligned.alignment->sensor_lag_s);
  chain.clock_offset_s = found.aligned.clock_offset_s - *found.aligned.alignment->sensor_lag_s;
  const Identification r = identify_files(chain, {});
  EXPECT_LT(r.holdout_without_gaps->rmse_deg, 0.4 * r.baseline.rmse_deg);
  EXPECT_GT(r.holdout_without_gaps->rmse_deg, 0.4);
  EXPECT_GT(r.holdout.rmse_deg, r.holdout_without_gaps->rmse_deg);
  EXPECT_EQ(r.rows.size(), families().size());
}

TEST_F(Simulated, TheModelKnowsItsOrigin) {
  const Identification r = identify_files(request("hw"), {});
  EXPECT_EQ(model::from_json(model::to_json(r.model), "m"), r.model);
  EXPECT_EQ(r.model.training.at("sensor"), "simulated_glove.csv");
  EXPECT_TRUE(r.model.training.at("sensor_digest").get<std::string>().starts_with("fnv1a64:"));
  EXPECT_DOUBLE_EQ(r.model.sample_period_s, 0.05);
  EXPECT_EQ(r.model.inputs[0].valid_min, 1);
  EXPECT_EQ(r.model.inputs[0].valid_max, 1022);
}

TEST_F(Simulated, JsonHasWhatOtherToolsReadFromIt) {
  const auto json = to_json(identify_files(request("hw"), {}));
  for (const char* key : {"clock_offset_s", "alignment_confidence", "structure", "fit_seconds", "warnings"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* part : {"holdout", "baseline_linear"}) {
    for (const char* key : {"rmse_deg", "fit_percent", "r2", "max_abs_deg", "iae_deg_s"}) {
      EXPECT_TRUE(json.at(part).at(key).is_number()) << part << '.' << key;
    }
  }
  EXPECT_EQ(json.at("structure"), "hw");
  EXPECT_TRUE(json.at("warnings").is_array());
}

TEST_F(Simulated, BadRequestsAreRefusedBeforeAnyWork) {
  FileRequest r = request("nonsense");
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("auto");
  r.order = 2;
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("hw");
  r.split = 1;
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("hw");
  r.rate_hz = 0;
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("hw");
  r.channel = "toe";
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("hw");
  r.order = 4;
  EXPECT_THROW((void)identify_files(r, {}), io::InputError);
  r = request("hw");
  r.clock_offset_s = 1e6;
  EXPECT_THROW((void)identify_files(r, {}), io::JobError);
}

}  // namespace
}  // namespace flexor::identify
