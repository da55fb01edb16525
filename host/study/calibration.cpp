#include "host/study/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "host/identify/identify_files.hpp"
#include "host/io/io.hpp"
#include "host/model/simulation.hpp"
#include "host/recording/csv.hpp"
#include "host/score/trial.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

constexpr double kCellDeviation = 0.35;     // of ln(ours / published)
constexpr double kPlacementDeviation = 16;  // degrees
constexpr double kKnotShares[] = {0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1};
constexpr double kRate_hz = 10;  // the article's

// The input at which a published compensator settles at angle_deg.
double inverse(const model::Channel& c, double angle_deg) {
  return angle_deg / c.lti.gain + (c.dead_zone ? c.dead_zone->upper : 0);
}

std::vector<Compensator> published() {
  return {compensator("raw", kRate_hz), compensator("published-w", kRate_hz),
          compensator("published-hw", kRate_hz)};
}

double log_rms_of(const twin::Parameters& parameters, int trials, std::uint64_t seed) {
  const Plan plan{parameters, motions("1-4"), published(), seed, trials, 0, {}, nullptr};
  return run(plan, {}).distance.fitted->log_rms;
}

class TwinProblem {
 public:
  TwinProblem(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
              const FitProgress& progress)
      : start_(start),
        evaluations_(evaluations),
        trials_(trials),
        seed_(seed),
        progress_(progress),
        free_(free_parameters()) {}

  TwinFit solve() {
    std::vector<double> x;
    for (const FreeParameter& p : free_) x.push_back((p.start - p.min) / (p.max - p.min));
    nlopt::opt optimizer(nlopt::LN_SBPLX, static_cast<unsigned>(x.size()));
    optimizer.set_lower_bounds(0);
    optimizer.set_upper_bounds(1);
    optimizer.set_maxeval(evaluations_);
    optimizer.set_xtol_abs(1e-4);
    optimizer.set_initial_step(0.2);
    optimizer.set_min_objective([](const std::vector<double>& at, std::vector<double>&,
                                   void* self) { return static_cast<TwinProblem*>(self)->cost(at); },
                                this);
    double cost = 0;
    optimizer.optimize(x, cost);
    TwinFit fit;
    fit.parameters = parameters(x);
    fit.cost = cost;
    fit.evaluations = count_;
    fit.log_rms = log_rms_of(fit.parameters, trials_, seed_);
    return fit;
  }

 private:
  // Rounded to what is written down: what is reported is what a file says.
  twin::Parameters parameters(const std::vector<double>& x) const {
    twin::Parameters p = start_;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double value = free_[i].min + (free_[i].max - free_[i].min) * x[i];
      twin::assign(p, fmt::format("{}={:.4g}", free_[i].name, value));
    }
    return p;
  }

  double cost(const std::vector<double>& x) {
    if (progress_) progress_(count_ + 1, evaluations_, best_);
    ++count_;
    const twin::Parameters p = parameters(x);
    if (!is_possible(p)) return kImpossible;
    const double rms = log_rms_of(p, trials_, seed_);
    best_ = std::min(best_, rms);
    double sum = 12 * rms * rms / (kCellDeviation * kCellDeviation);
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!free_[i].implied) continue;
      const double value = free_[i].min + (free_[i].max - free_[i].min) * x[i];
      const double d = (value - *free_[i].implied) / kPlacementDeviation;
      sum += d * d;
    }
    return sum;
  }

  // The search's box holds corners where a strip bends less with the finger at its upper limit.
  static bool is_possible(const twin::Parameters& p) {
    for (std::size_t i = 0; i < kFingers; ++i) {
      if (p.bend_lower_deg[i] >= p.bend_upper_deg[i]) return false;
    }
    return true;
  }

  static constexpr double kImpossible = 1e6;

  const twin::Parameters& start_;
  int evaluations_;
  int trials_;
  std::uint64_t seed_;
  const FitProgress& progress_;
  std::vector<FreeParameter> free_;
  int count_ = 0;
  double best_ = 1e9;
};

// What the glove logged and what its camera saw, as two files on two clocks.
class GloveRecorder {
 public:
  explicit GloveRecorder(const GloveRequest& request) : request_(request), motion_(calibration_motion()) {}

  // Between rounds the glove comes off and goes on again, and both logs pause.
  void record() const {
    const twin::Setup setup{request_.parameters, motion_, compensator("raw", request_.rate_hz).model,
                            request_.seed, true};
    twin::check(setup);
    recording::Recording glove;
    recording::Recording camera;
    for (const std::string& finger : model::finger_names()) {
      glove.columns.push_back({finger + "_alpha", {}});
      camera.columns.push_back({finger + "_deg", {}});
    }
    for (int round = 0; round < request_.rounds; ++round) {
      const twin::Trial trial = twin::simulate(setup, static_cast<std::uint64_t>(round), 1).front();
      const double start_s = round * (motion_.duration_s() + kPause_s);
      for (const double t : trial.sample_s) glove.t_s.push_back(kGloveClock_s + start_s + t);
      for (std::size_t k = 0; k < trial.glove_deg[0].size(); ++k) {
        camera.t_s.push_back(kCameraClock_s + start_s +
                             static_cast<double>(k) / request_.parameters.camera_rate_hz);
      }
      for (std::size_t i = 0; i < kFingers; ++i) {
        const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
        append(glove.columns[i].value, trial.alpha_deg[i]);
        append(camera.columns[i].value, trial.glove_deg[i]);
      }
    }
    io::make_folder(request_.folder);
    io::write_file(request_.folder / "glove.csv", recording::to_csv(glove));
    io::write_file(request_.folder / "camera.csv", recording::to_csv(camera));
  }

