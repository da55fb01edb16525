#include "apps/live/hand_port.hpp"

#include <utility>

namespace flexor::live {
namespace {

constexpr double kHandSilent_s = 2;  // it speaks several times a second

}  // namespace

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

const char* HandPort::status(double now_s) const {
  if (is_gone_) return "gone";
  return now_s - newest_s_ < kHandSilent_s ? "connected" : "waits";
}

std::string HandPort::remark(std::size_t column) const {
  return column < newest_.remark.size() ? newest_.remark[column] : "";
}

std::array<std::string, twin::kFingers> HandPort::faults() const {
  std::array<std::string, twin::kFingers> out;
  for (std::size_t f = 0; f < out.size(); ++f) out[f] = remark(2 * twin::kFingers + f);
  return out;
}

}  // namespace flexor::live
