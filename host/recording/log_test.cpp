#include "host/recording/log.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

Log log_of(std::vector<double> t_s, std::vector<double> index, std::vector<double> thumb) {
  Recording out;
  out.source = "held";
  out.t_s = std::move(t_s);
  out.columns = {{"index_V", std::move(index), "V"}, {"thumb_V", std::move(thumb), "V"}};
  return Log(std::move(out));
}

Recording read_all(const Log& log, const TableOptions& options) { return read(*open_log(log, options)); }

TEST(LogInMemory, RowsWithoutAReadingOfTheColumnsAreLeftOut) {
  const Log log = log_of({0, 1, 2, 3}, {5, kHole, 6, 7}, {1, 2, kHole, 3});
  const Recording one = read_all(log, {{"index_V"}, {}});
  EXPECT_EQ(one.t_s, (std::vector<double>{0, 2, 3}));
  EXPECT_EQ(one.column("index_V").unit, "V");
  EXPECT_EQ(one.warnings.size(), 1U);
  EXPECT_EQ(read_all(log, {{}, {}}).t_s, (std::vector<double>{0, 3}));
  EXPECT_EQ(read_all(log, {{}, {}, Holes::all}).t_s.size(), 4U);
}

TEST(LogInMemory, IsRefusedAsAFileIs) {
  const auto refusal = [](const Log& log, const std::string& column) {
    return io::refusal_of([&] { (void)read_all(log, {{column}, {}}); });
  };
  EXPECT_NE(refusal(log_of({0, 1}, {1, 2}, {1, 2}), "ring_V").find("no column"), std::string::npos);
  EXPECT_NE(refusal(log_of({0}, {1}, {1}), "index_V").find("at least two"), std::string::npos);
  EXPECT_NE(refusal(log_of({0, 1}, {1, HUGE_VAL}, {1, 2}), "index_V").find("row 2"), std::string::npos);
}

}  // namespace
}  // namespace flexor::recording
