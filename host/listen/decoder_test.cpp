#include "host/listen/decoder.hpp"

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

// Found by the fuzzer.
TEST(Lines, ALineWithoutValuesBehindItsTimeIsNoRow) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("1\n2\n12:03:11.123 -> \n"));
  EXPECT_EQ(decoder->tally().samples, 2U);
}

TEST(Lines, RowsOfAnotherNumberOfValuesAreToldWhileTheyCome) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("a,b,c,d,e\n1,2,3,4,5\n1,2\n1,2,3,4,5\n"));
  EXPECT_FALSE(decoder->tally().misfit) << "one was torn";
  decoded(*decoder, bytes_of("1,2,3\n"));
  EXPECT_FALSE(decoder->tally().misfit);
  decoded(*decoder, bytes_of("4,5,6\n"));
  ASSERT_TRUE(decoder->tally().misfit);
  EXPECT_EQ(decoder->tally().misfit->found, 3U);
  EXPECT_EQ(decoder->tally().misfit->expected, 5U);
  EXPECT_EQ(decoder->tally().torn, 3U);
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

TEST(Frames, LostOnesAreCountedAndTornOnesSkipped) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  decoded(*decoder, frame(glove, 0, 0));
  frame(glove, 10, 0);
  frame(glove, 20, 0);
  std::vector<std::uint8_t> torn = frame(glove, 30, 0);
  torn.erase(torn.begin() + 5);
  EXPECT_TRUE(decoded(*decoder, torn).empty());
  EXPECT_EQ(decoded(*decoder, frame(glove, 40, 0)).size(), 1U);
  EXPECT_EQ(decoder->tally().lost, 3U);
  EXPECT_EQ(decoder->tally().torn, 1U);
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

TEST(Lines, NoiseBeforeAHeaderIsNoPartOfAName) {
  const auto decoder = make_decoder(Format::lines);
  decoder->cut();  // as of a port that was just opened
  decoded(*decoder, bytes_of("\xbe\xddq'q\xf3time_ms,thumb_deg,index_deg\r\n0,1,2\r\n10,3,4\r\n"));
  EXPECT_EQ(decoder->columns(), (std::vector<std::string>{"thumb_deg", "index_deg"}));
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

TEST(Lines, TakeTheClockFromTheHeaderAndSurviveAReset) {
  const auto decoder = make_decoder(Format::lines);
  const auto samples = decoded(*decoder, bytes_of("hello\r\nt_s,thumb_count,index_count\r\n0.0100,512,498\r\n"
                                                  "0.0200,513,4"));
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(*samples[0].board_s, 0.01);
  EXPECT_EQ(samples[0].value, (std::vector<double>{512, 498}));
  const auto more = decoded(*decoder, bytes_of("97\nt_s,thumb_count,index_count\n0.0100,512\n0.0,1,2\n"));
  ASSERT_EQ(more.size(), 2U);
  EXPECT_EQ(more[0].value[1], 497);
  EXPECT_EQ(decoder->tally().torn, 2U) << "the greeting and the short line";
  EXPECT_EQ(decoder->columns(), (std::vector<std::string>{"thumb_count", "index_count"}));
}

TEST(Lines, ThatAreMalformedSinceTheNewestSampleAreCountedAndOneIsKept) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("t_s,a,b\n0,1,2\n0.1,1,2\nx\n0.2,1,2\n"));
  EXPECT_EQ(decoder->tally().torn_since, 0U);
  decoded(*decoder, bytes_of("0.3,error\n0.4,err\n"));
  EXPECT_EQ(decoder->tally().torn_since, 2U);
  EXPECT_EQ(decoder->tally().torn_line, "0.4,err");
}

// Found by mutated inputs: the units were written beyond the columns.
TEST(Lines, UnitsBelowARowOfWordsAreTaken) {
  const auto decoder = make_decoder(Format::lines);
  const auto samples = decoded(*decoder, bytes_of("t,phase,flex\n1,x,y\nms,,V\n1000,grasp,2\n"));
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].board_s, 1);
  EXPECT_EQ(samples[0].value, std::vector<double>{2});
}

TEST(Lines, WithLabelsBearATornOneAndKnowAnotherGlove) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("thumb:1,index:2\nthumb:1,indxx:2\n"));
  EXPECT_EQ(decoded(*decoder, bytes_of("thumb:3,index:4\n")).size(), 1U);
  EXPECT_EQ(decoder->refusal(), "");
  const auto turned = decoded(*decoder, bytes_of("index:6,thumb:5\nthumb:7,index:8\n"));
  ASSERT_EQ(turned.size(), 2U);
  EXPECT_EQ(turned[0].value, (std::vector<double>{5, 6}));
  EXPECT_EQ(turned[1].value, (std::vector<double>{7, 8}));
  decoder->cut();
  EXPECT_TRUE(
      decoded(*decoder, bytes_of("ring:1\nring:1,pinky:2\nring:1,pinky:2\nring:1,pinky:2\n")).empty());
  EXPECT_NE(decoder->refusal().find("ring,pinky"), std::string::npos);
}

