#include "host/experiment/trials.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/score/trial.hpp"
#include "host/twin/random.hpp"

namespace flexor::experiment {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

// Two-sided 95 % quantile of Student's t.
double student_t(int degrees) {
  constexpr double kTable[] = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  if (degrees <= 10) return kTable[degrees - 1];
  const double z = 1.959964;
  const double n = degrees;
  return z + (z * z * z + z) / (4 * n) + (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96 * n * n);
}

struct Row {
  double total_deg_s = 0;
  double lag_removed_deg_s = 0;
  double lag_s = 0;
  std::array<double, kFingers> finger_deg_s{};
  double excess_deg = 0;
  int sent = 0;
  int lost = 0;
};

// trials.csv, in the order of jobs.
class Log {
 public:
  static std::string header() {
    std::string out = "motion,compensator,trial,total_error_deg_s,lag_removed_deg_s,lag_s";
    for (const std::string& finger : model::finger_names()) out += fmt::format(",{}_error_deg_s", finger);
    return out + ",outside_limits_deg,frames_sent,frames_lost\n";
  }

  static std::string text(const std::string& motion, const std::string& compensator, int trial,
                          const Row& r) {
    std::string out = fmt::format("{},{},{},{},{},{}", motion, compensator, trial, r.total_deg_s,
                                  r.lag_removed_deg_s, r.lag_s);
    for (const double e : r.finger_deg_s) out += fmt::format(",{}", e);
    return out + fmt::format(",{},{},{}\n", r.excess_deg, r.sent, r.lost);
  }

