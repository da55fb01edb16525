// Several joints from several sensors, over any number of recordings, to one compensator that can be worn.
//
// For each pair of recordings: one clock offset for all joints -> the sensors on the compensator's grid, past
// readings only. The first part (in time) of each pair is fitted, the rest held out. For each joint the additive
// candidates (additive.hpp), best first; the first that holds still when the finger does and fits fixed point is
// taken. The model runs over the whole logs, as apply runs it, and is scored on the held-out parts, beside
// baselines from the same samples by the same estimator: a straight line, the line with motion, and the published
// form with its parameters fitted.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/joint_fit.hpp"
#include "host/identify/joint_map.hpp"
#include "host/model/model.hpp"
#include "host/recording/clock.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/time.hpp"
#include "host/score/judge.hpp"
#include "host/score/score.hpp"

namespace flexor::identify {

// A donning: the sensors in one recording, a measured angle for each joint of the map.
struct Take {
  recording::Recording sensor;
  std::vector<recording::Recording> reference;
  PairFiles files = {};  // where it was read, which names it
};

// What is left out, one after the other, of a fit to all the rest with every choice made again: pairs of recordings; persons,
// whose logs lie in folders of their own; eighths of every pair's time (of which readings, not angles, still tell what may be read).
enum class LeaveOut { none, take, person, block };

struct Options {
  std::vector<JointMap> map;
  double rate_hz = 20;
  double split = 0.5;
  std::string structure = "auto";  // structure_text.hpp
  std::optional<model::Model>
      initial;  // a start for the parameters of its chains, whose structure is taken unless one is asked for
  bool refit = false;  // its gains and dead zones alone are fitted
  bool fit_all =
      false;  // once proven on a part, the model is fitted in the same way to all of the recordings
  double lead_s = 0;
  std::optional<double> clock_offset_s;
  // RMS error of the measured angles themselves, by joint. The model's stated error then holds it too; no figure against those
  // angles does.
  std::map<std::string, double> reference_error_deg;
  std::map<std::string, model::Ends>
      ends;  // of joints, where they are known; else by quantiles of the angles
  std::string input_unit;
  std::string output_unit;
  recording::TimeOptions time;
  LeaveOut leave_out = LeaveOut::none;
  Room room;        // that all joints of an `auto` structure have together
  int threads = 0;  // on which joints are fitted; 0: as many as the machine has
};

struct Request : Options {
  std::vector<PairFiles> pairs;
};

using recording::Clock;

// By each joint's own sensor. All sensors of a file share its clock, and all references theirs, of which a drift is taken out.
// Throws io::JobError where no signal tells it.
Clock clock_of(const std::vector<JointMap>& map, std::optional<double> given, Take& files,
               std::vector<std::string>& warnings);

// A joint in one pair of recordings, at every sample of the compensator's grid. What counts begins where both logs run.
struct JointSamples {
  std::vector<recording::Aligned> sensors;  // the own one first
  // Of the compensator by the name "", and of the baselines that could be fitted by theirs.
  std::map<std::string, std::vector<double>> estimated_deg;

  const recording::Aligned& own() const { return sensors.front(); }
  std::size_t begin() const { return own().overlap_begin; }
  double since_begin_s(std::size_t k) const { return own().t_s[k] - own().t_s[begin()]; }
  bool gap(std::size_t k) const;  // a pause of a log
};

inline constexpr double kLeadOff_s = 0.05;

// RMSE over a pair's held-out part, or over what was left out, of the compensator and of the baselines by their names.
struct ScoreRow {
  std::string name;  // of the glove's log, the person's folder, or the block
  std::size_t samples = 0;
  double rmse_deg = 0;
  std::map<std::string, double> baseline_deg;
};

struct JointResult : JointFit {
  std::string name;
  score::Score holdout;
  score::Verdict verdict;
  std::map<std::string, score::Score> baselines;  // by their names in judge.hpp
  std::vector<std::string> baseline_refusals;
  std::vector<ScoreRow> pairs;
  std::vector<ScoreRow> left_out;
  double sooner_deg = 0;  // held out, RMSE where what follows takes kLeadOff_s less than the lead
  double later_deg = 0;   // and so much more
  std::optional<score::Verdict> left_out_verdict;  // over all of these, where every part could be left out
  std::vector<JointSamples> samples;  // of each pair; the estimates are of what the scores are of

  ScoreRow all() const;  // over all of what is held out, by the joint's name
};

struct Result {
  Options options;
  std::vector<PairFiles> files;  // of each take
  std::vector<Clock> clocks;
  std::vector<JointResult> joints;
  model::Model model;
  model::Model proven;  // fitted to a part: what scores and samples are of; with fit_all another than `model`
  double fit_seconds = 0;
  bool leave_out_stopped = false;
  std::vector<std::string> warnings;
};

// Of all pairs, a take for each trial in them.
std::vector<Take> read_takes(const Request& request, std::vector<std::string>& warnings);

// Throws io::InputError and io::JobError.
Result identify(std::vector<Take> takes, const Options& options, const Step& step);
Result identify_files(const Request& request, const Step& step);  // the same of files

// What LeaveOut::person finds of one person among many: pairs of `own` are left out of a fit to all the others. Of each joint the row of
// what is left out and its verdict. Pairs that cannot be read, or whose clock is not determined, are not there. Throws as above, io::Cancelled
// where `step` stops it.
struct LeftOut {
  ScoreRow row;
  score::Verdict verdict;
};
std::vector<LeftOut> leave_person_out(const Request& request, const std::vector<std::size_t>& own,
                                      const Step& step);

// The fit alone, to all of the takes: nothing is held out, nothing scored.
model::Model fit_takes(std::vector<Take> takes, const Options& options, const Step& step = {});

nlohmann::ordered_json to_json(const Result& result);

// As files that its report is drawn from: results.json, scores.csv (every
// RMSE in a row: of all that is held out, of each pair, of each part that was left out), and beside them for
// the joint number N, from 1, samples-N.csv: t_s (since both logs of that pair run), pair (from 1), reading (of the own
// sensor), measured_deg, estimated_deg, straight_line_deg, line_lead_deg (NaN: no such line could be fitted), gap, held_out.
// Makes the folder if needed; every file appears whole or not at all. Throws io::InputError when it cannot be written.
void save_results(const Result& result, const std::filesystem::path& folder);

// For tables and messages.
std::vector<std::string> names_of(const std::vector<PairFiles>& takes);

}  // namespace flexor::identify
