// What fixed point promises: within kFixedError_deg of double on the steps of Q5, and half a step of input
// times the chain's gain on top for an input, and for a dead zone's edge, between them.
#include "host/model/fixed_error.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "host/model/coefficients.hpp"

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
    c.dead_zone = DeadZone{-uniform(0, 10), uniform(0, 40)};
    if (*rc::gen::arbitrary<bool>()) c.dead_zone = DeadZone{-10, 20};
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

TEST(FixedPoint, HoldsItsPromiseForEveryPlainChainAndEveryInput) {
  int direct = 0;
  int between = 0;
  EXPECT_TRUE(rc::check([&] {
    const Channel c = random_plain_chain();
    const double period_s = *rc::gen::element(0.1, 0.1, 0.05, 0.02);
    ErrorSearch search;
    search.attacks = 30;
    search.seed = *rc::gen::inRange<std::uint32_t>(1, 1000000);
    direct += detail::direct_form(c, period_s).has_value() ? 1 : 0;
    const double half_step_deg = c.lti.gain / 64;
    const bool edge_between = c.dead_zone && c.dead_zone->upper != 20;
    const double promise = kFixedError_deg + (edge_between ? half_step_deg : 0);
    const double on_steps = worst_fixed_error_deg(c, period_s, search);
    RC_ASSERT(on_steps <= promise);
    search.in_steps = false;
    const double anywhere = worst_fixed_error_deg(c, period_s, search);
    RC_ASSERT(anywhere <= promise + half_step_deg);
    between += anywhere > on_steps ? 1 : 0;
  }));
  EXPECT_GE(direct, 20) << "of a hundred: the direct form was hardly tried";
  EXPECT_GE(between, 50) << "of a hundred: inputs between the steps must cost something";
}

TEST(FixedPoint, ThePublishedModelsHoldItToo) {
  for (const char* name : {"published_wiener", "published_hw"}) {
    const Model m = load(std::string(FLEXOR_SOURCE_DIR) + "/models/" + name + ".json");
    for (const Channel& c : m.channels) {
      const auto direct = detail::direct_form(c, m.sample_period_s);
      ASSERT_TRUE(direct.has_value()) << name << " " << c.name;
      EXPECT_LE(direct->error_deg, kFixedError_deg);
      const double on_steps = worst_fixed_error_deg(c, m.sample_period_s);
      EXPECT_LE(on_steps, direct->error_deg) << name << " " << c.name;
      EXPECT_GT(on_steps, 0.8 * direct->error_deg) << "the search is blind, or the bound far too wide";
      ErrorSearch anywhere;
      anywhere.in_steps = false;
      EXPECT_LE(worst_fixed_error_deg(c, m.sample_period_s, anywhere), direct->error_deg + c.lti.gain / 64);
    }
  }
}

// Just beside what the form allows: the angle comes down to zero as fast as it can, where rounding might take
// it below, and a number without a sign would become 4096 degrees.
TEST(FixedPoint, ADirectFormNeverFallsBelowZero) {
  EXPECT_TRUE(rc::check([] {
    Channel c = random_plain_chain();
    c.dead_zone.reset();
    c.saturation = {-10, 1900};
    std::vector<double> inputs;
    for (int k = 0; k < 400; ++k) inputs.push_back(k % 8 < 2 ? uniform(0, 1023) : uniform(0, 0.2));
    RC_ASSERT(fixed_error_deg(c, 0.1, inputs) <= kFixedError_deg);
  }));
}

}  // namespace
}  // namespace flexor::model
