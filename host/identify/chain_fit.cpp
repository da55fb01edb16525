// A chain of blocks with dynamics (structure_text.hpp) fitted to one joint from one sensor, by fit.hpp.
//
// Several recordings are fitted one behind the other; the first two seconds of each but the first do not count. A lag before
// the chain is a first-order low-pass of the reading; its time constant is searched for the least fitted error, and
// it is left out where that is no less without it. Poles that would let a held angle drift by more than kMostDrift_deg are made
// quicker until it does not, unless the sensor creeps and that pays (creep_refusal). Cross-validation as in folds.hpp, each fold
// from the parameters of the whole.
// A stop before the first fit is io::Cancelled; after it the chain is there and is finished.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "host/identify/additive_system.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/joint_fit.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/correction.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kNotFitted_s = 2;
constexpr std::array kLags_s = {0.03, 0.06, 0.12, 0.25, 0.5, 1.0};
constexpr double kLagIsWorth = 0.001;
constexpr int kHalvings = 4;                              // of the distance between lags that are tried
constexpr std::array kSlowest_s = {0.0, 1.0, 0.5, 0.25};  // 0: as slow as the data say

Data data_of(const Stack& stack, const Task& task, bool remembers) {
  Data out;
  out.channel = task.joint.joint;
  out.period_s = task.inputs.sample_period_s;
  out.input = stack.input.col(0);
  out.angle_deg = stack.angle;
  out.weight.resize(stack.angle.size());
  Index row = 0;
  for (const Session& session : task.sessions) {
    const double from_s = row == 0 || !remembers ? 0 : kNotFitted_s;
    for (std::size_t k = 0; k < session.use.size(); ++k)
      out.weight(row++) = session.use[k] != 0 && static_cast<double>(k) * out.period_s >= from_s ? 1 : 0;
  }
  return out;
}

bool remembers(const Chain& chain) { return chain.blocks.order > 0 || chain.blocks.plays > 0 || chain.lag; }

// As runtime/compensator/lag.hpp, started again at each recording.
VectorXd lagged(VectorXd signal, const Stack& stack, double share) {
  for (std::size_t s = 0; s + 1 < stack.begin.size(); ++s) {
    double y = signal(stack.begin[s]);
    for (Index k = stack.begin[s]; k < stack.begin[s + 1]; ++k) signal(k) = y += share * (signal(k) - y);
  }
  return signal;
}

class ChainFitter {
 public:
  ChainFitter(const Chain& wanted, const Task& task)
      : wanted_(wanted), task_(task), stack_(task.sessions), raw_(data_of(stack_, task, remembers(wanted))) {}

  JointFit run(const std::optional<Initial>& initial, double least_deg) {
    if (!progress()) throw io::Cancelled("cancelled");
    Chain chain = wanted_;
    if (chain.lag && !chain.lag_s) {
      chain.lag_s = best_lag_s();
      chain.lag = chain.lag_s.has_value();
    }
    const Data data = behind(chain);
    std::optional<JointFit> creeping;  // poles as slow as the data say
    std::optional<Fitted> first;
    JointFit out;
    ChainOptions options;
    options.initial = initial;
    const bool gain_alone = initial && initial->gain_alone;
    if (gain_alone) options.from = From::initial;
    ChainOptions fold;  // has one minimum to find, that of the whole
    const auto finish = [&] {
      if (out.fitted_rmse_deg < least_deg) validate(chain, data, fold, out);
    };
    for (const double slowest_s : kSlowest_s) {
      options.slowest_s = slowest_s;
      Summary summary = fit(chain.blocks, data, options);
      if (first) {  // this one went on from it
        summary.start = first->start;
        for (std::size_t k = 0; k < first->parameters.size(); ++k)
          summary.parameters[k].initial = first->parameters[k].initial;
      } else {
        first = summary;
      }
      options.initial = Initial{summary.channel, gain_alone};
      fold = options;
      fold.from = From::initial;
      fold.cost_tolerance = 1e-5;  // a fold's loss is judged by per cents
      fold.knots = summary.knots;
      fold.deviation_deg = summary.deviation_deg;
      out = filled(chain, summary);
      if (chain.blocks.order == 0 || gain_alone || out.hold_drift_deg <= kMostDrift_deg) break;
      if (!creeping) {
        finish();
        creeping = out;
      }
      progress();
    }
    finish();
    const bool pays = creeping && !creeping->fold_loss.empty() &&
                      (out.fold_loss.empty() || creep_refusal(*creeping, out, task_.sessions).empty());
    if (pays) out = std::move(*creeping);
    out.creeps = pays;
    return out;
  }

