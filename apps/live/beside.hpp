// Work beside a thread: a future at which it looks again and again. One that goes waits for its work.
#pragma once

#include <chrono>
#include <future>
#include <optional>

namespace flexor::live {

// What has come of it, once; none: nothing yet. Throws what the work throws.
template <class T>
std::optional<T> taken(std::future<T>& from, double wait_s = 0) {
  const std::chrono::duration<double> wait(wait_s);
  if (!from.valid() || from.wait_for(wait) != std::future_status::ready) return {};
  return from.get();
}

}  // namespace flexor::live
