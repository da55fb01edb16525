// What a glove's firmware may instantiate: every block there is in integers, one behind the other. Tables and what
// they are part of lie in flash; all other coefficients are constants of their instructions.
#include "runtime/compensator/blocks.hpp"

namespace {

using namespace flexor::compensator;  // NOLINT: a program of blocks

constexpr DeadZone<int16_t> kDeadZone = {-320, 640};
constexpr Play<int16_t> kPlay = {96};
const FixedHysteresis<4> kHysteresis PROGMEM = {{4, {32, 64, 128, 256}}, {1024, -512, 256, 128}};
const FixedCurve<3> kCurve PROGMEM = {{3, {0, 9600, 32000}, {4, 2, 1}},
                                      {{{0, 1228}, {720, 1054}, {1440, 0}}}};
constexpr FixedSum<2> kSum = {2, 12, {2048, 1024}, 512};
constexpr FixedLti<1, false> kFirst = {16384, -1, 0, {{40000, 3}}, {{0, 0}}, {0}, 15, 16, false, {{0}, {0}}};
constexpr FixedLti<3, true> kThird = {16384,
                                      -1,
                                      1000L,
                                      {{40000, 3}, {60000, 6}, {50000, 5}},
                                      {{50000, 2}, {40000, 4}, {50000, 3}},
                                      {100, 0, -200},
                                      14,
                                      16,
                                      false,
                                      {{0, 0, 0}, {0, 0, 0}}};
constexpr FixedLti<2, false> kDirect = {16384, -1, 0,    {{40000, 0}, {60000, 1}},   {{50000, 2}}, {0, 0},
                                        15,    16, true, {{30000, 2000}, {3000, 20}}};
constexpr FixedLag kLag = {{40000, 2}};
constexpr FixedPolePair kPolePair = {{-2768, 9000, -9000, -12768}, 15, {16384, -2048}, 14, 10, 11};
constexpr Saturation<int16_t> kSaturation = {0, 1440};

struct States {
  Play<int16_t>::State play;
  FixedHysteresis<4>::State hysteresis;
  FixedLti<1, false>::State first;
  FixedLti<3, true>::State third;
  FixedLti<2, false>::State direct;
  FixedLag::State lag;
  FixedPolePair::State pole_pair;
};

volatile int16_t adc[2];
volatile int16_t angle;

// The first sample starts a block, every one moves it.
template <class Block>
int16_t run(const Block& block, typename Block::State& state, bool first, int16_t u) {
  if (first) block.start(state, u);
  return block.step(state, u);
}

// The direct form starts from a block's own input in Q5, never negative.
int16_t angle_of(States& states, bool first, int16_t a, int16_t b) {
  int16_t v = run(kPlay, states.play, first, kDeadZone(a));
  v = kCurve(run(kHysteresis, states.hysteresis, first, v));
  v = run(kFirst, states.first, first, v);
  v = run(kThird, states.third, first, v);
  v = run(kLag, states.lag, first, v);
  v = run(kPolePair, states.pole_pair, first, v);
  const int16_t both[2] = {v, run(kDirect, states.direct, first, b)};
  return kSaturation(kSum(both));
}

}  // namespace

int main() {
  States states;
  for (bool first = true;; first = false) angle = angle_of(states, first, adc[0], adc[1]);
}
