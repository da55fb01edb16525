// The published experiment in the twin: gestures x compensators x trials.
//
// Trials run in batches on any number of threads and are committed in order, so that figures and files are
// the same bits whatever the threads. What is kept is sums, not trials: memory does not grow with their
// number. With a folder, every trial is a row of trials.csv as soon as its turn comes (journal.hpp); a run
// that was cut off goes on where the file ends.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/io/folder_lock.hpp"
#include "host/model/model.hpp"
#include "host/study/catalogue.hpp"
#include "host/study/shard.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::study {

// What plays the trials: the twin itself, or something that takes its place.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  // As twin::simulate; from any thread.
  virtual std::vector<twin::Trial> simulate(const twin::TrialInput& input, std::uint64_t first,
                                            int count) const = 0;
  // How many trials to ask for at a time: few where each takes long, so that progress shows.
  virtual int batch() const { return twin::kTrialsAtOnce; }
};

struct Plan {
  twin::Parameters parameters;
  std::vector<twin::Motion> motions;
  std::vector<Compensator> compensators;
  std::uint64_t seed = 1;
  int trials = 3;
  int threads = 0;                       // 0: as many as the machine has
  std::filesystem::path folder;          // empty: nothing is written
  Engine* engine = nullptr;              // none: the twin. Outlives the run
  const io::FolderLock* lock = nullptr;  // of the folder, where the caller has it already
  Scenario scenario = {};           // how long the glove is worn before each trial, and whether it tracks
  bool scenarios = false;           // whether whoever runs it goes on with study::scenarios()
  std::optional<Shard> shard = {};  // plays only the batches that this part of the run has
};

// Mean and 95 % interval (Student's t) of a stream of numbers.
class Statistic {
 public:
  void add(double value);
  int count() const { return count_; }
  double mean() const { return mean_; }
  std::optional<double> ci95() const;  // half the interval's width; none with fewer than two numbers

 private:
  int count_ = 0;
  double mean_ = 0;
  double squares_ = 0;
};

struct Cell {
  std::string motion;
  int gesture = 0;  // 0: none of the published
  std::string compensator;
  Statistic total_deg_s;  // causal
  // After the best constant lag of each trial that has one (host/score/trial.hpp): count() is how many.
  Statistic lag_removed_deg_s;
  Statistic lag_s;
  std::array<Statistic, kFingers> finger_deg_s;
  std::array<Statistic, kFingers> swing_deg;  // from the hand's smallest angle to its largest
  // Of paired trials: same person, glove, radio and hand.
  std::vector<Statistic> difference_deg_s;  // this minus compensator j, for each j of the plan
  std::optional<double> published_deg_s;
  // What the hand's end stops suffer (host/twin/plant.hpp), finger by finger.
  std::array<double, kFingers> impact_deg_s{};  // the fastest of all trials
  std::array<Statistic, kFingers> pressed_s;
  std::int64_t frames_sent = 0;
  std::int64_t frames_lost = 0;
  int silent_trials = 0;  // in which at most half of the frames reached the hand

  double total_pressed_s() const;  // mean of a trial, five fingers together
};

struct Result {
  std::vector<std::string> motions;
  std::vector<std::string> compensators;
  std::vector<Cell> cells;  // motion by motion, compensators inside
  double simulated_s = 0;   // of gestures, in this call
  double wall_s = 0;
  int threads = 1;
  std::int64_t resumed_rows = 0;
  double real_time_factor() const { return wall_s > 0 ? simulated_s / wall_s : 0; }
  const Cell& cell(std::size_t motion, std::size_t compensator) const {
    return cells[motion * compensators.size() + compensator];
  }
};

using TrialProgress = std::function<void(std::size_t done, std::size_t of)>;  // in batches

// Throws io::InputError: a model with other channels, an impossible configuration, names that a table cannot
// hold apart.
void check(const Plan& plan);

// What must be the same for a run to go on in its folder. A shard's also holds all that its plan is made of.
Json settings_of(const Plan& plan);

// Throws as check(); io::InputError: a folder that holds another run, or in which somebody else works;
// io::JobError: trials.csv cannot be written; io::Cancelled, by io::go_on() or `progress`, with everything done so far in the folder.
Result run(const Plan& plan, const TrialProgress& progress);

// The same result and trials.csv from the rows of all shards of this plan, in order, in place of playing. Throws as run();
// io::InputError: a shard that is not done, before anything is written.
Result merge(const Plan& plan, const std::vector<std::filesystem::path>& shards,
             const TrialProgress& progress);

// What the glove follows its sensors by: each sensor's poses as the first compensator that has them. All are tracked
// alike, so that what is compared is what they make of it. None: no compensator has any.
std::optional<twin::Tracking> tracking_of(const std::vector<Compensator>& compensators);

// Trial `number` as it is played once its compensator was recalibrated, as flexor recalibrate does, by what the glove reads before it:
//   poses    an open hand and a fist, two seconds each, each finger up to 2 degrees beside where it should be held;
//            once more for four and for eight seconds where the reading was not still; the model stays if it never is
//   motion   short_motion(), thirty seconds without a camera
// A compensator whose sensors are not known stays as it is. Throws io::InputError: another kind.
twin::TrialInput recalibrated(twin::TrialInput input, const std::string& by, std::uint64_t number);

// Trial 0 of a motion, exactly as run() meets it: what to play, and played.
twin::TrialInput first_input(const Plan& plan, const twin::Motion& motion, const Compensator& compensator);
twin::Trial first_trial(const Plan& plan, const twin::Motion& motion, const Compensator& compensator);

}  // namespace flexor::study
