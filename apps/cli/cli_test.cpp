// The program as its users run it: exit codes, one clear line for bad input, nothing half-written.
#include <sys/stat.h>

#include <cmath>
#include <map>

#include "apps/cli/command_test.hpp"
#include "host/io/folder_lock.hpp"
#include "host/model/channel.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace cli_test {

// The program runs in a folder of the test's.
std::string of_source(const char* file) { return fs::absolute(fs::path(FLEXOR_SOURCE_DIR) / file).string(); }

const std::string kPublished = of_source("models/published_hw.json");
const std::string kGreenMarkers = of_source("models/joints/green_markers.json");
// The logs that a test begins with.
const std::string kPair = "--sensor simulated_glove.csv --reference simulated_camera.csv ";
const std::string kVideo = of_source("../shared/data/video/green_markers.mp4");

class Cli : public Command {
 protected:
  Cli() { make(FLEXOR_SIMULATE); }
};

TEST_F(Cli, WrongUsageIsExitTwo) {
  for (const char* arguments :
       {"", "dance", "align --sensor x", "apply", "identify --sensor a --reference b --rate fast"})
    EXPECT_EQ(run(arguments).exit, 2) << arguments;
}

TEST_F(Cli, NoOutputTakesThePlaceOfAnInput) {
  const std::string before = content(path("simulated_glove.csv"));
  for (const std::string& arguments :
       {"identify --structure linear --model simulated_glove.csv " + kPair,
        "align --out simulated_glove.csv " + kPair, "align --out simulated_camera.csv " + kPair}) {
    expect_refused(arguments, 2, "is an input of this command");
  }
  EXPECT_EQ(content(path("simulated_glove.csv")), before);
  fs::create_directories(path("own"));
  io::write_file(fs::path(path("own")) / "glove-2.csv", before);
  expect_refused("twin record --donnings 2 --out own", 2, "choose another folder");
  EXPECT_EQ(content(fs::path(path("own")) / "glove-2.csv"), before);
}

TEST_F(Cli, AReadingInAnotherUnitThanTheModelsIsRefusedEverywhere) {
  ASSERT_EQ(run("identify " + kPair + "--structure linear --input-unit count --model m.json").exit, 0);
  const model::Model m = model::load(path("m.json"));
  model::Model renamed = m;
  renamed.inputs[0].column = "flex_V";
  model::save(renamed, path("v.json"));
  io::write_file(path("volts.csv"), "t_s,flex_V\n0,1\n0.05,1.5\n0.1,2\n");
  expect_refused("apply v.json volts.csv", 2, "is in V");
  expect_refused("deploy v.json --out d --recording volts.csv", 2, "is in V");
}

TEST_F(Cli, HeldPosesNameWhatTheReaderLeavesOut) {
  std::string log = "t_s,thumb_count,index_count,middle_count\n0,1,2\n";
  for (int k = 1; k < 600; ++k)
    log += fmt::format("{:.2f},{},{},nan\n", 0.02 * k, 300 + 200 * (k / 150 % 2), 400 + 100 * (k / 150 % 2));
  io::write_file(path("poses.csv"), log);
  const std::string arguments = "identify --poses poses.csv --model m.json";
  const std::string err = run(arguments).err;
  EXPECT_NE(err.find("1 row(s) are malformed"), std::string::npos) << err;
  EXPECT_NE(err.find("left out: middle_count; a sensor among them is dead"), std::string::npos) << err;
  EXPECT_EQ(json_of(arguments + " --json").at("warnings").size(), 2U);
}

