// The twin's glove alone, in real time, without boards: the converter's counts of every strip.
//
// The person is that of the experiment's trial 0 with this seed. Columns: FINGER_count. For one thread.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/worn_glove.hpp"
#include "host/listen/source.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/wearer.hpp"
#include "host/twin/world.hpp"

namespace flexor::live {

struct TwinOptions {
  twin::Parameters parameters = study::shipped_parameters();
  double rate_hz = 100;  // 1 to 1000
  std::uint64_t seed = 1;
  std::optional<twin::Motion> motion = study::ordinary_motion();  // again and again; none: at rest
};

class TwinSource : public listen::Source {
 public:
  // Throws io::InputError: a rate out of bounds, and as twin::check() does.
  explicit TwinSource(TwinOptions options = {});

  // What was due is given with the instant at which it was due. Whoever does not ask for seconds finds that the twin has
  // waited for him.
  listen::Event wait(double timeout_s, std::vector<listen::Sample>& out) override;
  const std::vector<std::string>& columns() const override { return columns_; }
  const listen::Tally& tally() const override { return tally_; }
  double now_s() const override;
  std::string says() const override;

  // Throws io::InputError for what is no finite number, a noise below 0, a loss that is no share.
  void set(const WornChange& change);
  // Another motion, or the same one from its beginning; none: rest. The hand goes there without a jump.
  void play(std::optional<twin::Motion> motion);

  // Of the newest sample: degrees in the article's convention.
  twin::PerFinger finger_deg() const { return finger_deg_; }

 private:
  void step();
  void sample(std::vector<listen::Sample>& out);
  double due_s() const;

  twin::TrialInput input_;
  double rate_hz_;
  twin::World world_;
  twin::Wearer wearer_;
  twin::Random random_;
  std::vector<std::string> columns_;
  listen::Tally tally_{.lost = 0};
  WornChange set_;
  double drifted_deg_ = 0;
  twin::PerFinger finger_deg_{};
  std::int64_t samples_ = 0;  // of the simulation, lost ones among them
  std::chrono::steady_clock::time_point start_;
  double waited_s_ = 0;  // by which the simulation is behind now_s()
};

}  // namespace flexor::live
