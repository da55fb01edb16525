// The program as its users run it, in a folder that ends with the test.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>

#include "host/io/io.hpp"

namespace flexor::cli {

namespace fs = std::filesystem;

inline std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline std::ptrdiff_t lines(const std::string& text) {  // those of progress aside
  static const std::regex kProgress(
      R"((?!flexor: |warning: |note: ).* (\d+( of \d+)?(, about \d+ s left)?|\.\.\.))");
  std::istringstream stream(text);
  std::ptrdiff_t out = 0;
  for (std::string line; std::getline(stream, line);) out += !std::regex_match(line, kProgress);
  return out;
}

struct Finished {
  int exit = -1;
  int signal = 0;
  std::string out;
  std::string err;
  double peak_mb = 0;
};

class Command : public testing::Test {
 protected:
  Command() {
    fs::create_directories(folder_ / "tmp");
    write("stdout", "");
    write("stderr", "");
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  // For a shell.
  static std::string quoted(const std::string& word) { return "'" + word + "'"; }

  // The inputs that one of the programs for tests writes.
  void make(const std::string& program) const {
    ASSERT_EQ(std::system((quoted(program) + " " + quoted(folder_.string())).c_str()), 0);
  }

  // A shell takes the arguments and the assignments of `environment`.
  pid_t start(const std::string& arguments, const std::string& input = "/dev/null",
              const std::string& environment = "") const {
    const std::string command = environment + " exec " + quoted(fs::absolute(FLEXOR_PROGRAM).string()) + " " +
                                arguments + " < " + quoted(input);
    std::ofstream(path("stdout")), std::ofstream(path("stderr"));  // so that they hold no older one's
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::setenv("TMPDIR", path("tmp").c_str(), 1);  // what a killed process leaves behind
    ::dup2(::open(path("stdout").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 1);
    ::dup2(::open(path("stderr").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 2);
    fs::current_path(runs_in_);
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }

  Finished wait(pid_t child) const {
    int status = 0;
    rusage used{};
    ::wait4(child, &status, 0, &used);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, WIFSIGNALED(status) ? WTERMSIG(status) : 0,
            content(path("stdout")), content(path("stderr")), static_cast<double>(used.ru_maxrss) / 1024};
  }

  Finished run(const std::string& arguments, const std::string& input = "/dev/null",
               const std::string& environment = "") const {
    return wait(start(arguments, input, environment));
  }

  // What it prints: one JSON object, nothing before it, nothing after it, and none among the messages.
  static Json json_of(const Finished& r) {
    EXPECT_EQ(r.exit, 0) << r.err;
    EXPECT_EQ(r.err.find('{'), std::string::npos) << "the object is no log";
    EXPECT_TRUE(r.out.starts_with('{') && r.out.ends_with("}\n")) << r.out.substr(0, 500);
    return Json::parse(r.out, nullptr, false);
  }
  Json json_of(const std::string& arguments) const { return json_of(run(arguments)); }

  // Exit status, one line that has `expected`, and no file that was not there before.
  void expect_refused(const std::string& arguments, int exit, const std::string& expected) const {
    const auto count = [&] { return std::distance(fs::recursive_directory_iterator(folder_), {}); };
    const auto before = count();
    const Finished r = run(arguments);
    EXPECT_EQ(r.exit, exit) << arguments << "\n" << r.err.substr(0, 500);
    EXPECT_NE(r.err.find(expected), std::string::npos) << arguments << "\n" << r.err.substr(0, 500);
    EXPECT_EQ(lines(r.err), 1) << arguments << "\n" << r.err.substr(0, 500);
    EXPECT_EQ(r.out, "") << arguments;
    EXPECT_EQ(count(), before) << arguments;
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  fs::path runs_in_ = folder_;
};

}  // namespace flexor::cli
