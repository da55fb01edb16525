// A row of trials.csv: one trial of one motion with one compensator.
#pragma once

#include <optional>
#include <string>

#include "host/score/trial.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::study {

struct TrialRow {
  double total_deg_s = 0;
  std::optional<score::LagRemoved> lag_removed;  // none: two empty fields
  twin::PerFinger finger_deg_s{};
  twin::PerFinger swing_deg{};  // from the hand's smallest angle to its largest
  twin::PerFinger impact_deg_s{};
  twin::PerFinger pressed_s{};
  int sent = 0;
  int lost = 0;

  bool operator==(const TrialRow&) const = default;
};

// Goes up when a row's numbers change their meaning; part of a run's settings.
inline constexpr int kRowsVersion = 2;

// The columns' names, a whole line.
std::string header_of_rows();

// A whole line; numbers read back to the bit.
std::string text_of_row(const std::string& motion, const std::string& compensator, int trial,
                        const TrialRow& row);

// A line without its end back to numbers; false if it is not one of ours.
bool parse_row(const std::string& line, const std::string& motion, const std::string& compensator, int trial,
               TrialRow& row);

}  // namespace flexor::study
