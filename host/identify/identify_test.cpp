#include "host/identify/identify_test.hpp"

#include <fmt/format.h>

#include "host/identify/estimator.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/map_check.hpp"
#include "host/identify/readings.hpp"
#include "host/io/json.hpp"
#include "host/model/compensator.hpp"
#include "host/model/correction.hpp"
#include "host/model/fixed_error.hpp"
#include "host/model/formats.hpp"
#include "host/model/tracking.hpp"

namespace flexor::identify {
namespace {
namespace fs = std::filesystem;

TEST_F(Hand, AllJointsOfOneRecordingAreFittedToOneModelThatCanBeWorn) {
  const Result r = found({write("one", {120, 1})}, kBoth);
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

// 180 degrees are straight; an angle that comes near zero is a flexion.
TEST_F(Hand, InnerAnglesOpenAtTheGreaterOneWithAWarning) {
  const auto ends_of = [&](double turn_deg, double sign, bool is_warned) {
    Request request = Hand::request({write("ends", {60, 3}, [&](std::vector<double>& angle) {
      for (double& a : angle) a = turn_deg + sign * a;
    })});
    request.structure = "line";
    const Result r = identify_files(request, {});
    EXPECT_EQ(warned(r, "--pose-angles index="), is_warned) << turn_deg;
    return r.model.joints[0].ends.value();
  };
  EXPECT_NEAR(ends_of(180, -1, true).open_deg, 173, 5);
  EXPECT_NEAR(ends_of(0, 1, false).open_deg, 7, 5);
  EXPECT_NEAR(ends_of(180, 1, true).open_deg, 187, 5) << "a whole finger's, which was never opened";
}

// Another angle of one take shows wholly where it is left out: nothing of it was fitted.
TEST_F(Hand, WhatIsLeftOutIsNotFitted) {
  const auto higher = [](std::vector<double>& angle) {
    for (double& a : angle) a += 30;
  };
  Request r = request({write("p", {60, 3}), write("q", {50, 4}, higher)});
  r.structure = "curve";
  r.leave_out = LeaveOut::person;
  EXPECT_TRUE(has(refusal(r), "one folder"));
  r.leave_out = LeaveOut::take;
  const Result both = identify_files(r, {});
  const JointResult& takes = both.joints[0];
  ASSERT_EQ(takes.left_out.size(), 2U);
  ASSERT_EQ(takes.pairs.size(), 2U);
  for (std::size_t p = 0; p < 2; ++p) {
    EXPECT_EQ(takes.left_out[p].name, takes.pairs[p].name);
    EXPECT_NEAR(takes.left_out[p].rmse_deg, 30, 4);
    EXPECT_NEAR(takes.left_out[p].baseline_deg.at("line"), 30, 4);
    EXPECT_LT(takes.pairs[p].rmse_deg, 20) << "both were fitted";
    EXPECT_GT(takes.left_out[p].samples, 2 * takes.pairs[p].samples - 100);
  }
  EXPECT_NEAR(takes.left_out_verdict->rmse_deg, 30, 4);
  save_results(both, folder_ / "report");
  const std::string saved = io::read_file(folder_ / "report" / "samples-1.csv");
  EXPECT_TRUE(has(saved, "\n0,1,") && has(saved, "\n0,2,")) << "each on a clock of its own";
  for (const Clock& clock : both.clocks) EXPECT_NEAR(clock.offset_s, kOffset_s, 0.1);
  r.pairs.pop_back();
  r.leave_out = LeaveOut::block;
  const JointResult blocks = identify_files(r, {}).joints[0];
  ASSERT_EQ(blocks.left_out.size(), 8U);
  std::size_t samples = 0;
  for (const ScoreRow& row : blocks.left_out) samples += row.samples;
  EXPECT_EQ(samples, blocks.samples[0].own().size() - blocks.samples[0].begin()) << "each once";
  EXPECT_NEAR(blocks.left_out_verdict->rmse_deg, blocks.holdout.rmse_deg, 1);
}

// What a part lacks, or a stop, costs the verdict alone.
TEST_F(Hand, APartThatCannotBeLeftOutCostsItsVerdictAlone) {
  Request r = request({write("p", {60, 3}), write("q", {60, 4})});
  r.structure = "line-lead";
  r.leave_out = LeaveOut::take;
  const auto until_q = [](std::size_t, std::size_t, const std::string& what) {
    return !what.starts_with("without q");
  };
  const Result stopped = identify_files(r, until_q);
  EXPECT_TRUE(stopped.leave_out_stopped);
  EXPECT_EQ(stopped.joints[0].untried, 0U) << "the model is whole";
  EXPECT_EQ(stopped.joints[0].left_out.size(), 1U);
  EXPECT_FALSE(stopped.joints[0].left_out_verdict);
  r.pairs[1] = write("short", {1.9, 5});
  r.split = 0.3;
  r.clock_offset_s = kOffset_s;
  const Result lacking = identify_files(r, {});
  EXPECT_FALSE(lacking.leave_out_stopped);
  EXPECT_TRUE(warned(lacking, "without p_glove.csv"));
  EXPECT_EQ(lacking.joints[0].left_out.size(), 1U);
  EXPECT_FALSE(lacking.joints[0].left_out_verdict);
}

// Nothing differs between them, so that each may say it as well as both.
TEST_F(Hand, ARecordingThatStandsThereTwiceWithADifferenceSpoilsNothing) {
  const PairFiles one = write("once", {90, 5});
  const PairFiles again{folder_ / "again_glove.csv", one.reference};
  fs::copy_file(one.sensor, again.sensor);
  change(again.sensor, [](recording::Recording& log) { log.columns[0].value[700] += 1; });
  EXPECT_LT(rmse_deg({one, again}), 1.15 * rmse_deg({one}));
}

TEST_F(Hand, TheColumnOfGapsIsNoSensor) {
  const fs::path aligned = folder_ / "aligned.csv";
  io::write_file(aligned, "t_s,index_adc,index_deg,gap\n0,1,2,0\n1,2,4,0\n");
  EXPECT_EQ(columns_of({aligned, aligned}, false, {}), std::vector<std::string>{"index_adc"});
}

TEST_F(Hand, JointsAreFoundByName) {
  const PairFiles files{folder_ / "glove.csv", folder_ / "camera.csv"};
  io::write_file(files.sensor, "t_s,thumb_adc,index_adc,index_dip_adc,battery_V\n0,1,2,3,4\n1,2,3,4,4\n");
  io::write_file(
      files.reference,
      "t_s,index_mcp_deg,index_dip_deg,thumb_deg,ring_deg,thumb_quality\n0,1,2,3,4,0\n1,2,3,4,5,0\n");
  std::string all;
  const auto beside = [](const std::string& map, const std::vector<std::string>& columns = {}) {
    return with_neighbours(parse_map(map), columns).at(0).sensors;
  };
  using Sensors = std::vector<std::string>;
  EXPECT_EQ(beside("thumb=a:x,index_pip=b:y,ring=d:z,index_mcp=e:w"), (Sensors{"a", "b", "e"}));
  EXPECT_EQ(beside("Index=a:x", {"middle_adc", "a", "ring_adc", "temp"}), (Sensors{"a", "middle_adc"}));
  EXPECT_EQ(beside("middle=a:x,elbow=b:y,wrist=c:z", {"palm", "x"}), Sensors{"a"});
  for (const JointMap& joint : map_by_name(files, "")) {
    ASSERT_EQ(joint.sensors.size(), 1U);
    all += joint.joint + "=" + joint.sensors[0] + ":" + joint.reference + " ";
  }
  EXPECT_EQ(
      all,
      "index_mcp=index_adc:index_mcp_deg index_dip=index_dip_adc:index_dip_deg thumb=thumb_adc:thumb_deg ");
  io::write_file(files.sensor, "t_s,trial,index,temp,Thumb\n0,1,2,3,4\n1,1,4,4,5\n");
  io::write_file(files.reference, "t_s,trial,index,temp,little,thumb\n0,1,2,3,4,0\n1,1,4,5,5,9\n");
  EXPECT_EQ(map_by_name(files, ""), parse_map("index=index:index,thumb=Thumb:thumb"));
  EXPECT_THROW(map_by_name({files.sensor, files.sensor}, ""), io::InputError);
  Take take;
  EXPECT_THROW((void)clock_of({{"index", {}, "index_deg"}}, {}, take, take.sensor.warnings), io::InputError);
  io::write_file(files.sensor, "t_s,A0,A1\n0,1,2\n1,2,3\n");
  const std::string message = io::refusal_of([&] { (void)map_by_name(files, ""); });
  EXPECT_TRUE(has(message, "A0, A1") && has(message, "--map")) << message;
}

TEST_F(Hand, WhatWasProvenIsFittedToEverything) {
  Request r = request({write("all", {90, 31})});
  const Result half = identify_files(r, {});
  r.fit_all = true;
  const Result whole = identify_files(r, {});
  EXPECT_EQ(whole.joints[0].holdout.rmse_deg, half.joints[0].holdout.rmse_deg) << "the proof is the half's";
  EXPECT_NE(whole.model.blocks, half.model.blocks);
  ASSERT_EQ(whole.model.blocks.size(), half.model.blocks.size()) << "the proven structure, fitted to more";
  for (std::size_t b = 0; b < half.model.blocks.size(); ++b)
    EXPECT_EQ(whole.model.blocks[b].kind.index(), half.model.blocks[b].kind.index());
}

// The errors that a model states are those that it makes on data that it never saw, and no less than those of the
// angles that it was measured with; the figures against these stay as they are.
TEST_F(Hand, StatedAccuracyIsThatOfUnseenDataAndOfTheReference) {
  Request request = Hand::request({write("acc", {160, 32})});
  const Result r = identify_files(request, {});
  ASSERT_TRUE(r.model.joints[0].accuracy);
  const auto& own = r.model.joints[0].accuracy->standard_error_deg;
  double squares = 0;
  for (const double error : own) squares += error * error;
  const double stated = std::sqrt(squares / static_cast<double>(own.size()));
  EXPECT_GT(stated, 0.7 * r.joints[0].holdout.rmse_deg);
  EXPECT_LT(stated, 1.5 * r.joints[0].holdout.rmse_deg);
  request.reference_error_deg = {{"index", 6}};
  const Result erring = identify_files(request, {});
  EXPECT_EQ(erring.joints[0].holdout.rmse_deg, r.joints[0].holdout.rmse_deg);
  const auto& more = erring.model.joints[0].accuracy->standard_error_deg;
  for (std::size_t i = 0; i < more.size(); ++i) EXPECT_DOUBLE_EQ(more[i], std::hypot(own[i], 6));
  EXPECT_TRUE(has(erring.warnings.back(), "err by about 6 deg"));
}

// Whatever the second half says, the model is the same; only its score differs.
TEST_F(Hand, WhatIsHeldOutChangesNoCoefficient) {
  Request r = request({write("h", {60, 5})});
  r.clock_offset_s = kOffset_s;
  const Result a = identify_files(r, {});
  r.pairs = {write("i", {60, 5}, [](std::vector<double>& angle) {
    for (std::size_t k = angle.size() * 6 / 10; k < angle.size(); ++k) angle[k] = 90 - angle[k] / 2;
  })};
  const Result b = identify_files(r, {});
  EXPECT_EQ(a.model.blocks, b.model.blocks);
  EXPECT_GT(b.joints[0].holdout.rmse_deg, 5 * a.joints[0].holdout.rmse_deg);
}

TEST_F(Hand, ASpikeIsLeftOutAndReported) {
  const PairFiles files = write("spike", {60, 1});
  Request r = request({files});
  r.input_unit = "count";
  r.structure = "curve(12) + motion(0.2)";
  const Result before = identify_files(r, {});
  EXPECT_FALSE(warned(before, "outside the valid range"));
  change(files.sensor, [](recording::Recording& log) { log.columns[0].value[500] = 1e6; });
  const Result after = identify_files(r, {});
  EXPECT_NEAR(after.joints[0].holdout.rmse_deg, before.joints[0].holdout.rmse_deg, 0.2);
  EXPECT_TRUE(warned(after, "a_adc: 1 reading(s) lie outside the valid range"));
  for (const std::size_t row : {300U, 1500U}) {  // of the angle: fitted, held out
    r.pairs = {write("angle", {60, 1}, [&](std::vector<double>& angle) { angle[row] = 1e6; })};
    const Result spoilt = identify_files(r, {});
    EXPECT_NEAR(spoilt.joints[0].holdout.rmse_deg, before.joints[0].holdout.rmse_deg, 0.05) << row;
    EXPECT_TRUE(warned(spoilt, "the first is 1e+06")) << row;
  }
}

TEST_F(Hand, ReadingsThatNoBoardTakesAreFittedForAPC) {
  const PairFiles files = write("wide", {60, 1});
  change_readings(files.sensor, [](double u) { return 40 * u; });
  Request r = request({files});
  r.input_unit = "count";
  const Result wide = identify_files(r, {});
  EXPECT_LT(wide.joints[0].holdout.rmse_deg, wide.joints[0].baselines.at("line").rmse_deg);
  EXPECT_TRUE(warned(wide, "runs on a PC"));
  EXPECT_THROW(model::check_fixed(wide.model), io::InputError);
}

TEST_F(Hand, JointsThatDoNotFitABoardTogetherGetSmaller) {
  Request r = request({write("p", {60, 3})}, kBoth);
  const auto knots = [](const model::Model& m) {
    double out = 0;
    for (const model::Block& block : m.blocks)
      if (const auto* curve = std::get_if<model::Curve>(&block.kind))
        out += static_cast<double>(curve->x.size());
    return out;
  };
  const Result large = identify_files(r, {});
  r.room = [&](const model::Model& m) {
    EXPECT_TRUE(m.joints.front().ends) << "which deploy maps to the hand's";
    return knots(m) / (0.8 * knots(large.model));
  };
  const Result small = identify_files(r, {});
  EXPECT_LE(knots(small.model), 0.8 * knots(large.model));
  for (std::size_t j = 0; j < 2; ++j)
    EXPECT_LT(small.joints[j].holdout.rmse_deg, 1.3 * large.joints[j].holdout.rmse_deg) << j;
}

// The board has the gain in its table of counts, so its integers are no coarser.
TEST_F(Hand, VoltsAreFittedAndHeldAsFinelyAsCounts) {
  const PairFiles files = write("volts", {60, 1});
  Request r = request({files}, kBoth);
  r.input_unit = "count";
  r.rate_hz = 10;
  const Result counts = identify_files(r, {});
  const recording::Recording log = change(files.sensor, [](recording::Recording& all) {
    for (recording::Column& column : all.columns) {
      column.name = column.name.substr(0, 1) + "_V";
      for (double& u : column.value) u *= 5.0 / 1023;
    }
  });
  r = request({files}, "index=a_V:index_deg,thumb=b_V+a_V:thumb_deg");
  r.rate_hz = 10;
  const Result volts = identify_files(r, {});
  for (std::size_t j = 0; j < 2; ++j) {
    const double ratio = volts.joints[j].holdout.rmse_deg / counts.joints[j].holdout.rmse_deg;
    EXPECT_NEAR(ratio, 1, 0.02) << volts.joints[j].name;
  }
  const model::Folded board = model::folded(volts.model);
  for (std::size_t j = 0; j < 2; ++j)
    EXPECT_LT(model::worst_fixed_error_deg(board.model)[j],
              model::allowed_fixed_error_deg(board.model.joints[j]));
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
  EXPECT_FALSE(warned(volts, "runs on a PC"));
}

TEST_F(Hand, TheSensorThatTellsAJointBetterIsNamed) {
  const PairFiles files = write("map", {60, 3});
  EXPECT_TRUE(has(refusal(request({files}, "index=b_adc:index_deg")), "index: a_adc explains"));
  EXPECT_FALSE(warned(found({files}), "explains"));
  const std::string log = io::read_file(files.sensor);
  const auto row = log.find('\n', log.size() / 2) + 1;
  const auto other = log.find(',', log.find(',', row) + 1) + 1;  // b_adc, which this map does not name
  io::write_file(files.sensor, log.substr(0, other) + "x" + log.substr(other));
  EXPECT_NO_THROW(found({files}));
  io::write_file(files.sensor, log);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(50, 20);
  change(files.reference, [&](recording::Recording& camera) {
    for (double& angle : camera.columns[1].value) angle = noise(random);
  });
  EXPECT_TRUE(has(refusal(request({files}, "index=a_adc:index_deg,thumb=b_adc:thumb_deg")),
                  "no sensor explains \"thumb_deg\""));
}

// A minute of an angle.
Session minute_of(const std::function<double(double)>& angle_deg) {
  return sampled(1200, [&](Eigen::Index k) {
    return std::pair{0.0, angle_deg(static_cast<double>(k) * 0.05)};
  });
}

Session swings(double degrees, double period_s) {
  return minute_of([=](double t) { return 50 + degrees / 2 * std::sin(2 * M_PI * t / period_s); });
}

bool lacks(const Session& session, const char* what) {
  return std::ranges::any_of(lacking({session}, 0.05),
                             [&](const std::string& line) { return has(line, what); });
}

TEST_F(Hand, WhatTheMotionLacksIsReportedWithTheMotionThatWouldSupplyIt) {
  EXPECT_FALSE(warned(found({write("all", {60, 1})}), "flexor protocol"));
  EXPECT_TRUE(lacks(swings(10, 2), "moves by 10 degrees only"));
  EXPECT_TRUE(lacks(swings(80, 2), "never held"));
  EXPECT_TRUE(lacks(swings(80, 30), "never moves quickly"));
  const Session jumps = minute_of([](double t) { return std::fmod(t, 4) < 2 ? 20.0 : 90.0; });
  EXPECT_TRUE(lacks(jumps, "never moves slowly"));
  EXPECT_FALSE(lacks(jumps, "never held"));
  Session held = swings(80, 2);
  held.angle_deg.segment(400, 40).setConstant(50);
  EXPECT_FALSE(lacks(held, "never held"));
  for (std::size_t k = 415; k < 425; ++k) held.use[k] = 0;
  EXPECT_TRUE(lacks(held, "never held")) << "a hold is no hold across a pause";
}

TEST_F(Hand, RecordingsThatDoNotBelongTogetherAreRefused) {
  const PairFiles one = write("one", {40, 1});
  EXPECT_TRUE(has(refusal(request({one, one})), "give it once"));
  const auto refused_at = [&](double gain) {
    const PairFiles two = write("two", {40, 2});
    change_readings(two.sensor, [&](double u) { return 450 + gain * (u - 450); });
    return has(refusal(request({one, two})), "are these of one glove?");
  };
  EXPECT_TRUE(refused_at(-1));
  EXPECT_TRUE(refused_at(0.3));
  EXPECT_FALSE(refused_at(0.8));
  const PairFiles volts = write("volts", {40, 2});
  change(volts.sensor, [](recording::Recording& log) {
    for (double& u : log.columns.back().value) u /= 200;
  });
  EXPECT_TRUE(has(refusal(request({one, volts}, kBoth)), "b_adc\" reads"));
}

TEST_F(Hand, WhereOneClockWasResetTheOtherLogGoesWithEachTrial) {
  for (const bool is_camera : {true, false}) {
    const PairFiles files = write("reset", {120, 7});
    change(is_camera ? files.reference : files.sensor, [](recording::Recording& log) {
      for (std::size_t k = log.t_s.size() / 2; k < log.t_s.size(); ++k) log.t_s[k] -= 40;
    });
    Request r = request({files});
    r.structure = "line";
    EXPECT_TRUE(has(refusal(r), "--segment clock"));
    r.time.segments = {"clock"};
    const Result found = identify_files(r, {});
    ASSERT_EQ(found.clocks.size(), 2U);
    EXPECT_NEAR(found.clocks[0].offset_s, kOffset_s, 0.1);
    EXPECT_NEAR(found.clocks[1].offset_s, kOffset_s + (is_camera ? -40 : 40), 0.1);
  }
}

// An angle of an inertial suit, where 180 goes over into -180 in the middle of the motion.
TEST_F(Hand, ASensorThatWrapsAtTheEndOfATurnGoesOnInEveryCommand) {
  std::vector<double> error_deg;
  for (const double off_deg : {-100, 30}) {
    const PairFiles files = write("turn", {60, 1, 40, 0});
    change(files.sensor, [&](recording::Recording& log) {
      log.columns.resize(1);
      log.columns[0].name = "index_deg";
      for (double& u : log.columns[0].value) u = std::remainder(u / 3 + off_deg, 360);
    });
    const Result r = found({files}, "index=index_deg:index_deg");
    EXPECT_EQ(warned(r, "jumps by a turn"), off_deg > 0);
    error_deg.push_back(r.joints[0].holdout.rmse_deg);
    double reading = -175;
    turn_into_range(r.model, {&reading, 1});
    EXPECT_EQ(reading, 185);
  }
  EXPECT_NEAR(error_deg[1], error_deg[0], 0.01);
}

TEST_F(Hand, AStuckSensorIsNamedFirstAndNoStructureIsAdvised) {
  const PairFiles files = write("stuck", {60, 1});
  change(files.sensor, [](recording::Recording& log) {
    std::vector<double>& u = log.columns[0].value;
    std::fill(u.begin() + std::ssize(u) / 2, u.end(), u[static_cast<std::size_t>(std::ssize(u) / 2)]);
  });
  Request r = request({files});
  r.clock_offset_s = kOffset_s;
  const Result stuck = identify_files(r, {});
  EXPECT_TRUE(has(stuck.warnings.front(), "a_adc does not change from")) << stuck.warnings.front();
  EXPECT_FALSE(warned(stuck, "is the map right"));
  EXPECT_FALSE(has(score::in_words(stuck.joints[0].verdict), "--structure"));
}

// Ten of the eighteen seconds that are fitted: rows that are missing, and an angle that stands still while the sensor moves.
TEST_F(Hand, WhatTheCameraLostIsNotFitted) {
  const auto fitted = [&](bool frozen) {
    const PairFiles files = write("lost", {36, 1});
    change(files.reference, [&](recording::Recording& seen) {
      const auto lose = [&](std::vector<double>& v) {
        const auto last = v.begin() + 180;
        frozen ? void(std::fill(last + 1, last + 290, *last)) : void(v.erase(last, last + 290));
      };
      if (frozen) return lose(seen.columns[0].value);
      lose(seen.t_s);
      for (recording::Column& column : seen.columns) lose(column.value);
    });
    Request r = request({files});
    r.structure = "curve";
    return identify_files(r, {});
  };
  const Result missing = fitted(false);
  const Result frozen = fitted(true);
  EXPECT_EQ(frozen.joints[0].holdout.rmse_deg, missing.joints[0].holdout.rmse_deg);
  EXPECT_TRUE(warned(missing, "of what is fitted nothing was measured"));
  EXPECT_TRUE(warned(frozen, "does not change from 14.6 to 24.3 s"));
}

TEST_F(Hand, ASensorsMissingReadingsCostTheOthersNothing) {
  const PairFiles whole = write("whole", {60, 7});
  const PairFiles holes = write("holes", {60, 7});
  change(holes.sensor, [](recording::Recording& log) {
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      if (k % 3 == 0 || (k > 800 && k < 1000)) log.columns[1].value[k] = std::nan("");
    }
  });
  const char* map = "index=a_adc:index_deg,thumb=b_adc:index_deg";
  const Result a = found({whole}, map);
  const Result b = found({holes}, map);
  EXPECT_NEAR(b.joints[0].holdout.rmse_deg, a.joints[0].holdout.rmse_deg, 0.05);
  EXPECT_NEAR(b.clocks[0].offset_s, a.clocks[0].offset_s, 0.02);
  EXPECT_TRUE(warned(b, "have no b_adc"));
  EXPECT_LT(b.joints[1].holdout.rmse_deg, 1.5 * a.joints[1].holdout.rmse_deg);
}

TEST_F(Hand, ReadingsThatAreNoCountsAreRefusedBeforeTheSearch) {
  const PairFiles pair = write("one", {60, 7});
  change_readings(pair.sensor, [](double u) { return u / 1023; });
  const std::string why = refusal(request({pair}));
  EXPECT_TRUE(has(why, "\"a_adc\" reads 0.3") && has(why, "outside of what counts can be (1 to 1022)"))
      << why;
}

TEST_F(Hand, SignalsThatTellNothingAreNamed) {
  const PairFiles files = write("one", {60, 1});
  recording::Recording glove = change(files.sensor, [](recording::Recording& log) {
    log.columns.push_back({"c_adc", log.columns[0].value});
    for (double& u : log.columns[0].value) u = std::min(u, 400.0);
  });
  EXPECT_TRUE(warned(found({files}), "a_adc stands at 400 for"));
  change(files.sensor, [](recording::Recording& log) { log.columns[0].value = log.columns[2].value; });
  const Result clean = found({files}, "index=a_adc+c_adc:index_deg");
  EXPECT_TRUE(warned(clean, "a_adc and c_adc say the same"));
  EXPECT_FALSE(warned(clean, "clipped"));
}

TEST_F(Hand, AChainIsFittedAsOneOfItsBlocksAndCanBeWorn) {
  Request r = request({write("one", {60, 1}), write("two", {60, 2})});
  for (const char* text : {"hw", "wh", "wiener", "hysteresis(1) > curve(8) > lti(1) > saturation",
                           "lag(0.1) > curve(12) > lti(1)"}) {
    r.structure = text;
    if (r.structure.starts_with("lag")) r.clock_offset_s = kOffset_s - 0.1;  // chains cannot lead
    const Result all = identify_files(r, {});
    const JointResult& one = all.joints.front();
    EXPECT_LT(one.holdout.rmse_deg, 5) << text;
    EXPECT_LT(one.holdout.rmse_deg, one.baselines.at("line").rmse_deg) << text;
    EXPECT_LE(one.hold_drift_deg, 1) << text;
    EXPECT_NO_THROW(model::check_fixed(all.model)) << text;
    EXPECT_TRUE(all.model.joints.front().accuracy) << text;
    r.structure = one.text;
    EXPECT_EQ(identify_files(r, {}).model.blocks.size(), all.model.blocks.size()) << r.structure;
  }
}

TEST_F(Hand, ASensorThatAddsNothingIsLeftOut) {
  const PairFiles files = write("one", {60, 1});
  std::mt19937 random(3);
  change(files.sensor, [&](recording::Recording& log) {
    log.columns.push_back({"c_adc", std::vector<double>(log.t_s.size())});
    for (double& u : log.columns[2].value) u = 400 + static_cast<double>(random() % 200);
  });
  Request r = request({files}, "index=a_adc+c_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  r.fit_all = true;
  const Result both = identify_files(r, {});
  EXPECT_EQ(both.joints[0].sensors, std::vector<std::string>{"a_adc"});
  EXPECT_EQ(both.joints[1].sensors, (std::vector<std::string>{"b_adc", "a_adc"}));
  EXPECT_EQ(both.model.inputs.size(), 2u) << "nobody reads c_adc";
  EXPECT_EQ(std::ranges::count_if(both.joints[0].rows, &CandidateRow::chosen), 1);
}

// Of several sensors, whose values are listed sensor by sensor, and of a chain with a lag.
TEST_F(Hand, TheCovarianceIsThatOfTheParametersInTheirOrder) {
  Request r = request({write("one", {60, 1})}, "index=a_adc+b_adc:index_deg");
  const auto check = [&] {
    const JointResult joint = identify_files(r, {}).joints.front();
    const auto n = static_cast<Eigen::Index>(joint.parameters.size());
    ASSERT_EQ(joint.covariance.rows(), n);
    ASSERT_EQ(joint.covariance.cols(), n);
    const Eigen::VectorXd error = joint.covariance.diagonal().cwiseSqrt();
    for (Eigen::Index k = 0; k < n; ++k) {
      const Parameter& p = joint.parameters[static_cast<std::size_t>(k)];
      EXPECT_NEAR(error(k), p.refused ? 0 : p.standard_error, 1e-9) << p.name;
      for (Eigen::Index l = 0; l < n; ++l)
        EXPECT_LE(std::abs(joint.covariance(k, l)), error(k) * error(l) * (1 + 1e-9) + 1e-12);
    }
  };
  check();
  r.map = parse_map(kIndex);
  r.structure = "wh";
  check();
}

TEST_F(Hand, IsTheSameOnAnyNumberOfThreads) {
  Request r = request({write("one", {60, 1})}, kBoth);
  std::vector<std::string> results;
  std::size_t done = 0;
  for (const int threads : {1, 2, 5}) {
    r.threads = threads;
    auto json = to_json(identify_files(r, [&](std::size_t now, std::size_t of, const std::string&) {
      EXPECT_LE(now, of);
      done = std::max(done, now);
      return true;
    }));
    EXPECT_EQ(json.erase("fit_seconds"), 1U);
    results.push_back(json.dump());
  }
  EXPECT_GT(done, 0u);
  EXPECT_EQ(results[1], results[0]);
  EXPECT_EQ(results[2], results[0]);
}

TEST_F(Hand, AStoppedSearchTakesTheBestSoFarOfEveryJointAndSaysSo) {
  Request r = request({write("one", {60, 1})}, kBoth);
  const auto at_once = [](std::size_t, std::size_t, const std::string&) { return false; };
  const Result stopped = identify_files(r, at_once);
  ASSERT_EQ(stopped.joints.size(), 2u);
  for (const JointResult& joint : stopped.joints) {
    EXPECT_EQ(joint.rows.size(), joint.name == "thumb" ? 3u : 1u)
        << "both sensors, their mix, and the own one";
    EXPECT_LT(joint.holdout.rmse_deg, joint.baselines.at("line").rmse_deg) << joint.name;
    EXPECT_TRUE(warned(stopped, joint.name + ": stopped before"));
  }
  EXPECT_FALSE(warned(identify_files(r, {}), "stopped before"));
  r.structure = "hw";
  r.map = parse_map(kIndex);
  EXPECT_THROW(identify_files(r, at_once), io::Cancelled);
}

// The first sensor feels a share of the second one's finger: what is left without it is a curve of its own.
TEST_F(Hand, ASensorThatFeelsAnothersFingerIsMixedWithItAndFitsABoard) {
  Request r = request({write("one", {60, 1})}, "index=a_adc+b_adc:index_deg");
  change_second(r.pairs[0].sensor, 0.3, [](std::size_t, double u) { return u; });
  r.clock_offset_s = kOffset_s;
  const Result mixed = identify_files(r, {});
  const JointResult& joint = mixed.joints.front();
  EXPECT_TRUE(joint.structure.starts_with("mixed: ")) << joint.structure;
  const auto& sum = std::get<model::Sum>(mixed.model.blocks.front().kind);
  EXPECT_NEAR(sum.weights[1] / sum.weights[0], -0.3, 0.06)
      << "it sees the first finger too, without the cloth's play";
  EXPECT_NO_THROW(model::check_fixed(mixed.model));
  r.structure = joint.text;
  EXPECT_NEAR(identify_files(r, {}).joints.front().holdout.rmse_deg, joint.holdout.rmse_deg, 1e-9);
  r.structure = "hw";  // a chain of several sensors stands behind their mix
  EXPECT_TRUE(identify_files(r, {}).joints.front().text.starts_with("mix > "));
}

// Where the other finger is elsewhere the sensor reads otherwise: poses are those of the whole hand.
TEST_F(Hand, PosesOfSensorsThatFeelEachOtherAreThoseOfTheOpenHandAndNoneIsTracked) {
  Request r = request({write("one", {120, 1})}, "index=a_adc+b_adc:index_deg,thumb=b_adc+a_adc:thumb_deg");
  change_second(r.pairs[0].sensor, 0.4, [](std::size_t, double u) { return u; });
  r.structure = "mix > curve";
  const model::Model model = identify_files(r, {}).model;
  ASSERT_TRUE(model.inputs[0].poses);
  EXPECT_LT(model.inputs[0].poses->open, 475) << "513 with the thumb anywhere";
  EXPECT_GT(model.inputs[0].poses->fist - model.inputs[0].poses->open, 375) << "339 likewise";
  for (const auto& range : model::tracked_ranges(model)) EXPECT_FALSE(range);
}

TEST_F(Hand, ASensorBesideThatIsOftenLostOrNeverChangesIsLeftOut) {
  const Request r = request({write("one", {60, 1})}, "index=a_adc+b_adc:index_deg");
  change_second(r.pairs[0].sensor, 0, [](std::size_t, double u) { return u > 550 ? 1023 : u; });
  EXPECT_TRUE(warned(identify_files(r, {}), "index: b_adc is left out"));
  change_second(r.pairs[0].sensor, 0, [](std::size_t k, double u) { return k < 1500 ? 400 : u; });
  const Result still = identify_files(r, {});
  EXPECT_EQ(still.joints.front().sensors, std::vector<std::string>{"a_adc"});
  EXPECT_TRUE(warned(still, "never changes in the fitted part"));
}

TEST_F(Hand, MapsThatMeanNothingAreRefusedWhereTheyGoWrong) {
  for (const auto& [map, why] : {std::pair{"index:a", "no joint at \"index:a\""},
                                 {"index=a", "no angle at \"=a\""},
                                 {"index=:b", "no sensor"},
                                 {"index=a+a:b", "a sensor twice"},
                                 {"index=a:b,index=c:d", "a joint twice"},
                                 {"index_se=a:b", "that apply adds"},
                                 {"in dex=a:b", "a joint cannot be called"}}) {
    EXPECT_TRUE(has(io::refusal_of([&] { (void)parse_map(map); }), why)) << map;
  }
}

TEST_F(Hand, RequestsThatCannotBeMetAreRefusedInWords) {
  const Request good = request({write("one", {60, 1})});
  const auto refuses = [&](const std::string& why, const std::function<void(Request&)>& with) {
    Request r = good;
    with(r);
    EXPECT_TRUE(has(refusal(r), why)) << why << ": " << refusal(r);
  };
  refuses("accepted", [](Request&) {});
  refuses("unknown block nonsense", [](Request& r) { r.structure = "nonsense"; });
  refuses("the split must lie between 0 and 1", [](Request& r) { r.split = 1; });
  refuses("the rate must be positive", [](Request& r) { r.rate_hz = 0; });
  refuses("would be held out", [](Request& r) { r.split = 0.999; });
  refuses("c_adc", [](Request& r) { r.map = parse_map("index=c_adc:index_deg"); });
  refuses("a_adc", [](Request& r) { r.map = parse_map("index=c_adc:index_deg"); });  // what there is
  refuses("never changes", [&](Request& r) {
    r.pairs = {write("s", {30, 7}, [](std::vector<double>& angle) { angle.assign(angle.size(), 40); })};
  });
  refuses("is it in another unit", [&](Request& r) {
    r.pairs = {write("mdeg", {30, 7}, [](std::vector<double>& angle) {
      for (double& v : angle) v *= 1000;
    })};
  });
  refuses("takes deg", [](Request& r) {
    r.initial = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
    r.refit = true;
    r.input_unit = "count";
  });
  refuses("flexor recalibrate", [&](Request& r) {
    r.structure = "line-lead";
    r.initial = identify_files(r, {}).model;
  });
  refuses("no joint of the map", [](Request& r) { r.reference_error_deg = {{"ring", 6}}; });
  refuses("between 0 and 90", [](Request& r) { r.reference_error_deg = {{"index", -1}}; });
}

TEST_F(Hand, ALineIsALineAndWhatIsNoBetterSaysSo) {
  Request r = request({write("line", {60, 8})});
  const auto verdict = [&](const Result& it) {
    EXPECT_EQ(it.model.fit["joints"]["index"]["verdict"], to_json(it)["joints"]["index"]["verdict"]);
    return to_json(it)["joints"]["index"]["verdict"]["word"].get<std::string>();
  };
  EXPECT_EQ(verdict(identify_files(r, {})), "better");
  r.structure = "line";
  const Result line = identify_files(r, {});
  EXPECT_NE(verdict(line), "better");
  EXPECT_EQ(line.joints[0].structure, "line");
  EXPECT_EQ(line.joints[0].verdict.itself, "line");
  EXPECT_NEAR(line.joints[0].holdout.rmse_deg, line.joints[0].baselines.at("line").rmse_deg, 1e-9);
}

// Of the rows of a table that was saved that were held out.
double saved_rmse_deg(const recording::Recording& samples, const std::string& estimate) {
  std::vector<std::uint8_t> fitted;
  for (const double held : samples.column("held_out").value) fitted.push_back(held == 0);
  const auto& measured = samples.column("measured_deg").value;
  return score::score_seen(samples.t_s, measured, samples.column(estimate).value, fitted).rmse_deg;
}

// Also where the model that is returned is another one, fitted to everything.
TEST_F(Hand, WhatIsSavedForAReportIsThePartThatWasProven) {
  Request all = request({write("saved", {60, 41})}, kBoth);
  all.fit_all = true;
  const Result r = identify_files(all, {});
  save_results(r, folder_ / "report");
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
  const auto& pair = json.at("pairs").at(0);
  EXPECT_EQ(pair.at("sensor"), "saved_glove.csv") << "a name, not where it lies";
  EXPECT_EQ(pair.at("sensor_digest"), r.model.training.at("pairs").at(0).at("sensor_digest"));
  const auto& thumb = json.at("joints").at("thumb");
  EXPECT_EQ(thumb.at("sensors").size(), 2U);
  // The static map is where the angle comes to when the readings stay for a minute.
  std::vector<double> a_adc = r.joints[1].samples[0].sensors[1].input;
  std::ranges::nth_element(a_adc, a_adc.begin() + std::ssize(a_adc) / 2);
  for (const std::size_t at : {10U, 150U, 290U}) {
    model::Compensator<model::DoubleArithmetic> held(r.proven);
    const double b_adc = thumb.at("static_map").at("reading").at(at);
    double angle_deg = 0;
    for (int k = 0; k < 1200; ++k)
      angle_deg = held.step(std::vector{a_adc[a_adc.size() / 2], b_adc})[1].angle_deg;
    EXPECT_NEAR(thumb.at("static_map").at("angle_deg").at(at).get<double>(), angle_deg, 1) << at;
  }
}

// The real recordings, raw logs in, against the figures that this project promises for them; both bounds count: a figure
// that is too good means that held-out data leaked.
struct Bounds {
  double low, high;
};

struct RealHand {
  std::string folder;
  std::string sensors;
  std::string kind;      // of the camera's columns
  Bounds held_out[2];    // RMSE in degrees
  double drift_deg = 1;  // at most, of b; more where the finger's own holds show the sensor's creep
  Bounds line[2] = {{0, 90}, {0, 90}};
};

void PrintTo(const RealHand& c, std::ostream* out) { *out << c.folder << ' ' << c.sensors << c.kind; }

class RealHands : public RealRecordings, public testing::WithParamInterface<RealHand> {};

TEST_P(RealHands, BothJointsOfOneCommandAreAsGoodAsWasMeasured) {
  const RealHand& c = GetParam();
  const std::string map = fmt::format("a={0}:∠ABC{1},b={0}:∠BCD{1}", c.sensors, c.kind);
  const Result r = identify_files(request("glove/" + c.folder, map), {});
  for (std::size_t j = 0; j < 2; ++j) {
    const JointResult& joint = r.joints[j];
    EXPECT_LT(joint.holdout.rmse_deg, c.held_out[j].high) << joint.name;
    EXPECT_GT(joint.holdout.rmse_deg, c.held_out[j].low) << joint.name;
    EXPECT_LT(joint.baselines.at("line").rmse_deg, c.line[j].high) << joint.name;
    EXPECT_GT(joint.baselines.at("line").rmse_deg, c.line[j].low) << joint.name;
    EXPECT_LE(joint.hold_drift_deg, j == 0 ? 1 : c.drift_deg) << joint.name;
    for (const auto& [name, score] : joint.baselines)
      EXPECT_TRUE(name != "published_form" || joint.holdout.rmse_deg < score.rmse_deg);
    EXPECT_EQ(std::ranges::count_if(joint.rows, &CandidateRow::chosen), 1);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Glove, RealHands,
    testing::Values(
        RealHand{"index_ind2", "SensorA1", "", {{0.9, 1.2}, {0.8, 1.0}}},
        RealHand{"index_ind2", "SensorA1", "_smooth", {{0.8, 1.6}, {0.7, 1.2}}, 1, {{5.2, 5.5}, {4.6, 4.9}}},
        RealHand{"middle_mid1", "SensorA2", "", {{3.5, 4.3}, {4.0, 4.9}}, 6},
        RealHand{"middle_mid1", "SensorA2", "_smooth", {{2.8, 4.1}, {3.0, 4.7}}, 6, {{5.0, 5.3}, {5.9, 6.3}}},
        RealHand{"middle_mid1", "SensorA2+SensorA0+SensorA1", "", {{2.8, 3.5}, {3.0, 4.2}}, 6}));

}  // namespace
}  // namespace flexor::identify
