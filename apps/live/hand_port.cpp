#include "apps/live/hand_port.hpp"

#include <utility>

#include "host/model/model.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::live {
namespace {

constexpr double kHandSilent_s = 2;  // it speaks several times a second

}  // namespace

Json hand_state(const char* status, const Json& port, const std::vector<std::string>& faults,
                const std::string& board) {
  return {{"names", model::finger_names()},
          {"open_deg", twin::Parameters().hand_lower_deg},
          {"status", status},
          {"port", port},
          {"faults", faults},
          {"board", board}};
}

HandPort::HandPort(std::shared_ptr<listen::Source> from, std::string at, double begin_s)
    : source(std::move(from)), path(std::move(at)), begin_s_(begin_s), newest_s_(begin_s - kHandSilent_s) {}

std::vector<listen::Sample> HandPort::poll() {
  std::vector<listen::Sample> out;
  const listen::Event event = source->wait(0, out);
  if (event == listen::Event::gone) is_gone_ = true;
  if (event == listen::Event::back) is_gone_ = false;
  for (listen::Sample& sample : out) sample.host_s += begin_s_;
  if (out.empty()) return out;
  newest_ = out.back();
  newest_s_ = newest_.host_s;
  return out;
}

std::string HandPort::remark(std::size_t column) const {
  return column < newest_.remark.size() ? newest_.remark[column] : "";
}

Json HandPort::state(double now_s) const {
  std::vector<std::string> faults;
  for (std::size_t f = 0; f < twin::kFingers; ++f) faults.push_back(remark(2 * twin::kFingers + f));
  // It waits for its glove where it reports nothing of its fingers.
  return hand_state(is_gone_                            ? "gone"
                    : now_s - newest_s_ < kHandSilent_s ? "connected"
                                                        : "waits",
                    path, faults, remark(3 * twin::kFingers));
}

}  // namespace flexor::live
