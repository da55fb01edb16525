#include "host/identify/hand.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include "host/identify/estimator.hpp"
#include "host/identify/hand_results.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/motion_check.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/compensator.hpp"
#include "host/model/correction.hpp"
#include "host/model/fixed_error.hpp"
#include "host/model/formats.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {
namespace fs = std::filesystem;

// A hand of two joints and two sensors. The first sensor feels the first joint through a bent curve and the cloth's
// play; the second feels the sum of both joints. The camera's clock is 1.37 s behind.
class Hand : public testing::Test {
 protected:
  static constexpr double kOffset_s = -1.37;

  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // Poses held for a while, then smooth moves, other ones for each joint.
  static std::vector<double> motion(std::size_t rows, double rate_hz, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> pose(5, 95);
    std::uniform_real_distribution<double> hold_s(0.5, 2.5);
    std::vector<double> out;
    double now = 20;
    while (out.size() < rows) {
      const double next = pose(random);
      const double move_s = 0.3 + std::abs(next - now) / 60;
      const auto moving = static_cast<int>(move_s * rate_hz);
      for (int k = 0; k < moving; ++k)
        out.push_back(now + (next - now) * (1 - std::cos(M_PI * k / moving)) / 2);
      now = next;
      out.resize(out.size() + static_cast<std::size_t>(hold_s(random) * rate_hz), now);
    }
    out.resize(rows);
    return out;
  }

  PairFiles write(const std::string& name, double seconds, unsigned seed,
                  const std::function<void(std::vector<double>&)>& change_angle = {}) const {
    constexpr double kGlove_hz = 40;
    constexpr double kCamera_hz = 30;
    const auto rows = static_cast<std::size_t>(seconds * kGlove_hz);
    const std::vector<double> index = motion(rows, kGlove_hz, seed);
    const std::vector<double> thumb = motion(rows, kGlove_hz, seed + 1000);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise;
    recording::Recording glove;
    glove.columns = {{"a_adc", {}}, {"b_adc", {}}};
    double slipped = index.front();
    for (std::size_t k = 0; k < rows; ++k) {
      slipped = std::clamp(slipped, index[k] - 4, index[k] + 4);
      glove.t_s.push_back(static_cast<double>(k) / kGlove_hz);
      glove.columns[0].value.push_back(
          std::round(300 + 2 * slipped + 0.02 * slipped * slipped + noise(random)));
      glove.columns[1].value.push_back(std::round(250 + 2 * index[k] + 3 * thumb[k] + noise(random)));
    }
    recording::Recording camera;
    camera.columns = {{"index_deg", {}}, {"thumb_deg", {}}};
    for (std::size_t k = 0; k < static_cast<std::size_t>(seconds * kCamera_hz); ++k) {
      const auto at = std::min(rows - 1, k * 4 / 3);
      camera.t_s.push_back(static_cast<double>(k) / kCamera_hz + kOffset_s + 2);
      camera.columns[0].value.push_back(index[at] + 0.3 * noise(random));
      camera.columns[1].value.push_back(thumb[at] + 0.3 * noise(random));
    }
    for (double& t : camera.t_s) t -= 2 - 10;  // both clocks start anywhere
    for (double& t : glove.t_s) t += 10;
    if (change_angle) change_angle(camera.columns[0].value);
    io::write_file(folder_ / (name + "_glove.csv"), recording::to_csv(glove));
    io::write_file(folder_ / (name + "_camera.csv"), recording::to_csv(camera));
    return {folder_ / (name + "_glove.csv"), folder_ / (name + "_camera.csv")};
  }

  static HandRequest request(std::vector<PairFiles> pairs, const std::string& map) {
    HandRequest r;
    r.pairs = std::move(pairs);
    r.map = parse_map(map);
    return r;
  }

