// The program as its users run it: exit codes, one clear line for bad input, nothing half-written.
#include <fmt/format.h>

#include <cmath>

#include "apps/cli/command_test.hpp"
#include "host/model/channel.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace cli_test {

class Cli : public Command {
 protected:
  Cli() { make(FLEXOR_SIMULATE); }

  std::string glove() const { return path("simulated_glove.csv"); }
  std::string camera() const { return path("simulated_camera.csv"); }

  std::string identify_arguments(const std::string& sensor, const std::string& reference) const {
    return "identify --sensor '" + sensor + "' --reference '" + reference +
           "' --structure linear-dynamic --model '" + path("m.json") + "' --report '" + path("report") + "'";
  }

  static std::string line(const std::string& text, int number) {
    std::size_t begin = 0;
    for (int i = 1; i < number; ++i) begin = text.find('\n', begin) + 1;
    return text.substr(begin, text.find('\n', begin) - begin);
  }
};

TEST_F(Cli, HelpIsThereForEveryCommand) {
  EXPECT_EQ(run("--help").exit, 0);
  for (const char* command : {"align", "identify", "apply", "score", "show", "experiment", "twin",
                              "twin record", "twin wear", "protocol", "wiring", "deploy", "latency", "live",
                              "track", "camera calibrate", "camera film", "export"}) {
    const Finished r = run(std::string(command) + " --help");
    EXPECT_EQ(r.exit, 0) << command;
    EXPECT_NE(r.out.find("Usage"), std::string::npos) << command;
  }
}

TEST_F(Cli, WrongUsageIsExitTwo) {
  EXPECT_EQ(run("").exit, 2);
  EXPECT_EQ(run("dance").exit, 2);
  EXPECT_EQ(run("align --sensor x").exit, 2);
  EXPECT_EQ(run("apply").exit, 2);
  EXPECT_EQ(run("identify --sensor a --reference b --rate fast").exit, 2);
}

TEST_F(Cli, NoOutputTakesThePlaceOfAnInput) {
  const std::string both = "--sensor '" + glove() + "' --reference '" + camera() + "' ";
  const std::string before = content(glove());
  for (const std::string& arguments :
       {"identify --structure linear --model '" + glove() + "' " + both,
        "align --out '" + glove() + "' " + both, "align --out '" + camera() + "' " + both}) {
    expect_refused(arguments, 2, "is an input of this command");
  }
  EXPECT_EQ(content(glove()), before);
  fs::create_directories(path("own"));
  io::write_file(fs::path(path("own")) / "glove-2.csv", before);
  expect_refused("twin record --donnings 2 --out '" + path("own") + "'", 2, "choose another folder");
  EXPECT_EQ(content(fs::path(path("own")) / "glove-2.csv"), before);
}

TEST_F(Cli, AReadingInAnotherUnitThanTheModelsIsRefusedEverywhere) {
  ASSERT_EQ(run("identify --sensor '" + glove() + "' --reference '" + camera() +
                "' --structure linear --input-unit count --model '" + path("m.json") + "'")
                .exit,
            0);
  const model::Model m = model::load(path("m.json"));
  model::Model renamed = m;
  renamed.inputs[0].column = "flex_V";
  model::save(renamed, path("v.json"));
  io::write_file(path("volts.csv"), "t_s,flex_V\n0,1\n0.05,1.5\n0.1,2\n");
  expect_refused("apply '" + path("v.json") + "' '" + path("volts.csv") + "'", 2, "is in V");
  expect_refused(
      "deploy '" + path("v.json") + "' --out '" + path("d") + "' --recording '" + path("volts.csv") + "'", 2,
      "is in V");
}

TEST_F(Cli, HeldPosesNameWhatTheReaderLeavesOut) {
  std::string log = "t_s,thumb_count,index_count,middle_count\n0,1,2\n";
  for (int k = 1; k < 600; ++k)
    log += fmt::format("{:.2f},{},{},nan\n", 0.02 * k, 300 + 200 * (k / 150 % 2), 400 + 100 * (k / 150 % 2));
  io::write_file(path("poses.csv"), log);
  const std::string arguments =
      "identify --poses '" + path("poses.csv") + "' --model '" + path("m.json") + "'";
  const std::string err = run(arguments).err;
  EXPECT_NE(err.find("1 row(s) are malformed"), std::string::npos) << err;
  EXPECT_NE(err.find("left out: middle_count; a sensor among them is dead"), std::string::npos) << err;
  EXPECT_EQ(nlohmann::json::parse(run(arguments + " --json").out).at("warnings").size(), 2U);
}

