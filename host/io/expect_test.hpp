// For tests: one line with the words that matter.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "host/io/refusal_test.hpp"

namespace flexor::io {

inline void expect_line(const std::string& what, const std::string& words) {
  EXPECT_NE(what.find(words), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
}

template <class Error = InputError, class Work>
void expect_refused(const Work& work, const std::string& words) {
  expect_line(refusal_of<Error>(work), words);
}

}  // namespace flexor::io
