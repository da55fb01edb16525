#include "host/recording/stream.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <sstream>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

// Rows of one column, which counts them.
class Rows : public MemoryReader {
 public:
  Rows(std::vector<double> t_s, double wrap_s) : MemoryReader(held(std::move(t_s)), {}), wrap_s_(wrap_s) {}
  Times times() const override { return {.wrap_s = wrap_s_}; }

 private:
  static std::shared_ptr<const Recording> held(std::vector<double> t_s) {
    Recording out{"log", std::move(t_s), {{"a", {}}}, {}, ""};
    for (std::size_t k = 0; k < out.t_s.size(); ++k) out.columns[0].value.push_back(static_cast<double>(k));
    return std::make_shared<const Recording>(std::move(out));
  }
  double wrap_s_;
};

struct Read {
  std::vector<double> t_s;
  std::vector<double> value;
  std::vector<std::string> notes;
  std::string error;
};

Read all(std::vector<double> t_s, Resets resets = Resets::follow, double wrap_s = 0) {
  Rows rows(std::move(t_s), wrap_s);
  Stream stream(rows, resets);
  Read out;
  Row row;
  try {
    while (stream.next(row)) {
      out.t_s.push_back(row.t_s);
      out.value.push_back(row.value[0]);
    }
  } catch (const io::InputError& error) {
    out.error = error.what();
  }
  out.notes = stream.notes();
  return out;
}

std::vector<double> steady(int rows, double step_s) {
  std::vector<double> t;
  for (int k = 0; k < rows; ++k) t.push_back(k * step_s);
  return t;
}

TEST(Stream, PassesAGoodLogUntouchedAndWithoutAWord) {
  const auto t = steady(500, 0.01);
  const Read r = all(t);
  EXPECT_EQ(r.t_s, t);
  EXPECT_TRUE(r.notes.empty());
}

TEST(Stream, OneRowFarAheadIsLeftOutByNameAndSilencesNothing) {
  auto t = steady(100, 0.05);
  t[40] = 200000000;
  const Read r = all(t);
  EXPECT_EQ(r.t_s.size(), 99u);
  EXPECT_DOUBLE_EQ(r.t_s.back(), t.back());
  ASSERT_EQ(r.notes.size(), 1u);
  EXPECT_NE(r.notes[0].find("far ahead"), std::string::npos);
  EXPECT_NE(r.notes[0].find("200000000"), std::string::npos);
  EXPECT_NE(r.notes[0].find("row 41"), std::string::npos);
}

TEST(Stream, APauseThatTheNextRowConfirmsIsAPause) {
  for (const int pause_s : {9, 600}) {  // below and above kJump_s
    auto t = steady(100, 0.05);
    for (std::size_t k = 50; k < 100; ++k) t[k] += pause_s;
    const Read r = all(t);
    EXPECT_EQ(r.t_s, t);
    ASSERT_EQ(r.notes.size(), 1U);
    EXPECT_NE(r.notes[0].find(fmt::format("jump of the clock, of up to {}", pause_s)), std::string::npos);
  }
}

TEST(Stream, ARowThatGoesBackIsLeftOutAndTheRestStays) {
  auto t = steady(200, 0.05);
  t[100] = 1;
  const Read r = all(t);
  EXPECT_EQ(r.t_s.size(), 199u);
  EXPECT_NE(r.notes.at(0).find("goes backwards"), std::string::npos);
  EXPECT_NE(r.notes.at(0).find("row 101"), std::string::npos);
}

TEST(Stream, AResetIsFollowedOneStepLaterOrRefusedByRow) {
  auto t = steady(100, 0.05);
  for (std::size_t k = 60; k < 100; ++k) t[k] -= 3;
  const Read followed = all(t);
  ASSERT_EQ(followed.t_s.size(), 100u);
  for (std::size_t k = 0; k < 100; ++k) EXPECT_NEAR(followed.t_s[k], 0.05 * static_cast<double>(k), 1e-9);
  EXPECT_NE(followed.notes.at(0).find("row 61"), std::string::npos) << followed.notes[0];
  const Read refused = all(t, Resets::refuse);
  EXPECT_NE(refused.error.find("log: row 61: time does not increase"), std::string::npos) << refused.error;
  EXPECT_NE(refused.error.find("reset"), std::string::npos);
}

