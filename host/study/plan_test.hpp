// For tests: a run of two of the article's compensators.
#pragma once

#include "host/study/trials.hpp"

namespace flexor::study {

inline Plan plan(const std::string& gestures, int trials, const std::filesystem::path& folder = {}) {
  const std::vector<Compensator> both = {compensator("raw", 10), compensator("published-hw", 10)};
  return {twin::Parameters(), motions(gestures), both, 3, trials, 2, folder};
}

}  // namespace flexor::study
