// A report for each kind of job: what its page begins with, and the whole.
#pragma once

#include "host/report/page.hpp"

namespace flexor::report {

#define FLEXOR_REPORTS(X) X(hand) X(experiment) X(tracking) X(deployment) X(latency)
#define FLEXOR_REPORT(kind)                               \
  void summarize_##kind(Page& page, const Json& results); \
  void render_##kind(const Saved& saved);
FLEXOR_REPORTS(FLEXOR_REPORT)
#undef FLEXOR_REPORT

}  // namespace flexor::report