TEST(Stream, ACounterThatWrapsGoesOn) {
  const double range_s = 4294.967296;
  std::vector<double> t;
  std::vector<double> truth;
  for (int k = 0; k < 200; ++k) {
    truth.push_back(range_s - 5 + 0.05 * k);
    t.push_back(truth.back() < range_s ? truth.back() : truth.back() - range_s);
  }
  const Read r = all(t, Resets::refuse, range_s);
  ASSERT_EQ(r.error, "");
  ASSERT_EQ(r.t_s.size(), truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(r.t_s[k], truth[k], 1e-9);
}

TEST(Stream, OneStrayZeroIsNoWrapOfTheCounter) {
  for (const double start_s : {1700000000.0, 4290000.0, 85000.0}) {
    for (const double wrap_s : {4294967.296, 86400.0}) {
      std::vector<double> t = steady(200, 0.05);
      for (double& v : t) v += start_s;
      t[100] = 0;
      const Read r = all(t, Resets::follow, wrap_s);
      EXPECT_EQ(r.error, "");
      ASSERT_EQ(r.t_s.size(), 199u);
      EXPECT_NEAR(r.t_s.back(), start_s + 199 * 0.05, 1e-6) << start_s << " " << wrap_s;
      EXPECT_EQ(r.notes.size(), 1u);
    }
  }
}

// Found by the fuzzer: of two strays, each farther ahead, the second passed for a confirmation of the first, which a
// second reading of what was written then left out.
TEST(Stream, OneStrayDoesNotConfirmAnother) {
  std::vector<double> t = steady(100, 0.05);
  t[50] = 94;
  t[51] = 8589;
  const Read r = all(t);
  EXPECT_EQ(r.t_s.size(), 98u);
  EXPECT_EQ(r.t_s.back(), t.back());
  EXPECT_EQ(all(r.t_s).t_s, r.t_s);
}

// Found by the fuzzer: a row that went back was taken for the counter's new start on the word of one far away.
TEST(Stream, AWrapIsConfirmedByARowThatFollowsItClosely) {
  const Read r = all({4294.90, 4294.95, 34.9, 4294.90, 0.05, 0.1}, Resets::follow, 4294.967296);
  for (std::size_t k = 1; k < r.t_s.size(); ++k) EXPECT_LT(r.t_s[k] - r.t_s[k - 1], kJump_s);
  EXPECT_NEAR(r.t_s.back(), 4294.967296 + 0.1, 1e-6);
}

// Found by the fuzzer: a time below 0 passed for the counter's new start, and what followed ran backwards.
TEST(Stream, ACounterDoesNotStartBelowZero) {
  const Read r = all({4294.9, -4294.95, 0.0327, 0.0827}, Resets::follow, 4294.967296);
  for (std::size_t k = 1; k < r.t_s.size(); ++k) EXPECT_GE(r.t_s[k], r.t_s[k - 1]);
}

// Twice in the log, once in a grid point's mean and once in the next one's.
TEST(Stream, ARowThatRepeatsTheOneBeforeWhollyIsLeftOut) {
  const Recording r = parse_csv("t_s,a\n0,1\n0,1\n0.05,2\n0.05,2\n0.1,3\n0.1,4\n", "log", {});
  EXPECT_EQ(r.t_s, (std::vector{0.0, 0.05, 0.1, 0.1}));
  EXPECT_EQ(r.columns[0].value, (std::vector{1.0, 2.0, 3.0, 4.0}));
  ASSERT_EQ(r.warnings.size(), 2U);
  EXPECT_NE(r.warnings[0].find("2 row(s) repeat the time and the readings"), std::string::npos);
}

TEST(Stream, OfALiveLogRowsThatComeLateAreLeftOutHoweverMany) {
  std::string text = "t_s,a\n";
  for (int k = 0; k < 200; ++k) {
    text += fmt::format("{},1\n", 1 + 0.05 * k);
    if (k % 10 == 9) text += fmt::format("{},-1\n{},-1\n", 0.87 + 0.05 * k, 0.92 + 0.05 * k);
  }
  for (const From from : {From::pipe, From::file}) {
    std::istringstream lines(text);
    CsvReader reader(lines, "log", {{}, {}, Holes::none, from});
    if (from == From::file) {
      EXPECT_THROW((void)read(reader, Resets::follow), io::InputError);
      continue;
    }
    const Recording r = read(reader, Resets::follow);
    EXPECT_EQ(r.columns[0].value, std::vector<double>(200, 1));
    EXPECT_NEAR(r.t_s.back(), 1 + 0.05 * 199, 1e-9);
  }
}

TEST(Stream, MillisecondsTakenForSecondsAreRefusedEarly) {
  const Read r = all(steady(1000, 50));
  EXPECT_NE(r.error.find("milliseconds"), std::string::npos) << r.error;
  EXPECT_LT(r.t_s.size(), 20u);
  EXPECT_NE(all(steady(4, 50)).error.find("milliseconds"), std::string::npos);
}

TEST(Stream, TimeNeverRunsBackwardsWhateverComes) {
  EXPECT_TRUE(rc::check([] {
    const auto ms = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-2000, 60000));
    RC_PRE(!ms.empty());
    std::vector<double> t;
    for (const int v : ms) t.push_back(v * 1e-3);
    const Read r = all(t, Resets::follow, *rc::gen::element(0.0, 30.0, 60.0));
    for (std::size_t k = 1; k < r.t_s.size(); ++k) RC_ASSERT(r.t_s[k] >= r.t_s[k - 1]);
    for (std::size_t k = 1; k < r.value.size(); ++k) RC_ASSERT(r.value[k] > r.value[k - 1]);  // none twice
  }));
}

}  // namespace
}  // namespace flexor::recording
