// For host/export/readers_test.py: what a program that wears a glove would send.
//   test_sender mcap PATH    samples into a file, a thousand a second, until it is killed
//   test_sender lsl NAME     once somebody listens 300 samples, a hundred a second; ends with its standard input
// Sample k has the angles k and -k / 2.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include "host/export/joint_state.hpp"
#include "host/export/lsl.hpp"
#include "host/io/io.hpp"

namespace flexor::exports {
namespace {

// A clock of its own, as a source of samples has.
double now_s() {
  static const auto kStart = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - kStart).count();
}

void send(Sink& sink, int samples, std::chrono::milliseconds step) {
  for (int k = 0; k < samples; ++k) {
    const double angles[] = {static_cast<double>(k), -0.5 * k};
    sink.add(now_s(), angles);
    std::this_thread::sleep_for(step);
  }
}

void to_mcap(const std::string& path) {
  JointStateFile file(path, {"index_mcp", "two words"}, {});
  send(file, 1'000'000, std::chrono::milliseconds(1));
}

void to_lsl(const std::string& name) {
  LslOptions options;
  options.name = name;
  options.rate_hz = 100;
  options.source_id = name;
  LslStream stream({"index_mcp", "two words"}, options);
  for (int i = 0; i < 6000 && !stream.is_heard(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  send(stream, 300, std::chrono::milliseconds(10));
  std::printf("%s\n", stream.says().c_str());
  std::fflush(stdout);
  char byte;
  while (::read(STDIN_FILENO, &byte, 1) > 0) {
  }
}

}  // namespace
}  // namespace flexor::exports

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    const std::string what = argv[1];
    what == "mcap" ? flexor::exports::to_mcap(argv[2]) : flexor::exports::to_lsl(argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
