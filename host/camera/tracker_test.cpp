// The whole pipeline on the real video, and on pictures that it should not believe.
#include "host/camera/tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "host/camera/mark_proposal.hpp"
#include "host/camera/pictures_test.hpp"
#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/recording/csv.hpp"

namespace flexor::camera {
namespace {
namespace fs = std::filesystem;

Joints green_markers() { return load_joints(FLEXOR_SOURCE_DIR "/models/joints/green_markers.json"); }

const fs::path kFolder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/video";
constexpr const char* kWhy =
    "needs the recording in ../shared/data/video, which is not part of the repository";

using Change = std::function<Picture(const Picture&)>;

Picture same(const Picture& picture) { return picture; }

Picture mirrored(const Picture& from) {
  Picture to;
  cv::flip(from, to, 1);
  return to;
}

Picture quarter_turned(const Picture& from) {
  Picture to;
  cv::rotate(from, to, cv::ROTATE_90_CLOCKWISE);
  return to;
}

struct Result {
  std::vector<FilteredRow> rows;
  Summary summary;
};

Result track_real(const Change& change, std::size_t frames) {
  VideoReader video(kFolder / "green_markers.mp4");
  Picture picture;
  double t_s = 0;
  std::optional<Tracker> tracker;
  Result out;
  while (video.frames() < frames && video.next(picture, t_s)) {
    const Picture changed = change(picture);
    if (!tracker) tracker.emplace(green_markers(), std::nullopt, changed.cols, changed.rows);
    for (FilteredRow& row : tracker->push(changed, t_s)) out.rows.push_back(std::move(row));
  }
  for (FilteredRow& row : tracker->flush()) out.rows.push_back(std::move(row));
  out.summary = tracker->summary();
  return out;
}

std::vector<double> column(const Result& run, const std::string& name) {
  std::vector<double> out;
  const auto it = std::ranges::find(run.summary.angles, name, &AngleSummary::name);
  const auto k = static_cast<std::size_t>(it - run.summary.angles.begin());
  for (const FilteredRow& row : run.rows) out.push_back(row.angles[k].deg);
  return out;
}

// The other tracker writes 180 degrees for a straight joint; its opening is ours.
class RealVideo : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kFolder)) GTEST_SKIP() << kWhy;
  }

  static std::vector<double> theirs(const std::string& name) {
    const recording::Recording csv = [] {
      // Its first column is the frame, one a 24th of a second.
      std::string text = io::read_file(kFolder / "green_markers_angles.csv");
      return recording::parse_csv("t_s" + text.substr(5), "green_markers_angles.csv", {});
    }();
    return csv.column(name).value;
  }

  // RMS of the difference without its median, ours `lag` frames later.
  static double rms(const std::vector<double>& ours, const std::vector<double>& other, double sign, int lag) {
    std::vector<double> d;
    for (int k = 5; k + 5 < static_cast<int>(ours.size()); ++k) {
      d.push_back(sign * ours[static_cast<std::size_t>(k + lag)] - other[static_cast<std::size_t>(k)]);
    }
    const double middle = io::median(d);
    double squares = 0;
    for (const double v : d) squares += (v - middle) * (v - middle);
    return std::sqrt(squares / static_cast<double>(d.size()));
  }
};

TEST_F(RealVideo, AllEightMarksInEveryFrameAndAgreementWithTheOtherTracker) {
  const Result run = track_real(same, 1000);
  EXPECT_EQ(run.summary.frames, 296U);
  EXPECT_EQ(run.summary.labelled, 296U);
  EXPECT_EQ(run.summary.dropped, 0);
  EXPECT_NEAR(run.summary.to_s, 295 / 24.0, 1e-6);
  struct Case {
    const char* ours;
    const char* theirs;
    double sign;
    double least;  // it is another tracker: too close would be suspicious
    double most;
  };
  for (const Case& c :
       {Case{"index_pip", "isaret_PIP_angle", -1, 0.5, 2.0},
        Case{"index_mcp", "isaret_MP_angle", -1, 0.2, 1.4},
        Case{"index_dip", "isaret_DIP_angle", -1, 1.0, 3.0}, Case{"thumb_cmc", "CMC_angle", 1, 0.1, 1.0},
        Case{"thumb_mcp", "bas_PIP_angle", -1, 0.2, 1.5}, Case{"thumb_ip", "bas_DIP_angle", -1, 0.2, 1.5}}) {
    const std::vector<double> ours = column(run, c.ours);
    const std::vector<double> other = theirs(c.theirs);
    const double now = rms(ours, other, c.sign, 0);
    EXPECT_GT(now, c.least) << c.ours;
    EXPECT_LT(now, c.most) << c.ours;
    for (const int lag : {-3, -2, -1, 1, 2, 3})
      EXPECT_GT(rms(ours, other, c.sign, lag), now) << c.ours << lag;
  }
}

