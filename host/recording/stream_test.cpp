#include "host/recording/stream.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
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

std::vector<double> steady(std::size_t rows, double step_s, double first_s = 0) {
  std::vector<double> t(rows);
  for (std::size_t k = 0; k < rows; ++k) t[k] = first_s + static_cast<double>(k) * step_s;
  return t;
}

std::vector<double> with(std::vector<double> t, std::size_t row, double t_s) {
  t[row] = t_s;
  return t;
}

std::vector<double> without(std::vector<double> t, std::ptrdiff_t row) {
  t.erase(t.begin() + row);
  return t;
}

// From the row on.
std::vector<double> moved(std::vector<double> t, std::size_t row, double by_s) {
  for (; row < t.size(); ++row) t[row] += by_s;
  return t;
}

struct Repair {
  std::string name;
  std::vector<double> t_s;
  std::vector<double> kept;
  std::string noted = {};  // within the notes, with a bar between two
  double wrap_s = 0;
  bool is_reset = false;  // which is followed one step later, or refused
};

std::vector<Repair> repairs() {
  constexpr double k32Bits_s = 4294.967296;
  const std::vector<double> t = steady(100, 0.05);
  std::vector<Repair> out = {
      {"a good log is untouched", t, t},
      {"one row far ahead silences nothing", with(t, 40, 2e8), without(t, 40),
       "far ahead of all around (200000000 s) were left out, the first is row 41"},
      {"a pause", moved(t, 50, 9), moved(t, 50, 9), "jump of the clock, of up to 9"},
      {"a pause that the next row confirms", moved(t, 50, 600), moved(t, 50, 600), "of up to 600"},
      {"a row that goes back", with(t, 60, 1), without(t, 60),
       "goes backwards were left out, the first is row 61"},
      {"a reset", moved(t, 60, -3), t, "row 61", 0, true},
      {"a counter that wraps", moved(steady(200, 0.05, k32Bits_s - 5), 100, -k32Bits_s),
       steady(200, 0.05, k32Bits_s - 5), "starts from 0: it is taken to go on, the first is row 101",
       k32Bits_s},
      // These were found by the fuzzer. Of two strays, each farther ahead, the second passed for a confirmation of the first.
      {"a stray confirms no other", with(with(t, 50, 94), 51, 8589), without(without(t, 50), 50), "2 row(s)"},
      {"a wrap is confirmed by a row that follows closely",
       std::vector{4294.90, 4294.95, 34.9, 4294.90, 0.05, 0.1},
       std::vector{4294.90, 4294.95, 4295.017296, 4295.067296},
       "the first is row 3|log: 1 row(s) where the clock's counter passes its end", k32Bits_s}};
  for (const double start_s : {1700000000.0, 4290000.0, 85000.0})
    for (const double wrap_s : {4294967.296, 86400.0})
      out.push_back({"one stray zero is no wrap", with(steady(200, 0.05, start_s), 100, 0),
                     without(steady(200, 0.05, start_s), 100), "goes backwards", wrap_s});
  return out;
}

TEST(Stream, RepairsTheClockAndSaysWhere) {
  for (const Repair& c : repairs()) {
    SCOPED_TRACE(c.name);
    const Read r = all(c.t_s, Resets::follow, c.wrap_s);
    EXPECT_EQ(r.error, "");
    ASSERT_EQ(r.t_s.size(), c.kept.size());
    for (std::size_t k = 0; k < c.kept.size(); ++k) EXPECT_NEAR(r.t_s[k], c.kept[k], 1e-6) << k;
    const std::string notes = fmt::format("{}", fmt::join(r.notes, "|"));
    EXPECT_EQ(notes.empty(), c.noted.empty()) << notes;
    EXPECT_EQ(std::ranges::count(notes, '|'), std::ranges::count(c.noted, '|')) << notes;
    EXPECT_NE(notes.find(c.noted), std::string::npos) << notes;
    EXPECT_EQ(all(r.t_s).t_s, r.t_s) << "repaired once more";
    const Read refused = all(c.t_s, Resets::refuse, c.wrap_s);
    EXPECT_EQ(refused.t_s == r.t_s, !c.is_reset);
    EXPECT_EQ(refused.error.find("log: row 61: time does not increase") == 0 &&
                  refused.error.find("reset") != std::string::npos,
              c.is_reset)
        << refused.error;
  }
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
