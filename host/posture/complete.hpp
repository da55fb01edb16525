// Readings to all 23 joints with their standard errors, one row after the other, from past rows only.
//
// Each row: readings that are missing are left out; a reading that is outside what the joints can do, or further from
// what the other inputs predict than anybody who was left out ever was, is left out too; one that shivers is weighed against
// their prediction; one that does not change at all while they predict that its finger moved is left out. What is left
// goes through the regression (regression.hpp) for just these inputs. DIP follows PIP where that is sensed by
// itself. Angles end at the joints' limits: a sum that is sensed is kept by the joints that still can, and a reading
// that is a little beyond all of them is reported so.
//
// As long as more than the inputs is shown, the model learns of that person: the first quarter of a second is the resting pose, which
// shifts all that follows and is the first observation; every half second of the hand is one more.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "host/posture/regression.hpp"

namespace flexor::posture {

enum class Quality { used = 0, missing = 1, implausible = 2, noisy = 3, stuck = 4, beyond = 5 };
inline constexpr int kQualities = 6;

// Times the largest error that was met on people left out.
inline constexpr double kImplausible = 1.5;

struct Estimate {
  Hand angle_deg;
  Hand se_deg;
  std::vector<Quality> quality;  // of each input
};

// How far a reading shivers, whatever the finger does: third differences of the last readings, their median.
class Shiver {
 public:
  void push(double reading_deg);  // NaN: starts again
  double variance_deg2() const;

 private:
  std::deque<double> last_;
  std::deque<double> size_;
};

// What a Calibrated knows of one person: the resting pose, and the observations beyond the codebooks.
class Personal {
 public:
  Personal(Calibrated calibrated, InputMatrix inputs);
  Personal(const Personal&) = delete;  // what is seen refers to the regression
  Personal& operator=(const Personal&) = delete;

  // `hands`: seen of this person, the resting pose first; NaN where a joint is not shown.
  void learn(const std::vector<Hand>& hands);

  Hand mean_deg(const Eigen::VectorXd& inputs_deg) const { return seen_.mean_deg(inputs_deg); }
  Hand variance_deg2(const Eigen::VectorXd& inputs_deg) const {
    return seen_.variance(inputs_deg, acquainted_deg2_, stranger_deg2_);
  }
  const Calibrated& calibrated() const { return calibrated_; }

 private:
  Calibrated calibrated_;
  InputMatrix inputs_;
  Seen seen_;
  Hand stranger_deg2_;       // s_j^2
  Hand acquainted_deg2_;     // s_j^2 of joints that were seen
  std::size_t seen_at_ = 0;  // how many hands that is good for
};

class Completer {
 public:
  // `rested`: the person will be shown at rest. The posture must outlive it. Throws io::InputError: no input, the
  // same twice, more than 30.
  Completer(const Posture& posture, std::vector<Input> inputs, bool rested);

  // Readings in degrees, NaN where there is none.
  Estimate complete(const Eigen::VectorXd& readings_deg);

  // Before complete() of the same row, as long as the person is shown, at rest first: NaN where a joint is not,
  // the same joints in each row.
  void show(const Hand& hand_deg, double seconds);

  const Shape& shape() const { return shape_; }
  double left_out_rmse_deg() { return model(all_).calibrated().rmse_deg; }

 private:
  using Mask = std::uint32_t;  // a bit for each input
  struct Readings {
    Eigen::VectorXd value_deg;
    Eigen::VectorXd variance_deg2;
    std::vector<Quality> quality;
    Mask mask;
    void set_quality(Eigen::Index input, Quality to) { quality[static_cast<std::size_t>(input)] = to; }
    void leave_out(Eigen::Index input, Quality why);
    Eigen::VectorXd of(Mask inputs) const;
  };

  Personal& model(Mask mask);
  // Of this input, by the others of the mask.
  struct Prediction {
    double value_deg;
    double variance_deg2;
    double worst_deg;
  };
  Prediction from_others(const Readings& readings, Eigen::Index input);
  void leave_out_missing(Readings& readings);
  void leave_out_implausible(Readings& readings);
  void leave_out_stuck(Readings& readings);
  void mark_beyond(Readings& readings) const;
  void weigh_noisy(Readings& readings);
  void add_noise(const Readings& readings, Hand& variance_deg2);
  void set_sensed(const Readings& readings, Estimate& estimate) const;
  void keep_sum(const std::vector<int>& joints, double sum_deg, Estimate& estimate) const;
  void set_coupled(const Readings& readings, Estimate& estimate) const;
  bool sensed_alone(Mask mask, int joint) const;

  const Posture& posture_;
  std::vector<Input> inputs_;
  InputMatrix matrix_;
  Eigen::VectorXd low_deg_;  // of each input, at the limits of its joints
  Eigen::VectorXd high_deg_;
  People people_;
  Shape shape_;
  Mask all_ = 0;
  std::map<Mask, std::unique_ptr<Personal>> models_;
  std::vector<Shiver> shiver_;
  // Since a reading last changed.
  struct Still {
    double reading_deg = 0;
    Mask others = 0;
    double predicted_deg = 0;  // by them, at first
    double moved_deg = 0;
    int rows = 0;
  };
  std::vector<Still> still_;
  // Of the person.
  bool rests_ = true;
  Hand piece_sum_ = Hand::Zero();
  double piece_rows_ = 0;
  double piece_s_ = 0;
  std::vector<Hand> seen_;
};

}  // namespace flexor::posture
