// The bench as its users meet it: `flexor` in another process speaks with a glove on a pseudo-terminal that a thread here
// keeps worn.
#include "host/study/bench.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "cosim/flexor_test.hpp"
#include "host/io/io.hpp"
#include "host/recording/csv.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;
using study::BenchView;

constexpr std::size_t kThumb = 0;
constexpr std::size_t kIndex = 1;

study::BenchOptions options() {
  study::BenchOptions out;
  out.model = study::compensator("published-hw", 10).model;
  return out;
}

class Bench : public testing::Test {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }
  fs::path file(const char* name) const { return folder_.path() / name; }
  io::TemporaryFolder folder_;
};

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto less_mean = [](const std::vector<double>& x) -> Eigen::VectorXd {
    const Eigen::Map<const Eigen::VectorXd> all(x.data(), std::ssize(x));
    return all.array() - all.mean();
  };
  return less_mean(a).normalized().dot(less_mean(b).normalized());
}

TEST_F(Bench, RecordSeesReadingsThatFollowTheFingersAndTheHandGoesOn) {
  study::Bench bench(fs::absolute(FLEXOR_COSIM), options());
  std::vector<BenchView> views = {bench.advance({.motion = "calibration"})};  // each 20 ms
  std::jthread worn([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) views.push_back(bench.advance({}));
  });
  const nlohmann::json report =
      json_of({"record", file("log.csv"), "--port", bench.port(), "--readings", "--for", "6"});
  worn = {};
  EXPECT_EQ(report.at("torn"), 0);
  const recording::Recording log = recording::read_csv(file("log.csv"), {"thumb_count", "index_count"});
  EXPECT_GT(log.t_s.size(), 45U) << "10 Hz";
  std::map<std::pair<int, int>, double> finger_deg;
  for (const BenchView& view : views)
    finger_deg.try_emplace({view.counts[kThumb], view.counts[kIndex]}, view.finger_deg[kThumb]);
  std::vector<double> counts;
  std::vector<double> angle;
  for (std::size_t k = 0; k < log.t_s.size(); ++k) {
    const auto there =
        finger_deg.find({std::lround(log.columns[0].value[k]), std::lround(log.columns[1].value[k])});
    if (there == finger_deg.end()) continue;  // between two views
    counts.push_back(log.columns[0].value[k]);
    angle.push_back(there->second);
  }
  EXPECT_GT(counts.size(), 9 * log.t_s.size() / 10) << "what was recorded is what the converter gave";
  EXPECT_GT(correlation(counts, angle), 0.97);
  // The hand follows meanwhile, and believes the glove: opened, it restarts once.
  double worst_deg = 0;
  double moved_deg = 0;
  for (const BenchView& view : views) {
    EXPECT_EQ(view.fault, (std::array<int, 5>{}));
    if (view.now_ms < views.back().now_ms - 4000) continue;
    worst_deg = std::max(worst_deg, std::abs(view.finger_deg[kThumb] - view.joint_deg[kThumb]));
    moved_deg = std::max(moved_deg, std::abs(view.joint_deg[kThumb] - views.back().joint_deg[kThumb]));
  }
  EXPECT_GT(moved_deg, 20);
  EXPECT_LT(worst_deg, 45) << "0.2 s at 130 deg/s, and the glove's own error";
}

TEST_F(Bench, ALinkWhoseTerminalIsThereIsAnothers) {
  study::BenchOptions o = options();
  o.port_link = file("glove");
  const study::Bench bench(fs::absolute(FLEXOR_COSIM), o);
  EXPECT_THROW(study::Bench(fs::absolute(FLEXOR_COSIM), o), io::InputError);
  EXPECT_TRUE(fs::exists(file("glove")));
}

TEST_F(Bench, AScoreThatIsStoppedLeavesTheBenchAsItWas) {
  study::Bench bench(fs::absolute(FLEXOR_COSIM), options());
  EXPECT_THROW((void)bench.score({1, 2, 3, 4, 5, 6}, [](std::size_t, std::size_t) { return false; }),
               io::Cancelled);
  const BenchView before = bench.advance({});
  EXPECT_EQ(bench.advance({}).now_ms, before.now_ms + 20);
}

}  // namespace
}  // namespace flexor::cosim
