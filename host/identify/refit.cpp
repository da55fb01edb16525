#include "host/identify/refit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/model/compensator.hpp"
#include "host/model/formats.hpp"

namespace flexor::identify {
namespace {

constexpr double kSpanTail = 0.01;
constexpr double kFirstStep_deg = 5;
constexpr double kLastStep_deg = 0.01;

using Pair = std::array<double, 2>;  // angles at two readings: both count alike in a search

// Compass search: the best neighbour at a distance that is halved where there is none.
template <class Loss>
Pair minimise(const Loss& loss, Pair best) {
  double least = loss(best);
  for (double step = kFirstStep_deg; step > kLastStep_deg;) {
    const Pair from = best;
    for (const auto& [low, high] : {Pair{1, 0}, Pair{0, 1}, Pair{1, 1}, Pair{1, -1}}) {
      for (const double way : {step, -step}) {
        const Pair next = {from[0] + way * low, from[1] + way * high};
        const double value = loss(next);
        if (value >= least) continue;
        least = value;
        best = next;
      }
    }
    if (best == from) step /= 2;
  }
  return best;
}

double loss_on(const model::Channel& c, const std::vector<Session>& sessions, double period_s) {
  const model::Compensator<model::DoubleArithmetic> fresh(model::model_of(c, period_s));
  double sum = 0;
  for (const Session& s : sessions) {
    auto compensator = fresh;
    for (Eigen::Index k = 0; k < s.angle_deg.size(); ++k) {
      const double angle_deg = compensator.step(s.input(k, 0)).angle_deg;
      if (s.use[static_cast<std::size_t>(k)]) sum += loss_of(angle_deg - s.angle_deg(k));
    }
  }
  return sum;
}

model::Interval readings(const std::vector<Session>& sessions) {
  std::vector<double> u = used_readings(sessions, 0);
  std::ranges::sort(u);
  return {quantile(u, kSpanTail), quantile(u, 1 - kSpanTail)};
}

model::Channel within_format(model::Channel c, const model::Interval& seen, double period_s) {
  const double low = c.valid_min;
  const double high = c.valid_max;
  for (double spans = 4; spans > 0.2; spans /= 2) {
    try {
      model::check_fixed(model::model_of(c, period_s));
      return c;
    } catch (const io::InputError&) {
      c.valid_min = std::max(low, seen.min - spans * (seen.width()));
      c.valid_max = std::min(high, seen.max + spans * (seen.width()));
    }
  }
  return c;
}

}  // namespace

model::Channel refit(const model::Channel& base, const std::vector<Session>& sessions, double period_s) {
  if (!base.dead_zone) throw io::InputError(fmt::format("{}: has no dead zone to fit", base.name));
  const model::Interval seen = readings(sessions);
  if (!(seen.max > seen.min)) throw io::JobError(fmt::format("{}: its sensor hardly changes", base.name));
  const auto channel = [&](const Pair& at) {
    model::Channel c = base;
    c.lti.gain = (at[1] - at[0]) / (seen.width());
    const double edge = seen.min - at[0] / c.lti.gain;
    c.dead_zone = {std::min(base.dead_zone->lower, edge), edge};
    return c;
  };
  const auto loss = [&](const Pair& at) {
    return at[1] - at[0] > 1e-3 * (seen.width()) ? loss_on(channel(at), sessions, period_s) : HUGE_VAL;
  };
  const auto published = [&](double u) { return base.lti.gain * (u - base.dead_zone->upper); };
  return within_format(channel(minimise(loss, {published(seen.min), published(seen.max)})), seen, period_s);
}

}  // namespace flexor::identify
