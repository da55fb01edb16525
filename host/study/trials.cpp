#include "host/study/trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "host/identify/recalibrate_files.hpp"
#include "host/io/io.hpp"
#include "host/io/run_in_order.hpp"
#include "host/model/wiring.hpp"
#include "host/score/judge.hpp"
#include "host/score/trial.hpp"
#include "host/study/journal.hpp"
#include "host/study/published.hpp"
#include "host/twin/exact_json.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

using io::InputError;

constexpr double kPoseError_deg = 2;
constexpr double kHeld_s[] = {2, 4, 8};
constexpr double kBetween_s = 1;
constexpr double kMotion_s = 30;
constexpr std::uint64_t kPoseErrors = 0x706f7365;  // draws of their own

// Open hand, then fist, as somebody holds them who was asked to.
twin::Motion poses(const twin::Parameters& p, std::uint64_t seed, double held_s) {
  twin::Random random(twin::seed_of(seed, kPoseErrors));
  std::array<std::vector<double>, kFingers> angle;
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double open = p.hand_lower_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    const double fist = p.hand_upper_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    angle[i] = {open, open, fist, fist};
  }
  return twin::Motion::from_samples("poses", {0, held_s, held_s + kBetween_s, 2 * held_s + kBetween_s},
                                    angle);
}

// As the glove's log has it: a column for each input.
recording::Recording log_of(const twin::TrialInput& input, std::uint64_t number) {
  const auto reading = twin::worn_readings(input, number);
  const model::Wiring wiring = model::wiring_of(input.compensator);
  recording::Recording out;
  out.source = input.worn->motion.name();
  for (std::size_t k = 0; k < reading[0].size(); ++k)
    out.t_s.push_back(static_cast<double>(k) * input.compensator.sample_period_s);
  for (std::size_t i = 0; i < input.compensator.inputs.size(); ++i)
    out.columns.push_back({input.compensator.inputs[i].name, reading[wiring.sensor[i]]});
  return out;
}

// A wearer whose pose was not held still holds both again, twice as long; empty: he gave it up.
identify::Held held(twin::TrialInput& input, std::uint64_t number) {
  for (const double held_s : kHeld_s) {
    input.worn = twin::Worn{poses(input.parameters, twin::seed_of(input.seed, number), held_s),
                            2 * held_s + kBetween_s};
    try {
      return identify::poses_in({"open", "fist"}, log_of(input, number), input.compensator);
    } catch (const io::JobError&) {
      continue;
    }
  }
  return {};
}

// What a compensator's sensors read where it was made; where it has none, what the first of the others has. All
// are recalibrated alike, so that what is compared is what they make of it.
model::Model with_readings_of(const std::vector<Compensator>& compensators, model::Model model) {
  const model::Wiring own = model::wiring_of(model);
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    model::Input& input = model.inputs[i];
    for (const Compensator& c : compensators) {
      const std::optional<std::size_t> other = model::wiring_of(c.model).input[own.sensor[i]];
      if (!other) continue;
      const model::Input& known = c.model.inputs[*other];
      if (!input.poses) input.poses = known.poses;
      if (!input.readings) input.readings = known.readings;
    }
  }
  return model;
}

std::vector<twin::Trial> play(const Plan& plan, const twin::TrialInput& input, std::uint64_t first,
                              int count) {
  return plan.engine != nullptr ? plan.engine->simulate(input, first, count)
                                : twin::simulate(input, first, count);
}

// A batch of trials of one motion: every compensator meets the same trials.
struct Job {
  std::size_t motion;
  int first;
  int count;
};
using JobRows = std::vector<std::vector<TrialRow>>;  // [compensator][trial]

Plan shard_of(Plan plan, std::size_t number, const std::vector<std::filesystem::path>& shards) {
  plan.shard = Shard{number + 1, shards.size()};
  plan.folder = shards[number];
  return plan;
}

class Runner {
 public:
  Runner(const Plan& plan, const TrialProgress& progress)
      : plan_(plan), progress_(progress), settings_(settings_of(plan)) {
    if (plan.engine != nullptr) batch_ = plan.engine->batch();
    const std::int64_t batches = (std::int64_t{plan.trials} + batch_ - 1) / batch_;
    jobs_ = plan.shard.value_or(Shard()).count(static_cast<std::size_t>(batches) * plan.motions.size());
    for (const twin::Motion& motion : plan.motions) {
      result_.motions.push_back(motion.name());
      for (const Compensator& c : plan.compensators) {
        Cell& cell = result_.cells.emplace_back();
        cell.motion = motion.name();
        cell.gesture = motion.number();
        cell.compensator = c.name;
        cell.difference_deg_s.resize(plan.compensators.size());
        cell.published_deg_s = published_error_deg_s(motion.number(), c.name);
      }
    }
    for (const Compensator& c : plan.compensators) result_.compensators.push_back(c.name);
  }