TEST_F(Cli, WhatCannotBeDoneIsRefusedBeforeTheWork) {
  write("lead.json", R"({"total": [1]})");
  write("short.csv", "time_ms,index_count\n12,");
  write("a.csv", "t_s,a_deg\n0,1\n1,2\n2,3\n");
  const std::string identify = "identify --structure linear --sensor G --reference C ";
  const std::string exported = "export F/a.csv --out F/out ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {identify + "--model ''", "--model"},
      {identify + "--report ''", "--report"},
      {identify + "--for F/lead.json", "flexor latency"},
      {identify + "--leave-out take", "--leave-out block"},
      {identify + "--lens x.json", "--joints"},
      {identify + "--model F/none/m.json", "none/m.json: cannot be written"},
      {identify + "--report F/a.csv", "a.csv: cannot make this folder"},
      {"identify --sensor F/short.csv --reference C", "short.csv"},
      {"align --sensor G --reference C --out F/none/a.csv", "none/a.csv: cannot be written"},
      {"align --sensor G --reference C --out F/x", "x: aligned recordings are written as .csv"},
      {"align --sensor G --reference C --out F/x.csv.gz", "x.csv.gz: aligned recordings are written as .csv"},
      {"score C C --estimate-offset nan", "--estimate-offset"},
      {exported + "--to xml", "--to"},
      {"export F/a.csv --to mcap", "--out is required"},
      {"export F/a.csv --to mcap --out F/a.csv", "it is an input of this command"},
      {"export F/a.csv --to mcap --out F/no/out", "there is no folder"},
      {exported + "--to matlab --start 2026-05-01T12:03:11Z", "--start is for --to mcap alone"},
      {exported + "--to bids", "python -m flexor.export FILE --to bids"},
      {exported + "--to mot", "python -m flexor.export FILE --to mot"},
      {exported + "--to mcap --start yesterday", "--start yesterday"},
      {exported + "--to mcap --start 5/6/2026", "--start 5/6/2026"},
      {exported + "F/a.csv --to mcap", "not expected"},
      {"record F/x --from twin --for 0", "--for: Value 0 not in range 0.001"},
      {"deploy M --out F/d --rate 0", "--rate must be a positive number"},
      {"deploy M --out F/d --key 1234", "32 hexadecimal digits"},
      {"deploy M --out F/d --hardware none", "is no file, nor a hardware preset; those are flexor and lucid"},
      {"deploy M --out F/d --encoding beta", "add --output opengloves"},
      {"deploy M --out F/d --calibration G", "simulated_glove.csv"},
      {"deploy M --out F/d --recording G", "thumb_alpha"},
      {"deploy F/none.json --out F/d", "none.json"},
      {"experiment --engine avr --set radio.baud=2400", "which wants 4800: raise radio.baud"},
      {"experiment --engine avr --rate 30", "10, 20, 50 or 100 Hz"},
      {"flash /dev/zero", "is a device"},
      {"live --from twin --opengloves F/none", "make a FIFO"}};
  const std::map<char, std::string> names = {
      {'G', "simulated_glove.csv"}, {'C', "simulated_camera.csv"}, {'M', kPublished}, {'F', "."}};
  for (const auto& [text, reason] : cases) {
    std::string arguments;
    for (const char c : text) arguments += names.contains(c) ? names.at(c) : std::string(1, c);
    expect_refused(arguments, 2, reason);
  }
}

TEST_F(Cli, AStandardErrorThatCannotBeWrittenCostsNothingButItsLines) {
  const std::string command = "cd " + quoted(folder_.string()) + " && " +
                              quoted(fs::absolute(FLEXOR_PROGRAM).string()) + " identify " + kPair +
                              "--structure linear --model m.json > stdout";
  for (const char* closed : {" 2> /dev/full", " 2>&-"}) {
    EXPECT_EQ(std::system((command + closed).c_str()), 0) << closed;
    EXPECT_TRUE(fs::exists(path("m.json")));
    fs::remove(path("m.json"));
  }
}

TEST_F(Cli, OnlyTheFilesOfAReportNeedGnuplot) {
  EXPECT_EQ(run("identify " + kPair + "--structure linear-dynamic --model m.json --report report",
                "/dev/null", "PATH=none")
                .exit,
            0);
  EXPECT_NE(content(path("report/joint-1.html")).find("class=\"chart\""), std::string::npos);
  const std::string files = "report report/ --pdf";
  EXPECT_NE(run(files, "/dev/null", "PATH=none").err.find("gnuplot is missing"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("report/holdout_1.svg")));
  EXPECT_EQ(run(files).out, "report   report/report.html\n");
  EXPECT_TRUE(fs::exists(path("report/holdout_1.svg")));
  EXPECT_TRUE(fs::exists(path("report/holdout_1.pdf")));
}

