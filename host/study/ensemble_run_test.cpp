#include "host/study/ensemble_run.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

fs::path fresh_folder(const std::string& name) {
  const fs::path path = fs::temp_directory_path() / ("flexor_ensemble_" + name + std::to_string(::getpid()));
  fs::remove_all(path);
  return path;
}

// The shipped laboratory, and others beside it.
EnsemblePlan plan(int laboratories, const fs::path& folder = {}) {
  EnsemblePlan out;
  const Point shipped = values_of(twin::Parameters());
  for (int k = 0; k < laboratories; ++k) {
    Point values = shipped;
    for (std::size_t i = 0; i < 2 * kFingers; ++i) values[i] += 3 * k;
    out.ensemble.values.push_back(std::move(values));
  }
  for (const FreeParameter& p : free_parameters())
    out.ensemble.posterior.push_back({p.name, 1, 0, 2, 1, 100});
  out.plan.motions = motions("2,4");
  out.plan.compensators = compensators({"raw", "published-w", "published-hw"}, 10);
  out.plan.trials = 4;
  out.plan.threads = 2;
  out.plan.folder = folder;
  return out;
}

TEST(Interval, OfKnownNumbers) {
  std::vector<double> values;
  for (int k = 100; k >= 0; --k) values.push_back(k);
  const Interval v = interval90(values);
  EXPECT_DOUBLE_EQ(v.low, 5);
  EXPECT_DOUBLE_EQ(v.median, 50);
  EXPECT_DOUBLE_EQ(v.high, 95);
  EXPECT_DOUBLE_EQ(interval90({7}).high, 7);
}

TEST(EnsembleRun, ThreadsAndACutDoNotChangeAByte) {
  const fs::path folder = fresh_folder("cut");
  EnsemblePlan p = plan(4, folder);
  const EnsembleResult whole = run_ensemble(p, {});
  const std::string text = io::read_file(folder / "laboratories.csv");
  for (const std::size_t keep : {std::size_t{0}, text.size() / 2, text.size() - 3}) {
    std::ofstream(folder / "laboratories.csv", std::ios::trunc | std::ios::binary) << text.substr(0, keep);
    p.plan.threads = 1;
    const EnsembleResult again = run_ensemble(p, {});
    EXPECT_EQ(io::read_file(folder / "laboratories.csv"), text) << keep;
    EXPECT_EQ(to_json(again, p), to_json(whole, p));
    const auto whole_lines = std::ranges::count(text.substr(0, keep), '\n');
    EXPECT_EQ(again.resumed, std::max<std::ptrdiff_t>(0, whole_lines - 1)) << "all rows whose line is whole";
  }
  p.plan.seed = 9;
  EXPECT_THROW((void)run_ensemble(p, {}), io::InputError);
  fs::remove_all(folder);
}

TEST(EnsembleRun, AScenarioChangesWhatIsPlayedAndNotWhatWasFitted) {
  const fs::path folder = fresh_folder("scenarios");
  EnsemblePlan p = plan(2, folder);
  p.scenarios = {{"nothing changes", {}}, {"a third is lost", {"radio.loss=0.33"}}};
  const EnsembleResult r = run_ensemble(p, {});
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    EXPECT_EQ(r.errors(0, c, 1), r.errors(0, c));
    EXPECT_NE(r.errors(0, c, 2), r.errors(0, c));
  }
  const auto json = to_json(r, p);
  EXPECT_EQ(json.at("scenarios")[0].at("headlines"), json.at("headlines"));
  EXPECT_NE(json.at("scenarios")[1].at("headlines"), json.at("headlines"));
  const EnsembleResult again = run_ensemble(p, {});
  EXPECT_EQ(again.resumed, 2);
  EXPECT_EQ(to_json(again, p), json);
  p.scenarios.pop_back();
  EXPECT_THROW((void)run_ensemble(p, {}), io::InputError) << "another run";
  fs::remove_all(folder);
}

TEST(EnsembleRun, ALaboratoryIsWhatItIsAlone) {
  const EnsembleResult many = run_ensemble(plan(3), {});
  const EnsembleResult one = run_ensemble(plan(1), {});
  EXPECT_EQ(many.rows[0].error_deg_s, one.rows[0].error_deg_s);
  EXPECT_NE(many.rows[1].error_deg_s, one.rows[0].error_deg_s);
}

TEST(EnsembleRun, StoppedItSaysWhatIsKeptAndGoesOn) {
  const fs::path folder = fresh_folder("stop");
  EnsemblePlan p = plan(4, folder);
  std::atomic<bool> stop = false;
  p.plan.stop = &stop;
  try {
    (void)run_ensemble(p, [&](std::size_t done, std::size_t) { stop = done >= 2; });
    ADD_FAILURE() << "it went on";
  } catch (const io::Cancelled& error) {
    EXPECT_NE(std::string(error.what()).find("of 4 laboratories are kept"), std::string::npos)
        << error.what();
  }
  stop = false;
  const EnsembleResult rest = run_ensemble(p, {});
  EXPECT_GE(rest.resumed, 2);
  EXPECT_EQ(to_json(rest, p), to_json(run_ensemble(plan(4), {}), p));
  fs::remove_all(folder);
}

TEST(EnsembleRun, HeadlinesAreQuantilesOfItsRows) {
  const EnsemblePlan p = plan(3);
  const EnsembleResult r = run_ensemble(p, {});
  ASSERT_EQ(r.compensators.size(), 7U);
  const std::size_t hw = r.index("published-hw");
  const std::size_t mine = r.index("identified");
  const double by_hand =
      std::sqrt(r.errors(0, mine)[1] / r.errors(0, hw)[1] * r.errors(1, mine)[1] / r.errors(1, hw)[1]);
  EXPECT_NEAR(r.mean_ratios(mine, hw)[1], by_hand, 1e-12);
  EXPECT_TRUE(r.log_rms(1, 4).empty()) << "gestures 1 and 3 are not in the run";
  EXPECT_EQ(r.shapes.size(), 2U);
  EXPECT_EQ(r.rows[0].shape_deg.size(), 2U);
  EXPECT_LT(r.mean_ratios(mine, r.index("raw"))[0], 0.3);
  EnsemblePlan clash = p;
  clash.plan.compensators[0].name = "line";
  EXPECT_THROW((void)run_ensemble(clash, {}), io::InputError);
}

}  // namespace
}  // namespace flexor::study
