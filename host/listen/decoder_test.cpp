#include "host/listen/decoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/listen/test_board.hpp"

namespace flexor::listen {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

std::vector<Sample> decoded(Decoder& decoder, const std::vector<std::uint8_t>& bytes, double host_s = 0) {
  std::vector<Sample> out;
  decoder.push(bytes, host_s, out);
  return out;
}

// Frames of a glove without a key.
std::vector<std::uint8_t> frame(link::GloveEnd& glove, std::uint16_t time_ms, std::int16_t thumb) {
  link::Frame f{};
  f.time_ms = time_ms;
  f.angle[0] = thumb;
  f.angle[4] = 1792;
  f.status[1] = link::SensorStatus::stuck;
  std::array<std::uint8_t, link::kMaxWire> wire{};
  const std::uint8_t size = glove.angles(f, false, wire.data());
  return {wire.begin(), wire.begin() + size};
}

TEST(Frames, GiveAnglesStatesAndAClockThatGoesOnAfterItsWrap) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  const std::vector<Sample> first = decoded(*decoder, frame(glove, 65000, 1440), 10);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(decoder->columns(),
            (std::vector<std::string>{"thumb_deg", "index_deg", "middle_deg", "ring_deg", "pinky_deg"}));
  EXPECT_EQ(first[0].value, (std::vector<double>{90, 0, 0, 0, 112}));
  EXPECT_EQ(first[0].remark[1], "stuck");
  EXPECT_EQ(*first[0].board_s, 65);
  EXPECT_NEAR(*decoded(*decoder, frame(glove, 464, 0), 11)[0].board_s, 66, 1e-9) << "one wrap";
  EXPECT_NEAR(*decoded(*decoder, frame(glove, 464, 0), 11 + 2 * 65.536)[0].board_s, 66 + 2 * 65.536, 1e-9)
      << "two wraps in a silence";
}

// Lines that come in pieces; \x18: the port was cut. Rows, their times and the columns as text.
struct Fed {
  const char* name;
  std::string text;
  std::string rows;
  std::string columns;
  std::uint64_t malformed = 0;
  std::string board_s = {};
};

const std::vector<Fed> kFed = {
    // Found by the fuzzer, and by mutated inputs: the units were written beyond the columns.
    {"no value behind a time", "1\n2\n12:03:11.123 -> \n", "1;2", "column1", 1},
    {"units below a row of words", "t,phase,flex\n1,x,y\nms,,V\n1000,grasp,2\n", "2", "flex_V", 1, "1"},
    {"noise before a header, of a port that was just opened",
     "\x18\xbe\xddq'q\xf3time_ms,thumb_deg,index_deg\r\n0,1,2\r\n10,3,4\r\n", "1,2;3,4",
     "thumb_deg,index_deg"},
    {"a greeting, a clock in the header, a reset and a short line",
     "hello\r\nt_s,a,b\r\n0.0100,512,498\r\n0.0200,513,497\nt_s,a,b\n0.0100,512\n0.0,1,2\n",
     "512,498;513,497;1,2", "a,b", 2, "0.01;0.02;0"},
    {"a malformed label, and labels in another order", "a:1,b:2\na:1,x:2\na:3,b:4\nb:6,a:5\na:7,b:8\n",
     "1,2;3,4;5,6;7,8", "a,b", 1},
    {"a cut in mid-line, whose other end is no row; of an end nobody knows how much was lost",
     "1,2,3\n1,2,3\n100,200,3\x18"
     "77,88,99\n4,5,6\n\x18half of the end\x18",
     "1,2,3;1,2,3;4,5,6", "column1,column2,column3", 1},
    {"a header in another order, once behind half a row; a malformed one, in the order that was first",
     "millis,x,y,z\n10,1,2,3\n\x18millis,z,y,x\n20,3,2,1\n12y,millis,x,z\n2,30,1,3\n\x18lis,x,y,z\n40,1,2,"
     "3\n",
     "1,2,3;1,2,3;1,2,3;1,2,3", "x,y,z", 0, "0.01;0.02;0.03;0.04"},
    {"a word in between; a greeting, then its header",
     "millis,a,b\n10,1,2\nplease,wait,now\n20,1,2\n\x18good,morning,all\nmillis,a,b\n30,1,2\n", "1,2;1,2;1,2",
     "a,b", 2},
    {"a header that was missed before: no wrong names", "1,2\n1,2\n\x18thumb,index\n1,2\n", "1,2;1,2;1,2",
     "column1,column2", 1},
    {"a dead sensor", "millis,a,b\n10,NaN,7\n20,8,\n30,nan,nan\n40,1,2\n", "nan,7;8,nan;nan,nan;1,2", "a,b",
     0, "0.01;0.02;0.03;0.04"},
    {"no time; no number", "millis,a,b\n40,1,2\nnan,1,2\n,1,2\n50,1,x\n", "1,2", "a,b", 3},
    {"columns that are not known yet", "nan nan\n1 2\n3 nan\nnan nan\n1e308 1e308\n", "", ""},
    {"rows that lack all readings", "nan nan\n1 2\n3 nan\nnan nan\n1e308 1e308\n1 2\n3 nan\nnan nan\n",
     "1,2;3,nan", "column1,column2", 6}};

