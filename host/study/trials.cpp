#include "host/study/trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <set>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/run_in_order.hpp"
#include "host/model/wiring.hpp"
#include "host/score/judge.hpp"
#include "host/score/trial.hpp"
#include "host/study/log_rms.hpp"
#include "host/study/null_model.hpp"
#include "host/study/recalibrated.hpp"
#include "host/study/shape_check.hpp"
#include "host/study/trial_row.hpp"
#include "host/twin/exact_json.hpp"
#include "host/twin/random.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

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

// Each motion has trials of its own, whichever others are in the plan.
std::uint64_t seed_of_motion(std::uint64_t seed, const std::string& name) {
  for (const char c : name) seed = twin::seed_of(seed, static_cast<unsigned char>(c));
  return seed;
}

Plan shard_of(Plan plan, std::size_t number, const std::vector<std::filesystem::path>& shards) {
  plan.shard = {number + 1, shards.size()};
  plan.folder = shards[number];
  return plan;
}

class Runner {
 public:
  Runner(const Plan& plan, const TrialProgress& progress) : plan_(plan), progress_(progress) {
    if (plan.engine != nullptr) batch_ = plan.engine->batch();
    const std::int64_t batches = (std::int64_t{plan.trials} + batch_ - 1) / batch_;
    jobs_ = plan.shard.count(static_cast<std::size_t>(batches) * plan.motions.size());
    for (const twin::Motion& motion : plan.motions) {
      result_.motions.push_back(motion.name());
      for (const Compensator& c : plan.compensators) {
        Cell cell;
        cell.motion = motion.name();
        cell.gesture = motion.number();
        cell.compensator = c.name;
        cell.difference_deg_s.resize(plan.compensators.size());
        cell.published_deg_s = published_error_deg_s(motion.number(), c.name);
        result_.cells.push_back(std::move(cell));
      }
    }
    for (const Compensator& c : plan.compensators) result_.compensators.push_back(c.name);
  }

  // `shards`: where the rows are; none: they are played.
  Result run(const std::vector<std::filesystem::path>& shards) {
    std::optional<io::FolderLock> lock;
    if (!plan_.folder.empty() && plan_.lock == nullptr) lock.emplace(plan_.folder);
    try {
      if (!plan_.folder.empty()) open_journal();
      shards.empty() ? play_all() : take_over(shards);
      if (journal_) write([&] { journal_->finish(); });
      if (plan_.shard.of > 1) seal(plan_.folder, settings_of(plan_), digest_);
    } catch (const std::exception&) {
      // An interruption ends compilers and the like, too: that they failed then is no news.
      if (is_stopped()) throw io::Cancelled(stopped());
      throw;
    }
    result_.distance = {distance(1, kLastFittedGesture), distance(kLastFittedGesture + 1, kLastGesture),
                        distance(1, kLastGesture)};
    return std::move(result_);
  }

  // How many of its batches the folder has, whole. Throws io::InputError: all, but not as they were written.
  std::size_t whole_jobs() {
    Journal journal(plan_.folder, settings_of(plan_), header_of_rows());
    std::size_t whole = 0;
    for (JobRows rows; whole < jobs_ && read(journal, job(whole), rows); ++whole)
      add_to_digest(text(job(whole), rows));
    if (whole == jobs_) require_sealed(plan_.folder, digest_);
    return whole;
  }
  std::size_t jobs() const { return jobs_; }

