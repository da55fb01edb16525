// What an experiment found: beside the article's figures and words, as JSON, and as the files that its report is drawn from:
// results.json, and in traces/ trial 0 of every motion with every compensator as the cameras saw it (t_s; for each finger
// NAME_finger_deg and NAME_hand_deg).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/io/pipe_json.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {

// From the published table, over what of some of its gestures is in the run.
struct Distance {
  std::vector<int> gestures;
  std::vector<std::string> compensators;
  double log_rms = 0;             // root mean square of ln(ours / published)
  double null_model_log_rms = 0;  // the same of null_model(), over the same cells
  bool is_all = false;            // none of the gestures is missing
};

FLEXOR_PIPE(Distance, gestures, compensators, log_rms, null_model_log_rms)

// The twin was fitted to 1 to 4; 5 and 6 are not unseen either: their motions were written down with these figures in view. None: the
// run has none of gestures `from` to `to`.
std::optional<Distance> distance(const Result& result, int from, int to);

// What the article states of curves and prints no number for, as numbers with a threshold. They are reported,
// and nothing is fitted to them.
//   gesture 2  "large fluctuations in rho_2 and rho_3" without a compensator, where the person keeps index and
//              middle still: swing of the hand's angle, from its smallest to its largest, with Raw; mean over
//              the trials, the smaller of both fingers. Large: 10 degrees or more: the published
//              compensator rests flat up to readings that allow 12 to 15 at most, and its error there is small.
//   gesture 4  "no significant deviations" of rho_3, rho_4 and rho_5 from rho_r with any of the compensators:
//              mean |e_i| over the gesture, E_i / duration, the largest of three fingers and three
//              compensators. Not significant: 5 degrees or less.
inline constexpr double kLargeSwing_deg = 10;
inline constexpr double kSignificant_deg = 5;

// Those that the run allows: gesture 2 with raw, gesture 4 with all three published. Each names what sets its value ("where"), and
// "at_least_deg" or "at_most_deg", within which it "agrees" with the article.
Json shape_checks(const Result& result, const Plan& plan);

// A line each: the first cell with silent trials, a delay beyond what the firmware follows.
std::vector<std::string> warnings(const Result& result, const Plan& plan);

// Everything but how long it took and on how many threads: the same run gives the same bytes.
Json to_json(const Result& result, const Plan& plan);

struct ScenarioResult {
  Scenario scenario;
  Result result;
};

// Its settings and its cells.
Json to_json(const ScenarioResult& result);

// Every file appears whole or not at all, results.json last. Throws io::InputError when it cannot be written, and
// io::Cancelled.
void save_results(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                  const std::filesystem::path& folder);

}  // namespace flexor::study
