#include "host/study/ensemble_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/study/glove_fit.hpp"
#include "host/study/log_rms.hpp"
#include "host/study/null_model.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFile = "laboratories.csv";

class Laboratories {
 public:
  Laboratories(const EnsemblePlan& plan, const TrialProgress& progress) : plan_(plan), progress_(progress) {
    for (const twin::Motion& motion : plan.plan.motions) {
      result_.motions.push_back(motion.name());
      result_.gestures.push_back(motion.number());
    }
    for (const Compensator& c : plan.plan.compensators) result_.compensators.push_back(c.name);
    for (const std::string& name : fitted_in_each()) {
      if (result_.index(name) < result_.compensators.size())
        throw io::InputError(fmt::format(
            "compensator {}: one of that name is fitted in each laboratory; rename the file", name));
      result_.compensators.push_back(name);
    }
    result_.scenarios = plan.scenarios;
    result_.shapes = shapes_without_values();
  }

  EnsembleResult run() {
    std::optional<FolderLock> lock;
    if (!plan_.plan.folder.empty() && plan_.plan.lock == nullptr) lock.emplace(plan_.plan.folder);
    const auto start = std::chrono::steady_clock::now();
    if (!plan_.plan.folder.empty()) open_journal();
    result_.threads = io::threads_of(plan_.plan.threads);
    try {
      io::run_in_order<LaboratoryRow>(
          result_.rows.size(), plan_.ensemble.values.size(), result_.threads,
          [this](std::size_t number) { return laboratory(number); },
          [this](std::size_t, const LaboratoryRow& row) { take(row); });
    } catch (const io::Cancelled&) {
      throw io::Cancelled("stopped: " + kept());
    }
    if (journal_) write([&] { journal_->finish(); });
    result_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return std::move(result_);
  }

 private:
  // Which checks the plan allows: those that a run of it would have.
  std::vector<ShapeCheck> shapes_without_values() const {
    Result empty;
    for (const twin::Motion& motion : plan_.plan.motions) {
      for (const std::string& c : result_.compensators) {
        Cell cell;
        cell.gesture = motion.number();
        cell.compensator = c;
        empty.cells.push_back(std::move(cell));
      }
    }
    return shape_checks(empty, plan_.plan);
  }

  Plan plan_of(std::size_t number) const {
    Plan plan = plan_.plan;
    plan.parameters = with_values(plan_.ensemble.base, plan_.ensemble.values[number]);
    plan.seed = twin::seed_of(plan_.plan.seed, number);
    plan.threads = 1;
    plan.folder.clear();
    plan.lock = nullptr;
    return plan;
  }

  LaboratoryRow laboratory(std::size_t number) const {
    Plan plan = plan_of(number);
    if (plan.stop != nullptr && plan.stop->load()) throw io::Cancelled("");
    const GloveRequest request{plan.parameters, plan_.rate_hz, 1, twin::seed_of(plan_.glove_seed, number)};
    const GloveFit glove = fit_in(request, number);
    for (const Compensator& c : glove.baselines) plan.compensators.push_back(c);
    plan.compensators.push_back({"identified", glove.identified});
    const Result result = study::run(plan, {});
    LaboratoryRow row;
    for (const Cell& cell : result.cells) row.error_deg_s.push_back(cell.total_deg_s.mean());
    for (const Scenario& scenario : plan_.scenarios) {
      Plan changed = plan;
      for (const std::string& assignment : scenario.set) twin::assign(changed.parameters, assignment);
      for (const Cell& cell : study::run(changed, {}).cells)
        row.error_deg_s.push_back(cell.total_deg_s.mean());
    }
    row.lag_s = glove.lead_s;
    for (const ShapeCheck& check : shape_checks(result, plan)) row.shape_deg.push_back(check.value_deg);
    return row;
  }

  static GloveFit fit_in(const GloveRequest& request, std::size_t number) {
    try {
      return fit_glove(request, record_glove(request));
    } catch (const std::runtime_error& error) {
      throw io::JobError(fmt::format("laboratory {}: {}", number, error.what()));
    }
  }

  void take(const LaboratoryRow& row) {
    if (journal_) write([&] { journal_->append(text(result_.rows.size(), row)); });
    result_.rows.push_back(row);
    if (progress_) progress_(result_.rows.size(), plan_.ensemble.values.size());
  }

  std::string kept() const {
    const std::size_t of = plan_.ensemble.values.size();
    if (plan_.plan.folder.empty())
      return fmt::format("{} of {} laboratories done, none kept without a folder", result_.rows.size(), of);
    return fmt::format("{} of {} laboratories are kept in {}, and the same command goes on from there",
                       result_.rows.size(), of, plan_.plan.folder.string());
  }

  template <class Write>
  void write(const Write& what) const {
    write_or_say(what, [this] { return kept(); });
  }