TEST(Lines, GiveRowsOfNamedColumns) {
  for (const Fed& c : kFed) {
    SCOPED_TRACE(c.name);
    const auto decoder = make_decoder(Format::lines);
    std::vector<Sample> samples;
    for (const char byte : c.text) {
      const auto read = static_cast<std::uint8_t>(byte);
      byte == '\x18' ? decoder->cut() : decoder->push({&read, 1}, 0, samples);
    }
    std::vector<std::string> rows, board_s;
    for (const Sample& sample : samples) {
      rows.push_back(fmt::format("{}", fmt::join(sample.value, ",")));
      if (!c.board_s.empty()) board_s.push_back(fmt::format("{:g}", sample.board_s.value_or(-1)));
    }
    EXPECT_EQ(fmt::format("{}", fmt::join(rows, ";")), c.rows);
    EXPECT_EQ(fmt::format("{}", fmt::join(board_s, ";")), c.board_s);
    EXPECT_EQ(fmt::format("{}", fmt::join(decoder->columns(), ",")), c.columns);
    EXPECT_EQ(decoder->tally().malformed, c.malformed);
    EXPECT_EQ(decoder->refusal(), "");
  }
}

TEST(Lines, RowsOfAnotherNumberOfValuesAreReportedWhileTheyCome) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("a,b,c,d,e\n1,2,3,4,5\n1,2\n1,2,3,4,5\n"));
  EXPECT_FALSE(decoder->tally().misfit) << "one was malformed";
  decoded(*decoder, bytes_of("1,2,3\n"));
  EXPECT_FALSE(decoder->tally().misfit);
  decoded(*decoder, bytes_of("4,5,6\n"));
  ASSERT_TRUE(decoder->tally().misfit);
  EXPECT_EQ(decoder->tally().misfit->found, 3U);
  EXPECT_EQ(decoder->tally().misfit->expected, 5U);
  EXPECT_EQ(decoder->tally().malformed, 3U);
  decoded(*decoder, bytes_of("1,2,3,4,5\n"));
  EXPECT_FALSE(decoder->tally().misfit);
  decoded(*decoder, bytes_of("1;2;3;4;5\n1;2;3;4;5\n"));
  ASSERT_TRUE(decoder->tally().misfit) << "other separators";
  EXPECT_EQ(decoder->tally().misfit->found, 1U);
  for (const char* line : {"no glove\n", "a,b,c,d,5\n", "a,b,c,d,e\n"}) {
    decoded(*decoder, bytes_of(std::string("1,2,3,4,5\n") + line));
    EXPECT_FALSE(decoder->tally().misfit) << line;
    decoded(*decoder, bytes_of(line));
    ASSERT_TRUE(decoder->tally().misfit) << line;
    EXPECT_EQ(decoder->tally().misfit->found, 0U);
  }
}