TEST_F(Cli, EmptyAndAbsurdValuesAreRefusedBeforeTheWork) {
  const std::string both = "--sensor '" + glove() + "' --reference '" + camera() + "' ";
  expect_refused("identify --structure linear --model '' " + both, 2, "--model");
  expect_refused("identify --structure linear --report '' " + both, 2, "--report");
  io::write_file(path("lead.json"), R"({"total": [1]})");
  expect_refused("identify --for '" + path("lead.json") + "' " + both, 2, "flexor latency");
  expect_refused("identify --leave-out take " + both, 2, "--leave-out block");
  expect_refused("score '" + camera() + "' '" + camera() + "' --estimate-offset nan", 2, "--estimate-offset");
  io::write_file(path("torn.csv"), "time_ms,index_count\n12,");
  expect_refused("identify --sensor '" + path("torn.csv") + "' --reference '" + camera() + "'", 2,
                 "torn.csv");
}

TEST_F(Cli, AStandardErrorThatCannotBeWrittenCostsNothingButItsLines) {
  const std::string command = "'" FLEXOR_PROGRAM "' identify --sensor '" + glove() + "' --reference '" +
                              camera() + "' --structure linear --model '" + path("m.json") + "' > '" +
                              path("stdout") + "'";
  for (const char* closed : {" 2> /dev/full", " 2>&-"}) {
    EXPECT_EQ(std::system((command + closed).c_str()), 0) << closed;
    EXPECT_TRUE(fs::exists(path("m.json")));
    fs::remove(path("m.json"));
  }
}

TEST_F(Cli, OnlyTheFilesOfAReportNeedGnuplot) {
  EXPECT_EQ(run(identify_arguments(glove(), camera()), "/dev/null", "PATH='" + path("none") + "'").exit, 0);
  EXPECT_NE(content(path("report/joint-1.html")).find("class=\"chart\""), std::string::npos);
  const std::string files = "report '" + path("report/") + "' --pdf";
  EXPECT_NE(run(files, "/dev/null", "PATH='" + path("none") + "'").err.find("gnuplot is missing"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(path("report/holdout_1.svg")));
  EXPECT_EQ(run(files).out, "report   " + path("report/report.html") + "\n");
  EXPECT_TRUE(fs::exists(path("report/holdout_1.svg")));
  EXPECT_TRUE(fs::exists(path("report/holdout_1.pdf")));
}

TEST_F(Cli, AlignedRecordingsAreWrittenInNoOtherFormat) {
  for (const char* name : {"x.parquet", "x", "x.csv.gz", "x.mat"}) {
    expect_refused(
        "align --sensor '" + glove() + "' --reference '" + camera() + "' --out '" + path(name) + "'", 2,
        std::string(name) + ": aligned recordings are written as .csv");
    EXPECT_FALSE(fs::exists(path(name)));
  }
}

TEST_F(Cli, AlignPrintsTheOffsetAndWritesTheAlignedRecording) {
  const Finished r = run("align --sensor '" + glove() + "' --reference '" + camera() + "' --json --out '" +
                         path("a.csv") + "'");
  ASSERT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_NEAR(json.at("clock_offset_s").get<double>(), 7.4, 0.15);
  EXPECT_GT(json.at("alignment_confidence").get<double>(), 0.3);
  EXPECT_EQ(recording::read_csv(path("a.csv"), {}).columns.size(), 3u);
}

TEST_F(Cli, TheWholeChainRuns) {
  const Finished identified =
      run("identify --sensor '" + glove() + "' --reference '" + camera() +
          "' --structure hw --json --model '" + path("m.json") + "' --report '" + path("report") + "'");
  ASSERT_EQ(identified.exit, 0) << identified.err;
  const auto json = nlohmann::json::parse(identified.out);
  EXPECT_TRUE(fs::exists(path("report/report.html")));
  EXPECT_EQ(run("show '" + path("m.json") + "'").exit, 0);
  EXPECT_EQ(model::from_json(run("show --json '" + path("m.json") + "'").out, "shown"),
            model::load(path("m.json")));

  // Applied to the glove's log, the model gives the very angles that were scored.
  const Finished applied = run("apply '" + path("m.json") + "' '" + glove() + "'");
  ASSERT_EQ(applied.exit, 0) << applied.err;
  io::write_file(path("angles.csv"), applied.out);
  const auto scored = recording::read_csv(path("report/samples-1.csv"), {"estimated_deg"});
  const auto angles = recording::read_csv(path("angles.csv"), {"index_deg"});
  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-4; };
  EXPECT_FALSE(std::ranges::search(angles.columns[0].value, scored.columns[0].value, near).empty());

  // Standard input gives the same bytes; float and fixed point nearly the same angles.
  EXPECT_EQ(run("apply '" + path("m.json") + "' -", glove()).out, applied.out);
  for (const auto& [arithmetic, tolerance] : {std::pair("float", 0.001), std::pair("fixed", 0.06)}) {
    io::write_file(path("other.csv"),
                   run("apply '" + path("m.json") + "' '" + glove() + "' --arithmetic " + arithmetic).out);
    const auto exact = recording::read_csv(path("angles.csv"), {"index_deg"});
    const auto other = recording::read_csv(path("other.csv"), {"index_deg"});
    ASSERT_EQ(exact.t_s, other.t_s);
    for (std::size_t row = 0; row < exact.t_s.size(); ++row) {
      ASSERT_NEAR(exact.columns[0].value[row], other.columns[0].value[row], tolerance)
          << arithmetic << " row " << row;
    }
  }
}