  // `shards`: where the rows are; none: they are played.
  Result run(const std::vector<std::filesystem::path>& shards) {
    std::optional<io::FolderLock> lock;
    if (!plan_.folder.empty() && plan_.lock == nullptr) lock.emplace(plan_.folder, "experiment");
    try {
      if (!plan_.folder.empty()) open_journal();
      shards.empty() ? play_all() : take_over(shards);
      if (journal_) write([&] { journal_->finish(); });
      if (journal_) seal(plan_.folder, settings_, journal_->digest());
    } catch (const io::Cancelled&) {
      throw io::Cancelled("stopped: " + kept());
    }
    return std::move(result_);
  }

  // How many of its batches the folder has, whole. Throws io::InputError: all, but not as they were written.
  std::size_t whole_jobs() {
    Journal journal = open();
    std::size_t whole = 0;
    for (JobRows rows; whole < jobs_ && read(journal, job(whole), rows); ++whole) journal.keep();
    if (whole == jobs_) require_sealed(plan_.folder, journal.digest());
    return whole;
  }
  std::size_t jobs() const { return jobs_; }

 private:
  Journal open() const { return {plan_.folder, settings_}; }

  void take_over(const std::vector<std::filesystem::path>& shards) {
    std::vector<Journal> journals;
    for (std::size_t i = 0; i < shards.size(); ++i)
      journals.push_back(Runner(shard_of(plan_, i, shards), {}).open());
    const std::size_t kept = committed_;
    JobRows rows;
    for (std::size_t number = 0; number < jobs_; ++number) {
      io::go_on();
      if (!read(journals[number % shards.size()], job(number), rows))
        throw io::JobError("{}: has changed meanwhile", shards[number % shards.size()].string());
      if (number >= kept) commit(number, rows);
    }
  }

  void play_all() {
    const auto start = std::chrono::steady_clock::now();
    result_.threads = io::threads_of(plan_.threads);
    io::run_in_order<JobRows>(
        committed_, jobs_, result_.threads, [this](std::size_t number) { return simulate(job(number)); },
        [this](std::size_t number, const JobRows& rows) { commit(number, rows); });
    result_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  // How much of everything is done and safe.
  std::string kept() const {
    std::int64_t of = 0;
    for (std::size_t number = 0; number < jobs_; ++number)
      of += static_cast<std::int64_t>(plan_.compensators.size()) * job(number).count;
    return plan_.folder.empty()
               ? fmt::format("{} of {} trials done, none kept without a folder", done_rows_, of)
               : fmt::format("{} of {} trials are kept in {}, and the same command goes on from there",
                             done_rows_, of, plan_.folder.string());
  }

  Job job(std::size_t number) const {
    number = plan_.shard.value_or(Shard()).item(number);
    const std::size_t motions = plan_.motions.size();
    const int first = static_cast<int>(number / motions) * batch_;
    return {number % motions, first, std::min(batch_, plan_.trials - first)};
  }

  // Takes over every whole job of the file.
  void open_journal() {
    journal_.emplace(open());
    for (JobRows rows; committed_ < jobs_ && read(*journal_, job(committed_), rows); ++committed_) {
      journal_->keep();
      take(job(committed_), rows);
      io::go_on();
    }
    result_.resumed_rows = done_rows_;
    write([&] { journal_->start(); });
  }

  bool read(Journal& journal, const Job& job, JobRows& rows) const {
    rows.assign(plan_.compensators.size(), std::vector<TrialRow>(static_cast<std::size_t>(job.count)));
    std::string line;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      int trial = job.first;
      for (TrialRow& row : rows[c]) {
        if (!journal.next(line) ||
            !parse_row(line, result_.motions[job.motion], result_.compensators[c], trial++, row))
          return false;
      }
    }
    return true;
  }

  template <class Write>
  void write(const Write& what) const {
    try {
      what();
    } catch (const io::JobError& error) {
      throw io::JobError(std::string(error.what()) + "; " + kept());
    }
  }

  void commit(std::size_t number, const JobRows& rows) {
    const Job now = job(number);
    if (journal_) write([&] { journal_->append(text(now, rows)); });
    take(now, rows);
    result_.simulated_s +=
        plan_.motions[now.motion].duration_s() * now.count * static_cast<double>(plan_.compensators.size());
    ++committed_;
    if (progress_) progress_(committed_, jobs_);
  }

  JobRows simulate(const Job& job) const {
    JobRows rows;
    for (const Compensator& c : plan_.compensators) {
      io::go_on();
      const twin::TrialInput input = first_input(plan_, plan_.motions[job.motion], c);
      std::vector<TrialRow>& out = rows.emplace_back();
      for (const twin::Trial& trial : trials(input, job)) out.push_back(row(trial));
    }
    return rows;
  }