TEST(Frames, LostOnesAreCountedAndMalformedOnesSkipped) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  decoded(*decoder, frame(glove, 0, 0));
  frame(glove, 10, 0);
  frame(glove, 20, 0);
  std::vector<std::uint8_t> malformed = frame(glove, 30, 0);
  malformed.erase(malformed.begin() + 5);
  EXPECT_TRUE(decoded(*decoder, malformed).empty());
  EXPECT_EQ(decoded(*decoder, frame(glove, 40, 0)).size(), 1U);
  EXPECT_EQ(decoder->tally().lost, 3U);
  EXPECT_EQ(decoder->tally().malformed, 1U);
  EXPECT_LT(decoder->tally().understood, decoder->tally().bytes);
}

TEST(Frames, ThatComeTwiceOrInAnotherOrderAreNoSamplesAndNoRestarts) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  const auto first = frame(glove, 10, 0), second = frame(glove, 20, 0), third = frame(glove, 30, 0);
  EXPECT_EQ(decoded(*decoder, first, 1.01).size(), 1U);
  EXPECT_TRUE(decoded(*decoder, first, 1.01).empty());
  EXPECT_EQ(*decoded(*decoder, third, 1.03).at(0).board_s, 0.03);
  EXPECT_TRUE(decoded(*decoder, second, 1.03).empty());
  EXPECT_EQ(*decoded(*decoder, frame(glove, 40, 0), 1.04).at(0).board_s, 0.04) << "the clock did not wrap";
  EXPECT_EQ(decoder->tally().late, 2U);
  EXPECT_EQ(decoder->tally().lost, 1U);
}

constexpr std::array<std::uint16_t, link::kFingers> kCounts = {100, 200, 300, 400, 500};

TEST(Frames, OfReadingsHaveNoCounterAndSoNobodyKnowsHowManyWereLost) {
  const auto decoder = make_decoder(Format::frames, true);
  EXPECT_EQ(decoded(*decoder, readings(0, kCounts))[0].value, (std::vector<double>{100, 200, 300, 400, 500}));
  EXPECT_EQ(decoded(*decoder, readings(50, kCounts)).size(), 1U);
  EXPECT_FALSE(decoder->tally().lost);
  EXPECT_EQ(lost_in_words(decoder->tally()), "not known how many were lost");
  const auto angles = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  decoded(*angles, frame(glove, 0, 0));
  EXPECT_EQ(lost_in_words(angles->tally()), "0 lost");
}

TEST(Hand, GivesAngleDutyAndFaultInWords) {
  const auto decoder = make_decoder(Format::hand);
  link::HandEnd hand(nullptr);
  const std::vector<Sample> out = decoded(*decoder, telemetry(hand, false));
  ASSERT_EQ(out.size(), 1U);
  ASSERT_EQ(decoder->columns().size(), 16U);
  const auto at = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(decoder->columns(), name) - decoder->columns().begin());
  };
  EXPECT_EQ(*out[0].board_s, 2.5);
  EXPECT_EQ(out[0].value.at(at("index_deg")), 45);
  EXPECT_EQ(out[0].value.at(at("index_duty_percent")), -100);
  EXPECT_EQ(out[0].value.at(at("index_fault")), 1);
  EXPECT_EQ(out[0].remark.at(at("index_fault")), "stalled");
  EXPECT_EQ(out[0].remark.at(at("thumb_fault")), "");
  EXPECT_EQ(out[0].remark.at(at("board_faults")), "supply dip, started by the watchdog");
  decoded(*decoder, telemetry(hand, true));
  decoded(*decoder, telemetry(hand, false));
  EXPECT_EQ(decoder->tally().lost, 0U) << "a state is no gap";
  telemetry(hand, false);
  decoded(*decoder, telemetry(hand, false));
  EXPECT_EQ(decoder->tally().lost, 1U);
}

