// What fixed point promises: within kFixedError_deg of double on the steps of Q5, and half a step of input
// times the chain's gain on top for an input between them. A dead zone's edges lie on steps here.
#include "host/model/fixed_error.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host/model/channel.hpp"
#include "host/model/formats.hpp"

namespace flexor::model {
namespace {

// Over all of it from the first case on: small cases are no simpler here.
double uniform(double low, double high) {
  return low + (high - low) * *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 1000001)) / 1e6;
}

// Gain and lags alone, with or without a dead zone: what may become a direct form. The poles are quick more
// often than not.
Channel random_plain_chain() {
  Channel c;
  c.name = "ring";
  c.valid_min = 0;
  c.valid_max = 1023;
  if (*rc::gen::arbitrary<bool>()) {
    c.dead_zone = DeadZone{-std::round(uniform(0, 320)) / 32, std::round(uniform(0, 1280)) / 32};
  }
  c.lti.gain = uniform(0.05, 1.9);
  const int order = *rc::gen::inRange(1, 4);
  for (int i = 0; i < order; ++i)
    c.lti.poles_rad_s.push_back(-uniform(*rc::gen::arbitrary<bool>() ? 0.5 : 12, 70));
  std::ranges::sort(c.lti.poles_rad_s, std::greater<>());
  const double upper = uniform(20, 1900);
  c.saturation = Saturation{-10, std::min(upper, 200 + upper / 4)};
  return c;
}

// The direct form that a joint's lti took, if it did, with its error.
std::optional<detail::Direct> direct_of(const Model& m, std::size_t joint) {
  const FixedModel fixed(m);
  const std::size_t count = m.inputs.size();
  std::size_t signal = fixed.graph.joint[joint];
  while (!std::holds_alternative<Lti>(m.blocks[signal - count].kind))
    signal = fixed.graph.from[signal - count][0];
  const std::size_t b = signal - count;
  if (!std::get<FixedCoefficients<Lti>>(fixed.blocks[b]).c.is_direct) return std::nullopt;
  const double top = fixed.signals[fixed.graph.from[b][0]].values.max;
  return detail::direct_form(std::get<Lti>(m.blocks[b].kind), top, fixed.signals[signal].values.max,
                             m.sample_period_s);
}

TEST(FixedPoint, HoldsItsPromiseForEveryPlainChainAndEveryInput) {
  int direct = 0;
  int between = 0;
  EXPECT_TRUE(rc::check([&] {
    const Channel c = random_plain_chain();
    const Model m = model_of(c, *rc::gen::element(0.1, 0.1, 0.05, 0.02));
    ErrorSearch search;
    search.attacks = 30;
    search.seed = *rc::gen::inRange<std::uint32_t>(1, 1000000);
    direct += direct_of(m, 0).has_value() ? 1 : 0;
    const double on_steps = worst_fixed_error_deg(m, search).front();
    RC_ASSERT(on_steps <= kFixedError_deg);
    search.in_steps = false;
    const double anywhere = worst_fixed_error_deg(m, search).front();
    RC_ASSERT(anywhere <= kFixedError_deg + c.lti.gain / 64);
    between += anywhere > on_steps ? 1 : 0;
  }));
  EXPECT_GE(direct, 20) << "of a hundred: the direct form was hardly tried";
  EXPECT_GE(between, 50) << "of a hundred: inputs between the steps must cost something";
}

TEST(FixedPoint, ThePublishedModelsHoldItToo) {
  for (const char* name : {"published_wiener", "published_hw"}) {
    const Model m = load(std::string(FLEXOR_SOURCE_DIR) + "/models/" + name + ".json");
    for (std::size_t i = 0; i < m.joints.size(); ++i) {
      const Channel c = channel(m, i).value();
      const auto direct = direct_of(m, i);
      ASSERT_TRUE(direct.has_value()) << name << " " << c.name;
      EXPECT_LE(direct->error_deg, kFixedError_deg);
      const Model alone = model_of(c, m.sample_period_s);
      const double on_steps = worst_fixed_error_deg(alone).front();
      EXPECT_LE(on_steps, direct->error_deg) << name << " " << c.name;
      EXPECT_GT(on_steps, 0.8 * direct->error_deg) << "the search is blind, or the bound far too wide";
      ErrorSearch anywhere;
      anywhere.in_steps = false;
      EXPECT_LE(worst_fixed_error_deg(alone, anywhere).front(), direct->error_deg + c.lti.gain / 64);
    }
  }
}

// Just beside what the form allows: the angle comes down to zero as fast as it can, where rounding might take
// it below, and a number without a sign would become 4096 degrees.
TEST(FixedPoint, ADirectFormNeverFallsBelowZero) {
  EXPECT_TRUE(rc::check([] {
    Channel c = random_plain_chain();
    c.dead_zone.reset();
    c.saturation = {-10, 1000};
    std::vector<std::vector<double>> inputs;
    for (int k = 0; k < 400; ++k) inputs.push_back({k % 8 < 2 ? uniform(0, 1023) : uniform(0, 0.2)});
    RC_ASSERT(fixed_error_deg(model_of(c, 0.1), inputs).front() <= kFixedError_deg);
  }));
}

}  // namespace
}  // namespace flexor::model
