#include "apps/live/device_state.hpp"

namespace flexor::live {

DeviceState after(DeviceState state, DeviceEvent event) {
  using enum DeviceState;
  const bool has_source = state == glove || state == gone || state == replay || state == worn;
  switch (event) {
    case DeviceEvent::drops:
      return none;
    case DeviceEvent::leaves:
      return left;
    case DeviceEvent::listens:
      return has_source ? state : listening;
    case DeviceEvent::misunderstands:
      return state == listening ? doubtful : state;
    case DeviceEvent::ends:
      return state == listening ? none : state == doubtful ? misunderstood : state;
    case DeviceEvent::speaks:
      return glove;
    case DeviceEvent::goes:
      return state == glove ? gone : state;
    case DeviceEvent::returns:
      return state == gone ? glove : state;
    case DeviceEvent::plays:
      return replay;
    case DeviceEvent::wears:
      return worn;
  }
  return state;
}

const char* name_of(DeviceState state) {
  switch (state) {
    case DeviceState::listening:
    case DeviceState::doubtful:
      return "listening";
    case DeviceState::glove:
      return "glove";
    case DeviceState::gone:
      return "gone";
    case DeviceState::replay:
      return "replay";
    default:
      return "none";
  }
}

}  // namespace flexor::live