  std::vector<twin::Trial> trials(const twin::TrialInput& input, const Job& job) const {
    const auto first = static_cast<std::uint64_t>(job.first);
    if (plan_.scenario.recalibrated.empty()) return play(plan_, input, first, job.count);
    std::vector<twin::Trial> out;
    for (std::uint64_t n = first; n < first + static_cast<std::uint64_t>(job.count); ++n) {
      io::go_on();
      out.push_back(twin::simulate_scalar(recalibrated(input, plan_.scenario.recalibrated, n), n, 1).front());
    }
    return out;
  }

  TrialRow row(const twin::Trial& trial) const {
    const score::TrialScore s =
        score::score_trial(trial.glove_deg, trial.hand_deg, 1 / plan_.parameters.camera_rate_hz);
    TrialRow r{s.total_error_deg_s, s.lag_removed,    {}, {}, trial.impact_deg_s, trial.pressed_s,
               trial.frames_sent,   trial.frames_lost};
    for (std::size_t i = 0; i < kFingers; ++i) {
      r.finger_deg_s[i] = s.finger_error_deg_s[i];
      const auto [least, most] = std::ranges::minmax(trial.hand_deg[i]);
      r.swing_deg[i] = static_cast<double>(most - least);
    }
    return r;
  }

  void take(const Job& job, const JobRows& rows) {
    done_rows_ += static_cast<std::int64_t>(rows.size()) * job.count;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      Cell& cell = result_.cells[job.motion * rows.size() + c];
      for (std::size_t t = 0; t < rows[c].size(); ++t) {
        const TrialRow& r = rows[c][t];
        cell.total_deg_s.add(r.total_deg_s);
        if (r.lag_removed) {
          cell.lag_removed_deg_s.add(r.lag_removed->total_error_deg_s);
          cell.lag_s.add(r.lag_removed->lag_s);
        }
        for (std::size_t i = 0; i < kFingers; ++i) {
          cell.finger_deg_s[i].add(r.finger_deg_s[i]);
          cell.swing_deg[i].add(r.swing_deg[i]);
          cell.impact_deg_s[i] = std::max(cell.impact_deg_s[i], r.impact_deg_s[i]);
          cell.pressed_s[i].add(r.pressed_s[i]);
        }
        for (std::size_t j = 0; j < rows.size(); ++j)
          cell.difference_deg_s[j].add(r.total_deg_s - rows[j][t].total_deg_s);
        cell.frames_sent += r.sent;
        cell.frames_lost += r.lost;
        cell.silent_trials += 2 * r.lost >= r.sent;
      }
    }
  }

  std::string text(const Job& job, const JobRows& rows) const {
    std::string out;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      int trial = job.first;
      for (const TrialRow& row : rows[c])
        out += text_of_row(result_.motions[job.motion], result_.compensators[c], trial++, row);
    }
    return out;
  }

  const Plan& plan_;
  const TrialProgress& progress_;
  const Json settings_;
  Result result_;
  int batch_ = twin::kTrialsAtOnce;
  std::size_t jobs_ = 0;
  std::int64_t done_rows_ = 0;
  std::optional<Journal> journal_;
  std::size_t committed_ = 0;
};

}  // namespace

void Statistic::add(double value) {
  ++count_;
  const double step = value - mean_;
  mean_ += step / count_;
  squares_ += step * (value - mean_);
}

std::optional<double> Statistic::ci95() const {
  if (count_ < 2) return std::nullopt;
  return score::student_t(count_ - 1) * std::sqrt(squares_ / (count_ - 1.0) / count_);
}

double Cell::total_pressed_s() const {
  double sum = 0;
  for (const Statistic& finger : pressed_s) sum += finger.mean();
  return sum;
}

void check(const Plan& plan) {
  if (plan.trials < 1) throw InputError("the number of trials must be at least 1");
  (void)io::threads_of(plan.threads);
  if (plan.motions.empty() || plan.compensators.empty())
    throw InputError("an experiment needs at least one gesture and one compensator");
  if (plan.scenario.worn_s > 0 && plan.engine != nullptr)
    throw InputError("engine {}: a glove that has been worn before its trial is the twin's alone",
                     plan.engine->name());
  if (plan.scenario.tracked && !tracking_of(plan.compensators))
    throw InputError(
        "no compensator has what its sensors read at the open hand and at the fist: nothing can be tracked");
  std::set<std::pair<std::string, std::string>> names;
  const auto name = [&](const char* what, const std::string& one) {
    require_name(one, what);
    if (!names.emplace(what, one).second)
      throw InputError("{} {}: there are two of that name; rename one", what, one);
  };
  for (const twin::Motion& motion : plan.motions) name("motion", motion.name());
  for (const Compensator& c : plan.compensators) {
    name("compensator", c.name);
    for (const twin::Motion& motion : plan.motions) twin::check(first_input(plan, motion, c));
  }
}

