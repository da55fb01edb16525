// Any bytes as recorded motion, wide CSV or GraspDB's text, and as a row of trials.csv: an InputError of one
// line, or a motion of finite angles within its bounds, or a row that reads back.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/io/fuzz_json.hpp"
#include "host/study/journal.hpp"
#include "host/study/recorded_motion.hpp"

namespace {

using namespace flexor;
using io::fuzz::require;

void follow(const twin::Motion& m) {
  require(m.duration_s() >= 0.01 && m.duration_s() <= twin::kMaxDuration_s);
  constexpr int kTimes = 100;
  for (int i = 0; i < twin::kFingers; ++i) {
    for (int k = -2; k <= kTimes + 2; ++k) {
      const double angle = m.angle(i, m.duration_s() * k / kTimes, {});
      require(angle >= -1e-6 && angle <= 180 + 1e-6);
    }
  }
}

void read_row(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  study::TrialRow row;
  if (!study::parse_row(line, "1", "raw", 0, row)) return;
  require(std::isfinite(row.total_deg_s));
  if (row.lag_removed)
    require(std::isfinite(row.lag_removed->total_error_deg_s) && std::isfinite(row.lag_removed->lag_s));
  for (const auto* values : {&row.finger_deg_s, &row.swing_deg, &row.impact_deg_s, &row.pressed_s})
    for (const double value : *values) require(std::isfinite(value));
  require(row.sent >= 0 && row.lost >= 0);
  std::string again = study::text_of_row("1", "raw", 0, row);
  again.pop_back();
  study::TrialRow back;
  require(study::parse_row(again, "1", "raw", 0, back) && back == row);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::vector<std::string> notes;
  io::fuzz::read_or_refuse([&] { follow(study::csv_motion(text, io::fuzz::kSource, notes)); });
  io::fuzz::read_or_refuse([&] { follow(study::grasp_motion(text, io::fuzz::kSource, notes)); });
  read_row(text);
  return 0;
}
