#include "apps/live/worn_gloves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "apps/live/bench_source.hpp"
#include "apps/live/twin_source.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"
#include "host/io/worker.hpp"
#include "host/study/bench.hpp"
#include "host/study/boards.hpp"
#include "host/twin/glove.hpp"

namespace flexor::live {
namespace {

constexpr double kRate_hz = 10;
// From a reading to the hand that follows it, as `flexor twin record` finds it for the shipped twin; the second with --rate 50 and
// --set radio.frame_rate_hz=25.
constexpr double kLead_s = 0.099;
constexpr double kTwinLead_s = 0.064;
constexpr double kTwinRate_hz = 50;
constexpr const char* kBoards = "flexor-cosim";

// A published compensator behind the divider's own curve: a board of which the strips' counts are not converted takes models of
// counts, as they are identified from a glove's readings.
model::Model of_counts(model::Model m, const twin::Parameters& parameters) {
  constexpr double kLeast_deg = -10;
  constexpr double kMost_deg = 220;
  constexpr int kKnots = 24;
  const twin::Divider divider(parameters);
  model::Curve curve;
  for (int k = 0; k < kKnots; ++k) {
    const int counts = divider.counts(kLeast_deg + (kMost_deg - kLeast_deg) * k / (kKnots - 1));
    curve.x.push_back(counts);
    curve.y.push_back(divider.alpha_deg(counts));
  }
  std::vector<model::Block> blocks;
  for (model::Input& input : m.inputs) {
    const std::string alpha = input.name + " alpha";
    for (model::Block& block : m.blocks) std::ranges::replace(block.from, input.name, alpha);
    blocks.push_back({{input.name}, alpha, curve});
    input.unit = "count";
    input.column = input.name + "_count";
    input.valid_min = curve.x.front();
    input.valid_max = curve.x.back();
  }
  m.blocks.insert(m.blocks.begin(), blocks.begin(), blocks.end());
  m.name += " of counts";
  model::check(m);
  return m;
}

std::string in_words(int fault) { return fault == 0 ? "" : fmt::format("fault {}", fault); }

class WornBoards : public WornGlove {
 public:
  WornBoards() {
    study::BenchOptions options;
    options.model = of_counts(study::compensator("published-hw", kRate_hz).model, options.parameters);
    options.port_link = folder_.path() / "glove";
    study::BenchChange begin;
    begin.motion = "ordinary";
    source_ = std::make_shared<BenchSource>(io::program_beside(kBoards), options, begin, true);
    if (const deploy::Key& key = source_->bench().key()) {
      facts.key_file = (folder_.path() / "pair.key").string();
      deploy::write_key(facts.key_file, *key);
    }
    facts.has_boards = true;
    facts.port = source_->bench().port();
    facts.why_not_written = source_->bench().has_bootloader() ? "" : study::why_no_bootloader();
    facts.rate_hz = kRate_hz;
    facts.lead_s = kLead_s;
  }

  std::shared_ptr<listen::Source> source() override { return source_; }

  void set(const WornChange& change) override {
    study::BenchChange out;
    out.slip_deg = change.slip_deg;
    out.drift_deg_per_min = change.drift_deg_per_min;
    out.noise_counts = change.noise_counts;
    out.loss = change.loss;
    source_->change(out);
  }

  void play(const std::string& motion, double) override {
    (void)study::bench_motion(motion);  // whether there is one
    study::BenchChange out;
    out.motion = motion;
    out.restart = true;
    source_->change(out);
  }

  WornNow now() const override {
    const study::BenchView view = source_->view();
    WornNow out;
    for (std::size_t f = 0; f < twin::kFingers; ++f) {
      out.finger_deg[f] = view.finger_deg[f];
      out.joint_deg[f] = view.joint_deg[f];
      out.fault[f] = in_words(view.fault[f]);
    }
    return out;
  }

  double now_s() const override { return source_->now_s(); }
  std::optional<double> begun_s() const override { return 0; }
  void load(const model::Model&) override { throw io::InputError("the boards take models at their port"); }

  Score score() override {
    return [source = source_](const Jobs::Goes& goes) {
      return source->score({1, 2, 3, 4, 5, 6}, [&](std::size_t done, std::size_t of) {
        return goes({"six gestures", done, of});
      });
    };
  }

 private:
  io::TemporaryFolder folder_;
  std::shared_ptr<BenchSource> source_;
};

// Without boards. All on one thread, but a score, during which nothing else is asked.
class WornTwin : public WornGlove {
 public:
  WornTwin() {
    facts.why_not_written = "the twin has no board: start flexor live --boards";
    facts.rate_hz = kTwinRate_hz;
    facts.lead_s = kTwinLead_s;
  }

  std::shared_ptr<listen::Source> source() override { return twin_; }
  void set(const WornChange& change) override { twin_->set(change); }
  void play(const std::string& motion, double pace) override {
    twin_->play(study::bench_motion(motion));
    twin_->go(pace);
  }
  WornNow now() const override { return twin_->now(); }
  double now_s() const override { return twin_->now_s(); }
  std::optional<double> begun_s() const override { return twin_->begun_s(); }
  void load(const model::Model& model) override {
    std::vector<std::string> notes;
    twin_->load(deploy::on_hand(model, {}, notes));
  }

  Score score() override {
    return [score = twin_->score()](const Jobs::Goes& goes) {
      std::vector<double> out;
      for (const twin::Motion& gesture : study::motions("1-6")) {
        out.push_back(score(gesture));
        if (!goes({"six gestures", out.size(), 6})) throw io::Cancelled("stopped");
      }
      return out;
    };
  }

 private:
  std::shared_ptr<TwinSource> twin_ = std::make_shared<TwinSource>(TwinOptions{.rate_hz = kTwinRate_hz});
};

}  // namespace

nlohmann::ordered_json WornGlove::pose_angles() {
  const twin::Parameters hand;
  nlohmann::ordered_json out;
  for (std::size_t f = 0; f < twin::kFingers; ++f)
    out.push_back(fmt::format("{}={:g}:{:g}", model::finger_names()[f], hand.hand_lower_deg[f],
                              hand.hand_upper_deg[f]));
  return out;
}

std::unique_ptr<WornGlove> worn_twin() { return std::make_unique<WornTwin>(); }

std::unique_ptr<WornGlove> worn_boards() { return std::make_unique<WornBoards>(); }

}  // namespace flexor::live