Result run(const Plan& plan, const TrialProgress& progress) {
  check(plan);
  if (plan.shard && plan.folder.empty()) throw InputError("a shard needs a folder of its own: --out");
  return Runner(plan, progress).run({});
}

Result merge(const Plan& plan, const std::vector<std::filesystem::path>& shards,
             const TrialProgress& progress) {
  check(plan);
  std::string missing;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    const Plan part = shard_of(plan, i, shards);
    Runner shard(part, progress);
    if (const std::size_t whole = shard.whole_jobs(); whole < shard.jobs())
      missing += fmt::format("{}{} has {} of its {} batches", missing.empty() ? "" : ", ", shards[i].string(),
                             whole, shard.jobs());
  }
  if (!missing.empty())
    throw InputError(missing + ": give that shard's command once more, it goes on from there");
  return Runner(plan, progress).run(shards);
}

Json settings_of(const Plan& plan) {
  Json compensators = Json::array();
  for (const Compensator& c : plan.compensators)
    compensators.push_back({{"name", c.name}, {"digest", io::digest(model::to_json(c.model))}});
  std::string motions;
  Json names = Json::array();
  for (const twin::Motion& m : plan.motions) {
    names.push_back(m.name());
    motions += Json(m).dump();
  }
  Json json = {{"version", FLEXOR_VERSION},
               {"rows_version", kRowsVersion},
               {"engine", plan.engine != nullptr ? plan.engine->name() : "twin"},
               {"seed", plan.seed},
               {"trials", plan.trials},
               {"motions", std::move(names)},
               {"motions_digest", io::digest(motions)},
               {"compensators", std::move(compensators)},
               {"twin", Json::parse(twin::to_json(plan.parameters))}};
  if (plan.scenario.worn_s > 0)
    json["worn"] = {{"for_s", plan.scenario.worn_s},
                    {"drift_turns_s", plan.scenario.drift_turns_s},
                    {"tracked", plan.scenario.tracked},
                    {"recalibrated", plan.scenario.recalibrated}};
  if (plan.shard) {
    json["shard"] = *plan.shard;
    json["plan"] = {{"scenarios", plan.scenarios}, {"motions", plan.motions}, {"models", Json::array()}};
    for (const Compensator& c : plan.compensators) json["plan"]["models"].push_back(c.model);
  }
  return json;
}

std::optional<twin::Tracking> tracking_of(const std::vector<Compensator>& compensators) {
  twin::Tracking out;
  for (const Compensator& c : compensators) {
    const model::Wiring wiring = model::wiring_of(c.model);
    const std::vector<std::optional<model::TrackedRange>> ranges = model::tracked_ranges(c.model);
    for (std::size_t i = 0; i < kFingers; ++i) {
      if (wiring.input[i] && !out.sensor[i]) out.sensor[i] = ranges[*wiring.input[i]];
    }
  }
  if (std::ranges::none_of(out.sensor, [](const auto& sensor) { return sensor.has_value(); }))
    return std::nullopt;
  return out;
}

twin::TrialInput recalibrated(twin::TrialInput input, const std::string& by, std::uint64_t number) {
  if (by != "poses" && by != "motion")
    throw io::InputError("recalibrated \"{}\": known are poses, motion", by);
  identify::RecalibrationRequest request;
  request.model = input.compensator;
  if (by == "motion") {
    input.worn = twin::Worn{short_motion(), kMotion_s};
    request.motion.push_back(identify::motion_in(log_of(input, number), request.model));
  } else {
    request.held = held(input, number);
  }
  if (!request.motion.empty() || !request.held.empty())
    input.compensator = identify::recalibrate(request).model;
  return input;
}

twin::TrialInput first_input(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  twin::TrialInput input{plan.parameters, motion, compensator.model, plan.seed};
  // Each motion has trials of its own, whichever others are in the plan.
  for (const char c : motion.name()) input.seed = twin::seed_of(input.seed, static_cast<unsigned char>(c));
  const Scenario& s = plan.scenario;
  if (s.worn_s > 0) input.worn = twin::Worn{ordinary_motion(), s.worn_s, s.drift_turns_s};
  if (s.tracked) input.tracking = tracking_of(plan.compensators);
  if (!s.recalibrated.empty())
    input.compensator = with_readings_of(plan.compensators, std::move(input.compensator));
  return input;
}

twin::Trial first_trial(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  io::go_on();
  return play(plan, first_input(plan, motion, compensator), 0, 1).front();
}

}  // namespace flexor::study