TEST_F(Cli, ApplyTracksASensorThatMovesAndReportsByHowMuch) {
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
  for (const std::string arithmetic : {"double", "float", "fixed"}) {
    const auto tracking =
        json_of("apply poses.json log.csv --track --json --arithmetic " + arithmetic).at("tracking");
    EXPECT_EQ(tracking.size(), 4U) << "the thumb's poses are not known";
    EXPECT_LT(tracking.at("index_alpha").at("shift_deg"), 0);
    EXPECT_GT(tracking.at("ring_alpha").at("shift_deg"), 0);
    EXPECT_FALSE(tracking.at("ring_alpha").at("alarm"));
  }
  expect_refused("apply " + kPublished + " log.csv --track", 2, "leave out --track");
}

TEST_F(Cli, ApplyHoldsThroughPausesAndSaysSo) {
  std::string log = "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n";
  for (int k = 0; k < 40; ++k) {
    const double t = 0.1 * k + (k >= 20 ? 3 : 0);
    log += std::to_string(t) + (k == 30 ? ",2000,2000,2000,2000,2000\n" : ",120,120,120,120,120\n");
  }
  io::write_file(path("log.csv"), log);
  const Finished r = run("apply " + kPublished + " log.csv");
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_TRUE(r.out.starts_with("t_s,thumb_deg,thumb_status,index_deg,i")) << r.out.substr(0, 50);
  EXPECT_NE(r.out.find(",4\n"), std::string::npos);  // pause
  EXPECT_NE(r.out.find(",2\n"), std::string::npos);  // above the range
  const auto json = json_of("apply --json " + kPublished + " log.csv");
  EXPECT_EQ(json.at("t_s").size(), 70u);
  EXPECT_EQ(json.at("channels").at("thumb").at("status")[25], 4);
  EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), 71);  // header, and 0 to 6.9 s every 0.1 s
  log.resize(log.find('\n') + 1);
  for (int k = 0; k < 9; ++k) log += fmt::format("{},120,120,120,120,120\n", k);
  io::write_file(path("log.csv"), log);
  EXPECT_TRUE(run("apply " + kPublished + " log.csv").err.find("about 1 rows a second") != std::string::npos);
}

TEST_F(Cli, ApplyTakesASensorWithoutReadingsForThatOneAlone) {
  std::string log = "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n";
  for (int k = 0; k < 20; ++k)
    log += fmt::format("{:.1f},120,{},120,120,{}\n", 0.1 * k, k < 10 ? "120" : "nan", 60 + k);
  write("log.csv", log);
  const std::string apply = "apply --json " + kPublished + " ";
  for (const Finished& r : {run(apply + "log.csv"), run(apply + "-", path("log.csv"))}) {
    const auto channels = json_of(r).at("channels");
    EXPECT_EQ(channels.at("index").at("status")[9], 0);
    EXPECT_EQ(channels.at("index").at("status")[19], 3);
    EXPECT_EQ(channels.at("pinky").at("status")[19], 0);
    EXPECT_NE(channels.at("pinky").at("angle_deg")[19], channels.at("pinky").at("angle_deg")[10]);
    EXPECT_NE(r.err.find("column \"ring_alpha\" reads 120 in all rows"), std::string::npos) << r.err;
  }
}

// 200 rows of two joints; the second is `off_deg` away in every other row, in which the first is not seen.
std::string angles(double off_deg, double late_s, bool by_turns = false) {
  std::string out = "t_s,thumb_deg,index_deg\n";
  for (int k = 0; k < 200; ++k) {
    const double t_s = 0.1 * k - late_s;
    const double deg = 50 + 40 * std::sin(t_s + 0.04 * t_s * t_s);
    const bool first = !by_turns || k % 2 == 0;
    const bool second = !by_turns || k % 2 == 1;
    out += fmt::format("{:.1f},{},{}\n", 0.1 * k, first ? fmt::format("{}", deg) : "",
                       second ? fmt::format("{}", deg + off_deg) : "");
  }
  return out;
}