 private:
  void take_over(const std::vector<std::filesystem::path>& shards) {
    std::deque<Journal> journals;
    for (std::size_t i = 0; i < shards.size(); ++i)
      journals.emplace_back(shards[i], settings_of(shard_of(plan_, i, shards)), header_of_rows());
    const std::size_t kept = committed_;
    JobRows rows;
    for (std::size_t number = 0; number < jobs_; ++number) {
      go_on();
      if (!read(journals[number % shards.size()], job(number), rows))
        throw io::JobError(fmt::format("{}: has changed meanwhile", shards[number % shards.size()].string()));
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

  bool is_stopped() const { return plan_.stop != nullptr && plan_.stop->load(); }

  void go_on() const {
    if (is_stopped()) throw io::Cancelled("");
  }

  // How much of everything is done and safe.
  std::string kept() const {
    std::int64_t of = 0;
    for (std::size_t number = 0; number < jobs_; ++number)
      of += static_cast<std::int64_t>(plan_.compensators.size()) * job(number).count;
    if (plan_.folder.empty())
      return fmt::format("{} of {} trials done, none kept without a folder", done_rows_, of);
    return fmt::format("{} of {} trials are kept in {}, and the same command goes on from there", done_rows_,
                       of, plan_.folder.string());
  }

  std::string stopped() const { return "stopped: " + kept(); }

  Job job(std::size_t number) const {
    number = plan_.shard.item(number);
    const std::size_t motions = plan_.motions.size();
    const int first = static_cast<int>(number / motions) * batch_;
    return {number % motions, first, std::min(batch_, plan_.trials - first)};
  }

  // Takes over every whole job of the file.
  void open_journal() {
    journal_.emplace(plan_.folder, settings_of(plan_), header_of_rows());
    for (JobRows rows; committed_ < jobs_ && read(*journal_, job(committed_), rows); ++committed_) {
      journal_->keep();
      take(job(committed_), rows);
      go_on();
    }
    result_.resumed_rows = done_rows_;
    write([&] { journal_->start(); });
  }

  bool read(Journal& journal, const Job& job, JobRows& rows) const {
    rows.assign(plan_.compensators.size(), std::vector<TrialRow>(static_cast<std::size_t>(job.count)));
    std::string line;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      for (int t = 0; t < job.count; ++t) {
        if (!journal.next(line)) return false;
        if (!parse_row(line, result_.motions[job.motion], result_.compensators[c], job.first + t,
                       rows[c][static_cast<std::size_t>(t)])) {
          return false;
        }
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
      go_on();
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
      go_on();
      out.push_back(twin::simulate_scalar(recalibrated(input, plan_.scenario.recalibrated, n), n, 1).front());
    }
    return out;
  }

  TrialRow row(const twin::Trial& trial) const {
    const score::TrialScore s =
        score::score_trial(trial.glove_deg, trial.hand_deg, 1 / plan_.parameters.camera_rate_hz);
    TrialRow r;
    r.total_deg_s = s.total_error_deg_s;
    r.lag_removed = s.lag_removed;
    r.sent = trial.frames_sent;
    r.lost = trial.frames_lost;
    r.impact_deg_s = trial.impact_deg_s;
    r.pressed_s = trial.pressed_s;
    for (std::size_t i = 0; i < kFingers; ++i) {
      r.finger_deg_s[i] = s.finger_error_deg_s[i];
      const auto [least, most] = std::ranges::minmax(trial.hand_deg[i]);
      r.swing_deg[i] = static_cast<double>(most - least);
    }
    return r;
  }

  void add_to_digest(const std::string& rows) { digest_ = io::digest(digest_ + rows); }

  void take(const Job& job, const JobRows& rows) {
    if (plan_.shard.of > 1) add_to_digest(text(job, rows));
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
        for (std::size_t j = 0; j < rows.size(); ++j) {
          cell.difference_deg_s[j].add(r.total_deg_s - rows[j][t].total_deg_s);
        }
        cell.frames_sent += r.sent;
        cell.frames_lost += r.lost;
        cell.silent_trials += 2 * r.lost >= r.sent;
      }
    }
  }

  std::string text(const Job& job, const JobRows& rows) const {
    std::string out;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      for (std::size_t t = 0; t < rows[c].size(); ++t) {
        out += text_of_row(result_.motions[job.motion], result_.compensators[c],
                           job.first + static_cast<int>(t), rows[c][t]);
      }
    }
    return out;
  }

  std::optional<Distance> distance(int from, int to) const {
    std::set<int> gestures;
    Distance out;
    const NullModel null = null_model();
    LogRms ours;
    LogRms constants;
    for (const Cell& cell : result_.cells) {
      if (!cell.published_deg_s || cell.gesture < from || cell.gesture > to) continue;
      ours.add(cell.total_deg_s.mean(), *cell.published_deg_s);
      constants.add(null.error_deg_s.at(cell.compensator), *cell.published_deg_s);
      gestures.insert(cell.gesture);
      if (std::ranges::find(out.compensators, cell.compensator) == out.compensators.end())
        out.compensators.push_back(cell.compensator);
    }
    if (ours.count() == 0) return std::nullopt;
    out.log_rms = ours.value();
    out.null_log_rms = constants.value();
    out.gestures.assign(gestures.begin(), gestures.end());
    out.is_all = static_cast<int>(out.gestures.size()) == to - from + 1;
    return out;
  }

  const Plan& plan_;
  const TrialProgress& progress_;
  Result result_;
  int batch_ = twin::kTrialsAtOnce;
  std::size_t jobs_ = 0;
  std::int64_t done_rows_ = 0;
  std::optional<Journal> journal_;
  std::size_t committed_ = 0;
  std::string digest_;  // of a shard's rows, batch by batch
};

Json statistic_json(const Statistic& s) {
  const std::optional<double> half = s.ci95();
  return {{"mean", s.mean()}, {"ci95", half ? Json(*half) : Json(nullptr)}};
}