TEST_F(Cli, ApplyTracksAStripThatMovesAndSaysByHowMuch) {
  model::Model model = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  for (model::Input& input : model.inputs) input.poses = model::Poses{40, 110};
  model.inputs[0].poses.reset();
  model::save(model, path("poses.json"));
  std::string log = "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n";
  for (int k = 0; k < 1200; ++k) {
    const double closed = k % 80 < 10   ? k % 80 / 10.0
                          : k % 80 < 40 ? 1
                          : k % 80 < 50 ? (50 - k % 80) / 10.0
                                        : 0;
    const double alpha = 40 + 70 * closed;
    log += fmt::format("{:.1f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", 0.1 * k, alpha, alpha + 9, alpha,
                       alpha - 6, alpha);
  }
  io::write_file(path("log.csv"), log);
  const std::string apply = "apply '" + path("poses.json") + "' '" + path("log.csv") + "' --track";
  for (const std::string arithmetic : {"double", "float", "fixed"}) {
    const Finished r = run(apply + " --arithmetic " + arithmetic);
    ASSERT_EQ(r.exit, 0) << r.err;
    EXPECT_NE(r.err.find("tracked: thumb_alpha not"), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("tracked: index_alpha shifted by -"), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("tracked: ring_alpha shifted by +"), std::string::npos);
    EXPECT_EQ(r.err.find("ALARM"), std::string::npos);
  }
  const auto json = nlohmann::json::parse(run(apply + " --json").out);
  EXPECT_EQ(json.at("tracking").size(), 4U);
  expect_refused("apply '" FLEXOR_SOURCE_DIR "/models/published_hw.json' '" + path("log.csv") + "' --track",
                 2, "leave out --track");
}

TEST_F(Cli, ApplyHoldsThroughPausesAndSaysSo) {
  const std::string model = FLEXOR_SOURCE_DIR "/models/published_hw.json";
  std::string log = "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n";
  for (int k = 0; k < 40; ++k) {
    const double t = 0.1 * k + (k >= 20 ? 3 : 0);
    log += std::to_string(t) + (k == 30 ? ",2000,2000,2000,2000,2000\n" : ",120,120,120,120,120\n");
  }
  io::write_file(path("log.csv"), log);
  const Finished r = run("apply '" + model + "' '" + path("log.csv") + "'");
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_EQ(line(r.out, 1).substr(0, 38), "t_s,thumb_deg,thumb_status,index_deg,i");
  EXPECT_NE(r.out.find(",4\n"), std::string::npos);  // pause
  EXPECT_NE(r.out.find(",2\n"), std::string::npos);  // above the range
  const auto json = nlohmann::json::parse(run("apply --json '" + model + "' '" + path("log.csv") + "'").out);
  EXPECT_EQ(json.at("t_s").size(), 70u);
  EXPECT_EQ(json.at("channels").at("thumb").at("status")[25], 4);
  EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), 71);  // header, and 0 to 6.9 s every 0.1 s
}

TEST_F(Cli, ApplyTakesASensorWithoutReadingsForThatOneAlone) {
  std::string log = "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n";
  for (int k = 0; k < 20; ++k)
    log += fmt::format("{:.1f},120,{},120,120,{}\n", 0.1 * k, k < 10 ? "120" : "nan", 60 + k);
  write("log.csv", log);
  const std::string apply = "apply --json '" FLEXOR_SOURCE_DIR "/models/published_hw.json' ";
  for (const Finished& r : {run(apply + "'" + path("log.csv") + "'"), run(apply + "-", path("log.csv"))}) {
    const auto channels = nlohmann::json::parse(r.out).at("channels");
    EXPECT_EQ(channels.at("index").at("status")[9], 0);
    EXPECT_EQ(channels.at("index").at("status")[19], 3);
    EXPECT_EQ(channels.at("pinky").at("status")[19], 0);
    EXPECT_NE(channels.at("pinky").at("angle_deg")[19], channels.at("pinky").at("angle_deg")[10]);
  }
}

TEST_F(Cli, OutputsThatCannotBeWrittenAreRefused) {
  io::write_file(path("file"), "x");
  const std::string base =
      "identify --sensor '" + glove() + "' --reference '" + camera() + "' --structure linear ";
  expect_refused(base + "--model '" + path("none/m.json") + "'", 2, "none/m.json: cannot be written");
  expect_refused(base + "--report '" + path("file") + "'", 2, "file: cannot make this folder");
  expect_refused(
      "align --sensor '" + glove() + "' --reference '" + camera() + "' --out '" + path("none/a.csv") + "'", 2,
      "none/a.csv: cannot be written");
  const Finished full =
      run("show '" FLEXOR_SOURCE_DIR "/models/published_hw.json' > /dev/full; exit $?; true");
  EXPECT_EQ(full.exit, 1);
}

