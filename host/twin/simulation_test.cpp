#include "host/twin/simulation.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/twin/glove.hpp"

namespace flexor::twin {
namespace {

Motion gesture(int number) {
  const std::string path =
      std::string(FLEXOR_SOURCE_DIR) + "/models/gestures/" + std::to_string(number) + ".json";
  return Motion::from_json(io::read_file(path), path);
}

model::Model published_hw() {
  return model::load(std::string(FLEXOR_SOURCE_DIR) + "/models/published_hw.json");
}

// alpha in, alpha out.
model::Model identity(double period_s) {
  model::Model m;
  m.name = "identity";
  m.sample_period_s = period_s;
  for (const std::string& finger : model::finger_names()) {
    model::Channel c;
    c.name = finger;
    c.input_unit = "deg";
    c.valid_min = -100;
    c.valid_max = 1000;
    c.saturation = {0, 180};
    model::add(m, c);
  }
  return m;
}

// Noise, spread and imperfection switched off but for the sensor's; it bends as the finger does.
Parameters perfect() {
  Parameters p;
  for (const char* name : {"person.start_spread_s",    "person.pose_spread_deg", "person.speed_spread",
                           "placement.spread_deg",     "placement.gain_spread",  "cloth.knuckle_deg",
                           "cloth.slip_deg",           "cloth.visco_share",      "cloth.creep_share",
                           "sensor.drift_deg_per_min", "sensor.flutter_deg",     "sensor.burst_rate_per_s",
                           "radio.jitter_s",           "radio.module_latency_s", "motor.coulomb_mNm",
                           "motor.viscous_mNms_rad",   "motor.backlash_deg",     "motor.disturbance_mNm",
                           "potentiometer.noise_deg",  "camera.noise_deg",       "cloth.neighbour_share",
                           "cloth.thumb_share"}) {
    assign(p, std::string(name) + "=0");
  }
  p.bend_lower_deg = p.hand_lower_deg;
  p.bend_upper_deg = p.hand_upper_deg;
  p.baud = 1e7;
  return p;
}

double total(const Trial& t) { return std::accumulate(t.error_deg_s.begin(), t.error_deg_s.end(), 0.0); }

TEST(Simulation, ATrialDependsOnSeedAndNumberAndNothingElse) {
  twin::TrialInput input{Parameters(), gesture(1), published_hw(), 5, false};
  const auto together = simulate(input, 0, 16);
  const auto alone = simulate(input, 6, 3);
  const auto scalar = simulate_scalar(input, 6, 3);
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_TRUE(alone[t] == together[6 + t]);
    EXPECT_TRUE(scalar[t] == together[6 + t]);
  }
  EXPECT_NE(together[0].hand_deg, together[1].hand_deg);
  input.seed = 6;
  EXPECT_NE(simulate(input, 6, 3)[0].hand_deg, alone[0].hand_deg);
}

// Gesture 1 is closed for about 7.2 of its 10 s and open for about 0.6; what the hand is off meanwhile.
double resting_error(const Trial& t, double frames_hz) {
  const auto mean = [&](std::size_t finger, double from_s, double to_s) {
    double sum = 0;
    int n = 0;
    for (auto k = static_cast<std::size_t>(from_s * frames_hz);
         k < static_cast<std::size_t>(to_s * frames_hz); ++k, ++n) {
      sum += std::abs(static_cast<double>(t.glove_deg[finger][k] - t.hand_deg[finger][k]));
    }
    return sum / n;
  };
  double out = 0;
  for (std::size_t i = 0; i < kFingers; ++i) out += 7.2 * mean(i, 0.5, 3.4) + 0.6 * mean(i, 5.2, 5.5);
  return out;
}

// Trap 6: with everything perfect, a transition of D degrees costs D times the lag. The lag is known
// beforehand: half a sample of hold, the frame's way, the loop's lag to a ramp and one step of the plant.
// What the 10-bit converters leave while the hand rests is measured there and taken off.
TEST(Simulation, WithoutImperfectionsTheErrorIsThePureLag) {
  Parameters p = perfect();
  p.loop_proportional_per_deg = 0.2;
  p.loop_integral_per_deg_s = 0;
  p.resistance_ohm = 0.6;  // quick beside the loop, whose lag to a ramp is K_e / (K_p V)
  p.current_limit_A = 100;
  p.loop_speed_deg_s = 100000;
  const double no_load_deg_s = p.motor_V / (p.torque_constant_mNm_A / 1000 * p.gear_ratio) * 180 / 3.14159265;
  const double loop_s = 1 / (p.loop_proportional_per_deg * no_load_deg_s);
  const double frame_s = p.frame_bytes * 10 / p.baud + 0.001;  // taken up at the plant's next millisecond
  const auto run = [&](double period_s, double delay_s) {
    p.module_latency_s = delay_s;
    double sum = 0;
    constexpr int kTrials = 16;
    for (const Trial& t : simulate({p, gesture(1), identity(period_s), 1, false}, 0, kTrials))
      sum += (total(t) - resting_error(t, p.camera_rate_hz)) / kTrials;
    return sum;
  };
  constexpr double travel =
      2 * (80 + 4 * 83);  // degrees of all fingers together; times a lag, what the lag alone costs
  const double lag_s = 0.01 + 0.35 + frame_s + loop_s + kStep_s;
  EXPECT_NEAR(run(0.02, 0.35), travel * lag_s, 0.01 * travel * lag_s);
  EXPECT_NEAR(run(0.02, 0.05) - run(0.02, 0), travel * 0.05, 0.01 * travel * 0.05);
  EXPECT_NEAR(run(0.1, 0) - run(0.02, 0), travel * 0.04, 0.05 * travel * 0.04);  // hold: 50 ms instead of 10
}

double worst(const PerFinger& of) { return *std::ranges::max_element(of); }
double sum(const PerFinger& of) { return std::accumulate(of.begin(), of.end(), 0.0); }

// Readings beyond the hand's range, sent as they are, ram the joints into their stops and keep the motors
// pressing; the same readings with the loop's commands limited inside the range do neither. Vectors and the
// plain loop measure the same bits.
TEST(Simulation, ReadingsOutsideTheHandPressIntoItsStopsAndLimitsPreventIt) {
  Parameters p;
  const twin::TrialInput rammed{p, gesture(1), identity(0.1), 3, false};
  const Trial ram = simulate(rammed, 0, 1).front();
  EXPECT_GT(worst(ram.impact_deg_s), 50);
  EXPECT_GT(sum(ram.pressed_s), 5);
  const Trial scalar = simulate_scalar(rammed, 0, 1).front();
  EXPECT_EQ(scalar.impact_deg_s, ram.impact_deg_s);
  EXPECT_EQ(scalar.pressed_s, ram.pressed_s);

  p.loop_lower_deg = 95;  // inside every finger's range, so that no command reaches a stop
  p.loop_upper_deg = 108;
  p.loop_integral_limit = 0.25;
  const Trial gentle = simulate({p, gesture(1), identity(0.1), 3, false}, 0, 1).front();
  EXPECT_EQ(worst(gentle.impact_deg_s), 0);
  EXPECT_EQ(sum(gentle.pressed_s), 0);
}

// Each parameter at either end of its range, the others as shipped: refused in one line or finite figures.
TEST(Simulation, EveryParameterAtTheEndsOfItsRangeGivesFiniteFiguresOrARefusal) {
  const Motion motion = gesture(4);
  int played = 0;
  for (const model::Number& e : numbers(Parameters())) {
    for (const double value : {e.min, e.max}) {
      Parameters p;
      assign(p, fmt::format("{}={}", e.name, value));
      const twin::TrialInput input{p, motion, published_hw(), 1, false};
      try {
        check(input);
      } catch (const io::InputError&) {
        continue;
      }
      ++played;
      const Trial t = simulate_scalar(input, 0, 1).front();
      for (std::size_t i = 0; i < kFingers; ++i) {
        EXPECT_TRUE(std::isfinite(t.error_deg_s[i])) << e.name << " " << value;
        EXPECT_TRUE(std::isfinite(t.impact_deg_s[i])) << e.name << " " << value;
        EXPECT_TRUE(std::ranges::all_of(t.hand_deg[i], [](float a) { return std::isfinite(a); }))
            << e.name << " " << value;
      }
    }
  }
  EXPECT_GT(played, 80);
}

// What is sent is what the runtime's chain makes of the same counts, to the bit.
TEST(Simulation, BrokenSensorsAreTreatedAsOnTheGlove) {
  Parameters p = perfect();
  p.faults = {{0, FaultKind::open, 1, 2},
              {1, FaultKind::short_circuit, 1, 2},
              {2, FaultKind::stuck, 0.5, 2.8},
              {3, FaultKind::loose, 1, 6}};
  const model::Model model = identity(0.1);
  const Trial t = simulate({p, gesture(1), model, 3, true}, 0, 1).front();
  const Divider divider(p);
  model::Sensors alpha;
  alpha.fill([&](double counts) { return divider.alpha_deg(counts); });
  model::HostChain chain({model::glove_tables(model, alpha), model::HostCompensator(model), {}, 1});
  for (std::size_t k = 0; k < t.sample_s.size(); ++k) {
    std::array<int, kFingers> counts{};
    for (std::size_t i = 0; i < kFingers; ++i)
      for (counts[i] = kAdcTop; divider.alpha_deg(counts[i]) > t.reading[i][k];) --counts[i];
    for (int on = 0; k == 0 && on < 10; ++on) chain.step(counts);
    const link::Frame& frame = chain.step(counts);
    for (std::size_t i = 0; i < kFingers; ++i) EXPECT_EQ(16 * t.beta_deg[i][k], frame.angle[i]) << i;
    EXPECT_EQ(counts[0] == kAdcTop && counts[1] == 0, t.sample_s[k] >= 1 && t.sample_s[k] < 3);
  }
  EXPECT_EQ(t.beta_deg[0][34], 0) << "at rest";
}

TEST(Simulation, AReadingBeyondTheModelsRangeHoldsItsFinger) {
  model::Model model = identity(0.1);
  for (model::Input& input : model.inputs) input.valid_max = 100;  // the fist's 112 are refused
  const Trial t = simulate({perfect(), gesture(1), model, 3, true}, 0, 1).front();
  for (std::size_t i = 1; i < kFingers; ++i) EXPECT_NEAR(t.beta_deg[i][95], 80, 20) << "not at rest";
}

// The article's Raw: readings beyond the end stop, sent as they are. Without anti-windup the hand is stuck
// for seconds.
TEST(Simulation, AHandPressedIntoItsStopWindsUpUnlessItsIntegralIsLimited) {
  Parameters p = perfect();
  p.bend_upper_deg = {190, 133, 133, 133, 133};
  p.loop_integral_limit = 100;
  const double wound_up = total(simulate({p, gesture(1), identity(0.1), 1, false}, 0, 1).front());
  p.loop_integral_limit = 0.5;
  const double limited = total(simulate({p, gesture(1), identity(0.1), 1, false}, 0, 1).front());
  EXPECT_GT(wound_up, 600);
  EXPECT_LT(limited, 350);
}

TEST(Simulation, RefusesWhatDoesNotFit) {
  const auto with = [](const model::Model& model) { check({Parameters(), gesture(1), model, 1, false}); };
  const model::Model one = model::model_of(*model::channel(published_hw(), 0), 0.1);
  io::expect_refused([&] { with(one); }, "only joint(s) thumb");
  io::expect_refused([&] { with(identity(1e-4)); }, "runs at 1000 Hz");
  io::expect_refused([&] { with(identity(0.01)); },
                     "do not fit 9600 baud: set radio.frame_rate_hz to at most 80");
  EXPECT_NO_THROW(with(identity(0.1)));
}

TEST(Simulation, JointsFollowTheArticlesCoupling) {
  EXPECT_DOUBLE_EQ(posture(1, 60).pip_deg, 45);
  EXPECT_DOUBLE_EQ(posture(1, 60).dip_deg, 40);
  EXPECT_DOUBLE_EQ(posture(0, 60).pip_deg, 30);
}

}  // namespace
}  // namespace flexor::twin