TEST(Lines, AreDroppedWhereTheyWereCut) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("1,2,3\n1,2,3\n100,200,3"));
  decoder->cut();
  EXPECT_EQ(decoder->tally().torn, 1U);
  const auto samples = decoded(*decoder, bytes_of("77,88,99\n4,5,6\n"));
  ASSERT_EQ(samples.size(), 1U) << "the first may be the end of a line";
  EXPECT_EQ(samples[0].value, (std::vector<double>{4, 5, 6}));
  decoder->cut();
  decoded(*decoder, bytes_of("half of the end"));
  decoder->cut();
  EXPECT_EQ(decoder->tally().torn, 1U) << "nothing was half, and of an end nobody knows how much was lost";
}

std::vector<std::vector<double>> values_of(const std::vector<Sample>& samples) {
  std::vector<std::vector<double>> out;
  for (const Sample& sample : samples) out.push_back(sample.value);
  return out;
}

TEST(Lines, KeepTheirColumnsWhereTheHeaderComesInAnotherOrder) {
  using Values = std::vector<std::vector<double>>;
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("millis,thumb,index,middle\n10,1,2,3\n"));
  decoder->cut();
  const auto other = decoded(*decoder, bytes_of("millis,middle,index,thumb\n20,3,2,1\n"));
  EXPECT_EQ(values_of(other), (Values{{1, 2, 3}}));
  EXPECT_EQ(other.at(0).board_s, 0.02);
  EXPECT_EQ(values_of(decoded(*decoder, bytes_of("12index,millis,thumb,middle\n2,30,1,3\n"))),
            (Values{{1, 2, 3}}))
      << "behind half a row";
  decoder->cut();
  EXPECT_EQ(values_of(decoded(*decoder, bytes_of("lis,thumb,index,middle\n40,1,2,3\n"))), (Values{{1, 2, 3}}))
      << "a torn header, in the order that was first";
  EXPECT_EQ(decoder->columns(), (std::vector<std::string>{"thumb", "index", "middle"}));
  EXPECT_EQ(decoder->refusal(), "");
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

TEST(Lines, GoOnAfterWhatIsNoOtherGlovesHeader) {
  const auto decoder = make_decoder(Format::lines);
  decoded(*decoder, bytes_of("millis,thumb,index\n10,1,2\n"));
  EXPECT_EQ(decoded(*decoder, bytes_of("please,wait,now\n20,1,2\n")).size(), 1U) << "a word in between";
  decoder->cut();
  EXPECT_EQ(decoded(*decoder, bytes_of("good,morning,all\nmillis,thumb,index\n20,1,2\n")).size(), 1U)
      << "a greeting, then its header";
  const auto nameless = make_decoder(Format::lines);
  decoded(*nameless, bytes_of("1,2\n1,2\n"));
  nameless->cut();
  EXPECT_EQ(decoded(*nameless, bytes_of("thumb,index\n1,2\n")).size(), 1U)
      << "a header that was missed before: column1 and column2 are no wrong names";
}

TEST(Frames, AreDroppedWhereTheyWereCut) {
  const auto decoder = make_decoder(Format::frames);
  link::GloveEnd glove(nullptr);
  std::vector<std::uint8_t> half = frame(glove, 0, 0);
  half.resize(half.size() / 2);
  decoded(*decoder, half);
  decoder->cut();
  EXPECT_EQ(decoder->tally().torn, 1U);
  EXPECT_EQ(decoded(*decoder, frame(glove, 10, 0)).size(), 1U);
  decoder->cut();
  EXPECT_EQ(decoder->tally().torn, 1U);
}

TEST(Lines, WithADeadStripKeepTheOtherFingers) {
  const auto decoder = make_decoder(Format::lines);
  const auto samples = decoded(*decoder, bytes_of("millis,a,b\n10,NaN,7\n20,8,\n30,nan,nan\n40,1,2\n"));
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_TRUE(std::isnan(samples[0].value[0]));
  EXPECT_EQ(samples[0].value[1], 7);
  EXPECT_EQ(samples[1].value[0], 8);
  EXPECT_TRUE(std::isnan(samples[1].value[1]));
  EXPECT_EQ(samples[2].board_s, 0.03);
  EXPECT_EQ(samples[3].value, (std::vector<double>{1, 2}));
  EXPECT_EQ(decoder->tally().torn, 0U);
  EXPECT_TRUE(decoded(*decoder, bytes_of("nan,1,2\n,1,2\n50,1,x\n")).empty()) << "no time; no number";
  EXPECT_EQ(decoder->tally().torn, 3U);
}

TEST(Lines, ThatLackAllReadingsNameNoColumnsAndAreNoSamples) {
  const auto decoder = make_decoder(Format::lines);
  const auto samples = decoded(*decoder, bytes_of("nan nan\n1 2\n3 nan\nnan nan\n1e308 1e308\n"));
  EXPECT_EQ(decoder->columns(), std::vector<std::string>()) << "the columns are not known yet";
  EXPECT_TRUE(samples.empty());
  const auto more = decoded(*decoder, bytes_of("1 2\n3 nan\nnan nan\n"));
  EXPECT_EQ(decoder->columns(), (std::vector<std::string>{"column1", "column2"}));
  ASSERT_EQ(more.size(), 2U);
  EXPECT_TRUE(std::isnan(more[1].value[1]));
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

TEST(Detection, TellsAHandFromAGlove) {
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

TEST(Detection, HearsAGloveThatWaitsForItsHand) {
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