// Two clocks give figures that look like a bad compensator: the lag at the search's edge tells them.
TEST_F(Cli, ScorePairsTheColumnsOfOneName) {
  const auto log = [&](const std::string& name, const std::string& header, double off_deg) {
    std::string text = "t_s," + header + "\n";
    for (int k = 0; k < 200; ++k) {
      const double a_deg = 50 + 40 * std::sin(0.1 * k);
      text += std::to_string(0.1 * k) + "," + std::to_string(a_deg + off_deg) + "," + std::to_string(a_deg) +
              "\n";
    }
    write(name, text);
  };
  log("a.csv", "thumb_deg,index_deg", 0);
  log("b.csv", "thumb_deg,index_deg", 2);
  const Finished r = run("score '" + path("a.csv") + "' '" + path("b.csv") + "' --json");
  const auto joints = nlohmann::json::parse(r.out).at("joints");
  EXPECT_NEAR(joints.at("thumb").at("rmse_deg").get<double>(), 2, 1e-3);
  EXPECT_NEAR(joints.at("index").at("rmse_deg").get<double>(), 0, 1e-3);
  std::string motion = "motion\nversion=1\ninDegrees=yes\nendheader\ntime\tthumb\tindex\n";
  for (int k = 0; k < 200; ++k) {
    const double a_deg = 50 + 40 * std::sin(0.1 * k);
    motion += std::to_string(0.1 * k) + "\t" + std::to_string(a_deg) + "\t" + std::to_string(a_deg) + "\n";
  }
  write("a.mot", motion);
  const std::string own = run("score '" + path("b.csv") + "' '" + path("a.mot") + "' --json").out;
  EXPECT_NEAR(nlohmann::json::parse(own).at("joints").at("thumb").at("rmse_deg").get<double>(), 2, 1e-3);
}

TEST_F(Cli, ScoreTakesEachColumnWhereItHasAngles) {
  std::string whole = "t_s,thumb_deg,index_deg\n";
  std::string joined = whole;
  for (int k = 0; k < 200; ++k) {
    const double a_deg = 50 + 40 * std::sin(0.1 * k);
    whole += fmt::format("{:.1f},{},{}\n", 0.1 * k, a_deg, a_deg);
    joined += k % 2 == 0 ? fmt::format("{:.1f},{},\n", 0.1 * k, a_deg)
                         : fmt::format("{:.1f},,{}\n", 0.1 * k, a_deg + 2);
  }
  write("a.csv", whole);
  write("b.csv", joined);
  const Finished r = run("score '" + path("a.csv") + "' '" + path("b.csv") + "' --json");
  const auto joints = nlohmann::json::parse(r.out).at("joints");
  EXPECT_NEAR(joints.at("thumb").at("rmse_deg").get<double>(), 0, 1e-3);
  EXPECT_NEAR(joints.at("index").at("rmse_deg").get<double>(), 2, 1e-3);
  EXPECT_EQ(joints.at("index").at("samples"), 100);
}

TEST_F(Cli, ScoreWarnsOfTwoClocks) {
  const auto log = [](double late_s) {
    std::string text = "t_s,a_deg\n";
    for (int k = 0; k < 600; ++k) {
      text += std::to_string(0.1 * k) + "," + std::to_string(50 + 40 * std::sin(0.1 * k - late_s)) + "\n";
    }
    return text;
  };
  io::write_file(path("a.csv"), log(0));
  const auto expect = [&](double late_s, double offset_s, bool at_edge) {
    io::write_file(path("b.csv"), log(late_s));
    const std::string command =
        "score '" + path("a.csv") + "' '" + path("b.csv") + "' --estimate-offset " + std::to_string(offset_s);
    const Finished text = run(command);
    const Finished json = run(command + " --json");
    EXPECT_EQ(text.exit, 0) << text.err;
    EXPECT_EQ(json.exit, 0) << json.err;
    EXPECT_EQ(text.err, at_edge
                            ? "warning: the best lag lies at the edge of the search: are the two on the same "
                              "clock? --estimate-offset shifts one\n"
                            : "")
        << late_s;
    EXPECT_EQ(json.err, text.err);
    EXPECT_EQ(nlohmann::json::parse(json.out).at("lag_at_edge"), at_edge) << late_s;
  };
  expect(0.3, 0, false);
  for (const double late_s : {1.4, -1.4}) {
    expect(late_s, 0, true);
    expect(late_s, -late_s, false);
  }
}