TEST(Gloves, GiveFingersAndJointsOfBothEncodings) {
  const auto alpha = make_decoder(Format::gloves);
  EXPECT_EQ(decoded(*alpha, bytes_of("A10B20C30D40E1023F512G512P0\n"))[0].value,
            (std::vector<double>{10, 20, 30, 40, 1023}));
  EXPECT_TRUE(decoded(*alpha, bytes_of("A10B20C30F512G512P0\n")).empty()) << "a finger less than before";
  const auto beta = make_decoder(Format::gloves);
  const auto samples = decoded(*beta, bytes_of("A1B2C3D4E5F512G512(BAB)77\n"));
  EXPECT_EQ(samples[0].value, (std::vector<double>{1, 2, 77, 3, 4, 5}));
  EXPECT_EQ(beta->columns()[2], "index_joint2_count");
}

TEST(Lines, ThatAreMalformedSinceTheNewestSampleAreCountedAndOneIsKept) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("t_s,a,b\n0,1,2\n0.1,1,2\nx\n0.2,1,2\n"));
  EXPECT_EQ(decoder->tally().malformed_since, 0U);
  decoded(*decoder, bytes_of("0.3,error\n0.4,err\n"));
  EXPECT_EQ(decoder->tally().malformed_since, 2U);
  EXPECT_EQ(decoder->tally().malformed_line, "0.4,err");
}

TEST(Lines, WithLabelsKnowAnotherGlove) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("thumb:1,index:2\nthumb:3,index:4\n"));
  decoder->cut();
  EXPECT_TRUE(
      decoded(*decoder, bytes_of("ring:1\nring:1,pinky:2\nring:1,pinky:2\nring:1,pinky:2\n")).empty());
  EXPECT_NE(decoder->refusal().find("ring,pinky"), std::string::npos);
}

TEST(Lines, OfAnotherGloveAreNotTakenUnderTheNamesOfTheFirst) {
  for (const char* header : {"t_s,flex1,flex2", "millis,thumb,ring", "millis,thumb,index,middle"}) {
    const auto decoder = make_decoder(Format::lines);
    decoded(*decoder, bytes_of("millis,thumb,index\n10,1,2\n"));
    decoder->cut();
    const std::string row =
        std::string(header).find("middle") == std::string::npos ? "20,3,4\n" : "20,3,4,5\n";
    EXPECT_TRUE(
        decoded(*decoder, bytes_of("hello\n" + std::string(header) + "\n" + row + "30,1,2\n")).empty());
    EXPECT_EQ(decoder->refusal(), "another glove speaks: its columns are " + std::string(header) +
                                      ", and they were millis,thumb,index");
  }
}

TEST(Frames, AreDroppedWhereTheyWereCut) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  std::vector<std::uint8_t> half = frame(glove, 0, 0);
  half.resize(half.size() / 2);
  decoded(*decoder, half);
  decoder->cut();
  EXPECT_EQ(decoder->tally().malformed, 1U);
  EXPECT_EQ(decoded(*decoder, frame(glove, 10, 0)).size(), 1U);
  decoder->cut();
  EXPECT_EQ(decoder->tally().malformed, 1U);
}

std::vector<std::string> columns_of(const std::string& header) {
  const auto decoder = make_decoder(Format::lines);
  std::string row = "1";
  for (auto k = std::ranges::count(header, ','); k > 0; --k) row += ",1";
  decoded(*decoder, bytes_of(header + "\n" + row + "\n"));
  return decoder->columns();
}

