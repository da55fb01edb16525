// The hand's image between end stops that give: how fast a joint gets, and how long a motor presses. Potentiometers lie in
// soak_test.cpp and, of all kinds, in runtime/hand/protection_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cosim/built_images_test.hpp"
#include "cosim/co_simulation.hpp"

namespace flexor::cosim {
namespace {

constexpr int kFinger = 2;
constexpr double kTop_deg_s = 450;
constexpr double kLongest_s = 0.05;

twin::TrialInput input_of(const std::string& gesture) {
  twin::TrialInput input = between_soft_stops(published_input(20, gesture));
  input.parameters.frame_bytes = link::frame_bytes(true);
  return input;
}

const Images& soft_images() {
  static const Images built = built_images(input_of("1"));
  return built;
}

// The drivers' enable is all that ends this: PWM at 0 does not.
TEST(Protection, ADriverThatSticksIsSwitchedOffWithAllOthersUntilTheNextStart) {
  const twin::TrialInput input = input_of("1");
  for (const double share : {1.0, -1.0}) {
    for (const int onset_ms : {300, 1234, 3456, 5005}) {
      CoSimulation simulation(soft_images(), input, 5);
      simulation.on_ms = [&](std::int64_t now) {
        if (now == onset_ms) simulation.hand().stick(kFinger, share);
        if (now < onset_ms + 100) return;
        for (int i = 0; i < twin::kFingers; ++i)
          ASSERT_EQ(simulation.hand().duty(i), 0) << share << ' ' << onset_ms;
      };
      const twin::Trial done = simulation.run();
      EXPECT_LE(done.pressed_s[kFinger], kLongest_s) << share << ' ' << onset_ms;
      EXPECT_EQ(simulation.hand_status().board, hand::kRunaway);
    }
  }
}

TEST(Protection, AnHonestHandHasNoFaultInAnyGestureAndTouchesNoStop) {
  for (const char* gesture : {"1", "2", "3", "4", "5", "6"}) {
    for (const std::uint64_t trial : {std::uint64_t{1}, std::uint64_t{2}}) {
      const twin::TrialInput input = input_of(gesture);
      CoSimulation simulation(soft_images(), input, trial);
      simulation.on_ms = [&](std::int64_t now) {
        const HandStatus status = simulation.hand_status();
        for (int i = 0; i < twin::kFingers && now >= 0; ++i) {
          ASSERT_EQ(status.fault[i], 0) << gesture;
          ASSERT_LE(std::abs(simulation.world().speed_deg_s(i)), kTop_deg_s) << gesture;
        }
      };
      const twin::Trial done = simulation.run();
      EXPECT_EQ(std::ranges::max(done.impacts), 0) << gesture;
      EXPECT_EQ(std::ranges::max(done.pressed_s), 0) << gesture;
    }
  }
}

TEST(Protection, ASupplyThatDipsAndAConverterThatStopsLetGoUntilTheyAreBack) {
  constexpr std::uint16_t kAdcsra = 0x7a;
  for (const std::uint8_t fault : {hand::kSupplyDip, hand::kAdcStuck}) {
    const twin::TrialInput input = input_of("1");
    CoSimulation simulation(soft_images(), input, 3);
    std::uint8_t seen = 0;
    simulation.on_ms = [&](std::int64_t now) {
      Board& board = simulation.hand();
      if (fault == hand::kSupplyDip && now == 3000) board.set_supply(4200);
      if (fault == hand::kSupplyDip && now == 3300) board.set_supply(5000);
      if (fault == hand::kAdcStuck && now >= 3000 && now < 3200) board.write(kAdcsra, 0);
      if (now < 0) return;
      const HandStatus status = simulation.hand_status();
      seen |= status.board;
      EXPECT_TRUE(now != 3100 || board.duty(kFinger) == 0) << "limp";
      EXPECT_TRUE(now != 6000 || status.board == 0) << "well again";
    };
    simulation.run();
    EXPECT_EQ(seen, fault);
  }
}

}  // namespace
}  // namespace flexor::cosim