  // The lag from finger to hand, seen by both cameras, with this compensator.
  double lag_s(const model::Model& compensator) const {
    const twin::Setup setup{request_.parameters, motion_, compensator, twin::seed_of(request_.seed, 1),
                            false};
    const twin::Trial trial = twin::simulate(setup, 0, 1).front();
    return score::score_trial(trial.glove_deg, trial.hand_deg, 1 / request_.parameters.camera_rate_hz).lag_s;
  }

 private:
  static constexpr double kPause_s = 5;
  static constexpr double kGloveClock_s = 3.0;
  static constexpr double kCameraClock_s = 17.35;  // nobody told the camera what time the glove has

  const GloveRequest& request_;
  twin::Motion motion_;
};

struct StepStructure {
  const char* name;
  const char* what;
  identify::Structure structure;
};

// Without a fitted saturation, which would let the ends of the curve run away behind it: the hand's limits
// are known.
identify::Structure unsaturated(int order, int plays) {
  identify::Structure s;
  s.family = plays > 0 ? identify::Family::hw_hysteresis : identify::Family::hammerstein;
  s.order = order;
  s.plays = plays;
  s.input_knots = static_cast<int>(std::size(kKnotShares));
  s.monotone = true;
  return s;
}

std::vector<StepStructure> step_structures() {
  return {{"static-curve", "a fitted curve, nothing else", unsaturated(0, 0)},
          {"dynamics", "and fitted dynamics, two poles", unsaturated(2, 0)},
          {"hysteresis", "and a play operator", unsaturated(2, 1)}};
}

class GloveIdentifier {
 public:
  explicit GloveIdentifier(const GloveRequest& request) : request_(request) {}

  model::Model fit(const StepStructure& step, double lead_s) {
    model::Model m;
    m.name = step.name;
    m.description = fmt::format("{}; {} Hz, {} rounds of the calibration motion, seed {}", step.what,
                                request_.rate_hz, request_.rounds, request_.seed);
    m.written_by = "flexor " FLEXOR_VERSION;
    m.sample_period_s = 1 / request_.rate_hz;
    m.training = {{"sensor", "glove.csv"}, {"reference", "camera.csv"}, {"lead_s", lead_s}};
    for (std::size_t i = 0; i < kFingers; ++i) m.channels.push_back(channel(step, lead_s, i, m));
    return m;
  }

  std::vector<std::string> warnings;

 private:
  model::Channel channel(const StepStructure& step, double lead_s, std::size_t finger, model::Model& m) {
    const std::string& name = model::finger_names()[finger];
    const recording::Pair pair = identify::load_pair(
        {request_.folder / "glove.csv", request_.folder / "camera.csv", name + "_alpha", name + "_deg"});
    const recording::Aligned a = recording::align_pair(pair, request_.rate_hz, std::nullopt, lead_s);
    identify::Data data;
    data.channel = name;
    data.period_s = a.period_s;
    data.input = Eigen::Map<const Eigen::VectorXd>(a.input.data(), static_cast<Eigen::Index>(a.input.size()));
    data.angle_deg = Eigen::Map<const Eigen::VectorXd>(a.angle_deg.data(), data.input.size());
    for (const std::uint8_t gap : a.gap) data.use.push_back(gap == 0);
    identify::Options options;
    options.slowest_s = kSlowest_s;
    options.widest_play = kWidestPlay_deg;
    options.delta_deg = kLoss_deg;
    options.input_knots = knots(a.input);
    const identify::Summary fit = identify::fit(step.structure, data, options);
    for (const std::string& refusal : fit.refusals)
      warnings.push_back(fmt::format("{}: {}", step.name, refusal));
    model::Channel c = complete(fit.channel, finger, pair.input, a.angle_deg);
    // A play and a steep curve can cancel each other: fits on paper, and in no microcontroller.
    try {
      (void)model::fixed_coefficients<model::AnyShape>(c, data.period_s);
    } catch (const io::InputError& error) {
      if (step.structure.plays == 0) throw;
      warnings.push_back(fmt::format("{}: without the play operator, since {}", step.name, error.what()));
      StepStructure without = step;
      without.structure = unsaturated(step.structure.order, 0);
      return channel(without, lead_s, finger, m);
    }
    m.fit[name] = {{"structure", identify::describe(fit.structure)},
                   {"fitted_rmse_deg", fit.rmse_deg},
                   {"clock_offset_s", a.clock_offset_s}};
    return c;
  }

