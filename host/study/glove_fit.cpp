#include "host/study/glove_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlopt.hpp>

#include "host/identify/fit.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/recording/pair.hpp"

namespace flexor::study {
namespace {

constexpr double kKnotShares[] = {0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1};
constexpr double kTail = 0.01;
constexpr double kWidestPlay_deg = 10;  // cloth does not slip further
constexpr double kLoss_deg = 0.3;       // mean absolute error, as the experiment scores it
constexpr double kSlowest_s = 0.5;      // slower is drift, or another donning
// A shorted strip reads -45 degrees, an open one beyond 1023.
constexpr double kValidMin_deg = -44;
constexpr double kValidMax_deg = 400;

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(std::lround(share * static_cast<double>(sorted.size() - 1)))];
}

double pseudo_huber(double error_deg) {
  const double r = error_deg / kLoss_deg;
  return kLoss_deg * kLoss_deg * (std::sqrt(1 + r * r) - 1);
}

// The best of what Nelder and Mead's search finds from each start.
template <class Loss>
std::vector<double> minimise(const Loss& loss, const std::vector<std::vector<double>>& starts,
                             const std::vector<double>& step) {
  const std::function<double(const std::vector<double>&)> cost = loss;
  double best = HUGE_VAL;
  std::vector<double> out;
  for (std::vector<double> x : starts) {
    nlopt::opt optimizer(nlopt::LN_NELDERMEAD, static_cast<unsigned>(x.size()));
    optimizer.set_xtol_abs(1e-4);
    optimizer.set_maxeval(250 * static_cast<int>(x.size()));
    optimizer.set_initial_step(step);
    optimizer.set_min_objective(
        [](const std::vector<double>& at, std::vector<double>&, void* what) {
          return (*static_cast<const std::function<double(const std::vector<double>&)>*>(what))(at);
        },
        const_cast<void*>(static_cast<const void*>(&cost)));
    double value = HUGE_VAL;
    optimizer.optimize(x, value);
    if (value >= best) continue;
    best = value;
    out = x;
  }
  return out;
}

std::pair<double, double> range_of(std::span<const double> x) {
  std::vector<double> sorted(x.begin(), x.end());
  std::ranges::sort(sorted);
  return {quantile(sorted, kTail), quantile(sorted, 1 - kTail)};
}

// A line by its values at two inputs, so that both count alike in a search.
struct LineEnds {
  double low = 0;  // inputs
  double high = 0;

  Line line(const std::vector<double>& y) const {
    const double gain = (y[1] - y[0]) / (high - low);
    return {gain, y[0] - gain * low};
  }
  std::vector<double> ends(const Line& line) const {
    return {line.gain * low + line.offset_deg, line.gain * high + line.offset_deg};
  }
};
constexpr double kEndStep_deg = 5;

// Least squares, over the samples whose angle is `inside` the limits.
std::optional<Line> least_squares(std::span<const double> x, std::span<const double> y,
                                  const model::Saturation& limits, double inside_deg) {
  double n = 0;
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (y[k] < limits.lower_deg + inside_deg || y[k] > limits.upper_deg - inside_deg) continue;
    ++n;
    sx += x[k];
    sy += y[k];
    sxx += x[k] * x[k];
    sxy += x[k] * y[k];
  }
  const double spread = n * sxx - sx * sx;
  if (!(spread > 0)) return std::nullopt;
  const double gain = (n * sxy - sx * sy) / spread;
  return Line{gain, (sy - gain * sx) / n};
}

std::vector<Line> starting_lines(std::span<const double> x, std::span<const double> y,
                                 const model::Saturation& limits) {
  std::vector<Line> out;
  for (const double inside_deg : {-1e9, 2.0}) {
    if (const auto line = least_squares(x, y, limits, inside_deg)) out.push_back(*line);
  }
  return out;
}

struct StepStructure {
  std::string name;
  std::string what;
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

// One finger's log and angle on the compensator's grid.
struct Samples {
  recording::Aligned aligned;
  identify::Data data;
  std::vector<double> input;  // where nothing pauses
  std::vector<double> angle_deg;
};

class GloveFitter {
 public:
  GloveFitter(const GloveRequest& request, const GloveRecording& recording)
      : request_(request), recording_(recording) {}

  FittedModel fit(const StepStructure& step, double lead_s) {
    model::Model m = document(step.name, step.what, lead_s);
    for (std::size_t i = 0; i < kFingers; ++i) model::add(m, channel(step, lead_s, i, m));
    return {step.name, step.what, std::move(m)};
  }