 private:
  bool progress() {
    return !task_.step ||
           task_.step(done_++, kSlowest_s.size(), fmt::format("{}: {}", task_.joint.joint, text_of(wanted_)));
  }

  Data behind(const Chain& chain) const {
    Data out = raw_;
    if (chain.lag_s) out.input = lagged(raw_.input, stack_, 1 - std::exp(-raw_.period_s / *chain.lag_s));
    if (chain.blocks != Structure{}) add_donnings(out);  // a line is fitted as anybody draws it
    return out;
  }

  // The recording twice more, as it may read when re-donned.
  void add_donnings(Data& data) const {
    const Donnings donnings(limits_of(stack_, kEnds), stack_, data.period_s);
    const double shift = donnings.step * range_of(stack_, 0);
    const Index n = data.input.size();
    VectorXd input(3 * n);
    input << data.input, data.input.array() - shift, data.input.array() + shift;
    data.input = std::move(input);
    data.angle_deg = raw_.angle_deg.replicate(3, 1);
    data.own = n;
    data.weight = raw_.weight.replicate(3, 1);
    const auto settled = static_cast<Index>(remembers(wanted_) ? kNotFitted_s / data.period_s : 0);
    for (Index k = 0; k < n; ++k) {
      const bool determines = raw_.weight(k) > 0 && donnings.tells(raw_.angle_deg(k));
      if (determines) data.weight(k) = donnings.original();
      data.weight(n + k) = data.weight(2 * n + k) = determines && k >= settled ? donnings.shifted() : 0;
    }
  }

  // None where the chain without a lag fits as well.
  std::optional<double> best_lag_s() {
    ChainOptions quick;
    quick.from = From::first;
    double least = (1 - kLagIsWorth) * fit(wanted_.blocks, behind(wanted_), quick).fitted_rmse_deg;
    std::optional<double> best;
    const auto look = [&](double lag_s) {
      Chain chain = wanted_;
      chain.lag_s = lag_s;
      const double rmse = fit(chain.blocks, behind(chain), quick).fitted_rmse_deg;
      if (rmse < least) {
        least = rmse;
        best = lag_s;
      }
    };
    for (const double lag_s : kLags_s) look(lag_s);
    double factor = std::sqrt(2.0);
    for (int i = 0; best && i < kHalvings; ++i, factor = std::sqrt(factor)) {
      const double middle = *best;
      look(middle * factor);
      look(middle / factor);
    }
    return best;
  }

