// For host/export/readers_test.py: what a program that wears a glove would send.
//   test_sender mcap PATH    samples into a file, a thousand a second, until it is killed
// Sample k has the angles k and -k / 2.
#include <chrono>
#include <thread>

#include "host/export/joint_state.hpp"

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

}  // namespace
}  // namespace flexor::exports

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  flexor::exports::JointStateFile file(argv[2], {"index_mcp", "two words"});
  flexor::exports::send(file, 1'000'000, std::chrono::milliseconds(1));
}