template <class Value>
Json by_finger(const Value& value) {
  Json out = Json::object();
  for (std::size_t i = 0; i < kFingers; ++i) out[model::finger_names()[i]] = value(i);
  return out;
}

Json cell_json(const Cell& c, const std::vector<std::string>& compensators) {
  const auto if_any = [](const Statistic& s) { return s.count() > 0 ? statistic_json(s) : Json(nullptr); };
  Json differences = Json::object();
  for (std::size_t j = 0; j < compensators.size(); ++j) {
    if (compensators[j] != c.compensator)
      differences[compensators[j]] = statistic_json(c.difference_deg_s[j]);
  }
  return {{"gesture", c.gesture > 0 ? Json(c.gesture) : Json(c.motion)},
          {"compensator", c.compensator},
          {"trials", c.total_deg_s.count()},
          {"total_error_deg_s", statistic_json(c.total_deg_s)},
          {"lag_removed_deg_s", if_any(c.lag_removed_deg_s)},
          {"lag_s", if_any(c.lag_s)},
          {"trials_with_a_lag", c.lag_s.count()},
          {"published_deg_s", c.published_deg_s ? Json(*c.published_deg_s) : Json(nullptr)},
          {"finger_error_deg_s", by_finger([&](std::size_t i) { return c.finger_deg_s[i].mean(); })},
          {"swing_deg", by_finger([&](std::size_t i) { return c.swing_deg[i].mean(); })},
          {"difference_deg_s", std::move(differences)},
          {"impact_deg_s", by_finger([&](std::size_t i) { return c.impact_deg_s[i]; })},
          {"pressed_s", by_finger([&](std::size_t i) { return c.pressed_s[i].mean(); })},
          {"frames_sent", c.frames_sent},
          {"frames_lost", c.frames_lost}};
}

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

double Cell::fastest_impact_deg_s() const { return *std::ranges::max_element(impact_deg_s); }

double Cell::total_pressed_s() const {
  double sum = 0;
  for (const Statistic& finger : pressed_s) sum += finger.mean();
  return sum;
}

std::vector<std::string> warnings(const Result& result, const Plan& plan) {
  const twin::Parameters& p = plan.parameters;
  const double period_s = plan.compensators.front().model.sample_period_s;
  const double frame_s = p.frame_rate_hz > 0 ? std::max(1 / p.frame_rate_hz, period_s) : period_s;
  const double delay_ms = 1000 * (p.module_latency_s + p.jitter_s);
  const double greatest_ms = link::greatest_delay_ms(1000 * frame_s);
  std::vector<std::string> out;
  if (plan.engine == nullptr && delay_ms > greatest_ms)
    out.push_back(
        fmt::format("the radio delays by {:g} ms (radio.module_latency_s, radio.jitter_s): the firmware's "
                    "guarded link follows up to {:g} ms, the twin has no such limit",
                    delay_ms, greatest_ms));
  const auto cell = std::ranges::find_if(result.cells, [](const Cell& c) { return c.silent_trials > 0; });
  if (cell == result.cells.end()) return out;
  const auto silent = std::ranges::count_if(result.cells, [](const Cell& c) { return c.silent_trials > 0; });
  out.push_back(fmt::format(
      "{} with {}{}: at most half of the frames reached the hand in {} of {} trials: its error is the "
      "radio's, no "
      "compensator's; see radio.* of the twin, and runtime/link/PROTOCOL.md for the greatest delay",
      cell->motion, cell->compensator, silent > 1 ? fmt::format(" and {} others", silent - 1) : "",
      cell->silent_trials, cell->total_deg_s.count()));
  return out;
}

std::string describe(const Distance& d) {
  const bool in_a_row = d.gestures.back() - d.gestures.front() + 1 == static_cast<int>(d.gestures.size());
  std::string out = d.gestures.size() == 1 ? fmt::format("gesture {}", d.gestures.front())
                    : in_a_row ? fmt::format("gestures {}-{}", d.gestures.front(), d.gestures.back())
                               : fmt::format("gestures {}", fmt::join(d.gestures, ", "));
  if (d.compensators.size() < kPublishedCompensators)
    out += fmt::format(" with {}", fmt::join(d.compensators, ", "));
  return out;
}