TEST_F(Cli, ExperimentPrintsTheTableAndOneJsonObject) {
  const Finished text = run("experiment --gestures 2,4 --trials 2");
  EXPECT_EQ(text.exit, 0) << text.err;
  EXPECT_NE(text.out.find("2 number two"), std::string::npos);
  EXPECT_NE(text.out.find("956.0"), std::string::npos);  // the published figure beside ours
  const Finished r = run("experiment --gestures 2,4 --trials 2 --json");
  EXPECT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  ASSERT_EQ(json.at("cells").size(), 6U);
  const auto& cell = json.at("cells").at(0);
  EXPECT_EQ(cell.at("gesture"), 2);
  EXPECT_EQ(cell.at("compensator"), "raw");
  EXPECT_EQ(cell.at("trials"), 2);
  EXPECT_EQ(cell.at("published_deg_s"), 956.0);
  const auto& hw = json.at("cells").at(2);
  EXPECT_EQ(hw.at("trials_with_a_lag"), 2);
  EXPECT_GT(hw.at("total_error_deg_s").at("mean"), hw.at("lag_removed_deg_s").at("mean"));
  EXPECT_NEAR(json.at("null_model").at("log_rms_gestures_5_and_6").get<double>(), 0.437, 0.0005);
  EXPECT_EQ(json.at("shapes").size(), 2U);
  EXPECT_NE(text.out.find("one constant for each compensator"), std::string::npos);
  EXPECT_NE(text.out.find("large fluctuations"), std::string::npos);
  for (const char* key : {"log_rms", "real_time_factor", "seed", "version"})
    EXPECT_TRUE(json.contains(key)) << key;
}

TEST_F(Cli, ExperimentRefusesTheImpossible) {
  expect_refused("experiment --gestures 7", 2, "known: 1 to 6");
  expect_refused("experiment --compensators kalman", 2, "published-hw");
  expect_refused("experiment --trials 0", 2, "at least 1");
  expect_refused("experiment --rate 2000", 2, "runs at 1000 Hz");
  expect_refused("experiment --rate 100", 2, "do not fit 9600 baud");
  expect_refused("experiment --set radio.baud=0", 2, "radio.baud");
  expect_refused("experiment --set motor.coulomb_mNm=-1", 2, "impossible");
  expect_refused("experiment --set motor.friction=1", 2, "motor.coulomb_mNm");
  expect_refused("experiment --twin '" + path("none.json") + "'", 2, "none.json");
  expect_refused("experiment --out '" + path("simulated_glove.csv/x") + "'", 2, "simulated_glove.csv");
  io::write_file(
      path("one.json"),
      R"({"schema":"flexor-model","schema_version":2,"sample_period_s":0.1,"inputs":[{"name":"a",)"
      R"("valid_min":0,"valid_max":1}],"blocks":[{"type":"saturation","from":"a","to":"b","lower_deg":30,)"
      R"("upper_deg":90}],"joints":[{"name":"index","from":"b","rest_deg":30}]})");
  expect_refused("experiment --compensators '" + path("one.json") + "'", 2,
                 "motor for thumb, middle, ring, pinky");
}

TEST_F(Cli, TheTwinsConfigurationIsAFileThatCanBeEdited) {
  EXPECT_NE(run("twin").out.find("loop.integral_limit"), std::string::npos);
  const Finished printed = run("twin --json");
  EXPECT_EQ(printed.exit, 0);
  io::write_file(path("twin.json"), printed.out);
  const std::string same = "experiment --gestures 1 --trials 1 --compensators raw --json";
  const auto mean = [](const Finished& r) {
    return nlohmann::json::parse(r.out).at("cells").at(0).at("total_error_deg_s").at("mean").get<double>();
  };
  EXPECT_EQ(mean(run(same)), mean(run(same + " --twin '" + path("twin.json") + "'")));
  auto edited = nlohmann::json::parse(printed.out);
  edited["hardware"]["parameters"]["loop.integral_limit"]["value"] = 0.5;
  io::write_file(path("twin.json"), edited.dump());
  EXPECT_LT(mean(run(same + " --twin '" + path("twin.json") + "'")), mean(run(same)));
}

TEST_F(Cli, DeployWritesImagesReportAndOneJsonObject) {
  const std::string model = FLEXOR_SOURCE_DIR "/models/published_hw.json";
  const Finished r = run("deploy '" + model + "' --rate 10 --json --out '" + path("d") + "'");
  ASSERT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  const auto& target = json.at("targets").at(0);
  EXPECT_EQ(target.at("name"), "atmega328p");
  EXPECT_GT(target.at("flash_bytes"), 3000);
  EXPECT_GT(target.at("ram_bytes"), 100);
  EXPECT_GT(target.at("stack_bytes"), 50);
  EXPECT_GT(target.at("step_cycles").at("mean"), 300);
  EXPECT_GE(target.at("step_cycles").at("worst"), target.at("step_cycles").at("mean"));
  EXPECT_GT(target.at("worst_error_deg"), 0.01);
  EXPECT_LE(target.at("worst_error_deg"), 0.06);
  EXPECT_EQ(json.at("bit_exact").at("mismatches"), 0);
  for (const char* file : {"glove.hex", "hand.hex", "pair.key", "report.html", "report.json",
                           "arduino/Flexor/src/glove_data.h"}) {
    EXPECT_TRUE(fs::exists(path("d") + "/" + file)) << file;
  }
  const std::string report = content(path("d/report.html"));
  fs::remove(path("d/report.html"));
  EXPECT_EQ(run("report '" + path("d") + "'").exit, 0) << content(path("stderr"));
  EXPECT_TRUE(content(path("d/report.html")) == report);
}

