#include "apps/live/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::live {
namespace {

class Guided : public testing::Test {
 protected:
  Calibration start(Reference reference) {
    CalibrationSetup setup;
    setup.reference = reference;
    setup.joints = reference == Reference::marks ? "paper_hand" : "";
    const Session session = sessions_.create("anna", "right", "glove", "calibration");
    return Calibration(setup, session, sessions_.folder(session));
  }
  // At its motion.
  Calibration moving(Reference reference) {
    Calibration c = start(reference);
    while (c.step() != Step::motion) {
      c.saw(1, 1);
      c.next(true);
    }
    return c;
  }
  // So long at 20 Hz, with the camera beside it.
  static void move(Calibration& c, double seconds, bool seen, double from_s = 0) {
    for (int k = 0; k < 20 * seconds; ++k) {
      const double t_s = from_s + 0.05 * k;
      const double angle = 45 + 40 * std::sin(t_s);
      c.add(listen::Sample{t_s, {}, {500 + angle, 600 - angle}, {}}, {"index_count", "thumb_count"});
      if (seen)
        c.add(SeenRow{t_s, {angle, k % 7 == 0 ? NAN : angle}, {}, {}}, {"index_mcp_deg", "thumb_mcp_deg"});
    }
  }
  io::TemporaryFolder folder_;
  Sessions sessions_{folder_.path()};
};

TEST(Steps, EachEventInEachStep) {
  using enum Step;
  using enum StepEvent;
  constexpr std::optional<Step> none;
  struct Row {
    StepEvent event;
    Reference by;
    std::array<std::optional<Step>, 6> to;  // from glove, reference, motion, identify, result, send
  };
  for (const Row& row : std::initializer_list<Row>{
           {next, Reference::marks, {reference, motion, identify, none, none, none}},
           {next, Reference::poses, {motion, none, identify, none, none, none}},
           {back, Reference::marks, {none, glove, reference, motion, motion, result}},
           {back, Reference::poses, {none, glove, glove, motion, motion, result}},
           {repeat, Reference::marks, {none, none, none, motion, motion, none}},
           {identified, Reference::marks, {none, none, none, result, result, none}},
           {accepted, Reference::marks, {none, none, none, none, send, none}},
       }) {
    for (const Step from : {glove, reference, motion, identify, result, send})
      EXPECT_EQ(after(from, row.event, row.by), row.to[static_cast<std::size_t>(from)]) << name_of(from);
  }
}

TEST_F(Guided, StatesWhatAStepStillNeeds) {
  const auto lacks = [](Calibration& c, bool glove_is_there = true) {
    return io::refusal_of([&] { c.next(glove_is_there); });
  };
  Calibration c = start(Reference::marks);
  EXPECT_EQ(lacks(c, false), "no_glove");
  EXPECT_EQ(lacks(c), "accepted");
  EXPECT_EQ(lacks(c, false), "glove_gone");
  EXPECT_EQ(lacks(c), "hand_unseen");
  c.saw(13, 14);
  EXPECT_EQ(c.state().at("marks_found"), 13);
  EXPECT_EQ(lacks(c), "accepted");
  move(c, 5, true);
  EXPECT_EQ(lacks(c), "motion_too_short");
  move(c, 40, false, 5);
  EXPECT_EQ(lacks(c), "marks_too_seldom");
  EXPECT_TRUE(c.wants_pictures()) << "and nothing is thrown away";
  move(c, 20, true, 45);
  EXPECT_EQ(lacks(c), "accepted");
  EXPECT_FALSE(c.wants_pictures());
  EXPECT_EQ(lacks(c), "identifies");
}

TEST_F(Guided, AMotionTakesNothingOfAnotherGlove) {
  Calibration c = moving(Reference::poses);
  move(c, 1, false);
  EXPECT_THROW(c.add(listen::Sample{1, {}, {1, 2}, {}}, {"thumb_count", "index_count"}), io::JobError);
}

TEST_F(Guided, ItsFilesAreWholeRecordings) {
  Calibration c = moving(Reference::marks);
  move(c, 45, true);
  c.next(true);
  c.set_rate(10);
  const auto request = c.identify_request(0.1);
  const auto pair = request.at("pair").at(0).get<std::vector<std::string>>();
  const recording::Recording log = recording::read_csv(pair.at(0), {"index_count"});
  const recording::Recording camera = recording::read_csv(pair.at(1), {"index_mcp_deg", "thumb_mcp_deg"});
  EXPECT_EQ(log.t_s.size(), 900U);
  EXPECT_NEAR(static_cast<double>(camera.t_s.size()), 900.0 * 6 / 7, 2) << "rows with a hole are left out";
  EXPECT_EQ(request.at("map"), "index=index_count:index_mcp_deg,thumb=thumb_count:thumb_mcp_deg");
}

TEST_F(Guided, StatesWhatFollowsAndWhen) {
  Calibration c = moving(Reference::poses);
  move(c, 3, false);
  EXPECT_NEAR(c.state().at("left_s").get<double>(), 1, 0.1);
  EXPECT_EQ(c.state().at("then"), "fist");
  move(c, 12, false, 3);
  EXPECT_NEAR(c.state().at("left_s").get<double>(), 1, 0.1);
  EXPECT_TRUE(c.state().at("then").is_null());
  move(c, 2, false, 15);
  EXPECT_TRUE(c.state().at("left_s").is_null());
}

TEST_F(Guided, ARepeatedMotionHasFilesOfItsOwn) {
  Calibration c = moving(Reference::marks);
  move(c, 45, true);
  c.next(true);
  const auto first = c.model();
  c.failed("no angle is related");
  EXPECT_EQ(c.state().at("asks"), "failed");
  EXPECT_EQ(c.state().at("failed"), "no angle is related");
  c.repeat();
  EXPECT_EQ(c.step(), Step::motion);
  EXPECT_NE(c.model(), first);
  move(c, 45, true);
  c.next(true);
  EXPECT_TRUE(std::filesystem::exists(first.parent_path() / "log.csv"));
  EXPECT_TRUE(std::filesystem::exists(first.parent_path() / "log-2.csv"));
}

TEST_F(Guided, PosesNeedNoCamera) {
  Calibration c = moving(Reference::poses);
  EXPECT_FALSE(c.wants_pictures());
  move(c, 16, false);
  c.next(true);
  EXPECT_TRUE(c.identify_request(0).contains("poses"));
  EXPECT_EQ(c.identify_request(0, {"thumb=90:170"}).at("pose-angles").at(0), "thumb=90:170");
}

TEST_F(Guided, PosesAreEnoughWhereTheyAreHeld) {
  const auto asks = [this](bool held) {
    Calibration c = moving(Reference::poses);
    for (int k = 0; k < 20 * 17; ++k) {
      const double t_s = 0.05 * k;
      const double share = held ? (std::fmod(t_s, 8) < 4 ? 0 : 1) : 0.5 + 0.5 * std::sin(t_s);
      c.add(listen::Sample{t_s, {}, {500 + 100 * share}, {}}, {"index_count"});
    }
    return c.state().at("asks");
  };
  EXPECT_EQ(asks(true), "enough");
  EXPECT_EQ(asks(false), "rest");
}

// As after `kill -9`: what is left is the session.
TEST_F(Guided, GoesOnAfterTheProgramHasEnded) {
  Calibration c = moving(Reference::marks);
  move(c, 45, true);
  const auto goes_on = [&] {
    c.session().calibration = c.kept();
    sessions_.save(c.session());
    const Session read = sessions_.list().at(0);
    return Calibration::resumed(read, sessions_.folder(read));
  };
  EXPECT_EQ(goes_on().step(), Step::reference) << "a motion is made again";
  c.next(true);
  c.set_rate(20);
  Calibration identifies = goes_on();
  EXPECT_EQ(identifies.step(), Step::identify);
  EXPECT_EQ(identifies.session().person, "anna");
  EXPECT_EQ(identifies.identify_request(0.1), c.identify_request(0.1));
}

TEST_F(Guided, ASessionThatWasTamperedWithIsRefusedInOneLine) {
  Calibration c = start(Reference::marks);
  Session session = c.session();
  for (const char* wrong :
       {R"(5)", R"({"step": "glove"})",
        R"({"step": "motion", "reference": "marks", "joints": "/dev/zero", "rate_hz": 0, "attempt": 1})",
        R"({"step": "identify", "reference": "marks", "joints": "", "rate_hz": 10, "attempt": 1})"}) {
    session.calibration = Json::parse(wrong);
    EXPECT_THROW(Calibration::resumed(session, sessions_.folder(session)), io::InputError) << wrong;
  }
  const auto folder = sessions_.folder(session);
  io::write_file(folder / "log.csv", "t_s,index_count\n0,1\n");
  io::write_file(folder / "camera.csv", "t_s,index_mcp_deg\n0,1\n");
  Calibration resumed = Calibration::resumed(session, folder);
  EXPECT_NO_THROW(resumed.identify_request(0));
  std::filesystem::create_directory(folder / "report");
  for (const char* link : {"report/report.html", "model.json"}) {
    std::filesystem::create_symlink(folder_.path() / "another", folder / link);
    EXPECT_THROW(resumed.identify_request(0), io::InputError) << link;
    std::filesystem::remove(folder / link);
  }
  std::filesystem::create_symlink(folder_.path() / "another", folder / "camera-2.csv");
  resumed.repeat();
  EXPECT_EQ(resumed.model().filename(), "model-3.json");
}

// A figure against angles that err is given with their error, and so is the model.
TEST_F(Guided, AMarkerlessReferenceStatesItsOwnError) {
  Calibration c = start(Reference::markerless);
  c.next(true);
  EXPECT_TRUE(c.wants_pictures());
  c.saw(1, 1);
  c.next(true);
  for (int k = 0; k < 900; ++k) {
    const double t_s = 0.05 * k;
    const double angle = 45 + 40 * std::sin(t_s);
    c.add(listen::Sample{t_s, {}, {500 + angle}, {}}, {"index_count"});
    c.add(SeenRow{t_s, {angle, angle, angle}, {}, {}}, {"index_mcp_deg", "index_pip_deg", "middle_mcp_deg"});
  }
  c.next(true);
  c.set_rate(10);
  const auto request = c.identify_request(0);
  EXPECT_EQ(request.at("reference-error"), (std::vector<std::string>{"index_mcp=14", "index_pip=13"}))
      << "of the fingers that have a sensor";
  EXPECT_FALSE(request.contains("map"));

  const auto joint = [](double rmse_deg, double fit_percent = 80) {
    return Json{{"verdict", {{"word", "better"}}},
                {"holdout", {{"rmse_deg", rmse_deg}, {"fit_percent", fit_percent}}},
                {"baselines", Json::object()}};
  };
  c.identified({{"joints", {{"index_mcp", joint(2)}, {"index_pip", joint(3)}}}}, {});
  const auto fingers = c.state().at("result").at("fingers");
  EXPECT_EQ(fingers.at(0).at("reference_error_deg"), 14);
  EXPECT_EQ(fingers.at(1).at("reference_error_deg"), 13);
  c.identified({{"joints", {{"index_mcp", joint(2)}, {"index_pip", joint(40, -60)}}}}, {});
  EXPECT_EQ(c.state().at("result").at("fingers").at(0).at("verdict"), "better");
  EXPECT_EQ(c.state().at("result").at("fingers").at(1).at("verdict"), "astray");
}

// The plot's line is the table's; the verdict is the job's.
TEST_F(Guided, AResultStandsBesideAStraightLine) {
  Calibration c = moving(Reference::marks);
  move(c, 45, true);
  c.next(true);
  const auto result = [](double rmse_deg) {
    const auto of = [](double error_deg) { return Json{{"rmse_deg", error_deg}}; };
    return Json{{"joints",
                 {{"index",
                   {{"verdict", {{"word", "as good"}, {"baseline", "static_curve"}}},
                    {"holdout", {{"rmse_deg", rmse_deg}, {"fit_percent", 80}}},
                    {"baselines", {{"line", of(8)}, {"line_lead", of(4)}, {"static_curve", of(2.5)}}},
                    {"held_out_curve",
                     {{"t_s", {1, 2}},
                      {"measured_deg", {2, 3}},
                      {"estimated_deg", {3, 4}},
                      {"straight_line_deg", {7, 7}}}}}}}}};
  };
  c.identified(result(2), {"index: something"});
  const Json good = c.state().at("result");
  EXPECT_EQ(good.at("fingers").at(0).at("line_deg"), 8);
  EXPECT_EQ(good.at("fingers").at(0).at("baseline"), "static_curve");
  EXPECT_EQ(good.at("fingers").at(0).at("baseline_deg"), 2.5);
  EXPECT_EQ(good.at("plot").at("line_deg"), Json({7, 7}));
  EXPECT_EQ(good.at("fingers").at(0).at("verdict"), "as good");
  EXPECT_EQ(good.at("warnings"), Json({"index: something"}));
}

TEST_F(Guided, AHandThatIsNotFoundIsReported) {
  Calibration c = start(Reference::markerless);
  c.next(true);
  const auto asks = [&] { return c.state().at("asks"); };
  EXPECT_EQ(asks(), "show_hand");
  c.saw(0, 1);
  EXPECT_EQ(asks(), "turn");
  for (int k = 0; k < 100; ++k) c.saw(1, 1);
  EXPECT_EQ(asks(), "seen");
  c.next(true);
  move(c, 5, true);
  for (int k = 0; k < 100; ++k) c.saw(0, 1);
  EXPECT_EQ(asks(), "hidden");
}

}  // namespace
}  // namespace flexor::live