  static std::string refusal(const std::function<void()>& job) {
    try {
      job();
    } catch (const io::InputError& error) {
      return error.what();
    } catch (const io::JobError& error) {
      return error.what();
    }
    return "accepted";
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("flexor_hand_" + std::to_string(::getpid()));
};

TEST_F(Hand, AllJointsOfOneRecordingAreFittedToOneModelThatCanBeWorn) {
  const HandIdentification r =
      identify_hand(request({write("one", 120, 1)}, "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg"), {});
  ASSERT_EQ(r.joints.size(), 2U);
  ASSERT_EQ(r.model.inputs.size(), 2U);
  for (const JointResult& joint : r.joints) {
    EXPECT_LT(joint.holdout.rmse_deg, 2.5) << joint.name;
    EXPECT_GT(joint.holdout.rmse_deg, 0.3) << joint.name << ": better than the camera's noise";
    EXPECT_LT(joint.holdout.rmse_deg, joint.baselines.at("line").rmse_deg) << joint.name;
    EXPECT_LE(joint.hold_drift_deg, 1) << joint.name;
    EXPECT_EQ(joint.baselines.size() + joint.baseline_refusals.size(), 5U);
  }
  EXPECT_NO_THROW(model::check_fixed(r.model));
  ASSERT_EQ(r.clocks.size(), 1U);
  EXPECT_NEAR(r.clocks[0].offset_s, kOffset_s, 0.1);
  EXPECT_GT(r.clocks[0].standard_error_s, 0);
  EXPECT_GT(r.clocks[0].confidence, 0.3);
}

TEST_F(Hand, ASecondSensorTellsWhatOneAloneCannot) {
  const PairFiles files = write("two", 90, 2);
  const HandIdentification one = identify_hand(request({files}, "thumb=b_adc:thumb_deg"), {});
  const HandIdentification both = identify_hand(request({files}, "thumb=b_adc+a_adc:thumb_deg"), {});
  EXPECT_LT(both.joints[0].holdout.rmse_deg, 0.3 * one.joints[0].holdout.rmse_deg);
}

TEST_F(Hand, SeveralRecordingsAreOneFitWithAClockEach) {
  const HandIdentification r =
      identify_hand(request({write("p", 60, 3), write("q", 60, 4)}, "index=a_adc:index_deg"), {});
  ASSERT_EQ(r.clocks.size(), 2U);
  for (const Clock& clock : r.clocks) EXPECT_NEAR(clock.offset_s, kOffset_s, 0.1);
  EXPECT_LT(r.joints[0].holdout.rmse_deg, 2.5);
  EXPECT_GT(r.joints[0].fitted_samples, 2 * 25 * 20) << "both first halves are fitted";
}

// Nothing differs between them, so that each may say it as well as both.
TEST_F(Hand, ARecordingThatStandsThereTwiceWithADifferenceSpoilsNothing) {
  const PairFiles one = write("once", 90, 5);
  PairFiles again = one;
  again.sensor = folder_ / "again_glove.csv";
  recording::Recording log = recording::read_csv(one.sensor, {}, "");
  log.columns[0].value[700] += 1;
  io::write_file(again.sensor, recording::to_csv(log));
  const double alone = identify_hand(request({one}, "index=a_adc:index_deg"), {}).joints[0].holdout.rmse_deg;
  const double both =
      identify_hand(request({one, again}, "index=a_adc:index_deg"), {}).joints[0].holdout.rmse_deg;
  EXPECT_LT(both, 1.15 * alone);
}

TEST_F(Hand, WhatVariesBetweenDonningsIsToldAndWritten) {
  std::vector<PairFiles> pairs;
  constexpr double kOffsets_deg[] = {-6, 0, 6};
  for (unsigned n = 0; n < 3; ++n) {
    pairs.push_back(write("d" + std::to_string(n), 60, 20 + n, [&](std::vector<double>& angle) {
      for (double& a : angle) a += kOffsets_deg[n];
    }));
  }
  const HandIdentification r = identify_hand(request(pairs, "index=a_adc:index_deg"), {});
  ASSERT_TRUE(r.joints[0].donnings);
  EXPECT_EQ(r.joints[0].donnings->count, 3);
  EXPECT_NEAR(r.joints[0].donnings->offset_deg, 6, 1.5);
  EXPECT_LT(r.joints[0].donnings->gain, 0.06);
  EXPECT_NEAR(r.model.fit["joints"]["index"]["donnings"]["offset_sd_deg"].get<double>(),
              r.joints[0].donnings->offset_deg, 1e-12);
  const HandIdentification one = identify_hand(request({pairs[0]}, "index=a_adc:index_deg"), {});
  EXPECT_FALSE(one.joints[0].donnings) << "one recording says nothing of the next";
}

TEST_F(Hand, JointsAreFoundByName) {
  const PairFiles files{folder_ / "glove.csv", folder_ / "camera.csv"};
  io::write_file(files.sensor, "t_s,thumb_adc,index_adc,index_dip_adc,battery_V\n0,1,2,3,4\n1,2,3,4,4\n");
  io::write_file(
      files.reference,
      "t_s,index_mcp_deg,index_dip_deg,thumb_deg,ring_deg,thumb_quality\n0,1,2,3,4,0\n1,2,3,4,5,0\n");
  std::string found;
  for (const JointMap& joint : map_by_name(files, "")) {
    ASSERT_EQ(joint.sensors.size(), 1U);
    found += joint.joint + "=" + joint.sensors[0] + ":" + joint.reference + " ";
  }
  EXPECT_EQ(
      found,
      "index_mcp=index_adc:index_mcp_deg index_dip=index_dip_adc:index_dip_deg thumb=thumb_adc:thumb_deg ");
  io::write_file(files.sensor, "t_s,A0,A1\n0,1,2\n1,2,3\n");
  const std::string said = refusal([&] { (void)map_by_name(files, ""); });
  EXPECT_NE(said.find("A0, A1"), std::string::npos) << said;
  EXPECT_NE(said.find("--map"), std::string::npos) << said;
}

TEST_F(Hand, WhatWasProvenIsFittedToEverything) {
  HandRequest part = request({write("all", 90, 31)}, "index=a_adc:index_deg");
  HandRequest all = part;
  all.fit_all = true;
  const HandIdentification half = identify_hand(part, {});
  const HandIdentification whole = identify_hand(all, {});
  EXPECT_EQ(whole.joints[0].holdout.rmse_deg, half.joints[0].holdout.rmse_deg) << "the proof is the half's";
  EXPECT_NE(whole.model.blocks, half.model.blocks);
  ASSERT_EQ(whole.model.blocks.size(), half.model.blocks.size()) << "the proven structure, fitted to more";
  for (std::size_t b = 0; b < half.model.blocks.size(); ++b)
    EXPECT_EQ(whole.model.blocks[b].kind.index(), half.model.blocks[b].kind.index());
}

// The errors that a model states are those that it makes on data that it never saw.
TEST_F(Hand, StatedAccuracyIsThatOfUnseenData) {
  const HandIdentification r = identify_hand(request({write("acc", 160, 32)}, "index=a_adc:index_deg"), {});
  ASSERT_TRUE(r.model.joints[0].accuracy);
  const model::Accuracy& accuracy = *r.model.joints[0].accuracy;
  double squares = 0;
  for (const double error : accuracy.standard_error_deg) squares += error * error;
  const double stated = std::sqrt(squares / static_cast<double>(accuracy.standard_error_deg.size()));
  EXPECT_GT(stated, 0.7 * r.joints[0].holdout.rmse_deg);
  EXPECT_LT(stated, 1.5 * r.joints[0].holdout.rmse_deg);
}

// What is measured with angles that err states no less than they do; the figures against them stay as they are.
TEST_F(Hand, TheReferencesOwnErrorIsStated) {
  HandRequest exact = request({write("acc", 160, 32)}, "index=a_adc:index_deg");
  HandRequest erring = exact;
  erring.reference_error_deg = {{"index", 6}};
  const HandIdentification before = identify_hand(exact, {});
  const HandIdentification after = identify_hand(erring, {});
  EXPECT_EQ(after.joints[0].holdout.rmse_deg, before.joints[0].holdout.rmse_deg);
  const auto& stated = after.model.joints[0].accuracy->standard_error_deg;
  const auto& own = before.model.joints[0].accuracy->standard_error_deg;
  for (std::size_t i = 0; i < stated.size(); ++i) EXPECT_DOUBLE_EQ(stated[i], std::hypot(own[i], 6));
  EXPECT_NE(after.warnings.back().find("err by about 6 deg"), std::string::npos);
  erring.reference_error_deg = {{"ring", 6}};
  EXPECT_NE(refusal([&] { identify_hand(erring, {}); }).find("no joint of the map"), std::string::npos);
  erring.reference_error_deg = {{"index", -1}};
  EXPECT_NE(refusal([&] { identify_hand(erring, {}); }).find("between 0 and 90"), std::string::npos);
}

TEST_F(Hand, ALineIsALine) {
  HandRequest line = request({write("line", 60, 33)}, "index=a_adc:index_deg");
  line.structure = "line";
  const HandIdentification r = identify_hand(line, {});
  EXPECT_EQ(r.joints[0].structure, "line");
  EXPECT_NEAR(r.joints[0].holdout.rmse_deg, r.joints[0].baselines.at("line").rmse_deg, 1e-9);
}

// Whatever the second half says, the model is the same; only its score differs.
TEST_F(Hand, WhatIsHeldOutChangesNoCoefficient) {
  HandRequest before = request({write("h", 60, 5)}, "index=a_adc:index_deg");
  before.clock_offset_s = kOffset_s;
  HandRequest after = before;
  after.pairs = {write("i", 60, 5, [](std::vector<double>& angle) {
    for (std::size_t k = angle.size() * 6 / 10; k < angle.size(); ++k) angle[k] = 90 - angle[k] / 2;
  })};
  const HandIdentification a = identify_hand(before, {});
  const HandIdentification b = identify_hand(after, {});
  EXPECT_EQ(a.model.blocks, b.model.blocks);
  EXPECT_GT(b.joints[0].holdout.rmse_deg, 5 * a.joints[0].holdout.rmse_deg);
}

bool warned(const HandIdentification& r, const std::string& what) {
  return std::ranges::any_of(r.warnings,
                             [&](const std::string& w) { return w.find(what) != std::string::npos; });
}

TEST_F(Hand, ASpikeIsLeftOutAndSaid) {
  const PairFiles files = write("spike", 60, 1);
  HandRequest r = request({files}, "index=a_adc:index_deg");
  r.input_unit = "count";
  const HandIdentification before = identify_hand(r, {});
  EXPECT_FALSE(warned(before, "outside the valid range"));
  recording::Recording log = recording::read_csv(files.sensor, {}, "");
  log.columns[0].value[500] = 1e6;
  io::write_file(files.sensor, recording::to_csv(log));
  const HandIdentification after = identify_hand(r, {});
  EXPECT_NEAR(after.joints[0].holdout.rmse_deg, before.joints[0].holdout.rmse_deg, 0.2);
  EXPECT_TRUE(warned(after, "a_adc: 1 reading(s) lie outside the valid range"));
}

TEST_F(Hand, ReadingsThatNoBoardTakesAreFittedForAPC) {
  const PairFiles files = write("wide", 60, 1);
  recording::Recording log = recording::read_csv(files.sensor, {}, "");
  for (double& u : log.columns[0].value) u *= 4;
  io::write_file(files.sensor, recording::to_csv(log));
  HandRequest r = request({files}, "index=a_adc:index_deg");
  r.input_unit = "count";
  const HandIdentification wide = identify_hand(r, {});
  EXPECT_LT(wide.joints[0].holdout.rmse_deg, wide.joints[0].baselines.at("line").rmse_deg);
  EXPECT_TRUE(warned(wide, "runs on a PC"));
  EXPECT_THROW(model::check_fixed(wide.model), io::InputError);
}

// The board has the gain in its table of counts, so its integers are no coarser.
TEST_F(Hand, VoltsAreFittedAndHeldAsFinelyAsCounts) {
  const PairFiles files = write("volts", 60, 1);
  HandRequest r = request({files}, "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  r.input_unit = "count";
  r.rate_hz = 10;
  const HandIdentification counts = identify_hand(r, {});
  recording::Recording log = recording::read_csv(files.sensor, {}, "");
  for (recording::Column& column : log.columns) {
    column.name = column.name.substr(0, 1) + "_V";
    for (double& u : column.value) u *= 5.0 / 1023;
  }
  io::write_file(files.sensor, recording::to_csv(log));
  r = request({files}, "index=a_V:index_deg,thumb=b_V+a_V:thumb_deg");
  r.rate_hz = 10;
  const HandIdentification volts = identify_hand(r, {});
  for (std::size_t j = 0; j < 2; ++j) {
    const double ratio = volts.joints[j].holdout.rmse_deg / counts.joints[j].holdout.rmse_deg;
    EXPECT_NEAR(ratio, 1, 0.02) << volts.joints[j].name;
  }
  const model::Folded board = model::folded(volts.model);
  EXPECT_LT(model::worst_fixed_error_deg(board.model), model::kFixedError_deg);
  EXPECT_EQ(board.model.blocks.size() + 2, volts.model.blocks.size()) << "one gain for each sensor";
  EXPECT_LT(volts.model.inputs[0].valid_max, 5);
  Estimator<model::DoubleArithmetic> exact(volts.model);
  Estimator<model::FixedArithmetic> fixed(volts.model);
  for (std::size_t k = 0; k < log.t_s.size(); ++k) {
    const std::vector<double> row = {log.columns[0].value[k], log.columns[1].value[k]};
    double angle_deg = 0;
    exact.push(log.t_s[k], row, [&](const Estimate& e) { angle_deg = e.angle_deg[0]; });
    fixed.push(log.t_s[k], row, [&](const Estimate& e) { ASSERT_NEAR(e.angle_deg[0], angle_deg, 0.15); });
  }
  EXPECT_EQ(model::from_json(model::to_json(volts.model), "it"), volts.model);
  EXPECT_FALSE(warned(volts, "runs on a PC"));
}

TEST_F(Hand, TheSensorThatTellsAJointBetterIsNamed) {
  const PairFiles files = write("map", 60, 3);
  EXPECT_TRUE(warned(identify_hand(request({files}, "index=b_adc:index_deg"), {}), "index: a_adc explains"));
  EXPECT_FALSE(warned(identify_hand(request({files}, "index=a_adc:index_deg"), {}), "explains"));
  std::string log = io::read_file(files.sensor);
  const auto row = log.find('\n', log.size() / 2) + 1;
  const auto other = log.find(',', log.find(',', row) + 1) + 1;  // b_adc, which this map does not name
  io::write_file(files.sensor, log.substr(0, other) + "x" + log.substr(other));
  EXPECT_NO_THROW(identify_hand(request({files}, "index=a_adc:index_deg"), {}));
  io::write_file(files.sensor, log);
  recording::Recording camera = recording::read_csv(files.reference, {}, "");
  std::mt19937 random(3);
  std::normal_distribution<double> noise(50, 20);
  for (double& angle : camera.columns[1].value) angle = noise(random);
  io::write_file(files.reference, recording::to_csv(camera));
  EXPECT_NE(refusal([&] {
              identify_hand(request({files}, "index=a_adc:index_deg,thumb=b_adc:thumb_deg"), {});
            }).find("no sensor explains \"thumb_deg\""),
            std::string::npos);
}

TEST_F(Hand, WhatTheMotionLacksIsSaidWithTheMotionThatWouldSupplyIt) {
  EXPECT_FALSE(
      warned(identify_hand(request({write("all", 60, 1)}, "index=a_adc:index_deg"), {}), "flexor protocol"));
  const auto made = [](const std::function<double(double)>& angle) {
    Session out;
    out.angle_deg.resize(1200);
    for (Eigen::Index k = 0; k < 1200; ++k) out.angle_deg(k) = angle(static_cast<double>(k) * 0.05);
    out.use.assign(1200, 1);
    return lacking({out}, 0.05);
  };
  const auto swing = [](double degrees, double period_s) {
    return [=](double t) { return 50 + degrees / 2 * std::sin(2 * M_PI * t / period_s); };
  };
  const auto says = [](const std::vector<std::string>& lines, const char* what) {
    return std::ranges::any_of(lines,
                               [&](const std::string& line) { return line.find(what) != std::string::npos; });
  };
  EXPECT_TRUE(says(made(swing(10, 2)), "moves by 10 degrees only"));
  EXPECT_TRUE(says(made(swing(80, 2)), "never held"));
  EXPECT_TRUE(says(made(swing(80, 30)), "never moves quickly"));
  EXPECT_TRUE(says(made([](double t) { return std::fmod(t, 4) < 2 ? 20.0 : 90.0; }), "never moves slowly"));
  EXPECT_FALSE(says(made([](double t) { return std::fmod(t, 4) < 2 ? 20.0 : 90.0; }), "never held"));
}

TEST_F(Hand, AHoldIsNoHoldAcrossAPause) {
  Session session;
  session.angle_deg.resize(1200);
  for (Eigen::Index k = 0; k < 1200; ++k)
    session.angle_deg(k) = 50 + 40 * std::sin(2 * M_PI * static_cast<double>(k) * 0.05 / 2);
  session.use.assign(1200, 1);
  session.angle_deg.segment(400, 40).setConstant(50);
  const auto held = [&] {
    return std::ranges::none_of(lacking({session}, 0.05), [](const std::string& text) {
      return text.find("never held") != std::string::npos;
    });
  };
  EXPECT_TRUE(held());
  for (std::size_t k = 415; k < 425; ++k) session.use[k] = 0;
  EXPECT_FALSE(held());
}

TEST_F(Hand, RecordingsThatDoNotBelongTogetherAreRefused) {
  const PairFiles one = write("one", 40, 1);
  PairFiles two = write("two", 40, 2);
  EXPECT_NE(refusal([&] {
              identify_hand(request({one, one}, "index=a_adc:index_deg"), {});
            }).find("give it once"),
            std::string::npos);
  const recording::Recording glove = recording::read_csv(two.sensor, {}, "");
  two.sensor = folder_ / "other_glove.csv";
  const auto refused_at = [&](double gain) {
    recording::Recording other = glove;
    for (double& u : other.columns[0].value) u = 450 + gain * (u - 450);
    io::write_file(two.sensor, recording::to_csv(other));
    return refusal([&] {
             identify_hand(request({one, two}, "index=a_adc:index_deg"), {});
           }).find("are these of one glove?") != std::string::npos;
  };
  EXPECT_TRUE(refused_at(-1));
  EXPECT_TRUE(refused_at(0.3));
  EXPECT_FALSE(refused_at(0.8));
}

TEST_F(Hand, SignalsThatTellNothingAreNamed) {
  const PairFiles files = write("one", 60, 1);
  recording::Recording glove = recording::read_csv(files.sensor, {}, "");
  glove.columns.push_back({"c_adc", glove.columns[0].value});
  for (double& u : glove.columns[0].value) u = std::min(u, 400.0);
  io::write_file(files.sensor, recording::to_csv(glove));
  EXPECT_TRUE(
      warned(identify_hand(request({files}, "index=a_adc:index_deg"), {}), "a_adc stands at 400 for"));
  glove.columns[0].value = glove.columns[2].value;
  io::write_file(files.sensor, recording::to_csv(glove));
  const HandIdentification clean = identify_hand(request({files}, "index=a_adc+c_adc:index_deg"), {});
  EXPECT_TRUE(warned(clean, "a_adc and c_adc say the same"));
  EXPECT_FALSE(warned(clean, "clipped"));
}

TEST_F(Hand, AnAngleThatIsASpikeIsLeftOut) {
  const double clean_deg =
      identify_hand(request({write("one", 60, 1)}, "index=a_adc:index_deg"), {}).joints[0].holdout.rmse_deg;
  for (const std::size_t row : {300U, 1500U}) {  // fitted, held out
    const PairFiles files = write("one", 60, 1, [&](std::vector<double>& angle) { angle[row] = 1e6; });
    const HandIdentification r = identify_hand(request({files}, "index=a_adc:index_deg"), {});
    EXPECT_NEAR(r.joints[0].holdout.rmse_deg, clean_deg, 0.05) << row;
    EXPECT_TRUE(warned(r, "lie far from all others, the first is 1e+06")) << row;
  }
}

TEST_F(Hand, AFewSamplesAreNoProof) {
  HandRequest r = request({write("one", 60, 1)}, "index=a_adc:index_deg");
  r.split = 0.999;
  EXPECT_NE(refusal([&] { identify_hand(r, {}); }).find("would be held out"), std::string::npos);
}

TEST_F(Hand, AChainIsFittedAsOneOfItsBlocksAndCanBeWorn) {
  HandRequest r = request({write("one", 60, 1), write("two", 60, 2)}, "index=a_adc:index_deg");
  for (const char* text :
       {"hw", "wh", "hysteresis(1) > curve(8) > lti(1) > saturation", "lag(0.1) > curve(12) > lti(1)"}) {
    r.structure = text;
    if (r.structure.starts_with("lag")) r.clock_offset_s = kOffset_s - 0.1;  // chains cannot lead
    const HandIdentification one = identify_hand(r, {});
    EXPECT_LT(one.joints.front().holdout.rmse_deg, 5) << text;
    EXPECT_LT(one.joints.front().holdout.rmse_deg, one.joints.front().baselines.at("line").rmse_deg) << text;
    EXPECT_LE(one.joints.front().hold_drift_deg, 1) << text;
    EXPECT_NO_THROW(model::check_fixed(one.model)) << text;
    EXPECT_TRUE(one.model.joints.front().accuracy) << text;
    EXPECT_TRUE(one.joints.front().donnings) << text;
    r.structure = one.joints.front().text;
    EXPECT_EQ(identify_hand(r, {}).model.blocks.size(), one.model.blocks.size()) << r.structure;
  }
  r.map = parse_map("index=a_adc+b_adc:index_deg");
  r.structure = "hw";
  EXPECT_NE(refusal([&] { identify_hand(r, {}); }).find("has one sensor, the map names 2"),
            std::string::npos);
}

TEST_F(Hand, ASensorThatAddsNothingIsLeftOut) {
  const PairFiles files = write("one", 60, 1);
  recording::Recording glove = recording::read_csv(files.sensor, {}, "");
  std::mt19937 random(3);
  glove.columns.push_back({"c_adc", {}});
  for (std::size_t k = 0; k < glove.t_s.size(); ++k)
    glove.columns[2].value.push_back(400 + static_cast<double>(random() % 200));
  io::write_file(files.sensor, recording::to_csv(glove));
  HandRequest r = request({files}, "index=a_adc+c_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  r.fit_all = true;
  const HandIdentification both = identify_hand(r, {});
  EXPECT_EQ(both.joints[0].sensors, std::vector<std::string>{"a_adc"});
  EXPECT_EQ(both.joints[1].sensors, (std::vector<std::string>{"b_adc", "a_adc"}));
  EXPECT_EQ(both.model.inputs.size(), 2u) << "nobody reads c_adc";
  EXPECT_EQ(std::ranges::count_if(both.joints[0].rows, &CandidateRow::chosen), 1);
}

// Of several sensors, whose values are told sensor by sensor, and of a chain with a lag.
TEST_F(Hand, TheCovarianceIsThatOfTheParametersInTheirOrder) {
  HandRequest r = request({write("one", 60, 1)}, "index=a_adc+b_adc:index_deg");
  const auto check = [&](const JointResult& joint) {
    const auto n = static_cast<Eigen::Index>(joint.parameters.size());
    ASSERT_EQ(joint.covariance.rows(), n);
    ASSERT_EQ(joint.covariance.cols(), n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Parameter& p = joint.parameters[static_cast<std::size_t>(k)];
      EXPECT_NEAR(std::sqrt(joint.covariance(k, k)), p.refused ? 0 : p.standard_error, 1e-9) << p.name;
      for (Eigen::Index l = 0; l < n; ++l) {
        EXPECT_LE(std::abs(joint.covariance(k, l)),
                  std::sqrt(joint.covariance(k, k) * joint.covariance(l, l)) * (1 + 1e-9) + 1e-12);
      }
    }
  };
  check(identify_hand(r, {}).joints.front());
  r.map = parse_map("index=a_adc:index_deg");
  r.structure = "wh";
  check(identify_hand(r, {}).joints.front());
}

TEST_F(Hand, IsTheSameOnAnyNumberOfThreads) {
  HandRequest r = request({write("one", 60, 1)}, "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  std::vector<std::string> results;
  std::size_t done = 0;
  for (const int threads : {1, 2, 5}) {
    r.threads = threads;
    auto json = to_json(identify_hand(r, [&](std::size_t now, std::size_t of, const std::string&) {
      EXPECT_LE(now, of);
      done = std::max(done, now);
      return true;
    }));
    json.erase("fit_seconds");
    results.push_back(json.dump());
  }
  EXPECT_GT(done, 0u);
  EXPECT_EQ(results[1], results[0]);
  EXPECT_EQ(results[2], results[0]);
}

TEST_F(Hand, AStoppedSearchTakesTheBestSoFarOfEveryJointAndSaysSo) {
  HandRequest r = request({write("one", 60, 1)}, "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  const auto at_once = [](std::size_t, std::size_t, const std::string&) { return false; };
  const HandIdentification stopped = identify_hand(r, at_once);
  ASSERT_EQ(stopped.joints.size(), 2u);
  for (const JointResult& joint : stopped.joints) {
    EXPECT_EQ(joint.rows.size(), joint.name == "thumb" ? 2u : 1u) << "both sensors, and the own one alone";
    EXPECT_LT(joint.holdout.rmse_deg, joint.baselines.at("line").rmse_deg) << joint.name;
    EXPECT_TRUE(warned(stopped, (joint.name + ": stopped before").c_str()));
  }
  EXPECT_FALSE(warned(identify_hand(r, {}), "stopped before"));
  r.structure = "hw";
  r.map = parse_map("index=a_adc:index_deg");
  EXPECT_THROW(identify_hand(r, at_once), io::Cancelled);
}

TEST_F(Hand, MapsThatMeanNothingAreRefusedWhereTheyGoWrong) {
  EXPECT_NE(refusal([] { (void)parse_map("index:a"); }).find("no joint at \"index:a\""), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("index=a"); }).find("no angle at \"=a\""), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("index=:b"); }).find("no sensor"), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("index=a+a:b"); }).find("a sensor twice"), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("index=a:b,index=c:d"); }).find("a joint twice"), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("index_se=a:b"); }).find("that apply adds"), std::string::npos);
  EXPECT_NE(refusal([] { (void)parse_map("in dex=a:b"); }).find("a joint cannot be called"),
            std::string::npos);
  const PairFiles files = write("m", 20, 6);
  const std::string missing =
      refusal([&] { (void)identify_hand(request({files}, "index=c_adc:index_deg"), {}); });
  EXPECT_NE(missing.find("c_adc"), std::string::npos) << missing;
  EXPECT_NE(missing.find("a_adc"), std::string::npos) << "lists what there is: " << missing;
}

