// An engine whose cameras see pictures: another one plays, the twin or boards, and both hands are drawn, frame
// by frame, and tracked by workers, flexor-camera.
#pragma once

#include <filesystem>

#include "host/io/worker.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {

class RenderedCameras : public Engine {
 public:
  // Plays on `inner`; null: the twin. Throws io::InputError when there is no such program.
  RenderedCameras(std::filesystem::path program, Engine* inner);

  std::string name() const override;
  int batch() const override { return 1; }
  // Throws io::JobError when a tracker loses a finger, which it never should in these pictures.
  std::vector<twin::Trial> simulate(const twin::TrialInput& input, std::uint64_t first,
                                    int count) const override;

 private:
  mutable io::WorkerPool workers_;
  Engine* inner_;
};

}  // namespace flexor::study
