// The experiment's boards: what is deployed on them, and what can be asked of them. Their firmware runs in
// another program (cosim/, with a licence of its own), which is asked through pipes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/deploy/calibration.hpp"
#include "host/io/io.hpp"
#include "host/io/worker.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {

// The pair's key in every simulated run.
deploy::Key bench_key();

// What the twin's glove and radio ask of the glove's firmware. A model of the divider's alpha reads the
// divider of the twin, one of counts the ADC's counts as they are, any other needs a calibration. Throws
// io::InputError.
deploy::Glove glove_for(const twin::Parameters& parameters, const model::Model& model,
                        const deploy::CalibrationDocument& calibration = {});
// The same for a glove that runs: what corrects its sensors stays in the model, since the board's tables are those of its image.
deploy::Glove glove_that_runs(const twin::Parameters& parameters, const model::Model& model,
                              const deploy::CalibrationDocument& calibration = {});

// Of a trial: a model that reads neither counts nor alpha gets what the twin's divider makes of the counts, at the knots of the
// board's table.
deploy::Glove twin_glove(const twin::TrialInput& input);

// The twin's hand as it is: loop, limits and end stops of the published system.
deploy::Hand twin_hand(const twin::Parameters& parameters, const model::Model& model);

// The same motors and joints with a loop that one may let loose: commands inside Psi, bounded effort and
// speed, stall detection, feed-forward of the motor's own back-EMF.
deploy::Hand safe_hand(const twin::Parameters& parameters, const model::Model& model);

// The model with the angles of this hand: where a finger's joint states ends (model::Ends) that lie farther off the hand's than
// a tenth of its range, open hand comes upon open hand and fist upon fist. `notes` gets a line for each.
model::Model on_hand(model::Model model, const twin::Parameters& parameters, std::vector<std::string>& notes);

using Counts = std::vector<std::array<int, kFingers>>;  // ADC readings, sample by sample

// The readings of trial 0 of the six gestures, one after the other, at the model's rate; of all fingers,
// whichever it has.
Counts gesture_counts(const twin::Parameters& parameters, const model::Model& model);

struct CycleStatistic {
  std::uint64_t count = 0;
  std::uint64_t sum = 0;
  std::uint64_t worst = 0;
  void add(std::uint64_t cycles) {
    ++count;
    sum += cycles;
    worst = cycles > worst ? cycles : worst;
  }
  double mean() const { return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0; }
};

struct GloveFigures {
  std::size_t samples = 0;
  std::size_t frames = 0;
  std::size_t angles = 0;      // compared with the host's runtime
  std::size_t mismatches = 0;  // messages of which one bit differs, or that never came
  CycleStatistic step;  // compensator, five channels; without the first, which starts it; markers subtracted
  CycleStatistic sample;  // all of a sample's work until a frame is sealed
  int stack_bytes = 0;
  double awake_share = 0;
};

struct HandFigures {
  CycleStatistic tick;  // five position loops, motors included
  int stack_bytes = 0;
  double awake_share = 0;
};

// From a sensor's edge to the motor, stage by stage.
inline constexpr std::array<const char*, 6> kLatencyStages = {"wait for the ADC", "sample and compute",
                                                              "wait for a frame", "UART and radio",
                                                              "verify",           "next motor command"};
using Latency = std::array<double, kLatencyStages.size()>;  // ms

// Boards whose firmware runs in workers, flexor-cosim, one for each thread that asks.
class Boards : public Engine {
 public:
  // Throws io::InputError when there is no such program.
  explicit Boards(std::filesystem::path program);

  std::string name() const override { return "avr"; }
  int batch() const override { return 1; }
  std::vector<twin::Trial> simulate(const twin::TrialInput& input, std::uint64_t first,
                                    int count) const override;

  // The glove's board on these readings, against the host.
  GloveFigures run_glove(const deploy::Glove& glove, const Counts& counts) const;
  // The board of this glove's hand with frames coming in as fast as the radio carries them.
  HandFigures run_hand(const twin::Parameters& parameters, const deploy::Glove& glove, double seconds) const;
  // Sensor edges at random times, both boards and the radio in between. An edge whose first frame the radio
  // loses is left out.
  std::vector<Latency> latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                               std::uint64_t seed) const;

 private:
  mutable io::WorkerPool workers_;
};

}  // namespace flexor::study