// Of a file of OpenSim, too. Two clocks give figures that look like a bad compensator, and so do two zeros: the motion tells them.
TEST_F(Cli, ScorePairsTheColumnsOfOneNameAndWarnsOfTwoClocks) {
  write("a.csv", angles(0, 0));
  std::string message;
  const auto joints = [&](const std::string& other, const std::string& options = "") {
    const Finished r = run("score a.csv " + other + " --json" + options);
    message = r.err;
    return json_of(r).at("joints");
  };
  write("b.csv", angles(2, 0));
  std::string text = angles(2, 0);
  std::ranges::replace(text, ',', '\t');
  write("b.mot",
        "motion\nversion=1\ninDegrees=yes\nendheader\ntime\tthumb\tindex" + text.substr(text.find('\n')));
  write("c.csv", angles(2, 0, true));
  for (const char* other : {"b.csv", "b.mot", "c.csv"}) {
    const auto found = joints(other);
    EXPECT_NEAR(found.at("thumb").at("rmse_deg").get<double>(), 0, 1e-3) << other;
    EXPECT_NEAR(found.at("index").at("rmse_deg").get<double>(), 2, 1e-3) << other;
    EXPECT_EQ(found.at("index").at("samples"), other == std::string("c.csv") ? 100 : 200);
  }
  EXPECT_EQ(message.find("warning"), std::string::npos) << message;
  for (const double ahead_s : {1.4, 6.0}) {
    write("b.csv", angles(0, ahead_s));
    (void)joints("b.csv");
    EXPECT_NE(message.find(fmt::format("thumb: by their motion --estimate-offset -{:.1f}", ahead_s)),
              std::string::npos)
        << message;
    (void)joints("b.csv", fmt::format(" --estimate-offset -{}", ahead_s));
    EXPECT_EQ(message.find("warning"), std::string::npos) << message;
  }
  write("b.csv", angles(360, 0));
  (void)joints("b.csv");
  EXPECT_NE(message.find("index: the two move together and yet are far apart"), std::string::npos) << message;
}

TEST_F(Cli, ExperimentPrintsTheTableAndOneJsonObject) {
  const Finished text = run("experiment --gestures 2,4 --trials 2");
  EXPECT_EQ(text.exit, 0) << text.err;
  EXPECT_NE(text.out.find("published-hw, here"), std::string::npos) << text.out;
  const auto json = json_of("experiment --gestures 2,4 --trials 2 --json");
  ASSERT_EQ(json.at("cells").size(), 6U);
  const auto& cell = json.at("cells").at(0);
  EXPECT_EQ(cell.at("gesture"), 2);
  EXPECT_EQ(cell.at("compensator"), "raw");
  EXPECT_EQ(cell.at("trials"), 2);
  EXPECT_EQ(cell.at("published_deg_s"), 956.0);
  EXPECT_EQ(json.at("shapes").size(), 2U);
  for (const char* key : {"log_rms", "null_model", "real_time_factor", "seed", "version"})
    EXPECT_TRUE(json.contains(key)) << key;
}

TEST_F(Cli, TheTwinsConfigurationIsAFileThatCanBeEdited) {
  EXPECT_NE(run("twin").out.find("loop.integral_limit"), std::string::npos);
  auto edited = json_of("twin --json");
  io::write_file(path("twin.json"), edited.dump());
  const auto mean = [&](const std::string& twin) {
    const auto json = json_of("experiment --gestures 1 --trials 1 --compensators raw --json" + twin);
    return json.at("cells").at(0).at("total_error_deg_s").at("mean").get<double>();
  };
  EXPECT_EQ(mean(""), mean(" --twin twin.json"));
  edited["hardware"]["parameters"]["loop.integral_limit"]["value"] = 0.5;
  io::write_file(path("twin.json"), edited.dump());
  EXPECT_LT(mean(" --twin twin.json"), mean(""));
}

TEST_F(Cli, DeployWritesImagesAndOneJsonObject) {
  const auto json = json_of("deploy " + kPublished + " --rate 10 --json --out d");
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
  for (const char* file :
       {"glove.hex", "hand.hex", "pair.key", "report.html", "report.json", "arduino/Flexor/src/glove_data.h"})
    EXPECT_TRUE(fs::exists(path("d") + "/" + file)) << file;
}

