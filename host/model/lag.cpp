#include "host/model/lag.hpp"

#include <cmath>

#include "host/model/lti.hpp"

namespace flexor::model {
void Lag::check(const Place& place) const { check_rate(place, rate_rad_s, "rate_rad_s"); }

// What is far beyond the need still pulls: nothing of the input may saturate.
Need Lag::need(const FixedSignal& in, const Need& out) const { return {in.values, out.fraction, out.finer}; }

double Lag::share(double period_s) const { return -std::expm1(-rate_rad_s * period_s); }

Lag::Fixed Lag::fixed(const FixedBlock& block) const { return {weight(share(block.period_s))}; }

}  // namespace flexor::model