  // One complete line back to numbers; false if it is not one of ours.
  static bool parse(const std::string& line, const std::string& motion, const std::string& compensator,
                    int trial, Row& r) {
    const std::string start = fmt::format("{},{},{},", motion, compensator, trial);
    if (!line.starts_with(start)) return false;
    const char* at = line.data() + start.size();
    const char* const end = line.data() + line.size();
    const auto next = [&](auto& value) {
      const auto [stop, error] = std::from_chars(at, end, value);
      at = stop + (stop < end ? 1 : 0);
      return error == std::errc();
    };
    bool good = next(r.total_deg_s) && next(r.lag_removed_deg_s) && next(r.lag_s);
    for (double& e : r.finger_deg_s) good = good && next(e);
    return good && next(r.excess_deg) && next(r.sent) && next(r.lost) && at == end;
  }
};

std::vector<twin::Trial> play(const Plan& plan, const twin::Setup& setup, std::uint64_t first, int count) {
  return plan.engine != nullptr ? plan.engine->simulate(setup, first, count)
                                : twin::simulate(setup, first, count);
}

// A batch of trials of one motion: every compensator meets the same trials.
struct Job {
  std::size_t motion;
  int first;
  int count;
};
using JobRows = std::vector<std::vector<Row>>;  // [compensator][trial]

// Each motion has trials of its own, whichever others are in the plan.
std::uint64_t seed_of_motion(std::uint64_t seed, const std::string& name) {
  for (const char c : name) seed = twin::seed_of(seed, static_cast<unsigned char>(c));
  return seed;
}

class Runner {
 public:
  Runner(const Plan& plan, const TrialProgress& progress) : plan_(plan), progress_(progress) {
    const int batch = plan.engine != nullptr ? plan.engine->batch() : twin::kTrialsAtOnce;
    for (int first = 0; first < plan.trials; first += batch) {
      for (std::size_t m = 0; m < plan.motions.size(); ++m) {
        jobs_.push_back({m, first, std::min(batch, plan.trials - first)});
      }
    }
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

  Result run() {
    check_plan();
    if (!plan_.folder.empty()) open_folder();
    const auto start = std::chrono::steady_clock::now();
    result_.threads =
        plan_.threads > 0 ? plan_.threads : static_cast<int>(std::thread::hardware_concurrency());
    result_.threads = std::clamp(result_.threads, 1, 256);
    next_ = committed_;
    {
      std::vector<std::jthread> workers;
      for (int i = 0; i < result_.threads; ++i) workers.emplace_back([this] { work(); });
    }
    if (failure_) std::rethrow_exception(failure_);
    result_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    result_.log_rms = log_rms();
    return std::move(result_);
  }

 private:
  void check_plan() const {
    if (plan_.trials < 1) throw InputError("the number of trials must be at least 1");
    if (plan_.threads < 0) throw InputError("the number of threads must not be negative");
    if (plan_.motions.empty() || plan_.compensators.empty()) {
      throw InputError("an experiment needs at least one gesture and one compensator");
    }
    for (const Compensator& c : plan_.compensators) {
      const twin::Setup setup{plan_.parameters, plan_.motions.front(), c.model, plan_.seed, false};
      twin::check(setup);
      if (plan_.engine != nullptr) plan_.engine->prepare(setup);
      if (c.name.find_first_of(",\n\"") != std::string::npos) {
        throw InputError(fmt::format(
            "compensator {}: a name with a comma or a quote cannot stand in a CSV; rename it", c.name));
      }
    }
  }

  // What must be the same for a run to go on.
  std::string identity() const {
    Json compensators = Json::array();
    for (const Compensator& c : plan_.compensators) {
      compensators.push_back({{"name", c.name}, {"digest", io::digest(model::to_json(c.model))}});
    }
    std::string motions;
    for (const twin::Motion& m : plan_.motions) {
      motions += m.name() + fmt::format(" {}", m.duration_s());
      for (int k = 0; k * 0.05 <= m.duration_s(); ++k) {
        for (int i = 0; i < kFingers; ++i) motions += fmt::format(" {:.3f}", m.angle(i, k * 0.05, {}));
      }
    }
    const Json json = {{"version", FLEXOR_VERSION},
                       {"engine", plan_.engine != nullptr ? plan_.engine->name() : "twin"},
                       {"seed", plan_.seed},
                       {"trials", plan_.trials},
                       {"motions", result_.motions},
                       {"motions_digest", io::digest(motions)},
                       {"compensators", std::move(compensators)},
                       {"twin", Json::parse(twin::to_json(plan_.parameters))}};
    return io::dump(json);
  }

  void open_folder() {
    io::make_folder(plan_.folder);
    const auto run_path = plan_.folder / "run.json";
    const auto csv_path = plan_.folder / "trials.csv";
    const std::string mine = identity();
    if (std::filesystem::exists(run_path)) {
      if (io::read_file(run_path) != mine) {
        throw InputError(
            fmt::format("{} holds the results of other settings (see run.json there): choose another folder "
                        "or remove it",
                        plan_.folder.string()));
      }
      if (std::filesystem::exists(csv_path)) resume(csv_path);
    } else {
      io::write_file(run_path, mine);
    }
    csv_.open(csv_path, std::ios::binary | std::ios::app);
    if (committed_ == 0) csv_ << Log::header();
    csv_.flush();
    if (!csv_) throw InputError(fmt::format("{}: cannot be written", csv_path.string()));
  }

  // Takes over every whole job of the file and cuts off what follows.
  void resume(const std::filesystem::path& csv_path) {
    std::istringstream text(io::read_file(csv_path));
    std::string line;
    std::uintmax_t good_bytes = 0;
    if (!std::getline(text, line) || line + "\n" != Log::header()) {
      std::filesystem::resize_file(csv_path, 0);
      return;
    }
    good_bytes = line.size() + 1;
    for (const Job& job : jobs_) {
      JobRows rows(plan_.compensators.size(), std::vector<Row>(static_cast<std::size_t>(job.count)));
      std::uintmax_t bytes = 0;
      for (std::size_t c = 0; c < rows.size(); ++c) {
        for (int t = 0; t < job.count; ++t) {
          if (!std::getline(text, line) || text.eof() ||
              !Log::parse(line, result_.motions[job.motion], result_.compensators[c], job.first + t,
                          rows[c][static_cast<std::size_t>(t)])) {
            std::filesystem::resize_file(csv_path, good_bytes);
            return;
          }
          bytes += line.size() + 1;
        }
      }
      good_bytes += bytes;
      take(job, rows);
      ++committed_;
      result_.resumed_rows += job.count * static_cast<int>(rows.size());
    }
    std::filesystem::resize_file(csv_path, good_bytes);
  }

  void work() {
    try {
      for (;;) {
        std::size_t mine = 0;
        {
          // Not too far ahead of the slowest: what waits for its turn takes memory.
          std::unique_lock lock(mutex_);
          moved_.wait(lock, [&] { return failure_ || next_ < committed_ + kAhead * plan_threads(); });
          if (failure_ || next_ >= jobs_.size()) return;
          mine = next_++;
        }
        JobRows rows = simulate(jobs_[mine]);
        const std::lock_guard lock(mutex_);
        waiting_.emplace(mine, std::move(rows));
        commit();
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      moved_.notify_all();
    }
  }

  std::size_t plan_threads() const { return static_cast<std::size_t>(result_.threads); }

  void commit() {
    while (!waiting_.empty() && waiting_.begin()->first == committed_) {
      const Job& job = jobs_[committed_];
      const JobRows rows = std::move(waiting_.begin()->second);
      waiting_.erase(waiting_.begin());
      take(job, rows);
      if (csv_.is_open()) write(job, rows);
      result_.simulated_s +=
          plan_.motions[job.motion].duration_s() * job.count * static_cast<double>(plan_.compensators.size());
      ++committed_;
      if (progress_) progress_(committed_, jobs_.size());
    }
    moved_.notify_all();
  }

  JobRows simulate(const Job& job) const {
    JobRows rows;
    for (const Compensator& c : plan_.compensators) {
      const twin::Motion& motion = plan_.motions[job.motion];
      const twin::Setup setup{plan_.parameters, motion, c.model, seed_of_motion(plan_.seed, motion.name()),
                              false};
      std::vector<Row>& out = rows.emplace_back();
      for (const twin::Trial& trial : play(plan_, setup, static_cast<std::uint64_t>(job.first), job.count)) {
        out.push_back(row(trial));
      }
    }
    return rows;
  }

  Row row(const twin::Trial& trial) const {
    const score::TrialScore s =
        score::score_trial(trial.glove_deg, trial.hand_deg, 1 / plan_.parameters.camera_rate_hz);
    Row r;
    r.total_deg_s = s.total_error_deg_s;
    r.lag_removed_deg_s = s.lag_removed_deg_s;
    r.lag_s = s.lag_s;
    r.sent = trial.frames_sent;
    r.lost = trial.frames_lost;
    for (std::size_t i = 0; i < kFingers; ++i) {
      r.finger_deg_s[i] = s.finger_error_deg_s[i];
      r.excess_deg = std::max({r.excess_deg, plan_.parameters.hand_lower_deg[i] - trial.hand_min_deg[i],
                               trial.hand_max_deg[i] - plan_.parameters.hand_upper_deg[i]});
    }
    return r;
  }

  void take(const Job& job, const JobRows& rows) {
    for (std::size_t c = 0; c < rows.size(); ++c) {
      Cell& cell = result_.cells[job.motion * rows.size() + c];
      for (std::size_t t = 0; t < rows[c].size(); ++t) {
        const Row& r = rows[c][t];
        cell.total_deg_s.add(r.total_deg_s);
        cell.lag_removed_deg_s.add(r.lag_removed_deg_s);
        cell.lag_s.add(r.lag_s);
        for (std::size_t i = 0; i < kFingers; ++i) cell.finger_deg_s[i].add(r.finger_deg_s[i]);
        for (std::size_t j = 0; j < rows.size(); ++j) {
          cell.difference_deg_s[j].add(r.total_deg_s - rows[j][t].total_deg_s);
        }
        cell.worst_excess_deg = std::max(cell.worst_excess_deg, r.excess_deg);
        cell.frames_sent += r.sent;
        cell.frames_lost += r.lost;
      }
    }
  }

  void write(const Job& job, const JobRows& rows) {
    std::string text;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      for (std::size_t t = 0; t < rows[c].size(); ++t) {
        text += Log::text(result_.motions[job.motion], result_.compensators[c],
                          job.first + static_cast<int>(t), rows[c][t]);
      }
    }
    csv_ << text;
    csv_.flush();
    if (!csv_)
      throw io::JobError(
          fmt::format("{}: cannot be written; is the disk full?", (plan_.folder / "trials.csv").string()));
  }

  LogRms log_rms() const {
    const auto over = [&](int from, int to) -> std::optional<double> {
      double sum = 0;
      int n = 0;
      for (const Cell& cell : result_.cells) {
        if (!cell.published_deg_s || cell.gesture < from || cell.gesture > to) continue;
        const double l = std::log(cell.total_deg_s.mean() / *cell.published_deg_s);
        sum += l * l;
        ++n;
      }
      if (n == 0) return std::nullopt;
      return std::sqrt(sum / n);
    };
    return {over(1, 4), over(5, 6), over(1, 6)};
  }

  static constexpr std::size_t kAhead = 8;

  const Plan& plan_;
  const TrialProgress& progress_;
  Result result_;
  std::vector<Job> jobs_;
  std::ofstream csv_;

  std::mutex mutex_;
  std::condition_variable moved_;
  std::size_t next_ = 0;
  std::size_t committed_ = 0;
  std::map<std::size_t, JobRows> waiting_;
  std::exception_ptr failure_;
};

}  // namespace

void Statistic::add(double value) {
  ++count_;
  const double step = value - mean_;
  mean_ += step / count_;
  squares_ += step * (value - mean_);
}

double Statistic::ci95() const {
  if (count_ < 2) return 0;
  return student_t(count_ - 1) * std::sqrt(squares_ / (count_ - 1.0) / count_);
}

Result run(const Plan& plan, const TrialProgress& progress) { return Runner(plan, progress).run(); }

twin::Setup first_setup(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  return {plan.parameters, motion, compensator.model, seed_of_motion(plan.seed, motion.name()), false};
}

twin::Trial first_trial(const Plan& plan, const twin::Motion& motion, const Compensator& compensator) {
  const twin::Setup setup = first_setup(plan, motion, compensator);
  if (plan.engine != nullptr) plan.engine->prepare(setup);
  return play(plan, setup, 0, 1).front();
}

Json to_json(const Result& r, const Plan& plan) {
  const auto statistic = [](const Statistic& s) { return Json{{"mean", s.mean()}, {"ci95", s.ci95()}}; };
  const auto optional = [](const std::optional<double>& v) { return v ? Json(*v) : Json(nullptr); };
  Json cells = Json::array();
  for (const Cell& c : r.cells) {
    Json fingers = Json::object();
    for (std::size_t i = 0; i < kFingers; ++i) fingers[model::finger_names()[i]] = c.finger_deg_s[i].mean();
    Json differences = Json::object();
    for (std::size_t j = 0; j < r.compensators.size(); ++j) {
      if (r.compensators[j] != c.compensator)
        differences[r.compensators[j]] = statistic(c.difference_deg_s[j]);
    }
    cells.push_back({{"gesture", c.gesture > 0 ? Json(c.gesture) : Json(c.motion)},
                     {"compensator", c.compensator},
                     {"trials", c.total_deg_s.count()},
                     {"total_error_deg_s", statistic(c.total_deg_s)},
                     {"lag_removed_deg_s", statistic(c.lag_removed_deg_s)},
                     {"lag_s", statistic(c.lag_s)},
                     {"published_deg_s", optional(c.published_deg_s)},
                     {"finger_error_deg_s", std::move(fingers)},
                     {"difference_deg_s", std::move(differences)},
                     {"outside_limits_deg", c.worst_excess_deg},
                     {"frames_sent", c.frames_sent},
                     {"frames_lost", c.frames_lost}});
  }
  return {{"cells", std::move(cells)},
          {"log_rms",
           {{"gestures_1_to_4", optional(r.log_rms.gestures_1_to_4)},
            {"gestures_5_and_6", optional(r.log_rms.gestures_5_and_6)},
            {"all", optional(r.log_rms.all)}}},
          {"real_time_factor", r.simulated_s > 0 ? Json(r.real_time_factor()) : Json(nullptr)},
          {"engine", plan.engine != nullptr ? plan.engine->name() : "twin"},
          {"threads", r.threads},
          {"resumed_rows", r.resumed_rows},
          {"rate_hz", 1 / plan.compensators.front().model.sample_period_s},
          {"seed", plan.seed},
          {"version", FLEXOR_VERSION}};
}

}  // namespace flexor::experiment