TEST_F(Cli, DeployForVrSpeaksText) {
  io::write_file(path("mine.json"), R"({"schema": "flexor-hardware", "schema_version": 1, "pins": {
      "thumb": "A4", "index": "A3", "ring": "A1", "pinky": "A0", "calibrate": "D12"}})");
  const auto json =
      json_of("deploy " + kPublished +
              " --rate 100 --output opengloves --hand left --hardware mine.json --json --out d");
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
  const auto with_pins = [&](const std::string& file, const std::string& pins) {
    io::write_file(path(file), R"({"schema": "flexor-hardware", "schema_version": 1, "pins": )" + pins + "}");
    return " --plain --out d --hardware " + file;
  };
  const std::string button = with_pins("button.json", R"({"calibrate": "D12"})");
  const Finished r = run("deploy poses.json" + button);
  EXPECT_EQ(r.exit, 0) << r.err;
  EXPECT_NE(r.out.find("press calibrate, hold the hand open for three seconds"), std::string::npos) << r.out;
  expect_refused("deploy poses.json" + with_pins("two.json", R"({"calibrate": "D12", "menu": "D10"})"), 2,
                 "joystick and buttons but calibrate go to VR drivers");
  for (model::Input& input : model.inputs) input.poses.reset();
  model::save(model, path("none.json"));
  expect_refused("deploy none.json" + button, 2, "does not know what its sensors read at the open hand");
}

TEST_F(Cli, AGloveForVrWithoutAFingerIsRefusedUnlessAllowed) {
  const model::Model all = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  model::Model two;
  two.sample_period_s = all.sample_period_s;
  for (const std::size_t joint : {1U, 3U}) model::add(two, *model::channel(all, joint));
  two.inputs.push_back({"extra", "extra", "count", {}, 0, 1023});
  model::save(two, path("two.json"));
  const std::string command = "deploy two.json --output opengloves --out d";
  expect_refused(command, 2, "has no joint for thumb, middle, pinky");
  EXPECT_FALSE(fs::exists(path("d")));
  const Finished done = run(command + " --allow-missing --json");
  EXPECT_NE(done.err.find("nothing says where extra is: it is read at A0"), std::string::npos) << done.err;
  const auto json = json_of(done);
  EXPECT_EQ(json.at("fingers").at("missing").size(), 3U);
  EXPECT_EQ(json.at("fingers").at("covered").at(1), "ring");
}

TEST_F(Cli, WiringIsThereBeforeAModelIs) {
  auto hardware = json_of("show --hardware flexor");
  hardware["parameters"]["divider.fixed_kohm"]["value"] = 47;
  io::write_file(path("mine.json"), hardware.dump());
  EXPECT_EQ(json_of("wiring --hardware mine.json --json --out w").at("pins").at("pinky"), "A4");
  EXPECT_NE(content(path("w/wiring_glove.svg")).find("47 kΩ"), std::string::npos);
  EXPECT_NE(content(path("w/wiring.md")).find("resistor 47 kOhm"), std::string::npos);
  hardware["pins"]["thumb"] = "A4";
  io::write_file(path("mine.json"), hardware.dump());
  expect_refused("wiring --hardware mine.json --out v", 2, "mine.json: pins: thumb and pinky are both on A4");
}

TEST_F(Cli, ExportTakesARecordingFromStandardInputAndWritesIntoAPipe) {
  io::write_file(path("a.csv"), "t_s,a_deg\n0,1\n1,2\n2,3\n");
  const Finished r = run("export - --to mcap --start 2026-05-01T12:00:00Z --out /dev/stderr", path("a.csv"));
  EXPECT_EQ(r.exit, 0);
  EXPECT_TRUE(r.err.starts_with("\x89MCAP0\r\n")) << r.err;
  EXPECT_EQ(r.out, "/dev/stderr: 3 rows, 2.0 s, 1 joint(s): a\n");
}