// Second differences do not see slow motion: of white jitter they are sqrt(6) times as large.
TEST_F(RealVideo, JitterIsBelowThreeTenthsOfADegreeWhereTheHandRests) {
  const Result run = track_real(same, 1000);
  constexpr std::size_t kWindow = 13;
  int windows = 0;
  for (const char* name : {"index_dip", "index_pip", "thumb_cmc", "thumb_mcp", "thumb_ip"}) {
    const std::vector<double> x = column(run, name);
    double squares = 0;
    int count = 0;
    for (std::size_t k = 0; k + kWindow <= x.size(); ++k) {
      const auto [low, high] = std::minmax_element(x.begin() + static_cast<std::ptrdiff_t>(k),
                                                   x.begin() + static_cast<std::ptrdiff_t>(k + kWindow));
      if (*high - *low > 1.5) continue;
      ++windows;
      for (std::size_t j = k; j + 2 < k + kWindow; ++j) {
        squares += std::pow(x[j] - 2 * x[j + 1] + x[j + 2], 2) / 6;
        ++count;
      }
    }
    ASSERT_GT(count, 0) << name;
    EXPECT_LT(std::sqrt(squares / count), 0.3) << name;
    EXPECT_GT(std::sqrt(squares / count), 0.005) << name;
  }
  EXPECT_GT(windows, 50);
}

TEST_F(RealVideo, MirroredOrTurnedItGivesTheSameAngles) {
  constexpr std::size_t kFrames = 60;
  const Result plain = track_real(same, kFrames);
  for (const Change& change : {Change(mirrored), Change(quarter_turned)}) {
    const Result other = track_real(change, kFrames);
    EXPECT_EQ(other.summary.labelled, kFrames);
    for (const AngleSummary& a : plain.summary.angles) {
      const auto x = column(plain, a.name);
      const auto y = column(other, a.name);
      for (std::size_t k = 0; k < x.size(); ++k) ASSERT_NEAR(x[k], y[k], 0.6) << a.name << " " << k;
    }
  }
}

TEST_F(RealVideo, TheProposedSetupIsRightAndCanBeOverruled) {
  VideoReader video(kFolder / "green_markers.mp4");
  Picture picture;
  double t_s = 0;
  ASSERT_TRUE(video.next(picture, t_s));
  const Skeleton skeleton = green_markers().skeletons[0];
  const camera::MarkProposal proposal = propose_marks(skeleton, picture, {}, {});
  EXPECT_EQ(proposal.trouble, "");
  // As anybody sees them in the picture.
  const std::map<std::string, Point> truth = {{"wrist", {718, 335}},     {"index_mcp", {594, 230}},
                                              {"index_pip", {478, 205}}, {"index_dip", {430, 233}},
                                              {"index_tip", {367, 255}}, {"thumb_mcp", {606, 372}},
                                              {"thumb_ip", {497, 392}},  {"thumb_tip", {425, 397}}};
  std::map<int, std::string> assigned;
  for (std::size_t i = 0; i < proposal.candidates.size(); ++i) {
    const std::string& name = proposal.name[i];
    if (name.empty()) continue;
    const Point p = proposal.candidates[i].centre;
    EXPECT_LT(std::hypot(p.x - truth.at(name).x, p.y - truth.at(name).y), 8) << name;
    assigned[static_cast<int>(i + 1)] = name;
  }
  ASSERT_EQ(assigned.size(), 8U);
  const Skeleton kept = with_start(skeleton, propose_marks(skeleton, picture, Point{718, 335}, assigned));
  EXPECT_LT(std::hypot(kept.start[0]->x - 718, kept.start[0]->y - 335), 8);
  assigned.erase(assigned.begin());
  EXPECT_THROW(with_start(skeleton, propose_marks(skeleton, picture, {}, assigned)), io::InputError);
  assigned[99] = "wrist";
  EXPECT_THROW(propose_marks(skeleton, picture, {}, assigned), io::InputError);
}

// Whatever the pictures are: no angle without a flag.
Summary hostile(const Joints& joints, const std::function<Picture(int)>& picture, int frames = 20) {
  const Picture first = picture(0);
  Tracker tracker(joints, std::nullopt, first.cols, first.rows);
  for (int k = 0; k < frames; ++k) tracker.push(picture(k), k / 30.0);
  tracker.flush();
  return tracker.summary();
}

TEST(Hostile, PicturesWithoutAHandGiveNoAngleAndAReason) {
  std::vector<std::function<Picture(int)>> cases = {[](int k) {
    Picture noise(120, 160, CV_8UC3);
    cv::RNG(static_cast<unsigned>(k + 1)).fill(noise, cv::RNG::UNIFORM, 0, 256);
    return noise;
  }};
  for (const Picture& still : {dots(160, 120, {0, 0, 0}, {}), dots(160, 120, {40, 150, 50}, {}),
                               Picture(1, 1, CV_8UC3, cv::Scalar()), dots(160, 120, kWall, {{{80, 60}}})})
    cases.emplace_back([still](int) { return still; });
  for (const char* file : {"green_markers", "paper_hand", "printed_finger"}) {
    const Joints joints = load_joints(std::string(FLEXOR_SOURCE_DIR "/models/joints/") + file + ".json");
    for (const auto& picture : cases) {
      const Summary s = hostile(joints, picture);
      EXPECT_EQ(s.trouble.size(), joints.skeletons.size());
      EXPECT_EQ(s.labelled, 0U);
      for (const AngleSummary& a : s.angles) EXPECT_EQ(a.frames[3], 20U) << file;
    }
  }
}

TEST(Hostile, FortyFalseMarksAreNotTakenForAHand) {
  const Summary s = hostile(
      green_markers(),
      [](int k) {
        std::vector<Dot> all;
        for (int i = 0; i < 40; ++i)
          all.push_back({{20.0 + 60 * (i % 10) + k % 2, 20.0 + 60.0 * (i / 10)}, 8});
        return dots(640, 260, kWall, all);
      },
      3);
  for (const AngleSummary& a : s.angles) EXPECT_EQ(a.frames[0], 0U);
}

}  // namespace
}  // namespace flexor::camera
