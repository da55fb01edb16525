// Numbered jobs on any number of threads, their products taken one after the other: what is summed or written
// is the same bits whatever the threads.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"

namespace flexor::io {

inline constexpr int kMaxThreads = 256;

// 0: as many as the machine has. Throws InputError for a number that is none of threads.
inline int threads_of(int wanted) {
  if (wanted < 0 || wanted > kMaxThreads)
    throw InputError(std::to_string(wanted) + " threads are impossible; 0, as many as the machine has, to " +
                     std::to_string(kMaxThreads));
  return wanted > 0 ? wanted
                    : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, kMaxThreads);
}

// make(number) -> Product for first <= number < end, on any thread; take(number, product) in that order, one
// at a time. What either throws ends the run and is thrown here; what was taken before stays taken.
template <class Product, class Make, class Take>
void run_in_order(std::size_t first, std::size_t end, int threads, const Make& make, const Take& take) {
  // Not too far ahead of the slowest: what waits for its turn takes memory.
  const std::size_t ahead = 8 * static_cast<std::size_t>(threads);
  std::mutex mutex;
  std::condition_variable moved;
  std::size_t next = first;
  std::size_t taken = first;
  std::map<std::size_t, Product> waiting;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (;;) {
        std::size_t mine = 0;
        {
          std::unique_lock lock(mutex);
          moved.wait(lock, [&] { return failure || next < taken + ahead; });
          if (failure || next >= end) return;
          mine = next++;
        }
        go_on();
        Product product = make(mine);
        const std::lock_guard lock(mutex);
        waiting.emplace(mine, std::move(product));
        while (!failure && !waiting.empty() && waiting.begin()->first == taken) {
          take(taken, waiting.begin()->second);
          waiting.erase(waiting.begin());
          ++taken;
        }
        moved.notify_all();
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      moved.notify_all();
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 1; i < threads; ++i) workers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flexor::io
