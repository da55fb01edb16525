// A glove that the digital twin wears, so that everything can be tried without hardware: with both simulated boards, or the
// glove alone.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/live/jobs.hpp"
#include "host/listen/source.hpp"
#include "host/study/bench.hpp"

namespace flexor::live {

using study::WornChange;

struct WornFacts {
  bool has_boards = false;
  std::string port = {};             // of the boards; empty: none
  std::string key_file = {};         // likewise
  std::string why_not_written = {};  // its board, through a bootloader, with the mend; "": it can be
  double rate_hz = 0;                // at which a model runs
  double lead_s = 0;                 // by which the hand comes after the reading
  const char* name() const { return has_boards ? "boards" : "twin"; }
};

// What the glove sends, on the clock of everything that comes from here.
class WornGlove : public listen::Source {
 public:
  virtual void set(const WornChange& change) = 0;
  // A motion by name (study::bench_motion), from its start, again and again; without boards at so many times the wall's pace, where
  // the machine can. Throws io::InputError.
  virtual void play(const std::string& motion, double pace) = 0;
  virtual study::BenchView now() const = 0;  // its angles, and the hand's faults
  // When the motion that was asked for last began; none: it has not yet.
  virtual std::optional<double> begun_s() const = 0;
  // Into the glove; without boards. Throws io::InputError where it does not run there.
  virtual void load(const model::Model& model) = 0;

  WornFacts facts;
  // For flexor identify: the open hand and the fist are the ends of the bionic hand.
  static nlohmann::ordered_json pose_angles();

  // Integrals of absolute error of the six gestures on what runs now, degree seconds: called on a thread of its own.
  using Score = std::function<nlohmann::ordered_json(const Jobs::Goes& goes)>;
  virtual Score score() = 0;
};

// Both simulated boards (host/study/bench.hpp). Throws io::InputError, io::JobError.
std::shared_ptr<WornGlove> worn_boards();

// Glove and hand without boards, at once and on any machine; its readings in this unit.
std::shared_ptr<WornGlove> worn_twin(const std::string& unit);

}  // namespace flexor::live