TEST_F(Cli, DeployForVrSpeaksText) {
  const std::string model = FLEXOR_SOURCE_DIR "/models/published_hw.json";
  io::write_file(path("mine.json"), R"({"schema": "flexor-hardware", "schema_version": 1, "pins": {
      "thumb": "A4", "index": "A3", "ring": "A1", "pinky": "A0", "calibrate": "D12"}})");
  const Finished r = run("deploy '" + model + "' --rate 100 --output opengloves --hand left --hardware '" +
                         path("mine.json") + "' --json --out '" + path("d") + "'");
  ASSERT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_EQ(json.at("fingers").at("covered").size(), 5U);
  EXPECT_TRUE(json.at("fingers").at("missing").empty());
  const auto& glove = json.at("wiring").at("boards").at(0).at("connections");
  EXPECT_EQ(glove.at(0).at("name"), "thumb");
  EXPECT_EQ(glove.at(0).at("pin"), "A4");
  EXPECT_EQ(glove.at(5).at("pin"), "D12");
  EXPECT_EQ(json.at("wiring").at("boards").size(), 1U) << "no hand";
  EXPECT_NE(json.at("next").back().get<std::string>().find("left hand"), std::string::npos);
  EXPECT_GT(json.at("budget").at("flash_share"), 0.1);
  EXPECT_LT(json.at("budget").at("time_share"), 0.3);
  for (const char* file : {"glove.hex", "wiring.md", "wiring_glove.svg"})
    EXPECT_TRUE(fs::exists(path("d") + "/" + file)) << file;
  for (const char* file : {"hand.hex", "wiring_hand.svg", "bench"})
    EXPECT_FALSE(fs::exists(path("d") + "/" + file)) << file;
}

TEST_F(Cli, AButtonThatZeroesAGloveGoesWithARadioAndAModelThatKnowsItsPoses) {
  model::Model model = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  for (model::Input& input : model.inputs) input.poses = model::Poses{40, 110};
  model::save(model, path("poses.json"));
  const auto with_pins = [&](const char* file, const std::string& pins) {
    io::write_file(path(file), R"({"schema": "flexor-hardware", "schema_version": 1, "pins": )" + pins + "}");
    return " --plain --out '" + path("d") + "' --hardware '" + path(file) + "'";
  };
  const std::string button = with_pins("button.json", R"({"calibrate": "D12"})");
  const Finished r = run("deploy '" + path("poses.json") + "'" + button);
  EXPECT_EQ(r.exit, 0) << r.err;
  EXPECT_NE(r.out.find("press calibrate, hold the hand open for three seconds"), std::string::npos) << r.out;
  expect_refused(
      "deploy '" + path("poses.json") + "'" + with_pins("two.json", R"({"calibrate": "D12", "menu": "D10"})"),
      2, "joystick and buttons but calibrate go to VR drivers");
  for (model::Input& input : model.inputs) input.poses.reset();
  model::save(model, path("none.json"));
  expect_refused("deploy '" + path("none.json") + "'" + button, 2,
                 "does not know what its sensors read at the open hand");
}

TEST_F(Cli, AGloveForVrWithoutAFingerIsRefusedUnlessAllowed) {
  const model::Model all = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  model::save(model::with_channels(all, {*model::channel(all, 1), *model::channel(all, 3)}),
              path("two.json"));
  const std::string command =
      "deploy '" + path("two.json") + "' --output opengloves --out '" + path("d") + "'";
  expect_refused(command, 2, "has no joint for thumb, middle, pinky");
  EXPECT_FALSE(fs::exists(path("d")));
  const Finished r = run(command + " --allow-missing --json");
  ASSERT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_EQ(json.at("fingers").at("missing").size(), 3U);
  EXPECT_EQ(json.at("fingers").at("covered").at(1), "ring");
}

TEST_F(Cli, WiringIsThereBeforeAModelIs) {
  auto hardware = nlohmann::json::parse(run("show --hardware flexor").out);
  hardware["parameters"]["divider.fixed_kohm"]["value"] = 47;
  io::write_file(path("mine.json"), hardware.dump());
  const Finished r = run("wiring --hardware '" + path("mine.json") + "' --json --out '" + path("w") + "'");
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_EQ(nlohmann::json::parse(r.out).at("pins").at("pinky"), "A4");
  EXPECT_NE(content(path("w/wiring_glove.svg")).find("47 kΩ"), std::string::npos);
  EXPECT_NE(content(path("w/wiring.md")).find("resistor 47 kOhm"), std::string::npos);
  hardware["pins"]["thumb"] = "A4";
  io::write_file(path("mine.json"), hardware.dump());
  expect_refused("wiring --hardware '" + path("mine.json") + "' --out '" + path("v") + "'", 2,
                 "mine.json: pins: thumb and pinky are both on A4");
}