  FittedModel line() {
    FittedModel out{"line", "gain and offset inside the range that the recording shows", {}};
    out.model = document(out.name, out.what, 0);
    for (std::size_t i = 0; i < kFingers; ++i) {
      const Samples& s = samples(i, 0);
      model::Channel c = complete({}, i, s.aligned.angle_deg);
      const Line fitted = fit_line(s.input, s.angle_deg, c.saturation);
      c.lti.gain = fitted.gain;
      c.lti.offset = fitted.offset_deg;
      model::add(out.model, within_format(std::move(c), s));
    }
    return describe(std::move(out), 0);
  }

  FittedModel line_with_lead(double lead_s) {
    FittedModel out{"line-lead",
                    fmt::format("the same with a pole and a zero, predicting {:.0f} ms ahead", 1000 * lead_s),
                    {}};
    out.model = document(out.name, out.what, lead_s);
    for (std::size_t i = 0; i < kFingers; ++i) {
      model::add(out.model, leading_line(i, samples(i, lead_s), lead_s));
    }
    return describe(std::move(out), lead_s);
  }

  FittedModel published_refitted() {
    FittedModel out{
        "published-hw-refitted",
        "the published Hammerstein-Wiener model with gain and dead-zone edge fitted to the wearer",
        {}};
    out.model = document(out.name, out.what, 0);
    const model::Model published = compensator("published-hw", request_.rate_hz).model;
    for (std::size_t i = 0; i < kFingers; ++i) {
      model::add(out.model, refitted(published, i, samples(i, 0)));
    }
    return describe(std::move(out), 0);
  }

  std::vector<std::string> warnings;

 private:
  model::Model document(const std::string& name, const std::string& what, double lead_s) const {
    model::Model m;
    m.name = name;
    m.description =
        fmt::format("{}; {} Hz, {} round{} of the calibration motion, seed {}", what, request_.rate_hz,
                    request_.rounds, request_.rounds > 1 ? "s" : "", request_.seed);
    m.written_by = "flexor " FLEXOR_VERSION;
    m.sample_period_s = 1 / request_.rate_hz;
    m.training = {{"sensor", "glove.csv"}, {"reference", "camera.csv"}, {"lead_s", lead_s}};
    return m;
  }

  // Aligned once for each finger and lead: steps and baselines see the same samples.
  const Samples& samples(std::size_t finger, double lead_s) {
    const auto known = samples_.find({finger, lead_s});
    if (known != samples_.end()) return known->second;
    const std::string& name = model::finger_names()[finger];
    const recording::Pair pair{recording_.glove, name + "_alpha", recording_.camera, name + "_deg"};
    Samples s;
    s.aligned = recording::align_pair(pair, request_.rate_hz, std::nullopt, lead_s);
    const recording::Aligned& a = s.aligned;
    s.data.channel = name;
    s.data.period_s = a.period_s;
    const auto n = static_cast<Eigen::Index>(a.input.size());
    s.data.input = Eigen::Map<const Eigen::VectorXd>(a.input.data(), n);
    s.data.angle_deg = Eigen::Map<const Eigen::VectorXd>(a.angle_deg.data(), n);
    for (std::size_t k = 0; k < a.gap.size(); ++k) {
      s.data.use.push_back(a.gap[k] == 0);
      if (a.gap[k] != 0) continue;
      s.input.push_back(a.input[k]);
      s.angle_deg.push_back(a.angle_deg[k]);
    }
    return samples_.emplace(std::pair{finger, lead_s}, std::move(s)).first->second;
  }

  identify::Summary fit_structure(const identify::Structure& structure, const Samples& s,
                                  const std::string& step) {
    identify::Options options;
    options.slowest_s = kSlowest_s;
    options.widest_play = kWidestPlay_deg;
    options.delta_deg = kLoss_deg;
    options.input_knots = knots(s.aligned.input);
    identify::Summary fit = identify::fit(structure, s.data, options);
    for (const std::string& refusal : fit.refusals) warnings.push_back(fmt::format("{}: {}", step, refusal));
    return fit;
  }

  model::Channel channel(const StepStructure& step, double lead_s, std::size_t finger, model::Model& m) {
    const Samples& s = samples(finger, lead_s);
    const identify::Summary fit = fit_structure(step.structure, s, step.name);
    model::Channel c = complete(fit.channel, finger, s.aligned.angle_deg);
    // A play and a steep curve can cancel each other: fits on paper, and in no microcontroller.
    try {
      model::check_fixed(model::model_of(c, s.data.period_s));
    } catch (const io::InputError& error) {
      if (step.structure.plays == 0) throw;
      warnings.push_back(fmt::format("{}: without the play operator, since {}", step.name, error.what()));
      StepStructure without = step;
      without.structure = unsaturated(step.structure.order, 0);
      return channel(without, lead_s, finger, m);
    }
    m.fit[c.name] = {{"structure", identify::describe(fit.structure)},
                     {"fitted_rmse_deg", fit.rmse_deg},
                     {"clock_offset_s", s.aligned.clock_offset_s}};
    return c;
  }

