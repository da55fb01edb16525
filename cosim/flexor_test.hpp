// For tests: `flexor` as a user runs it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/io/process.hpp"
#include "host/io/terminal_test.hpp"

namespace flexor::cosim {

using Finished = io::ProcessResult;

inline Finished flexor(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), std::filesystem::absolute(FLEXOR_PROGRAM).string());
  return io::run_process(arguments);
}

// What it prints with --json.
inline nlohmann::json json_of(std::vector<std::string> arguments) {
  arguments.emplace_back("--json");
  const Finished r = flexor(arguments);
  EXPECT_EQ(r.status, 0) << r.err;
  return nlohmann::json::parse(r.out, nullptr, false);
}

// The last thing on standard error is one line of the program's with these words.
inline void expect_message(const Finished& r, int exit, const std::string& message) {
  EXPECT_EQ(r.status, exit) << r.err;
  const std::size_t from = r.err.rfind("flexor: ");
  const std::string last = r.err.substr(from == std::string::npos ? 0 : from);
  EXPECT_NE(last.find(message), std::string::npos) << r.err;
  EXPECT_EQ(std::count(last.begin(), last.end(), '\n'), 1) << r.err;
}

}  // namespace flexor::cosim