TEST(Lines, HaveColumnsThatNoOtherColumnOfARecordingIsCalled) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(columns_of("millis,t_s,index_count"), (Names{"t_s-2", "index_count"}));
  EXPECT_EQ(columns_of("millis,index,host_s"), (Names{"index", "host_s-2"}));
  EXPECT_EQ(columns_of("millis,index,index"), (Names{"index", "index-2"}));
  EXPECT_EQ(columns_of("millis,host_s,host_s"), (Names{"host_s-2", "host_s-3"}));
  EXPECT_EQ(columns_of("index,index,index-2,index"), (Names{"index", "index-3", "index-2", "index-4"}));
  EXPECT_EQ(columns_of("t_s,t_s,t_s-2"), (Names{"t_s-3", "t_s-2"}));
}

TEST(Detection, KnowsEachFormatFromItsMiddleAndNoiseFromAll) {
  link::GloveEnd glove(nullptr);
  std::vector<std::uint8_t> frames;
  for (int i = 0; i < 5; ++i) {
    const auto one = frame(glove, static_cast<std::uint16_t>(10 * i), 500);
    frames.insert(frames.end(), one.begin(), one.end());
  }
  frames.erase(frames.begin(), frames.begin() + 7);
  EXPECT_EQ(guess(frames)->format, Format::frames);
  EXPECT_EQ(guess(bytes_of("F512G512\nA1B2C3D4E5F512G512\nA1B2C3D4E5F512G512\nA1B2C3D4E5F512G512\n"))->format,
            Format::gloves);
  EXPECT_EQ(guess(bytes_of("12,13\n512,498,1\n513,498,1\n514,498,1\n515,498,1\n"))->format, Format::lines);
  std::vector<std::uint8_t> noise;
  for (unsigned i = 0, x = 1; i < 4000; ++i)
    noise.push_back(static_cast<std::uint8_t>((x = x * 1103515245U + 12345U) >> 16));
  for (const auto& nothing : {noise, bytes_of(""), std::vector<std::uint8_t>(4000)})
    EXPECT_FALSE(guess(nothing));
}

TEST(Detection, DistinguishesAHandFromAGlove) {
  const link::Key key = {{1, 2, 3}};
  link::HandEnd alone(&key);
  alone.start(1);
  std::vector<std::uint8_t> challenges;
  for (int i = 0; i < 3; ++i) {
    std::array<std::uint8_t, link::kMaxWire> wire{};
    const std::uint8_t size = alone.challenge(wire.data());
    challenges.insert(challenges.end(), wire.begin(), wire.begin() + size);
  }
  ASSERT_TRUE(guess(challenges));
  EXPECT_EQ(guess(challenges)->format, Format::hand);
  EXPECT_EQ(guess(challenges)->samples, 0U);
  link::HandEnd hand(nullptr);
  ASSERT_TRUE(guess(telemetry(hand, false)));
  EXPECT_EQ(guess(telemetry(hand, false))->format, Format::hand);
  EXPECT_EQ(guess(telemetry(hand, false))->samples, 1U);
}

TEST(Detection, FindsAGloveThatWaitsForItsHand) {
  const link::Key key = {{1, 2, 3}};
  const link::GloveEnd glove(&key);
  std::vector<std::uint8_t> states;
  std::array<std::uint8_t, link::kMaxWire> wire{};
  for (int i = 0; i < 4; ++i) {
    const std::uint8_t size = glove.state(0, 5, wire.data());
    states.insert(states.end(), wire.begin(), wire.begin() + size);
  }
  ASSERT_TRUE(guess(states));
  EXPECT_EQ(guess(states)->samples, 0U);
  EXPECT_EQ(guess(states)->format, Format::frames);
  EXPECT_EQ(guess(states, true)->samples, 0U);
  for (std::uint16_t i = 0; i < 3; ++i) {
    const auto one = readings(i, kCounts);
    states.insert(states.end(), one.begin(), one.end());
  }
  EXPECT_EQ(guess(states)->samples, 0U) << "nobody asked for readings";
  EXPECT_EQ(guess(states, true)->samples, 3U);
  EXPECT_TRUE(guess(states, true)->readings);
}

}  // namespace
}  // namespace flexor::listen
