// The recommended motion as a guide for a terminal: what to do now, for how long still, what comes next, how far to close.
#pragma once

#include <functional>
#include <string>

namespace flexor::cli {

// `wait` returns at t_s of the motion, or later, with the time that it is then; below zero it has not begun. `write` gets
// the same lines again and again, each time over those before, and a bell where there is something else to do.
void guide_motion(const std::function<double(double t_s)>& wait,
                  const std::function<void(const std::string& text)>& write);

}  // namespace flexor::cli
