// The twin that wears a glove, as the page has it: what goes wrong at will, and the bionic hand that follows.
#pragma once

#include <cmath>

#include "apps/live/context.hpp"
#include "apps/live/hand_port.hpp"
#include "apps/live/messages.hpp"

namespace flexor::live {

class Demo {
 public:
  explicit Demo(Context& context) : context_(context), worn_(context.options.worn) {
    context.words.add({{"twin.set", {{"no_twin"}, [this](io::JsonReader& parts) { set(parts); }}}},
                      {{"no_twin", [this] { return !worn_; }}});
  }

  void tick() {
    const double now = context_.now_s();
    if (!worn_ || now - sent_s_ < kEvery_s) return;
    sent_s_ = now;
    Rows rows(Kind::hand, twin::kFingers);
    rows.add(now, std::vector<double>(twin::kFingers, NAN), worn_->now().joint_deg);
    context_.server.send_all(rows.bytes());
  }

  void write(Json& state) const {
    if (!worn_) return;
    state["twin"] = change_;
    std::vector<std::string> faults;
    for (const int fault : worn_->now().fault)
      faults.push_back(fault == 0 ? "" : fmt::format("fault {}", fault));
    state["hand"] = hand_state("simulated", nullptr, faults, "");
  }

 private:
  static constexpr double kEvery_s = 1.0 / 30;

  void set(io::JsonReader& parts) {
    WornChange change = change_;
    const auto take = [&](const char* key, double& value, double low, double high) {
      if (parts.has(key)) value = parts.number_within(key, low, high);
    };
    take("slip_deg", change.slip_deg, -30, 30);
    take("drift_deg_per_min", change.drift_deg_per_min, -30, 30);
    take("noise_counts", change.noise_counts, 0, 50);
    take("loss", change.loss, 0, 1);
    worn_->set(change_ = change);
  }

  Context& context_;
  std::shared_ptr<WornGlove> worn_;
  WornChange change_;
  double sent_s_ = -1;
};

}  // namespace flexor::live
