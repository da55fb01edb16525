#include "host/identify/structure_text.hpp"

#include <gtest/gtest.h>

#include "host/io/refusal_test.hpp"

namespace flexor::identify {
namespace {

Branches sum(const std::string& text) {
  return std::get<Candidates>(parse_structure(text, 1)).branches.front();
}
Chain chain(const std::string& text) { return std::get<Chain>(parse_structure(text, 1)); }

TEST(StructureText, ASumHasTheCurvesThatItNames) {
  EXPECT_EQ(sum("curve(20) + play(0.03)>curve(20)+ play( 0.08 ) > curve + motion(0.3)"),
            (Branches{{0.03, 0.08}, {0.3}, 20}));
  EXPECT_EQ(sum("curve(2)"), sum("limited-line"));
  EXPECT_EQ(sum("curve(12) + open").open, true);
  EXPECT_EQ(sum("curve"), sum("curve(12) + open"));
}

TEST(StructureText, AChainHasTheBlocksThatItNames) {
  const Chain all = chain("lag(0.2) > dead-zone > hysteresis(3) > curve(9) > lti(1) > saturation");
  EXPECT_EQ(all.lag_s, 0.2);
  EXPECT_TRUE(all.blocks.dead_zone);
  EXPECT_EQ(all.blocks.plays, 3);
  EXPECT_EQ(all.blocks.input_knots, 9);
  EXPECT_EQ(all.blocks.order, 1);
  EXPECT_TRUE(all.blocks.saturation);
  EXPECT_EQ(chain("curve(5) > pair > curve(7)").blocks,
            (Structure{.input_knots = 5, .order = 2, .pair = true, .output_knots = 7}));
}

TEST(StructureText, ShorthandsAreTheFamilies) {
  EXPECT_EQ(chain("hysteresis-hw").blocks,
            (Structure{.plays = 2, .input_knots = 10, .order = 2, .saturation = true}));
  EXPECT_EQ(chain("wiener").blocks, (Structure{.order = 2, .output_knots = 10}));
  EXPECT_TRUE(chain("wh").lag);
  EXPECT_FALSE(chain("wh").lag_s);
  EXPECT_EQ(chain("dead-zone > lti(1) > saturation"), chain(std::string(kPublishedForm)));
  EXPECT_TRUE(std::get<Candidates>(parse_structure("auto", 1)).search);
}

TEST(StructureText, WhatIsWrittenIsReadAsTheSame) {
  for (const char* text : {"auto", "limited-line", "line-lead", "curve", "hysteresis"}) {
    const WantedStructure wanted = parse_structure(text, 1);
    for (const Branches& branches : std::get<Candidates>(wanted).branches)
      EXPECT_EQ(sum(text_of(branches)), branches);
  }
  for (const char* text : {"line", "linear-dynamic", "hammerstein", "wiener", "hw", "wh", "hysteresis-hw",
                           "lag(0.1) > gain > lti(3) > saturation", "curve(4) > pair > curve(6)"}) {
    EXPECT_EQ(chain(text_of(chain(text))), chain(text)) << text;
  }
}

TEST(StructureText, WhatHasNoMeaningIsPointedAt) {
  const auto refusal = [](const std::string& text) {
    return io::refusal_of([&] { (void)parse_structure(text, 1); });
  };
  const auto says = [&](const std::string& text, const std::string& what) {
    EXPECT_NE(refusal(text).find(what), std::string::npos) << text << ": " << refusal(text);
  };
  says("", "at character 1, the end");
  says("splines", "unknown block splines");
  says("splines", "line-lead");
  says("curve(20) + crve(20)", "at character 13, \"crve(20)\"");
  says("curve(20", "a ) is missing at character 9, the end");
  says("curve(x)", "a number is missing at character 7");
  says("curve(nan)", "2 to 32 at character 7");
  says("curve(1e999)", "a number is missing");
  says("curve(33)", "2 to 32 at character 7");
  says("curve(2.5)", "whole number");
  says("curve curve", "a > or + is missing at character 7");
  says("curve >", "the name of a block is missing at character 8, the end");
  says("curve + play(0.1)", "a curve is missing behind the play at character 9");
  says("curve + play > curve", "radius");
  says("curve + motion", "seconds");
  says("curve(20) + play(0.1) > curve(12)", "one number of knots, 20 before, 12 here at character 31");
  says("curve + play(0.6) > curve", "0.001 to 0.5");
  says("curve + motion(0.1) + motion(0.2) + motion(0.3) + motion(0.4) + motion(0.5)",
       "more than 4 of a kind");
  says("curve + curve", "a second curve");
  says("motion(0.3)", "begins with the curve");
  says("lti > gain", "gain cannot stand here");
  says("gain > lti > curve", "needless");
  says("lti > pair", "pair cannot stand here");
  says("curve > lti + curve", "cannot be added at character 15");
  says("play(0.1) > curve > lti", "play belongs into a sum");
  says("saturation(3)", "takes no number");
  says("curve > lti(4)", "1 to 3 at character 13");
  says("mix > curve > lti(4)", "1 to 3 at character 19");
  says("mix", "before one of several sensors mix >");
  says(std::string(10000, 'c'), "unknown block");
  EXPECT_LT(refusal(std::string(10000, 'c')).size(), 400u);
}

}  // namespace
}  // namespace flexor::identify
