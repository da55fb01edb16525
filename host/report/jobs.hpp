// A report for each kind of job; render() picks one.
#pragma once

#include "host/report/saved.hpp"

namespace flexor::report {

void render_hand(const Saved& saved);
void render_experiment(const Saved& saved);
void render_tracking(const Saved& saved);
void render_deployment(const Saved& saved);
void render_latency(const Saved& saved);

}  // namespace flexor::report
