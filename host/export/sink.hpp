// Where angles go while they come.
#pragma once

#include <span>

namespace flexor::exports {

class Sink {
 public:
  virtual ~Sink() = default;
  // t_s: seconds of the caller's clock, which never runs backwards. One angle for each joint that the sink was made
  // for, in that order; NaN: not known. Never waits for a reader. Throws io::JobError when it can take no more.
  virtual void add(double t_s, std::span<const double> angle_deg) = 0;
};

}  // namespace flexor::exports
