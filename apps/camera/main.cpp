// flexor-camera: everything that needs OpenCV, as a worker (host/io/worker.hpp).

#include <sys/resource.h>

#include <thread>

#include "apps/camera/cameras.hpp"
#include "apps/camera/live_jobs.hpp"

int main(int argc, char** argv) {
  using namespace flexor;
  // A picture or a video may state any size, and its decoder asks nobody: memory that it does not get is the video's end. Each
  // core's threads have their stacks beside.
  constexpr rlim_t kMostBytes = 1100 << 20;
  constexpr rlim_t kStacks = 24 << 20;
  const rlim_t bytes = kMostBytes + kStacks * std::thread::hardware_concurrency();
  const rlimit most{bytes, bytes};
  setrlimit(RLIMIT_DATA, &most);
  std::map<std::string, io::Job> jobs = filming::live_jobs();
  jobs.insert({{"track", filming::track},
               {"propose_marks", filming::propose_marks},
               {"fit_lens", filming::fit_lens},
               {"film", filming::film},
               {"see", filming::see}});
  return io::serve(argc, argv, "flexor-camera: tracks hands in videos", jobs);
}