TEST_F(Cli, ExportRefusesInOneLineWhatItCannotWrite) {
  io::write_file(path("a.csv"), "t_s,a_deg\n0,1\n1,2\n2,3\n");
  const std::string a = "export '" + path("a.csv") + "' ";
  const std::string out = " --out '" + path("out") + "'";
  expect_refused(a + "--to xml" + out, 2, "--to");
  expect_refused(a + "--to mcap", 2, "--out is required");
  expect_refused(a + "--to mcap --out '" + path("a.csv") + "'", 2, "it is an input of this command");
  expect_refused(a + "--to mcap --out '" + path("no/out") + "'", 2, "there is no folder");
  expect_refused(a + "--to matlab --start 2026-05-01T12:03:11Z" + out, 2, "--start is for --to mcap alone");
  for (const std::string to : {"bids", "mot"})
    expect_refused(a + "--to " + to + out, 2, "python -m flexor.export FILE --to " + to);
  expect_refused(a + "--to mcap --start yesterday" + out, 2, "--start yesterday");
  expect_refused(a + "--to mcap --start 5/6/2026" + out, 2, "--start 5/6/2026");
  expect_refused(a + "'" + path("a.csv") + "' --to mcap" + out, 2, "not expected");
}

TEST_F(Cli, ExportTakesARecordingFromStandardInputAndWritesIntoAPipe) {
  io::write_file(path("a.csv"), "t_s,a_deg\n0,1\n1,2\n2,3\n");
  const Finished r = run("export - --to mcap --start 2026-05-01T12:00:00Z --out /dev/stderr", path("a.csv"));
  EXPECT_EQ(r.exit, 0);
  EXPECT_TRUE(r.err.starts_with("\x89MCAP0\r\n")) << r.err;
  EXPECT_EQ(r.out, "/dev/stderr: 3 rows, 2.0 s, 1 joint(s): a\n");
}

TEST_F(Cli, DeployRefusesTheImpossible) {
  const std::string model = "'" FLEXOR_SOURCE_DIR "/models/published_hw.json'";
  const std::string out = " --out '" + path("d") + "'";
  for (const char* rate : {"nan", "-5", "0", "inf"}) {
    expect_refused("deploy " + model + out + " --rate " + rate, 2, "--rate must be a positive number");
    expect_refused("send " + model + " --rate " + rate, 2, "--rate must be a positive number");
  }
  expect_refused("experiment --engine avr --set radio.baud=2400", 2, "which wants 4800: raise radio.baud");
  expect_refused("flash /dev/zero", 2, "no plain file");
  expect_refused("live --from twin --opengloves " + path("none"), 2, "make a FIFO");
  expect_refused("deploy " + model + out + " --key 1234", 2, "32 hexadecimal digits");
  expect_refused("deploy " + model + out + " --hardware none", 2,
                 "none: is no file, nor a hardware preset; those are flexor and lucidgloves");
  expect_refused("deploy " + model + out + " --encoding beta", 2, "add --output opengloves");
  expect_refused("deploy '" + path("none.json") + "'" + out, 2, "none.json");
  expect_refused("deploy " + model + out + " --calibration '" + glove() + "'", 2, "simulated_glove.csv");
  expect_refused("deploy " + model + out + " --recording '" + glove() + "'", 2, "thumb_alpha");
  expect_refused("experiment --engine avr --rate 30", 2, "10, 20, 50 or 100 Hz");
}

const std::string kGreenMarkers = FLEXOR_SOURCE_DIR "/models/joints/green_markers.json";
const std::string kVideo = FLEXOR_SOURCE_DIR "/../shared/data/video/green_markers.mp4";

