// The twin's glove and hand without boards: the converter's counts of every sensor, and a hand that follows what the glove's chain
// makes of them over the radio.
//
// The person is that of the experiment's trial 0 with seed 1. Columns: FINGER_count, or in degrees FINGER_alpha_deg. Time is the
// simulation's: it keeps pace with the wall, and stands while nobody waits for samples. For one thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/worn_glove.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/simulation.hpp"
#include "host/twin/wearer.hpp"

namespace flexor::live {

struct TwinOptions {
  double rate_hz = 100;                                           // 1 to 1000
  std::optional<twin::Motion> motion = study::ordinary_motion();  // again and again; none: at rest
  std::string unit = "count";                                     // as twin::Divider::reading takes it
  double pace = 1;  // of the wall's time at most; 0: a sample is there whenever somebody waits
};

class TwinSource : public WornGlove {
 public:
  explicit TwinSource(TwinOptions options = {});
  ~TwinSource() override;

  // One sample at most.
  listen::Event wait(double timeout_s, std::vector<listen::Sample>& out) override;
  double now_s() const override { return static_cast<double>(now_ms_) / 1000; }
  std::string description() const override;

  void set(const WornChange& change) override;
  // The glove's compensator, at the source's rate. Throws io::InputError as twin::check() does.
  void run_on_glove(model::Model compensator);
  void load(const model::Model& model) override;
  // Another motion, or the same one from its beginning; none: rest. The hand goes there without a jump. Where the motion begins,
  // two seconds of rest before its t = 0, cloth, sensors and noise begin again: what comes from there on is the same each time.
  void play(std::optional<twin::Motion> motion);
  void play(const std::string& motion, double pace) override;
  std::optional<double> begun_s() const override;

  study::BenchView now() const override;
  // Integral of the absolute error in a motion of its own, all fingers, deg s; with glove and hand as they are now, on any thread.
  std::function<double(const twin::Motion&)> score_on() const;
  Score score() override;

 private:
  struct Run;

  bool step();  // whether the glove took a sample
  twin::TrialInput now_worn() const;
  void begin_again();
  double wall_s() const;  // as long as the twin has had, at its pace
  double due_s() const;

  twin::TrialInput input_;
  double pace_;
  twin::Wearer wearer_;
  std::unique_ptr<Run> run_;
  std::string unit_;
  std::function<double(double counts)> reading_;
  WornChange set_;
  double drifted_deg_ = 0;
  bool is_joining_ = false;
  std::int64_t now_ms_ = 0;
  double start_s_ = 0;  // now_s() at start_
};

}  // namespace flexor::live
