#include "host/report/saved.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/io/expect_test.hpp"
#include "host/report/render.hpp"

namespace flexor::report {
namespace {
namespace fs = std::filesystem;

class SavedTest : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const { io::write_file(folder_ / name, text); }

  void expect_refused(const std::string& words) const {
    io::expect_refused([&] { render(folder_); }, words);
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(SavedTest, ReadsColumnsOfNumbers) {
  write("results.json", R"({"kind": "experiment"})");
  write("a.csv", "t_s,x\n0,1.5\n0.1,\n0.2,-3e2\n");
  const Columns c = Saved(folder_).columns("a.csv");
  EXPECT_EQ(c.at("t_s"), (std::vector<double>{0, 0.1, 0.2}));
  EXPECT_EQ(c.at("x")[2], -300);
  EXPECT_TRUE(std::isnan(c.at("x")[1]));
  write("a.csv", "t_s,x\n0,1.5\n0.1,two\n");
  EXPECT_THROW((void)Saved(folder_).columns("a.csv"), io::InputError);
}

TEST_F(SavedTest, WhatIsNoJobsFolderIsRefusedInOneLine) {
  expect_refused("no results.json");
  write("results.json", "[1]");
  expect_refused("another version");
  write("results.json", R"({"kind": "poetry"})");
  expect_refused("unknown job \"poetry\"");
  for (const char* kind : {"hand", "experiment", "tracking", "deployment", "latency"}) {
    write("results.json", std::string(R"({"kind": ")") + kind + R"(", "angles": 3, "cells": []})");
    write("samples.csv", "t_s\n0\n");
    expect_refused("run the job again");
    EXPECT_FALSE(fs::exists(folder_ / "report.html"));
  }
}

}  // namespace
}  // namespace flexor::report