TEST_F(Cli, TrackWritesAnglesPreviewAndReportOfTheRealVideo) {
  if (!fs::exists(kVideo)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  const Finished r = run("track " + kVideo + " --joints " + kGreenMarkers +
                         " --out a.csv --preview p.mp4 --report rep --seconds 2 --json");
  EXPECT_EQ(json_of(r).at("frames_labelled"), 49);
  const std::string angles = content(path("a.csv"));
  EXPECT_TRUE(angles.starts_with("t_s,index_dip_deg,index_dip_se_deg,index_dip_quality,index_pip_deg,"))
      << angles;
  EXPECT_EQ(std::ranges::count(angles.substr(0, angles.find('\n')), ','), 18);
  EXPECT_EQ(lines(angles), 50);
  EXPECT_GT(fs::file_size(path("p.mp4")), 10000U);
  for (const char* part : {"class=\"chart\"", "data:image/jpeg;base64,"})
    EXPECT_NE(content(path("rep/report.html")).find(part), std::string::npos) << part;
  EXPECT_NE(r.err.find("no lens calibration"), std::string::npos);
}

TEST_F(Cli, SetupProposesTakesAnAssignmentAndSavesAJointFile) {
  if (!fs::exists(kVideo)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  const std::string setup = "track --setup " + kVideo + " --joints " + kGreenMarkers + " --out s.png --json";
  std::string assign;
  const auto json = json_of(setup + " --save j.json");
  for (const auto& c : json.at("candidates"))
    if (c.at("mark") != "")
      assign += " --assign " + c.at("number").dump() + "=" + c.at("mark").get<std::string>();
  EXPECT_GT(fs::file_size(path("s.png")), 10000U);
  EXPECT_EQ(run(setup + " --colour 718,335" + assign + " --save k.json").exit, 0);
  EXPECT_EQ(
      json_of("track " + kVideo + " --joints k.json --out a.csv --seconds 0.5 --json").at("frames_labelled"),
      13);
  expect_refused(setup + " --assign 99=wrist", 2, "there is no candidate 99");
  expect_refused(setup + " --assign 1=elbow", 2, "no mark is called \"elbow\"");
  expect_refused(setup + " --colour 9999,5", 2, "outside the picture");
  expect_refused(setup + " --at 100", 2, "ends at");
}

TEST_F(Cli, CameraCommandsRefuseBadInputInOneLineAndLeaveNothingBehind) {
  make(FLEXOR_TEST_INPUTS);
  write("text.mp4", "no video");
  fs::create_directory(path("own"));
  fs::copy_file(path("joints.json"), path("own/angles.csv"));
  write("empty.mp4", "");
  ASSERT_EQ(::mkfifo(path("pipe.mp4").c_str(), 0600), 0);
  fs::create_directory(path("rep"));
  const io::FolderLock lock(path("rep"));
  const std::string joints = " --joints " + kGreenMarkers;
  const std::string out = " --out a.csv";
  const std::string picture = " board0.png";
  const std::string setup = "track --setup" + picture + joints + out;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"track none.mp4" + joints + out, "none.mp4"},
      {"track text.mp4" + joints + out, "no video that can be read"},
      {"track empty.mp4" + joints + out, "is empty"},
      {"track" + picture + " --joints simulated_glove.csv" + out, "simulated_glove.csv"},
      {"track" + picture + joints + " --out no/where.csv", "no/where.csv"},
      {"track" + picture + joints + out + " --lens " + kGreenMarkers, "\"flexor-lens\""},
      {"track" + picture + joints + out + " --preview p.txt", ".mp4"},
      {"track" + picture + joints + out + " --preview pipe.mp4", "is no file"},
      {"track" + picture + joints + " --out x.mp4 --preview x.mp4", "another output"},
      {"identify --sensor simulated_glove.csv --reference simulated_camera.csv --model rep/m.json --report "
       "rep",
       "folder of the report"},
      {"identify --sensor simulated_glove.csv --reference simulated_camera.csv --report rep",
       "another run works"},
      {"track" + picture + joints + out + " --report rep", "another run works"},
      {"track video.mp4 --joints own/angles.csv --report own" + out,
       "own/angles.csv: cannot be written: it is an input"},
      {"track /dev/null" + joints + out, "camera cannot be opened"},
      {"track" + picture + joints + out + " --colour 1,1", "--setup"},
      {setup + " --colour one", "--colour: At least 2"},
      {setup + " --assign x", "NUMBER=MARK"},
      {"identify --sensor simulated_glove.csv --reference text.mp4" + joints, "no video that can be read"},
      {"camera calibrate" + picture + " --board nine --out l.json", "COLUMNSxROWS"}};
  for (const auto& [arguments, reason] : cases) expect_refused(arguments, 2, reason);
  expect_refused("track" + picture + joints + out, 1, "no angle in any of 1 frame(s)");
}

}  // namespace cli_test
}  // namespace flexor::cli