  JointFit filled(const Chain& chain, const Summary& summary) const {
    JointFit out;
    out.sensors = task_.joint.sensors;
    out.structure = text_of(chain);
    out.text = text_of(chain);
    static_cast<Fitted&>(out) = summary;
    if (wanted_.lag && !wanted_.lag_s) ++out.effective;
    const Structure& blocks = chain.blocks;
    out.limits = blocks.input_knots > 0 || blocks.output_knots > 0 || blocks.saturation ? 2 : 0;
    if (chain.lag_s) {
      out.parameters.push_back({"lag s", *chain.lag_s, 0, true});
      const Index last = summary.covariance.rows();
      out.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(last + 1, last + 1));
    }
    try {
      for (const double share : {1.0, 0.5, 0.25}) {
        out.model = own_inputs(task_.inputs, task_.joint);
        add_blocks(chain, summary.channel, share, out.model);
        if (refusal_of(out.model).empty()) break;
      }
      out.hold_drift_deg = identify::hold_drift_deg(out.model, task_.sessions, task_.joint.sensors);
    } catch (const io::InputError& error) {  // too steep for any document
      throw io::JobError(error.what());
    }
    return out;
  }

  // Between dynamics and curve the scale is free: one that the states of a board hold.
  static void scale_for_board(const model::Input& input, double period_s, model::Channel& channel) {
    constexpr double kMost = 1000;
    model::Interval in{input.valid_min, input.valid_max};
    if (channel.input_curve) {
      const auto [least, most] = std::ranges::minmax(channel.input_curve->y);
      in = {least, most};
    }
    const double most = channel.lti.values({{in}}, period_s).magnitude();
    if (most <= kMost) return;
    const double share = std::exp2(std::floor(std::log2(kMost / most)));
    channel.lti.gain *= share;
    channel.lti.offset *= share;
    for (double& knot : channel.output_curve->x) knot *= share;
  }

  // A line so steep that a board cannot hold what it makes of every reading is a curve of two knots between the limits of the
  // angle, beyond which nothing counts; before dynamics a whole span beyond them.
  static void bound_line(const model::Input& input, model::Channel& channel) {
    constexpr double kMost_deg = 1000;
    const auto angle = [&](double u) { return channel.lti.gain * u + channel.lti.offset; };
    if (channel.dead_zone || channel.input_curve || channel.output_curve || channel.lti.gain == 0 ||
        std::max(std::abs(angle(input.valid_min)), std::abs(angle(input.valid_max))) <= kMost_deg)
      return;
    const auto [lower, upper] = channel.saturation;
    const double room = channel.lti.poles_rad_s.empty() ? 0 : upper - lower;
    const auto reading = [&](double deg) {
      return std::clamp((deg - channel.lti.offset) / channel.lti.gain, input.valid_min, input.valid_max);
    };
    const auto [from, to] = std::minmax({reading(lower - room), reading(upper + room)});
    channel.input_curve = model::Curve{{from, to}, {angle(from), angle(to)}};
    channel.lti.gain = 1;
    channel.lti.offset = 0;
  }

  // The channel's blocks behind the joint's own input, whose readings a board takes in about the converter's steps.
  void add_blocks(const Chain& chain, const model::Channel& fitted, double share, model::Model& model) const {
    model::Input& input = model.inputs.front();
    const double gain = scale_to_counts(input, share);
    model::Channel channel = model::scaled(fitted, gain);
    if (channel.hysteresis) {  // in the board's steps, so that its plays are these
      const auto rounded = [](double x, int fraction) {
        return std::ldexp(std::round(std::ldexp(x, fraction)), -fraction);
      };
      for (double& radius : channel.hysteresis->radii) radius = rounded(radius, core::kInputFraction);
      for (double& weight : channel.hysteresis->weights)
        weight = rounded(weight, compensator::kHysteresisWeightFraction);
    }
    bound_line(input, channel);
    if (channel.output_curve) scale_for_board(input, model.sample_period_s, channel);
    channel.name = task_.joint.joint;
    channel.input_column = task_.joint.sensors.front();
    model::Model alone = model::model_of(channel, model.sample_period_s);
    std::string from = task_.joint.sensors.front();
    if (chain.lag_s) {
      const std::string to = task_.joint.joint + " lag";
      model.blocks.push_back({{from}, to, model::Lag{1 / *chain.lag_s}});
      from = to;
    }
    alone.blocks.front().from = {from};
    model.blocks.insert(model.blocks.end(), alone.blocks.begin(), alone.blocks.end());
    model.joints = alone.joints;
    if (gain != 1) model = model::corrected(std::move(model), 0, {gain, 0});
  }

  void validate(const Chain& chain, const Data& data, const ChainOptions& options, JointFit& out) {
    const std::vector<Fold> folds = folds_of(used_rows(data, true), stack_.begin, data.period_s);
    const std::vector<Summary> summaries = fit_folds(chain.blocks, data, folds, options);
    std::vector<std::pair<double, double>> estimates;
    double squares = 0;
    for (std::size_t f = 0; f < folds.size(); ++f) {
      const model::Saturation& limits = summaries[f].channel.saturation;
      double loss = 0;
      const std::size_t before = estimates.size();
      for (const Block& block : folds[f]) {
        for (Index k = block.first; k <= block.last; ++k) {
          if (data.weight(k) == 0) continue;
          const double estimate =
              std::clamp(summaries[f].predicted_deg(k), limits.lower_deg, limits.upper_deg);
          const double error = estimate - data.angle_deg(k);
          estimates.emplace_back(estimate, error);
          squares += error * error;
          loss += loss_of(error);
        }
      }
      out.fold_loss.push_back(loss /
                              static_cast<double>(std::max<std::size_t>(estimates.size() - before, 1)));
    }
    out.cross_validated_deg = std::sqrt(squares / static_cast<double>(estimates.size()));
    out.model.joints.front().accuracy = accuracy_of(std::move(estimates));
  }

  const Chain& wanted_;
  const Task& task_;
  Stack stack_;
  Data raw_;
  std::size_t done_ = 0;
};

}  // namespace

JointFit fit_chain(const Chain& wanted, const Task& task, const std::optional<Initial>& initial,
                   double least_deg) {
  return ChainFitter(wanted, task).run(initial, least_deg);
}

}  // namespace flexor::identify