  // Close together where the finger rests, at either end, so that the curve can be flat there and steep
  // beside it. A burst of contact noise now and then must not own an end.
  static std::vector<double> knots(const std::vector<double>& input) {
    const auto [low, high] = range_of(input);
    std::vector<double> out;
    for (const double share : kKnotShares) out.push_back(low + share * (high - low));
    return out;
  }

  // The person's own range: what lies beyond is overshoot.
  static model::Channel complete(model::Channel c, std::size_t finger, const std::vector<double>& angle_deg) {
    read_by(c, finger);
    const auto [low, high] = range_of(angle_deg);
    c.saturation = {low, high};
    c.rest_deg = low;
    return c;
  }

  static void read_by(model::Channel& c, std::size_t finger) {
    c.name = model::finger_names()[finger];
    c.input_column = c.name + "_alpha";
    c.input_unit = "deg";
    c.valid_min = kValidMin_deg;
    c.valid_max = kValidMax_deg;
  }

  // What a channel loses on its samples; more than anything where it makes no model.
  static double loss_of(const model::Channel& c, const Samples& s) {
    model::Compensator<model::DoubleArithmetic> compensator(model::model_of(c, s.data.period_s));
    double sum = 0;
    for (std::size_t k = 0; k < s.aligned.input.size(); ++k) {
      const double angle_deg = compensator.step(s.aligned.input[k]).angle_deg;
      if (s.data.use[k] != 0) sum += pseudo_huber(angle_deg - s.aligned.angle_deg[k]);
    }
    return sum;
  }

  // A steep line leaves fixed point's range on readings that this glove never gives: then those are invalid.
  static model::Channel within_format(model::Channel c, const Samples& s) {
    const auto [low, high] = range_of(s.input);
    for (double spans = 4; spans > 0.2; spans /= 2) {
      try {
        model::check_fixed(model::model_of(c, s.data.period_s));
        return c;
      } catch (const io::InputError&) {
        c.valid_min = std::max(kValidMin_deg, low - spans * (high - low));
        c.valid_max = std::min(kValidMax_deg, high + spans * (high - low));
      }
    }
    return c;
  }

  // H = (1 + (lead + 1 / a) s) / (1 + s / a) behind a line: c_0 = 1 + lead a.
  static model::Channel leading_line(std::size_t finger, const Samples& s, double lead_s) {
    constexpr double kFirstPole_rad_s = 15;
    constexpr double kSlowest_rad_s = 1 / kSlowest_s;
    constexpr double kFastest_rad_s = 100;
    const model::Channel from = complete({}, finger, s.aligned.angle_deg);
    const auto [low, high] = range_of(s.input);
    const LineEnds line{low, high};
    const auto channel = [&](const std::vector<double>& x) {
      model::Channel c = from;
      const auto [gain, offset_deg] = line.line(x);
      const double pole = std::clamp(std::exp(x[2]), kSlowest_rad_s, kFastest_rad_s);
      c.lti = {gain, offset_deg, {-pole}, {1 + x[3]}};
      return c;
    };
    std::vector<std::vector<double>> starts;
    for (const Line& start : starting_lines(s.input, s.angle_deg, from.saturation)) {
      std::vector<double> x = line.ends(start);
      x.insert(x.end(), {std::log(kFirstPole_rad_s), lead_s * kFirstPole_rad_s});
      starts.push_back(std::move(x));
    }
    const auto loss = [&](const std::vector<double>& x) { return loss_of(channel(x), s); };
    return within_format(channel(minimise(loss, starts, {kEndStep_deg, kEndStep_deg, 0.5, 0.5})), s);
  }

  // Above its dead zone the published model is a line with a pole behind it.
  static model::Channel refitted(const model::Model& published, std::size_t finger, const Samples& s) {
    model::Channel from = *model::channel(published, finger);
    read_by(from, finger);
    const auto [low, high] = range_of(s.input);
    const LineEnds line{low, high};
    const auto channel = [&](const std::vector<double>& x) {
      model::Channel c = from;
      const auto [gain, offset_deg] = line.line(x);
      const double edge = -offset_deg / gain;
      c.lti.gain = gain;
      c.dead_zone = {std::min(from.dead_zone->lower, edge), edge};
      return c;
    };
    const auto loss = [&](const std::vector<double>& x) {
      return line.line(x).gain > 1e-3 ? loss_of(channel(x), s) : HUGE_VAL;
    };
    std::vector<std::vector<double>> starts = {
        line.ends({from.lti.gain, -from.lti.gain * from.dead_zone->upper})};
    for (const Line& start : starting_lines(s.input, s.angle_deg, from.saturation)) {
      starts.push_back(line.ends(start));
    }
    return within_format(channel(minimise(loss, starts, {kEndStep_deg, kEndStep_deg})), s);
  }