TEST_F(Hand, TheAngleOfAHoldThatNeverMovesIsRefused) {
  const PairFiles files =
      write("s", 30, 7, [](std::vector<double>& angle) { angle.assign(angle.size(), 40); });
  EXPECT_NE(refusal([&] {
              (void)identify_hand(request({files}, "index=a_adc:index_deg"), {});
            }).find("never changes"),
            std::string::npos);
}

TEST_F(Hand, TheJsonHasWhatOtherToolsRead) {
  const auto json = to_json(identify_hand(request({write("j", 60, 8)}, "index_mcp=a_adc:index_deg"), {}));
  const auto& joint = json.at("joints").at("index_mcp");
  for (const char* key : {"line", "line_lead", "published_form"}) {
    EXPECT_TRUE(joint.at("baselines").at(key).contains("rmse_deg")) << key;
  }
  EXPECT_TRUE(joint.at("holdout").contains("rmse_deg"));
  EXPECT_TRUE(joint.at("structure").is_string());
  EXPECT_LE(joint.at("hold_drift_deg").get<double>(), 1);
  for (const char* key : {"clock_offset_s", "clock_offset_se_s", "confidence"}) {
    EXPECT_TRUE(json.at("pairs").at(0).at(key).is_number()) << key;
  }
  EXPECT_TRUE(json.contains("fit_seconds"));
  EXPECT_TRUE(json.at("warnings").is_array());
}

