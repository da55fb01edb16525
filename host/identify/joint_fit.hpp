// The compensator of one joint: the chain that was asked for (chain_fit.hpp), or of the additive candidates (additive.hpp), best
// first, the first that can be worn. It holds still when the finger does, to a degree in a minute, and in the glove's integers
// it is as near to double as deploy asks for (model::allowed_fixed_error_deg); where none is, the best that holds still. A
// candidate that creeps back after its sensor is taken in its place where its cross-validated error is a tenth lower, its loss
// surely lower over the folds, and its error wanders no more than half as much again in the holds that the reference itself
// shows; without a hold a drift above twice the error needs one that is a quarter lower, above ten degrees one that is halved. Then
// chains, over the same folds and fitted for other donnings too (Donnings): one is taken where its loss is lower, by a standard
// error unless it is the smaller; one that creeps is judged as other candidates that do. Of several sensors their mix
// (structure_text.hpp) and the own one alone are tried as well, and taken where they are as good and hold as still. Of readings
// that no board takes the integers are not asked for.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/additive.hpp"
#include "host/identify/fit.hpp"
#include "host/identify/joint_map.hpp"
#include "host/identify/structure_text.hpp"
#include "host/model/model.hpp"

namespace flexor::identify {

inline constexpr const char* kStopped = "stopped before all structures were tried: the best so far is taken";

struct CandidateRow {
  std::string structure;
  std::optional<double> cross_validated_deg;  // none: its fit alone is worse than what others reach there
  double fitted_rmse_deg = 0;
  double parameters = 0;                 // effective
  std::optional<double> hold_drift_deg;  // none: a better one was worth wearing before
  std::string refusal;                   // why this one was passed over
  bool chosen = false;
  std::optional<double> fold_loss = {};  // mean over the folds; none: it was not validated
  double fold_loss_se = 0;               // by how they scatter
};

struct JointFit : Fitted {
  std::vector<CandidateRow> rows;
  std::string structure;             // in words
  std::string text;                  // as structure_text.hpp reads it
  std::vector<std::string> sensors;  // that it reads, the own one first
  model::Model model;                // this joint alone, without other joints' inputs
  double hold_drift_deg = 0;         // see hold.hpp
  bool creeps = false;               // of a chain: it drifts, as the sensor was seen to
  double cross_validated_deg = 0;    // root mean square
  std::vector<double> fold_loss;     // of the same estimates: mean of each fold (robust.hpp)
  double limits = 0;        // of the angle, taken from what was seen: `effective` does not count them
  std::size_t untried = 0;  // structures of the search that was stopped
  std::map<std::string, model::Model> baseline_models;  // by structure, those that were fitted on the way

  CandidateRow row() const;  // of it, which is chosen
};

// The share of a board's room that a model takes; empty: it runs on a PC.
using Room = std::function<double(const model::Model&)>;

// What a joint is fitted to.
struct Task {
  const std::vector<Session>& sessions;  // their columns are the joint's sensors
  const model::Model& inputs;            // without blocks and joints
  const JointMap& joint;
  Step step = {};  // where it stops the search of a sum, the best so far is taken, of one structure at least
  Room room = {};
  double most = HUGE_VAL;  // candidates of a search that take so much of the room or more are passed over

  bool fits(const model::Model& model) const { return !room || room(model) < most; }
};

// `structure` is the text of structure_text.hpp. Throws io::InputError and io::JobError.
// `initial`: a start for the parameters of a chain that is asked for.
JointFit fit_joint(const Task& task, const std::string& structure,
                   const std::optional<Initial>& initial = {});

// The same of a structure that nobody needs to wear.
JointFit fit_baseline(const Task& task, const std::string& structure);

// A chain of one sensor (chain_fit.cpp). `initial`: one start more for its parameters. Cross-validated only where the fitted error is
// below `least_deg`: what another errs by on what it did not see. Throws io::JobError where the fit cannot be done.
JointFit fit_chain(const Chain& wanted, const Task& task, const std::optional<Initial>& initial = {},
                   double least_deg = HUGE_VAL);

// Why `one`, which creeps back after its sensor, is not worth more than the best that holds still; empty: it is. While the finger
// itself holds still its error may wander by half as much again.
std::string creep_refusal(const JointFit& one, const JointFit& still, const std::vector<Session>& sessions);

// Why such a model cannot be worn; empty: it can.
std::string refusal_of(const model::Model& model, double drift_deg = 0);

// What brings readings in volts, kilohms, ohms or counts of more than ten bits to about what a board's converter counts, for in
// steps of that size it computes: a power of two, which rounds nothing. The range of `input` passes it too, but of counts, whose
// converter's rails stay where they are. `share` of that, where what comes behind goes beyond the readings.
double scale_to_counts(model::Input& input, double share = 1);

// `inputs` with the joint's own alone.
model::Model own_inputs(model::Model inputs, const JointMap& joint);

// A model of this joint alone. Readings in a unit of other size than counts pass a gain first (host/model/correction.hpp),
// which a board has in its table of counts: its integers are as fine as with counts.
model::Model joint_model(const model::Model& inputs, const Additive& fit, const JointMap& joint);

// Blocks and joints of `one` behind those that the model has; a sensor's gain, which joints share, once.
void append(const model::Model& one, model::Model& model);

}  // namespace flexor::identify