  std::string header() const {
    std::string out = "laboratory";
    for (std::size_t use = 0; use <= plan_.scenarios.size(); ++use) {
      const std::string where = use == 0 ? "" : fmt::format("scenario {} ", use);
      for (const std::string& m : result_.motions) {
        for (const std::string& c : result_.compensators) out += fmt::format(",{}{} {} deg_s", where, m, c);
      }
    }
    out += ",lag_s";
    for (const ShapeCheck& check : result_.shapes) out += fmt::format(",shape {} deg", check.gesture);
    return out + "\n";
  }

  static std::string text(std::size_t number, const LaboratoryRow& row) {
    return fmt::format("{},{},{}{}{}\n", number, fmt::join(row.error_deg_s, ","),
                       row.lag_s ? fmt::format("{}", *row.lag_s) : "", row.shape_deg.empty() ? "" : ",",
                       fmt::join(row.shape_deg, ","));
  }

  bool parse(const std::string& line, LaboratoryRow& row) const {
    const std::string start = fmt::format("{},", result_.rows.size());
    if (!line.starts_with(start)) return false;
    const char* at = line.data() + start.size();
    const char* const end = line.data() + line.size();
    const auto number = [&](double& value) {
      const auto [stop, error] = std::from_chars(at, end, value);
      at = stop;
      return error == std::errc() && std::abs(value) < 1e9;  // as all of ours are
    };
    const auto comma = [&] { return at < end && *at++ == ','; };
    row.error_deg_s.resize((1 + plan_.scenarios.size()) * result_.motions.size() *
                           result_.compensators.size());
    row.shape_deg.resize(result_.shapes.size());
    for (double& value : row.error_deg_s) {
      if (!number(value) || value <= 0 || !comma()) return false;
    }
    row.lag_s.reset();
    if (at < end && *at != ',' && !number(row.lag_s.emplace())) return false;
    for (double& value : row.shape_deg) {
      if (!comma() || !number(value) || value < 0) return false;
    }
    return at == end;
  }

  // What must be the same for a run to go on.
  std::string identity() const {
    const std::string settings = settings_of(plan_.plan);
    Json json = Json::parse(settings);
    json.erase("twin");
    json["rate_hz"] = plan_.rate_hz;
    json["glove_seed"] = plan_.glove_seed;
    json["fitted_in_each"] = fitted_in_each();
    for (const Scenario& s : plan_.scenarios) json["scenarios"].push_back({{"name", s.name}, {"set", s.set}});
    json["ensemble"] = io::digest(to_json(plan_.ensemble));
    return io::dump(json);
  }

  void open_journal() {
    journal_.emplace(plan_.plan.folder, identity(), header(), kFile);
    std::string line;
    LaboratoryRow row;
    while (result_.rows.size() < plan_.ensemble.values.size() && journal_->next(line) && parse(line, row)) {
      journal_->keep();
      result_.rows.push_back(row);
    }
    result_.resumed = static_cast<std::int64_t>(result_.rows.size());
    write([&] { journal_->start(); });
  }

  const EnsemblePlan& plan_;
  const TrialProgress& progress_;
  EnsembleResult result_;
  std::optional<Journal> journal_;
};

Json interval(const std::vector<double>& values) {
  if (values.empty()) return nullptr;
  const Interval v = interval90(values);
  return {{"median", v.median}, {"low", v.low}, {"high", v.high}};
}

double share(const std::vector<double>& values, const std::function<bool(double)>& counts) {
  return static_cast<double>(std::ranges::count_if(values, counts)) / static_cast<double>(values.size());
}

Json cells_json(const EnsembleResult& r) {
  Json out = Json::array();
  const std::size_t hw = r.index("published-hw");
  for (std::size_t m = 0; m < r.motions.size(); ++m) {
    for (std::size_t c = 0; c < r.compensators.size(); ++c) {
      Json cell = {{"gesture", r.gestures[m] > 0 ? Json(r.gestures[m]) : Json(r.motions[m])},
                   {"compensator", r.compensators[c]},
                   {"total_error_deg_s", interval(r.errors(m, c))}};
      const auto published = published_error_deg_s(r.gestures[m], r.compensators[c]);
      cell["published_deg_s"] = published ? Json(*published) : Json(nullptr);
      if (hw < r.compensators.size()) cell["ratio_to_published_hw"] = interval(r.ratios(m, c, hw));
      out.push_back(std::move(cell));
    }
  }
  return out;
}

