#include "host/io/run_in_order.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>

namespace flexor::io {
namespace {

// Jobs of very different length: numbers are squared by adding.
std::size_t square(std::size_t n) {
  std::size_t sum = 0;
  for (std::size_t k = 0; k < (n % 7 == 0 ? 200 : 1) * n; ++k) sum += n % 7 == 0 ? (k % 200 == 0 ? n : 0) : n;
  return sum;
}

TEST(RunInOrder, TakesEveryProductOnceAndInOrderOnAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8, 32}) {
    std::vector<std::size_t> taken;
    std::vector<std::size_t> products;
    run_in_order<std::size_t>(5, 500, threads, square, [&](std::size_t number, std::size_t product) {
      taken.push_back(number);
      products.push_back(product);
    });
    std::vector<std::size_t> all(495);
    std::iota(all.begin(), all.end(), 5);
    EXPECT_EQ(taken, all) << threads;
    for (std::size_t i = 0; i < products.size(); ++i) EXPECT_EQ(products[i], (i + 5) * (i + 5));
  }
}

TEST(RunInOrder, WhatAJobThrowsEndsTheRunAndWhatWasTakenStays) {
  for (const int threads : {1, 4}) {
    std::size_t taken = 0;
    const auto run = [&] {
      run_in_order<int>(
          0, 1000, threads,
          [](std::size_t number) {
            if (number == 300) throw std::runtime_error("300");
            return 1;
          },
          [&](std::size_t, int product) { taken += static_cast<std::size_t>(product); });
    };
    EXPECT_THROW(run(), std::runtime_error);
    EXPECT_LE(taken, 300U);
  }
}

TEST(RunInOrder, WhatTakingThrowsEndsTheRun) {
  std::atomic<std::size_t> made = 0;
  const auto run = [&] {
    run_in_order<int>(
        0, 100000, 4, [&](std::size_t) { return static_cast<int>(++made > 0); },
        [](std::size_t number, int) {
          if (number == 10) throw std::runtime_error("full");
        });
  };
  EXPECT_THROW(run(), std::runtime_error);
  EXPECT_LT(made, 1000U);
}

TEST(RunInOrder, NothingToDoIsDone) {
  run_in_order<int>(
      3, 3, 4, [](std::size_t) { return 1; }, [](std::size_t, int) { FAIL(); });
}

}  // namespace
}  // namespace flexor::io
