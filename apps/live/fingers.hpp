// What a source's columns and a model make of each sample: the fingers that the live view shows.
//
// Without a model there is a finger for each column. With one there is a finger for each joint, with the reading of its own
// sensor, and one for each column that the model does not take. The angles are those that `flexor apply` would give for the
// recording: the same clock, resampler and runtime, causal.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/estimator.hpp"
#include "host/io/pipe_json.hpp"
#include "host/listen/log.hpp"

namespace flexor::live {

inline constexpr double kMoves_counts = 3;  // a reading that has changed by no more has not moved

struct FingerView {
  std::string name;
  std::string unit;
  double raw = 0;
  double angle_deg = 0;  // NaN: not known
  double sd_deg = 0;     // likewise
  double least = 0;      // reading so far, single outliers left out
  double most = 0;
  double covered = 0;            // share of the range that the model was made from, at most 1; NaN: not known
  std::string quality = "none";  // good, fair, poor, none
  std::string remark;            // what is wrong, in words
  std::string tracked;           // how its sensor is followed while it is worn, in words; "": it is not
  double open_deg = std::numeric_limits<double>::quiet_NaN();  // the joint's ends; NaN: no model has it
  double fist_deg = std::numeric_limits<double>::quiet_NaN();
};

FLEXOR_PIPE(FingerView, name, unit, raw, angle_deg, sd_deg, open_deg, fist_deg, least, most, covered, quality,
            remark, tracked)

// Whether any sensor of it can be followed while it is worn (host/model/tracking.hpp).
bool can_be_tracked(const model::Model& model);

class Fingers {
 public:
  explicit Fingers(std::vector<std::string> columns);

  // From now on. Throws io::InputError naming the column that the model needs and is not there.
  void wear(const model::Model& model, bool tracked);
  void take_off();

  void add(const listen::Sample& sample);

  std::size_t size() const { return fingers_.size(); }
  // Of each in the newest sample. NaN: not known.
  std::vector<double> raw() const { return of_each(&Fingers::reading_of); }
  std::vector<double> angle_deg() const { return of_each(&Fingers::angle_of); }
  std::vector<FingerView> view(double now_s) const;
  // By whole bends two sensors (the one, where there is one) lie otherwise than when the model was made, by twice the standard error,
  // or drift more quickly than they could be followed.
  bool has_slipped() const;
  // Some sensor of the model, over half of what the model was made from.
  bool has_moved() const;
  bool is_worn() const { return estimator_.has_value(); }
  // The joints' angles of the newest sample, in the model's order; empty without a model.
  const std::vector<double>& joints_deg() const { return joints_deg_; }

 private:
  struct Column {
    std::string name;  // as recording::cut_name gives it
    std::string unit;
    double now = std::numeric_limits<double>::quiet_NaN();  // NaN: no reading came, or the newest is missing
    std::array<double, 3> last{};                           // readings that were not missing, newest first
    int count = 0;                                          // of them
    double least = 0;
    double most = 0;
    std::string remark;
  };
  struct Finger {
    std::string name;
    std::size_t column = 0;
    std::optional<std::size_t> joint;
    std::optional<std::size_t> input;
  };

  std::size_t column_of(const model::Input& input) const;
  void remember(Column& column, double reading);
  double angle_of(const Finger& finger) const;
  double reading_of(const Finger& finger) const { return columns_[finger.column].now; }
  std::vector<double> of_each(double (Fingers::*value)(const Finger&) const) const {
    std::vector<double> out;
    for (const Finger& finger : fingers_) out.push_back((this->*value)(finger));
    return out;
  }
  FingerView view_of(const Finger& finger, bool recent) const;
  void add_tracking(const model::Followed& followed, FingerView& view) const;

  std::vector<std::string> names_;
  std::vector<Column> columns_;
  std::vector<Finger> fingers_;
  std::optional<model::Model> model_;
  std::vector<std::size_t> inputs_;  // the model's, as columns
  using Estimator = identify::Estimator<model::DoubleArithmetic>;
  std::optional<Estimator> estimator_;
  std::optional<Estimator> watch_;  // where the estimator follows no changes, what would: for has_slipped
  std::vector<double> reading_;
  std::vector<double> joints_deg_;
  std::vector<int> status_;
  listen::SampleClock clock_;
  double newest_s_ = -1;  // host's
};

}  // namespace flexor::live
