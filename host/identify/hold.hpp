// How far an angle goes while its readings stay as they are: what a finger would do that holds a pose.
#pragma once

#include <string>
#include <vector>

#include "host/identify/readings.hpp"
#include "host/model/model.hpp"

namespace flexor::identify {

inline constexpr double kMostDrift_deg = 1;  // of a model that holds still

double slowest_s(const model::Model& model);  // of its time constants; 0 where it has none

// The most that any joint moves in a hold, degrees: the sessions are replayed, and from instants all over them
// every reading is held until the slowest block has settled, a minute at most; the angle counts from one second on. `sensors` names the
// sessions' columns.
double hold_drift_deg(const model::Model& model, const std::vector<Session>& sessions,
                      const std::vector<std::string>& sensors);

// Samples of which the finger itself holds still: all used, for a second at least, their running median within 2 degrees: a
// camera's noise ends no hold.
std::vector<StillPart> holds_of(const Session& session, double period_s);

// How far the model's first angle goes from its mean in such holds, root mean square; 0 where there is none.
double wander_deg(const model::Model& model, const std::vector<Session>& sessions,
                  const std::vector<std::string>& sensors);

}  // namespace flexor::identify