void check(const Plan& plan) {
  if (plan.trials < 1) throw InputError("the number of trials must be at least 1");
  (void)io::threads_of(plan.threads);
  if (plan.motions.empty() || plan.compensators.empty()) {
    throw InputError("an experiment needs at least one gesture and one compensator");
  }
  if (plan.scenario.worn_s > 0 && plan.engine != nullptr)
    throw InputError(fmt::format("engine {}: a glove that has been worn before its trial is the twin's alone",
                                 plan.engine->name()));
  if (plan.scenario.tracked && !tracking_of(plan.compensators))
    throw InputError(
        "no compensator says what its strips read at the open hand and at the fist: nothing can be tracked");
  std::set<std::string> names;
  for (const twin::Motion& motion : plan.motions) {
    require_name(motion.name(), "motion");
    if (!names.insert(motion.name()).second)
      throw InputError(fmt::format("motion {}: there are two of that name; rename one", motion.name()));
  }
  names.clear();
  for (const Compensator& c : plan.compensators) {
    require_name(c.name, "compensator");
    if (!names.insert(c.name).second)
      throw InputError(fmt::format("compensator {}: there are two of that name; rename one", c.name));
    for (const twin::Motion& motion : plan.motions) twin::check(first_input(plan, motion, c));
  }
}

Result run(const Plan& plan, const TrialProgress& progress) {
  check(plan);
  if (plan.shard.of > 1 && plan.folder.empty()) throw InputError("a shard needs a folder of its own: --out");
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

std::string settings_of(const Plan& plan) {
  Json compensators = Json::array();
  for (const Compensator& c : plan.compensators) {
    compensators.push_back({{"name", c.name}, {"digest", io::digest(model::to_json(c.model))}});
  }
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
  if (plan.scenario.worn_s > 0) {
    json["worn"] = {{"for_s", plan.scenario.worn_s},
                    {"drift_turns_s", plan.scenario.drift_turns_s},
                    {"tracked", plan.scenario.tracked},
                    {"recalibrated", plan.scenario.recalibrated}};
  }
  if (plan.shard.of > 1) {
    json["shard"] = {{"index", plan.shard.index}, {"of", plan.shard.of}};
    json["plan"] = {{"scenarios", plan.scenarios}, {"motions", plan.motions}, {"models", Json::array()}};
    for (const Compensator& c : plan.compensators) json["plan"]["models"].push_back(c.model);
  }
  return io::dump(json);
}

std::optional<twin::Tracking> tracking_of(const std::vector<Compensator>& compensators) {
  twin::Tracking out;
  for (const Compensator& c : compensators) {
    const model::Wiring wiring = model::wiring_of(c.model);
    const std::vector<std::optional<model::TrackedRange>> ranges = model::tracked_ranges(c.model);
    for (std::size_t i = 0; i < kFingers; ++i) {
      if (wiring.input[i] && !out.strip[i]) out.strip[i] = ranges[*wiring.input[i]];
    }
  }
  if (std::ranges::none_of(out.strip, [](const auto& strip) { return strip.has_value(); }))
    return std::nullopt;
  return out;
}

twin::TrialInput first_input(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  twin::TrialInput input{plan.parameters, motion, compensator.model, seed_of_motion(plan.seed, motion.name()),
                         false};
  const Scenario& s = plan.scenario;
  if (s.worn_s > 0) input.worn = twin::Worn{ordinary_motion(), s.worn_s, s.drift_turns_s};
  if (s.tracked) input.tracking = tracking_of(plan.compensators);
  if (!s.recalibrated.empty())
    input.compensator = with_readings_of(plan.compensators, std::move(input.compensator));
  return input;
}

twin::Trial first_trial(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  if (plan.stop != nullptr && plan.stop->load()) throw io::Cancelled("stopped");
  return play(plan, first_input(plan, motion, compensator), 0, 1).front();
}

Json to_json(const Result& r, const Plan& plan) {
  const auto whole = [](const std::optional<Distance>& d) {
    return d && d->is_all ? Json(d->log_rms) : Json(nullptr);
  };
  const auto part = [](const std::optional<Distance>& d) {
    return d ? Json{{"gestures", d->gestures},
                    {"compensators", d->compensators},
                    {"log_rms", d->log_rms},
                    {"null_model_log_rms", d->null_log_rms}}
             : Json(nullptr);
  };
  Json cells = Json::array();
  for (const Cell& c : r.cells) cells.push_back(cell_json(c, r.compensators));
  return {{"cells", std::move(cells)},
          {"log_rms",
           {{"gestures_1_to_4", whole(r.distance.fitted)},
            {"gestures_5_and_6", whole(r.distance.not_fitted)},
            {"all", whole(r.distance.all)},
            {"fitted", part(r.distance.fitted)},
            {"not_fitted", part(r.distance.not_fitted)}}},
          {"null_model", to_json(null_model())},
          {"shapes", to_json(shape_checks(r, plan))},
          {"engine", plan.engine != nullptr ? plan.engine->name() : "twin"},
          {"rate_hz", 1 / plan.compensators.front().model.sample_period_s},
          {"seed", plan.seed},
          {"warnings", warnings(r, plan)},
          {"version", FLEXOR_VERSION}};
}

}  // namespace flexor::study
