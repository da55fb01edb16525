#include "host/study/trial_row.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "host/model/model.hpp"

namespace flexor::study {
namespace {

constexpr double kMost =
    1e9;  // of anything in a row, and at least 0 but for a lag; more was written by somebody else

}  // namespace

std::string header_of_rows() {
  std::string out = "motion,compensator,trial,total_error_deg_s,lag_removed_deg_s,lag_s";
  for (const char* what : {"error_deg_s", "swing_deg", "impact_deg_s", "pressed_s"}) {
    for (const std::string& finger : model::finger_names()) out += fmt::format(",{}_{}", finger, what);
  }
  return out + ",frames_sent,frames_lost\n";
}

std::string text_of_row(const std::string& motion, const std::string& compensator, int trial,
                        const TrialRow& row) {
  std::string out = fmt::format("{},{},{},{}", motion, compensator, trial, row.total_deg_s);
  out += row.lag_removed ? fmt::format(",{},{}", row.lag_removed->total_error_deg_s, row.lag_removed->lag_s)
                         : ",,";
  for (const auto* values : {&row.finger_deg_s, &row.swing_deg, &row.impact_deg_s, &row.pressed_s}) {
    out += fmt::format(",{}", fmt::join(*values, ","));
  }
  return out + fmt::format(",{},{}\n", row.sent, row.lost);
}

bool parse_row(const std::string& line, const std::string& motion, const std::string& compensator, int trial,
               TrialRow& row) {
  const std::string start = fmt::format("{},{},{},", motion, compensator, trial);
  if (!line.starts_with(start)) return false;
  const char* at = line.data() + start.size();
  const char* const end = line.data() + line.size();
  const auto number = [&](auto& value) {
    const auto [stop, error] = std::from_chars(at, end, value);
    at = stop;
    return error == std::errc() && std::abs(static_cast<double>(value)) < kMost;
  };
  const auto any_next = [&](auto& value) { return number(value) && at < end && *at++ == ','; };
  const auto next = [&](auto& value) { return any_next(value) && value >= 0; };
  bool good = next(row.total_deg_s);
  row.lag_removed.reset();
  if (good && std::string_view(at, end).starts_with(",,")) {
    at += 2;
  } else {
    row.lag_removed.emplace();
    good = good && next(row.lag_removed->total_error_deg_s) && any_next(row.lag_removed->lag_s);
  }
  for (auto* values : {&row.finger_deg_s, &row.swing_deg, &row.impact_deg_s, &row.pressed_s}) {
    for (double& value : *values) good = good && next(value);
  }
  return good && next(row.sent) && number(row.lost) && at == end && row.sent >= 0 && row.lost >= 0;
}

}  // namespace flexor::study