Json headlines_json(const EnsembleResult& r, std::size_t use = 0) {
  Json out = Json::array();
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    Json one = {{"compensator", r.compensators[c]}};
    Json ratios = Json::object();
    Json better = Json::object();
    for (std::size_t to = 0; to < r.compensators.size(); ++to) {
      if (to == c) continue;
      const std::vector<double> values = r.mean_ratios(c, to, use);
      ratios[r.compensators[to]] = interval(values);
      better[r.compensators[to]] = share(values, [](double v) { return v < 1; });
    }
    one["mean_ratio_to"] = std::move(ratios);
    one["share_of_laboratories_below"] = std::move(better);
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace

const std::vector<std::string>& fitted_in_each() {
  static const std::vector<std::string> names = {"line", "line-lead", "published-hw-refitted", "identified"};
  return names;
}

std::vector<double> EnsembleResult::errors(std::size_t motion, std::size_t compensator,
                                           std::size_t use) const {
  std::vector<double> out;
  for (const LaboratoryRow& row : rows) {
    out.push_back(row.error_deg_s[(use * motions.size() + motion) * compensators.size() + compensator]);
  }
  return out;
}

std::vector<double> EnsembleResult::ratios(std::size_t motion, std::size_t compensator, std::size_t to,
                                           std::size_t use) const {
  std::vector<double> out = errors(motion, compensator, use);
  const std::vector<double> below = errors(motion, to, use);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] /= below[k];
  return out;
}

std::vector<double> EnsembleResult::mean_ratios(std::size_t compensator, std::size_t to,
                                                std::size_t use) const {
  std::vector<double> out(rows.size());
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const std::vector<double> one = ratios(m, compensator, to, use);
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] += std::log(one[k]) / static_cast<double>(motions.size());
    }
  }
  for (double& v : out) v = std::exp(v);
  return out;
}

std::vector<double> EnsembleResult::log_rms(int from, int to) const {
  std::vector<LogRms> sum(rows.size());
  for (int g = from; g <= to; ++g) {
    const auto motion = std::ranges::find(gestures, g);
    for (const std::string& c : published_compensators()) {
      if (motion == gestures.end() || index(c) == compensators.size()) return {};
      const std::vector<double> ours = errors(static_cast<std::size_t>(motion - gestures.begin()), index(c));
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k].add(ours[k], *published_error_deg_s(g, c));
    }
  }
  std::vector<double> out;
  for (const LogRms& laboratory : sum) out.push_back(laboratory.value());
  return out;
}

std::size_t EnsembleResult::index(const std::string& compensator) const {
  return static_cast<std::size_t>(std::ranges::find(compensators, compensator) - compensators.begin());
}

EnsembleResult run_ensemble(const EnsemblePlan& plan, const TrialProgress& progress) {
  check(plan.plan);
  return Laboratories(plan, progress).run();
}

Json to_json(const EnsembleResult& r, const EnsemblePlan& plan) {
  std::vector<double> lags;
  for (const LaboratoryRow& row : r.rows) {
    if (row.lag_s) lags.push_back(*row.lag_s);
  }
  Json shapes = Json::array();
  for (std::size_t s = 0; s < r.shapes.size(); ++s) {
    std::vector<double> values;
    for (const LaboratoryRow& row : r.rows) values.push_back(row.shape_deg[s]);
    ShapeCheck check = r.shapes[s];
    const double agree = share(values, [&](double v) {
      check.value_deg = v;
      return check.agrees();
    });
    shapes.push_back({{"gesture", check.gesture},
                      {"what", check.what},
                      {"value_deg", interval(values)},
                      {check.is_least ? "at_least_deg" : "at_most_deg", check.threshold_deg},
                      {"share_of_laboratories_that_agree", agree}});
  }
  Json scenarios = Json::array();
  for (std::size_t s = 0; s < r.scenarios.size(); ++s) {
    scenarios.push_back({{"name", r.scenarios[s].name},
                         {"set", r.scenarios[s].set},
                         {"headlines", headlines_json(r, s + 1)}});
  }
  return {{"kind", "ensemble"},
          {"laboratories", r.rows.size()},
          {"interval", "median, 5 and 95 % quantile over the laboratories"},
          {"cells", cells_json(r)},
          {"headlines", headlines_json(r)},
          {"scenarios", std::move(scenarios)},
          {"log_rms",
           {{"gestures_1_to_4", interval(r.log_rms(1, 4))}, {"gestures_5_and_6", interval(r.log_rms(5, 6))}}},
          {"null_model", to_json(null_model())},
          {"lag_s", interval(lags)},
          {"laboratories_with_a_lag", lags.size()},
          {"shapes", std::move(shapes)},
          {"ensemble",
           {{"seed", plan.ensemble.seed},
            {"chains", plan.ensemble.chains},
            {"kept", plan.ensemble.kept},
            {"acceptance", plan.ensemble.acceptance},
            {"worst_r_hat", plan.ensemble.worst_r_hat()},
            {"least_effective", plan.ensemble.least_effective()},
            {"doubt", plan.ensemble.doubt()}}},
          {"trials", plan.plan.trials},
          {"rate_hz", plan.rate_hz},
          {"seed", plan.plan.seed},
          {"glove_seed", plan.glove_seed},
          {"version", FLEXOR_VERSION}};
}

}  // namespace flexor::study
