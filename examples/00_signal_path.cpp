// The whole signal path on one page: a finger closes, its strip bends, the compensator answers, the hand
// follows. Everything between the two columns of degrees is the twin's; the compensator is the one that
// ships.
//
//   signal_path models/published_hw.json models/gestures/3.json
#include <cstdio>
#include <numeric>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/twin/simulation.hpp"

int main(int argc, char** argv) {
  using namespace flexor;
  const std::string gesture = argc > 2 ? argv[2] : "models/gestures/3.json";
  const twin::TrialInput input{
      .parameters = twin::Parameters(),  // the laboratory: every number has a name, see `flexor twin`
      .motion = twin::Motion::from_json(io::read_file(gesture), gesture),
      .compensator = model::load(argc > 1 ? argv[1] : "models/published_hw.json"),
      .seed = 1,
      .record_samples = true,
  };
  twin::check(input);
  const twin::Trial trial = twin::simulate(input, 0, 1).front();

  constexpr std::size_t kIndex = 1;
  std::printf("%s, index finger with %s\n", input.motion.name().c_str(), input.compensator.name.c_str());
  std::printf("  t (s)   finger   sensor   compensator    hand   (degrees)\n");
  for (std::size_t k = 0; k < trial.sample_s.size(); k += 2) {
    const double t = trial.sample_s[k];
    if (t < 3 || t > 5.5) continue;
    const auto frame = static_cast<std::size_t>(t * input.parameters.camera_rate_hz);
    std::printf("%7.2f %8.1f %8.1f %13.1f %7.1f\n", t, trial.true_deg[kIndex][k], trial.reading[kIndex][k],
                trial.beta_deg[kIndex][k], static_cast<double>(trial.hand_deg[kIndex][frame]));
  }
  const double total = std::accumulate(trial.error_deg_s.begin(), trial.error_deg_s.end(), 0.0);
  std::printf("total error of five fingers in %.0f s: %.1f degree-seconds\n", input.motion.duration_s(),
              total);
}