  static double quantile(const std::vector<double>& sorted, double share) {
    return sorted[static_cast<std::size_t>(std::lround(share * static_cast<double>(sorted.size() - 1)))];
  }

  // Close together where the finger rests, at either end, so that the curve can be flat there and steep
  // beside it. A burst of contact noise now and then must not own an end.
  static std::vector<double> knots(std::vector<double> input) {
    std::ranges::sort(input);
    const double low = quantile(input, kTail);
    const double range = quantile(input, 1 - kTail) - low;
    std::vector<double> out;
    for (const double share : kKnotShares) out.push_back(low + share * range);
    return out;
  }

  static model::Channel complete(model::Channel c, std::size_t finger, const std::string& column,
                                 std::vector<double> angle_deg) {
    c.name = model::finger_names()[finger];
    c.input_column = column;
    c.input_unit = "deg";
    c.valid_min = kValidMin_deg;
    c.valid_max = kValidMax_deg;
    // The person's own range: what lies beyond is overshoot.
    std::ranges::sort(angle_deg);
    c.saturation = {quantile(angle_deg, kTail), quantile(angle_deg, 1 - kTail)};
    c.rest_deg = c.saturation.lower_deg;
    return c;
  }

  static constexpr double kTail = 0.01;
  static constexpr double kWidestPlay_deg = 10;  // cloth does not slip further
  static constexpr double kLoss_deg = 0.3;       // mean absolute error, as the experiment scores it
  static constexpr double kSlowest_s = 0.5;      // slower is drift, or another donning
  // A shorted strip reads -45 degrees, an open one beyond 1023.
  static constexpr double kValidMin_deg = -44;
  static constexpr double kValidMax_deg = 400;

  const GloveRequest& request_;
};

}  // namespace

std::vector<FreeParameter> free_parameters() {
  const Compensator w = compensator("published-w", kRate_hz);
  const Compensator hw = compensator("published-hw", kRate_hz);
  const twin::Parameters p;
  std::vector<FreeParameter> out;
  for (const bool upper : {false, true}) {
    for (std::size_t i = 0; i < kFingers; ++i) {
      const double angle_deg = upper ? p.hand_upper_deg[i] : p.hand_lower_deg[i];
      const double implied =
          (inverse(w.model.channels[i], angle_deg) + inverse(hw.model.channels[i], angle_deg)) / 2;
      out.push_back(
          {fmt::format("placement.bend_{}_deg.{}", upper ? "upper" : "lower", model::finger_names()[i]),
           implied, implied - 45, implied + 45, implied});
    }
  }
  out.push_back({"loop.integral_limit", 60, 0.2, 120, std::nullopt});
  out.push_back({"loop.integral_per_deg_s", 0.1, 0.002, 0.3, std::nullopt});
  out.push_back({"cloth.slip_deg", 1.5, 0.2, 6, std::nullopt});
  out.push_back({"cloth.creep_share", 0.02, 0.005, 0.1, std::nullopt});
  return out;
}

TwinFit calibrate_twin(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
                       const FitProgress& progress) {
  return TwinProblem(start, evaluations, trials, seed, progress).solve();
}

GloveCalibration calibrate_glove(const GloveRequest& request, const StepProgress& progress) {
  const auto say = [&](const std::string& what) {
    if (progress) progress(what);
  };
  if (request.rounds < 1 || request.rounds > 100) throw io::InputError("a calibration takes 1 to 100 rounds");
  // These are the names that anybody gives to logs of their own.
  for (const char* name : {"glove.csv", "camera.csv"}) {
    if (std::filesystem::exists(request.folder / name) &&
        !std::filesystem::exists(request.folder / "lead.json")) {
      throw io::InputError(
          fmt::format("{}: is there already and may be a log of yours: choose another folder",
                      (request.folder / name).string()));
    }
  }
  GloveCalibration out;
  const GloveRecorder recorder(request);
  say("recording the calibration motion");
  recorder.record();
  GloveIdentifier identifier(request);
  const auto add = [&](const StepStructure& step, double lead_s) {
    say(fmt::format("identifying: {}", step.name));
    out.steps.push_back({step.name, step.what, identifier.fit(step, lead_s)});
    model::save(out.steps.back().model, request.folder / (std::string(step.name) + ".json"));
  };
  for (const StepStructure& step : step_structures()) add(step, 0);
  out.lag_s = recorder.lag_s(out.steps.back().model);
  StepStructure lead = step_structures().back();
  lead.name = "lead";
  const std::string what =
      fmt::format("and a prediction {:.0f} ms ahead, the lag from finger to hand", 1000 * out.lag_s);
  lead.what = what.c_str();
  add(lead, std::max(0.0, out.lag_s));
  model::save(out.steps.back().model, request.folder / "identified.json");
  out.warnings = identifier.warnings;
  return out;
}

}  // namespace flexor::study