  // The figures that every fitted model carries.
  FittedModel describe(FittedModel fitted, double lead_s) {
    for (std::size_t i = 0; i < kFingers; ++i) {
      const Samples& s = samples(i, lead_s);
      model::Compensator<model::DoubleArithmetic> compensator(
          model::model_of(*model::channel(fitted.model, i), s.data.period_s));
      double squares = 0;
      for (std::size_t k = 0; k < s.aligned.input.size(); ++k) {
        const double e = compensator.step(s.aligned.input[k]).angle_deg - s.aligned.angle_deg[k];
        if (s.data.use[k] != 0) squares += e * e;
      }
      fitted.model.fit[model::finger_names()[i]] = {
          {"structure", fitted.name},
          {"fitted_rmse_deg", std::sqrt(squares / static_cast<double>(s.input.size()))},
          {"clock_offset_s", s.aligned.clock_offset_s}};
    }
    return fitted;
  }

  const GloveRequest& request_;
  const GloveRecording& recording_;
  std::map<std::pair<std::size_t, double>, Samples> samples_;
};

}  // namespace

Line fit_line(std::span<const double> alpha, std::span<const double> angle_deg,
              const model::Saturation& limits) {
  const auto [low, high] = range_of(alpha);
  const LineEnds ends{low, high};
  const auto loss = [&](const std::vector<double>& x) {
    const Line line = ends.line(x);
    double sum = 0;
    for (std::size_t k = 0; k < alpha.size(); ++k) {
      const double y = line.gain * alpha[k] + line.offset_deg;
      sum += pseudo_huber(std::clamp(y, limits.lower_deg, limits.upper_deg) - angle_deg[k]);
    }
    return sum;
  };
  std::vector<std::vector<double>> starts;
  for (const Line& start : starting_lines(alpha, angle_deg, limits)) starts.push_back(ends.ends(start));
  return ends.line(minimise(loss, starts, {kEndStep_deg, kEndStep_deg}));
}

GloveFit fit_glove(const GloveRequest& request, const GloveRecording& recording, bool all_steps,
                   const StepProgress& progress) {
  GloveFit out;
  GloveFitter fitter(request, recording);
  const auto say = [&](const std::string& name) {
    if (progress) progress(fmt::format("identifying: {}", name));
  };
  const std::vector<StepStructure> structures = step_structures();
  for (const StepStructure& step : structures) {
    if (!all_steps && step.name != structures.back().name) continue;
    say(step.name);
    out.steps.push_back(fitter.fit(step, 0));
  }
  out.lag_s = hand_lag_s(request, out.steps.back().model);
  const double lead_s = std::max(0.0, out.lag_s.value_or(0));
  StepStructure lead = structures.back();
  lead.name = "lead";
  lead.what = fmt::format("and a prediction {:.0f} ms ahead, the lag from finger to hand", 1000 * lead_s);
  say(lead.name);
  out.steps.push_back(fitter.fit(lead, lead_s));
  say("baselines");
  out.baselines.push_back(fitter.line());
  out.baselines.push_back(fitter.line_with_lead(lead_s));
  out.baselines.push_back(fitter.published_refitted());
  out.warnings = fitter.warnings;
  return out;
}

GloveFit calibrate_glove(const GloveRequest& request, const std::filesystem::path& folder,
                         const StepProgress& progress) {
  // These are the names that anybody gives to logs of their own.
  for (const char* name : {"glove.csv", "camera.csv"}) {
    if (std::filesystem::exists(folder / name) && !std::filesystem::exists(folder / "lead.json")) {
      throw io::InputError(fmt::format(
          "{}: is there already and may be a log of yours: choose another folder", (folder / name).string()));
    }
  }
  if (progress) progress("recording the calibration motion");
  const GloveRecording recording = record_glove(request);
  write_recording(recording, folder);
  GloveFit out = fit_glove(request, recording, true, progress);
  for (const auto* models : {&out.steps, &out.baselines}) {
    for (const FittedModel& m : *models) model::save(m.model, folder / (m.name + ".json"));
  }
  model::save(out.identified(), folder / "identified.json");
  return out;
}

}  // namespace flexor::study
