// Commands that are interrupted at random instants die of that signal, say so in one line, and leave neither a temporary nor a worker
// behind, whatever they were doing: tracking, fitting, drawing.
#include <random>
#include <thread>

#include "apps/cli/command_test.hpp"

namespace flexor::cli {
namespace interrupt_test {

using Interrupted = Command;

TEST_F(Interrupted, AtAnyInstantACommandEndsInOneLineAndLeavesNothing) {
  make(FLEXOR_TEST_INPUTS);
  make(FLEXOR_SIMULATE);
  fs::copy_file(FLEXOR_SOURCE_DIR "/models/published_hw.json", path("hw.json"));
  std::mt19937 random(2019);
  for (const std::string command :
       {"track video.mp4 --joints joints.json --out o/a.csv --preview o/p.mp4 --report o/r",
        "identify --sensor simulated_glove.csv --reference simulated_camera.csv --structure linear "
        "--model o/m.json --report o/r",
        "deploy hw.json --out o/d", "experiment --gestures 1 --trials 2 --out o/e"}) {
    fs::create_directory(path("o"));
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(run(command).exit, 0) << command;
    std::chrono::duration<double> whole = std::chrono::steady_clock::now() - begin;
    int stopped = 0, reported = 0;
    for (int k = 0; k < 12; ++k) {
      fs::remove_all(path("o"));
      fs::create_directory(path("o"));
      const pid_t child = start(command);
      const auto instant = whole * std::uniform_real_distribution<>()(random);
      std::this_thread::sleep_for(instant);
      ::kill(child, k % 2 == 0 ? SIGINT : SIGTERM);
      const Finished r = wait(child);
      EXPECT_TRUE(r.signal == (k % 2 == 0 ? SIGINT : SIGTERM) || r.exit == 0) << command << r.err;
      static const std::regex kLine("flexor: (interrupted|stopped: .*)\n$");
      if (r.signal == 0) whole = instant;  // it is quicker than the first time
      stopped += r.signal != 0;
      reported += std::regex_search(r.err, kLine);
      EXPECT_TRUE(r.signal == 0 || r.err.empty() || std::regex_search(r.err, kLine)) << command << r.err;
      EXPECT_TRUE(fs::is_empty(path("tmp")));
      for (const auto& entry : fs::recursive_directory_iterator(path("o"))) {
        const std::string name = entry.path().filename();
        EXPECT_TRUE(name.find(".part-") == name.npos && !name.starts_with(".deploy-")) << name;
      }
      // A worker's command line names nothing: what it may write to does.
      for (const auto& process : fs::directory_iterator("/proc"))
        EXPECT_EQ(content(process.path() / "environ").find(path("tmp")), std::string::npos) << process;
    }
    EXPECT_GT(2 * reported, stopped) << command << ": the others died before they listened";
    fs::remove_all(path("o"));
  }
}

}  // namespace interrupt_test
}  // namespace flexor::cli