TEST_F(Hand, WhatIsNoBetterThanALineSaysSo) {
  HandRequest r = request({write("line", 60, 8)}, "index=a_adc:index_deg");
  const auto verdict = [&] {
    const HandIdentification found = identify_hand(r, {});
    EXPECT_EQ(found.model.fit["joints"]["index"]["verdict"], to_json(found)["joints"]["index"]["verdict"]);
    return to_json(found)["joints"]["index"]["verdict"]["word"].get<std::string>();
  };
  EXPECT_EQ(verdict(), "better");
  r.structure = "line";
  EXPECT_NE(verdict(), "better");
}

// Scores the held-out rows of a table that was saved, pair by pair.
double saved_rmse_deg(const recording::Recording& samples, const std::string& estimate) {
  double squares = 0;
  double count = 0;
  for (std::size_t k = 0; k < samples.t_s.size(); ++k) {
    if (samples.column("held_out").value[k] == 0) continue;
    const double e = samples.column(estimate).value[k] - samples.column("measured_deg").value[k];
    squares += e * e;
    ++count;
  }
  return std::sqrt(squares / count);
}

// Also where the model that is returned is another one, fitted to everything.
TEST_F(Hand, WhatIsSavedForAReportIsThePartThatWasProven) {
  HandRequest all = request({write("saved", 60, 41)}, "index=a_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  all.fit_all = true;
  const HandIdentification r = identify_hand(all, {});
  save_hand_results(r, folder_ / "report");
  for (std::size_t j = 0; j < 2; ++j) {
    const auto samples =
        recording::read_csv(folder_ / "report" / ("samples-" + std::to_string(j + 1) + ".csv"), {});
    EXPECT_NEAR(saved_rmse_deg(samples, "estimated_deg"), r.joints[j].holdout.rmse_deg, 1e-9);
    EXPECT_NEAR(saved_rmse_deg(samples, "straight_line_deg"), r.joints[j].baselines.at("line").rmse_deg,
                1e-9);
    EXPECT_EQ(samples.t_s.front(), 0);
    const auto& held = samples.column("held_out").value;
    EXPECT_NEAR(static_cast<double>(std::ranges::count(held, 1.0)), static_cast<double>(held.size()) / 2, 1);
  }
  const auto json = io::parse_json(io::read_file(folder_ / "report" / "results.json"), "");
  EXPECT_EQ(json.at("kind"), "hand");
  EXPECT_EQ(json.at("pairs").at(0).at("sensor"), "saved_glove.csv") << "a name, not where it lies";
  EXPECT_EQ(json.at("pairs").at(0).at("sensor_digest"),
            r.model.training.at("pairs").at(0).at("sensor_digest"));
  EXPECT_EQ(json.at("joints").at("thumb").at("sensors").size(), 2U);
}

TEST_F(Hand, EachPairsSamplesAreSavedOnAClockOfTheirOwn) {
  const HandIdentification r =
      identify_hand(request({write("c", 60, 42), write("d", 50, 43)}, "index=a_adc:index_deg"), {});
  save_hand_results(r, folder_ / "report");
  const std::string text = io::read_file(folder_ / "report" / "samples-1.csv");
  EXPECT_NE(text.find("\n0,1,"), std::string::npos);
  EXPECT_NE(text.find("\n0,2,"), std::string::npos);
  ASSERT_EQ(r.joints[0].samples.size(), 2U);
  EXPECT_NEAR(r.joints[0].samples[0].t_s.back() - r.joints[0].samples[1].t_s.back(), 10, 0.5);
}

// The static map is where the angle comes to when the readings stay for a minute.
TEST_F(Hand, TheStaticMapIsWhereAHeldFingerSettles) {
  const HandIdentification r =
      identify_hand(request({write("map", 60, 44)}, "thumb=b_adc+a_adc:thumb_deg"), {});
  save_hand_results(r, folder_ / "report");
  const auto json = io::parse_json(io::read_file(folder_ / "report" / "results.json"), "");
  const auto& map = json.at("joints").at("thumb").at("static_map");
  std::vector<double> other = r.joints[0].samples[0].reading[1];
  std::ranges::nth_element(other, other.begin() + std::ssize(other) / 2);
  const double median = other[other.size() / 2];
  ASSERT_EQ(r.model.inputs.front().name, "b_adc");
  for (const std::size_t at : {10U, 150U, 290U}) {
    model::Compensator<model::DoubleArithmetic> held(r.model);
    const std::vector<double> row = {map.at("reading").at(at).get<double>(), median};
    double angle_deg = 0;
    for (int k = 0; k < 1200; ++k) angle_deg = held.step(row).front().angle_deg;
    EXPECT_NEAR(map.at("angle_deg").at(at).get<double>(), angle_deg, 1) << at;
  }
}

// The real recordings, raw logs in, both bounds: what is too good has seen what was held out.
struct RealHand {
  const char* folder;
  const char* map;
  double low[2];
  double high[2];
};

void PrintTo(const RealHand& c, std::ostream* out) { *out << c.folder << ' ' << c.map; }

// Two halves of one recording: together as good as it is, though each may have had its own line.
TEST(RealDonnings, RecordingsOfOneDonningAreAsGoodTogether) {
  const fs::path folder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove/index_ind2";
  if (!fs::exists(folder))
    GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  const io::TemporaryFolder parts;
  HandRequest request;
  const recording::Recording log = recording::read_csv(folder / "sensor_log.csv", {"SensorA1"}, "");
  for (const std::size_t half : {0U, 1U}) {
    recording::Recording part = log;
    const auto middle = static_cast<std::ptrdiff_t>(log.t_s.size() / 2);
    const auto cut = [&](std::vector<double>& v) {
      half == 0 ? v.erase(v.begin() + middle, v.end()) : v.erase(v.begin(), v.begin() + middle);
    };
    cut(part.t_s);
    cut(part.columns[0].value);
    const fs::path file = parts.path() / (half == 0 ? "first.csv" : "second.csv");
    io::write_file(file, recording::to_csv(part));
    request.pairs.push_back({file, folder / "camera_angles.csv"});
  }
  request.map = parse_map("index=SensorA1:∠ABC");
  request.input_unit = "count";
  const HandIdentification r = identify_hand(request, {});
  EXPECT_LT(r.joints[0].holdout.rmse_deg, 1.2);
  EXPECT_GT(r.joints[0].holdout.rmse_deg, 0.9);
}

class RealHands : public testing::TestWithParam<RealHand> {};

TEST_P(RealHands, BothJointsOfOneCommandAreAsGoodAsWasMeasured) {
  const RealHand& c = GetParam();
  const fs::path folder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove" / c.folder;
  if (!fs::exists(folder)) {
    GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  }
  HandRequest request;
  request.pairs = {{folder / "sensor_log.csv", folder / "camera_angles.csv"}};
  request.map = parse_map(c.map);
  request.input_unit = "count";
  const HandIdentification r = identify_hand(request, {});
  for (std::size_t j = 0; j < 2; ++j) {
    const JointResult& joint = r.joints[j];
    EXPECT_LT(joint.holdout.rmse_deg, c.high[j]) << c.folder << ' ' << joint.name;
    EXPECT_GT(joint.holdout.rmse_deg, c.low[j]) << c.folder << ' ' << joint.name;
    EXPECT_LE(joint.hold_drift_deg, 1) << c.folder << ' ' << joint.name;
    EXPECT_LT(joint.holdout.rmse_deg, joint.baselines.at("published_form").rmse_deg);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Glove, RealHands,
    testing::Values(RealHand{"index_ind2", "a=SensorA1:∠ABC,b=SensorA1:∠BCD", {0.9, 0.8}, {1.2, 1.0}},
                    RealHand{"middle_mid1", "a=SensorA2:∠ABC,b=SensorA2:∠BCD", {3.5, 4.0}, {4.3, 4.9}},
                    RealHand{"middle_mid1",
                             "a=SensorA2+SensorA0+SensorA1:∠ABC,b=SensorA2+SensorA0+SensorA1:∠BCD",
                             {2.8, 3.0},
                             {3.5, 4.2}}));

}  // namespace
}  // namespace flexor::identify
