// What is asked of boards and what they answer on its way through a pipe: the same bits on the other side.
#pragma once

#include "host/deploy/deployment.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::link {

FLEXOR_PIPE(Key, bytes)

}  // namespace flexor::link

namespace flexor::model {

FLEXOR_PIPE(Pins, strip, joystick, button)

}  // namespace flexor::model

namespace flexor::deploy {

FLEXOR_PIPE(Sensor, counts, value)
FLEXOR_PIPE(Glove, model, sensor, output, baud, frame_rate_hz, key, pins, encoding, right_hand, track)
FLEXOR_PIPE(CycleStatistic, count, sum, worst)
FLEXOR_PIPE(GloveFigures, samples, frames, angles, mismatches, step, sample, stack_bytes, awake_share)
FLEXOR_PIPE(HandFigures, tick, stack_bytes, awake_share)

}  // namespace flexor::deploy
