// All kinds of block that a model may have, in one list: the interpreter's operations, the host's documents and the assembler
// come from it. To add one (docs/adding-a-block.md does it):
//
//   1. Write its equation, in floating point and in integers, as a struct here, with `code`: its coefficients in order.
//   2. Write what a document has of it as a struct in host/model/kinds.hpp (kind.hpp lists its members).
//   3. Add both to the list below, at its end: its place is its number in models that boards have stored. Until both are
//      there, nothing compiles.
//   4. Show in a test what it computes. Where the bytes of a block that was there change, raise kGraphVersion (graph.hpp).
#pragma once

#include "runtime/compensator/curve.hpp"
#include "runtime/compensator/dead_zone.hpp"
#include "runtime/compensator/hysteresis.hpp"
#include "runtime/compensator/lag.hpp"
#include "runtime/compensator/lti.hpp"
#include "runtime/compensator/play.hpp"
#include "runtime/compensator/pole_pair.hpp"
#include "runtime/compensator/saturation.hpp"
#include "runtime/compensator/sum.hpp"

namespace flexor {
namespace compensator {

constexpr uint8_t kMostPlays = 4;
constexpr uint8_t kMostTerms = 32;

// Its name in documents and as an operation, its struct in host/model, its struct here in integers.
#define FLEXOR_BLOCKS(BLOCK)                                 \
  BLOCK(dead_zone, DeadZone, DeadZone<int16_t>)              \
  BLOCK(curve, Curve, Curves)                                \
  BLOCK(play, Play, Play<int16_t>)                           \
  BLOCK(hysteresis, Hysteresis, FixedHysteresis<kMostPlays>) \
  BLOCK(lag, Lag, FixedLag)                                  \
  BLOCK(lti, Lti, FixedLti<kMaxOrder, true>)                 \
  BLOCK(pole_pair, PolePair, FixedPolePair)                  \
  BLOCK(saturation, Saturation, Saturation<int16_t>)         \
  BLOCK(sum, Sum, SumOfSignals<kMostTerms>)

}  // namespace compensator
}  // namespace flexor
