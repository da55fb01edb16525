#include "apps/live/glove_port.hpp"

#include <gtest/gtest.h>

#include <array>

namespace flexor::live {
namespace {

TEST(DeviceState, EachEventInEachState) {
  using enum DeviceState;
  constexpr std::array kStates = {none, left, listening, doubtful, misunderstood, glove, gone, replay, worn};
  struct Row {
    DeviceEvent event;
    std::array<DeviceState, 9> next;
  };
  const std::array<Row, 10> rows = {{
      {DeviceEvent::drops, {none, none, none, none, none, none, none, none, none}},
      {DeviceEvent::leaves, {left, left, left, left, left, left, left, left, left}},
      {DeviceEvent::listens,
       {listening, listening, listening, listening, listening, glove, gone, replay, worn}},
      {DeviceEvent::misunderstands,
       {none, left, doubtful, doubtful, misunderstood, glove, gone, replay, worn}},
      {DeviceEvent::ends, {none, left, none, misunderstood, misunderstood, glove, gone, replay, worn}},
      {DeviceEvent::speaks, {glove, glove, glove, glove, glove, glove, glove, glove, glove}},
      {DeviceEvent::goes, {none, left, listening, doubtful, misunderstood, gone, gone, replay, worn}},
      {DeviceEvent::returns, {none, left, listening, doubtful, misunderstood, glove, glove, replay, worn}},
      {DeviceEvent::plays, {replay, replay, replay, replay, replay, replay, replay, replay, replay}},
      {DeviceEvent::wears, {worn, worn, worn, worn, worn, worn, worn, worn, worn}},
  }};
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < kStates.size(); ++k)
      EXPECT_EQ(after(kStates[k], row.event), row.next[k])
          << static_cast<int>(row.event) << " in " << static_cast<int>(kStates[k]);
  }
}

}  // namespace
}  // namespace flexor::live