TEST_F(Cli, TrackWritesAnglesPreviewAndReportOfTheRealVideo) {
  if (!fs::exists(kVideo)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  const Finished r =
      run("track '" + kVideo + "' --joints '" + kGreenMarkers + "' --out '" + path("a.csv") +
          "' --preview '" + path("p.mp4") + "' --report '" + path("rep") + "' --seconds 2 --json");
  ASSERT_EQ(r.exit, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_EQ(json.at("frames"), 49);
  EXPECT_EQ(json.at("frames_labelled"), 49);
  const recording::Recording angles = recording::read_csv(path("a.csv"), {});
  std::vector<std::string> names;
  for (const recording::Column& c : angles.columns) names.push_back(c.name);
  EXPECT_EQ(names.size(), 18U);
  EXPECT_EQ(
      (std::vector<std::string>(names.begin(), names.begin() + 4)),
      (std::vector<std::string>{"index_dip_deg", "index_dip_se_deg", "index_dip_quality", "index_pip_deg"}));
  EXPECT_EQ(angles.t_s.size(), 49U);
  EXPECT_GT(fs::file_size(path("p.mp4")), 10000U);
  const std::string report = content(path("rep/report.html"));
  EXPECT_NE(report.find("class=\"chart\""), std::string::npos);
  EXPECT_NE(report.find("data:image/jpeg;base64,"), std::string::npos);
  EXPECT_NE(r.err.find("no lens calibration"), std::string::npos);
}

TEST_F(Cli, SetupProposesTakesAnAssignmentAndSavesAJointFile) {
  if (!fs::exists(kVideo)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  const std::string setup =
      "track --setup '" + kVideo + "' --joints '" + kGreenMarkers + "' --out '" + path("s.png") + "' --json";
  const Finished proposed = run(setup + " --save '" + path("j.json") + "'");
  ASSERT_EQ(proposed.exit, 0) << proposed.err;
  std::string assign;
  const auto json = nlohmann::json::parse(proposed.out);
  for (const auto& c : json.at("candidates")) {
    if (c.at("mark") != "")
      assign += " --assign " + c.at("number").dump() + "=" + c.at("mark").get<std::string>();
  }
  EXPECT_GT(fs::file_size(path("s.png")), 10000U);
  EXPECT_EQ(run(setup + " --colour 718,335" + assign + " --save '" + path("k.json") + "'").exit, 0);
  const Finished r = run("track '" + kVideo + "' --joints '" + path("k.json") + "' --out '" + path("a.csv") +
                         "' --seconds 0.5 --json");
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_EQ(nlohmann::json::parse(r.out).at("frames_labelled"), 13);
  expect_refused(setup + " --assign 99=wrist", 2, "there is no candidate 99");
  expect_refused(setup + " --assign 1=elbow", 2, "no mark is called \"elbow\"");
  expect_refused(setup + " --colour 9999,5", 2, "outside the picture");
  expect_refused(setup + " --at 100", 2, "ends at");
}

TEST_F(Cli, CameraCommandsRefuseBadInputInOneLineAndLeaveNothingBehind) {
  const std::string joints = " --joints '" + kGreenMarkers + "'";
  const std::string out = " --out '" + path("a.csv") + "'";
  // One grey pixel.
  constexpr unsigned char kPixel[] = {
      0x89, 'P',  'N',  'G',  13,  10,  26,  10,   0,    0,    0,    13,  'I',  'H',  'D',  'R',  0,
      0,    0,    1,    0,    0,   0,   1,   8,    0,    0,    0,    0,   0x3a, 0x7e, 0x9b, 0x55, 0,
      0,    0,    10,   'I',  'D', 'A', 'T', 0x78, 0x9c, 0x63, 0x68, 0,   0,    0,    0x82, 0,    0x81,
      0x77, 0xcd, 0x72, 0xb6, 0,   0,   0,   0,    'I',  'E',  'N',  'D', 0xae, 0x42, 0x60, 0x82};
  io::write_file(path("pixel.png"), {reinterpret_cast<const char*>(kPixel), sizeof kPixel});
  io::write_file(path("text.mp4"), "no video");
  io::write_file(path("empty.mp4"), "");
  expect_refused("track '" + path("none.mp4") + "'" + joints + out, 2, "none.mp4");
  expect_refused("track '" + path("text.mp4") + "'" + joints + out, 2, "no video that can be read");
  expect_refused("track '" + path("empty.mp4") + "'" + joints + out, 2, "is empty");
  expect_refused("track '" + path("pixel.png") + "'" + joints + out, 1, "no angle in any of 1 frame(s)");
  expect_refused("track '" + path("pixel.png") + "' --joints '" + glove() + "'" + out, 2,
                 "simulated_glove.csv");
  expect_refused("track '" + path("pixel.png") + "'" + joints + " --out '" + path("no/where.csv") + "'", 2,
                 "no/where.csv");
  expect_refused("track '" + path("pixel.png") + "'" + joints + out + " --lens '" + kGreenMarkers + "'", 2,
                 "not a lens file");
  expect_refused("track '" + path("pixel.png") + "'" + joints + out + " --preview '" + path("p.txt") + "'", 2,
                 ".mp4");
  expect_refused("track /dev/null" + joints + out, 2, "camera cannot be opened");
  expect_refused("track '" + path("pixel.png") + "'" + joints + out + " --colour 1,1", 2, "--setup");
  expect_refused("track --setup '" + path("pixel.png") + "'" + joints + out + " --colour one", 2,
                 "--colour: At least 2");
  expect_refused("track --setup '" + path("pixel.png") + "'" + joints + out + " --assign x", 2,
                 "NUMBER=MARK");
  expect_refused("identify --sensor '" + glove() + "' --reference '" + path("text.mp4") + "'" + joints, 2,
                 "no video that can be read");
  expect_refused("identify --sensor '" + glove() + "' --reference '" + camera() + "' --lens x.json", 2,
                 "--joints");
  expect_refused("camera calibrate '" + path("pixel.png") + "' --board nine --out '" + path("l.json") + "'",
                 2, "COLUMNSxROWS");
}

}  // namespace cli_test
}  // namespace flexor::cli
