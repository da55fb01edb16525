#include "host/twin/wearer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/io/io.hpp"
#include "host/twin/laboratory.hpp"

namespace flexor::twin {
namespace {

Motion worn_gesture(const std::string& name) {
  const std::string path = std::string(FLEXOR_SOURCE_DIR) + "/models/gestures/" + name + ".json";
  return Motion::from_json(io::read_file(path), path);
}

class WearerTest : public testing::Test {
 protected:
  // Until `end_ms`, in blocks; the fastest finger, deg/s.
  double go(std::int64_t end_ms) {
    double fastest = 0;
    for (; now_ms_ < end_ms; now_ms_ += kBlock_ms) {
      for (int i = 0; i < kFingers; ++i) {
        const double next = wearer_.angle(i, now_ms_ + kBlock_ms);
        fastest = std::max(fastest, std::abs(next - was_[static_cast<std::size_t>(i)]) / kBlock_s);
        was_[static_cast<std::size_t>(i)] = next;
      }
    }
    return fastest;
  }

  Variation variation_ = draw_variation(Parameters(), seed_of(1, 0));
  Wearer wearer_{variation_, worn_gesture("calibration")};
  std::int64_t now_ms_ = 0;
  PerFinger was_ = [this] {
    PerFinger out{};
    for (int i = 0; i < kFingers; ++i) out[static_cast<std::size_t>(i)] = wearer_.angle(i, 0);
    return out;
  }();
};

TEST_F(WearerTest, RestsBeforeTheFirstInstantToo) { EXPECT_EQ(wearer_.angle(1, -1990), wearer_.angle(1, 0)); }

TEST_F(WearerTest, PlaysAMotionAsATrialDoesAndAgainAfterARest) {
  EXPECT_EQ(go(1000), 0) << "at rest";
  EXPECT_FALSE(wearer_.start_ms());
  const Motion grab = worn_gesture("1");
  wearer_.play(grab, now_ms_);
  for (int round = 0; round < 2; ++round) {
    const std::int64_t start_ms = wearer_.start_ms().value();
    EXPECT_GT(start_ms, now_ms_);
    EXPECT_LT(go(start_ms), Wearer::kJoinSpeed_deg_s + 1);
    const auto end_ms = start_ms + static_cast<std::int64_t>(grab.duration_s() * 1000);
    for (; now_ms_ < end_ms; now_ms_ += kBlock_ms) {
      for (int i = 0; i < kFingers; ++i) {
        EXPECT_EQ(wearer_.angle(i, now_ms_),
                  grab.angle(i, static_cast<double>(now_ms_ - start_ms) / 1000, variation_));
      }
    }
    for (int i = 0; i < kFingers; ++i) was_[static_cast<std::size_t>(i)] = wearer_.angle(i, now_ms_);
    go(end_ms + Wearer::kAfter_ms + 2 * kBlock_ms);
  }
}

TEST_F(WearerTest, IsInterruptedInTheMiddleOfAMotionWithoutAJump) {
  wearer_.play(worn_gesture("1"), now_ms_);
  go(*wearer_.start_ms() + 3600);
  wearer_.play(worn_gesture("3"), now_ms_);
  EXPECT_LT(go(*wearer_.start_ms()), Wearer::kJoinSpeed_deg_s + 1);
  wearer_.rest(now_ms_);
  EXPECT_LT(go(now_ms_ + 5000), Wearer::kJoinSpeed_deg_s + 1);
  EXPECT_EQ(go(now_ms_ + 1000), 0);
}

}  // namespace
}  // namespace flexor::twin
