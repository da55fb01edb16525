// How it stands with the glove: every state, and each transition in one place.
#pragma once

namespace flexor::live {

enum class DeviceState {
  none,           // nobody is there: somebody is looked for
  left,           // a person disconnected: nobody is looked for
  listening,      // to ports, one after the other
  doubtful,       // likewise, after one that says nothing that is known
  misunderstood,  // at the end of that
  glove,
  gone,  // unplugged: it is looked for
  replay,
  worn,  // by the twin
};

enum class DeviceEvent { drops, leaves, listens, misunderstands, ends, speaks, goes, returns, plays, wears };

DeviceState after(DeviceState state, DeviceEvent event);

// As SOCKET.md has it, but for gloves of the twin.
const char* name_of(DeviceState state);

}  // namespace flexor::live
