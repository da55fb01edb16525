// Engines that run in workers, other programs that are asked through pipes: the experiment's boards, whose firmware runs in cosim/
// (with a licence of its own), with what is deployed on them and what can be asked of them; and cameras that see pictures.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/deploy/deployment.hpp"
#include "host/deploy/hardware.hpp"
#include "host/io/io.hpp"
#include "host/io/worker.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {

// The pair's key in every simulated run.
deploy::Key bench_key();

// Of a trial: a model that reads neither counts nor alpha gets what the twin's divider makes of the counts, at the knots of the
// board's table.
deploy::Glove twin_glove(const twin::TrialInput& input);

using Counts = std::vector<std::array<int, kFingers>>;  // ADC readings, sample by sample

// The readings of trial 0 of the six gestures, one after the other, at the model's rate; of all fingers,
// whichever it has.
Counts gesture_counts(const twin::Parameters& parameters, const model::Model& model);

// From a sensor's edge to the motor, stage by stage.
inline constexpr std::array<const char*, 6> kLatencyStages = {"wait for the ADC", "sample and compute",
                                                              "wait for a frame", "UART and radio",
                                                              "verify",           "next motor command"};
using Latency = std::array<double, kLatencyStages.size()>;  // ms

// Of those that came through out of `asked`: "edges", "lost" (of which the frame that showed them first was lost on the way),
// "stages" and "total", each with mean_ms, min_ms, max_ms. Throws io::JobError where none did.
Json budget_of(const std::vector<Latency>& edges, int asked);
// Its results.json and latency.csv, which its report is drawn from. Throws io::InputError.
void save_results(const Json& budget, const std::string& title, const std::filesystem::path& folder);

// Boards whose firmware runs in workers, flexor-cosim, one for each thread that asks.
class Boards : public Engine {
 public:
  // Throws io::InputError when there is no such program.
  explicit Boards(std::filesystem::path program) : workers_(std::move(program)) {}

  std::string name() const override { return "avr"; }
  int batch() const override { return 1; }
  std::vector<twin::Trial> simulate(const twin::TrialInput& input, std::uint64_t first,
                                    int count) const override;

  // The glove's board on these readings, against the host.
  deploy::GloveFigures run_glove(const deploy::Glove& glove, const Counts& counts) const;
  // The board of this glove's hand with frames coming in as fast as the radio carries them.
  deploy::HandFigures run_hand(const model::Hardware& hardware, const deploy::Glove& glove,
                               double seconds) const;
  // Sensor edges at random times, both boards and the radio in between. An edge whose first frame the radio
  // loses is left out.
  std::vector<Latency> latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                               std::uint64_t seed) const;

 private:
  mutable io::WorkerPool workers_;
};

// Another engine plays, and both hands are drawn, frame by frame, and tracked by workers, flexor-camera.
class RenderedCameras : public Engine {
 public:
  // Plays on `inner`; null: the twin. Throws io::InputError when there is no such program.
  RenderedCameras(std::filesystem::path program, Engine* inner)
      : workers_(std::move(program)), inner_(inner) {}

  std::string name() const override {
    return (inner_ != nullptr ? inner_->name() : std::string("twin")) + ", rendered cameras";
  }
  int batch() const override { return 1; }
  // Throws io::JobError when a tracker loses a finger, which it never should in these pictures.
  std::vector<twin::Trial> simulate(const twin::TrialInput& input, std::uint64_t first,
                                    int count) const override;

 private:
  mutable io::WorkerPool workers_;
  Engine* inner_;
};

}  // namespace flexor::study
