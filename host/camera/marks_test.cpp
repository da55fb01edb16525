#include "host/camera/marks.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>

#include "host/camera/pictures_test.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

const Window kAll = {0, 0, 320, 200};

Picture three() { return dots(320, 200, kWall, {{{60.3, 50.7}}, {{150.5, 90.25}}, {{260.1, 150.9}}}); }

void add_noise(Picture& picture, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, sigma);
  for (std::uint8_t& v : std::span(picture.data, 3 * picture.total()))
    v = static_cast<std::uint8_t>(std::clamp(v + normal(random), 0.0, 255.0));
}

TEST(Colour, IsLearntFromAClickATellingOrAlone) {
  const Picture picture = three();
  const std::vector<ColourModel> models = {colour_at(picture, {150, 90}), colour_like(picture, {40, 150, 50}),
                                           colour_automatic(picture, kAll, 3)};
  for (const ColourModel& model : models) {
    EXPECT_NEAR(model.weight[0] + model.weight[1] + model.weight[2], 0, 1e-9);
    EXPECT_GT(model.level, 50);
    EXPECT_EQ(find_marks(picture, model, kAll, 6).size(), 3U);
  }
}

TEST(Colour, RefusesWhatIsNoMark) {
  const Picture picture = three();
  EXPECT_THROW(colour_at(picture, {-1, 5}), io::InputError);
  EXPECT_THROW(colour_at(picture, {10, 190}), io::InputError);
  EXPECT_THROW(colour_like(picture, {250, 20, 250}), io::InputError);
  EXPECT_THROW(colour_automatic(picture, kAll, 4), io::JobError);
  EXPECT_THROW(colour_automatic(Picture(1, 1, CV_8UC3, cv::Scalar()), {0, 0, 1, 1}, 3), io::JobError);
}

TEST(Colour, AutomaticPassesByOtherColoursAndThingsThatAreNoDots) {
  const Picture picture = dots(320, 200, kWall,
                               {{{160, 100}, 70, {120, 150, 205}},  // skin, large
                                {{30, 30}, 8, {30, 30, 200}},
                                {{60.3, 50.7}},
                                {{150.5, 90.25}},
                                {{260.1, 150.9}}});
  const ColourModel model = colour_automatic(picture, kAll, 3);
  EXPECT_EQ(find_marks(picture, model, kAll, 20).size(), 3U);
}

// What sampling a sharp edge costs falls with the root of its length.
RC_GTEST_PROP(Marks, CentresAreKnownToATenthOfAPixelHoweverSharpTheEdge, ()) {
  const Point at = {100 + *rc::gen::inRange(0, 100) / 100.0, 80 + *rc::gen::inRange(0, 100) / 100.0};
  const double radius = *rc::gen::inRange(50, 160) / 10.0;
  const Picture picture = dots(200, 160, kWall, {{at, radius}});
  const ColourModel model = colour_at(picture, {std::round(at.x), std::round(at.y)});
  const std::vector<Mark> marks = find_marks(picture, model, {0, 0, 200, 160}, 6);
  RC_ASSERT(marks.size() == 1);
  RC_ASSERT(std::hypot(marks[0].centre.x - at.x, marks[0].centre.y - at.y) < 0.25 / std::sqrt(radius));
  RC_ASSERT(std::abs(std::sqrt(marks[0].area_px / 3.14159) - radius) < 0.3);
}

TEST(Marks, TheCovarianceIsHonestUnderNoise) {
  double squares = 0;
  double estimate = 0;
  constexpr int kPictures = 200;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  const ColourModel model = colour_at(dots(120, 120, kWall, {{{60, 60}}}), {60, 60});
  for (int i = 0; i < kPictures; ++i) {
    const Point at = {60 + uniform(random), 60 + uniform(random)};
    Picture picture = dots(120, 120, kWall, {{at}});
    add_noise(picture, 8, static_cast<unsigned>(i));
    const std::vector<Mark> marks = find_marks(picture, model, {0, 0, 120, 120}, 50);
    ASSERT_EQ(marks.size(), 1U);
    squares += std::pow(marks[0].centre.x - at.x, 2) + std::pow(marks[0].centre.y - at.y, 2);
    estimate += marks[0].covariance[0] + marks[0].covariance[2];
  }
  EXPECT_GT(estimate / squares, 0.8);
  EXPECT_LT(estimate / squares, 1.6);
}

TEST(Marks, HalfTheLightFindsTheSameCentres) {
  const Picture bright = three();
  const ColourModel model = colour_automatic(bright, kAll, 3);
  const Picture dark = bright * 0.55;
  const std::vector<Mark> a = find_marks(bright, model, kAll, 20);
  const std::vector<Mark> b = find_marks(dark, model, kAll, 20);
  ASSERT_EQ(a.size(), 3U);
  ASSERT_EQ(b.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i].centre.x, b[i].centre.x, 0.1);
}

TEST(Marks, ThatTouchArePartedAndFlagged) {
  const Picture apart = dots(200, 120, kWall, {{{80, 60}}, {{120, 60}}});
  const ColourModel model = colour_at(apart, {80, 60});
  const Picture touching = dots(200, 120, kWall, {{{90.5, 60}}, {{108.5, 60}}});
  const auto out =
      measure_marks(touching, model, {{{89, 61}, 12, 314, model.level}, {{110, 59}, 12, 314, model.level}});
  ASSERT_TRUE(out[0] && out[1]);
  EXPECT_TRUE(out[0]->touching && out[1]->touching);
  EXPECT_NEAR(out[0]->centre.x, 90.5, 1);
  EXPECT_NEAR(out[1]->centre.x, 108.5, 1);
  EXPECT_GT(out[0]->covariance[0], 1);
}

TEST(Marks, OneThatIsGoneOrMostlyHiddenIsNotMeasured) {
  const Picture whole = dots(120, 120, kWall, {{{60, 60}}});
  const ColourModel model = colour_at(whole, {60, 60});
  const auto is_measured = [&](const Picture& picture) {
    return measure_marks(picture, model, {{{60, 60}, 10, 314, model.level}}).front().has_value();
  };
  EXPECT_TRUE(is_measured(whole));
  EXPECT_FALSE(is_measured(dots(120, 120, kWall, {})));
  EXPECT_FALSE(is_measured(dots(120, 120, kWall, {{{60, 60}}, {{66, 60}, 10, {60, 60, 60}}})));
}

TEST(Marks, AtThePicturesEdgeAreFlaggedAndWindowsOutsideAreEmpty) {
  const Picture picture = dots(120, 120, kWall, {{{2, 60}}, {{60, 60}}});
  const ColourModel model = colour_at(picture, {60, 60});
  const auto out =
      measure_marks(picture, model, {{{4, 60}, 8, 200, model.level}, {{400, 400}, 8, 314, model.level}});
  ASSERT_TRUE(out[0]);
  EXPECT_TRUE(out[0]->at_edge);
  EXPECT_FALSE(out[1]);
}

}  // namespace
}  // namespace flexor::camera
