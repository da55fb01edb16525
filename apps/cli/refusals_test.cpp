// Command lines and files that nobody could have meant: refused in one line, before anything is done. In this process.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <fstream>
#include <vector>

#include "apps/cli/commands.hpp"
#include "apps/cli/job.hpp"
#include "host/io/io.hpp"

namespace flexor::cli {
namespace refusals_test {

namespace fs = std::filesystem;

std::string refusal_of(const std::string& arguments) {
  CLI::App app;
  add_commands(app);
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return error.what();
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "accepted";
}

class Refusals : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;  // io would know it as an input of the case before
    return path(name);
  }
  static std::string shipped(const std::string& name) {
    return io::read_file(FLEXOR_SOURCE_DIR "/models/" + name);
  }

  // With the arguments between `before` and `after`; nothing is written.
  void expect_refused(const std::string& before, const std::vector<std::string>& all,
                      const std::string& after, const std::string& reason) const {
    const auto files = [&] { return std::distance(fs::recursive_directory_iterator(folder_.path()), {}); };
    const auto there = files();
    for (const std::string& one : all) {
      const std::string arguments = before + one + after;
      const std::string refusal = refusal_of(arguments);
      EXPECT_NE(refusal.find(reason), std::string::npos) << arguments << "\n" << refusal.substr(0, 500);
      EXPECT_EQ(refusal.find('\n'), std::string::npos) << arguments;
    }
    EXPECT_EQ(files(), there) << before << reason;
  }
  void expect_refused(const std::string& arguments, const std::string& reason) const {
    expect_refused(arguments, {""}, "", reason);
  }
  void expect_no_motion(const std::string& motion, const std::string& reason) const {
    expect_refused("experiment --trials 1 --compensators raw --gestures " + motion, reason);
  }
  static void expect_warned(const std::string& motion, const std::string& reason) {
    std::string warnings;
    (void)run_job({"experiment"}, {{"trials", 1}, {"compensators", {"raw"}}, {"gestures", motion}},
                  [&](const nlohmann::ordered_json& event) {
                    if (event.contains("warning")) warnings += event.dump();
                    return true;
                  });
    EXPECT_NE(warnings.find(reason), std::string::npos) << warnings;
  }

  const io::TemporaryFolder folder_;
};

TEST_F(Refusals, NumbersThatNobodyCanMean) {
  const std::string small = "experiment --gestures 4 --compensators raw --trials 1 ";
  const std::string out = " --out " + path("x");
  expect_refused("experiment --trials 1 --gestures=",
                 {"1-6-2", "1,1", "1-3,2", "0", "7", "3-2", "-", "1-", "-1", "1,,2", "99999999999"}, "",
                 "gesture");
  expect_refused(small + "--rate ", {"0", "-10", "nan", "inf", "1e308", "1e-308", "0.01", "1000.1"}, out,
                 "rate");
  for (const std::string command :
       {"experiment", "twin record --out x", "latency", "camera film --out x", "twin wear"})
    expect_refused(command + " --seed ",
                   {"-1", "1.5", "18446744073709551616", "99999999999999999999999", "nan", "1e3", "' 7'"}, "",
                   "--seed");
  expect_refused(small + "--threads ", {"-1", "257", "1000000", "2147483647"}, out, "threads");
  expect_refused("identify --sensor a.csv --reference b.csv --map index=a:b --threads ", {"-3", "257"}, "",
                 "threads are impossible");
  expect_refused("experiment --gestures 4 --trials ", {"0", "-1", "-2147483648"}, out, "at least 1");
  expect_refused("experiment --trials ", {"2147483648", "1.5"}, "", "--trials");
  for (const std::string& option : {"twin record" + out + " --rate ", std::string("live --demo --rate ")})
    expect_refused(option, {"0", "nan", "inf", "-3", "1e9", "1e-9"}, "", "rate");
  expect_refused("twin record" + out + " --donnings ", {"0", "-1", "101", "2147483647"}, "",
                 "must be 1 to 100");
  const std::string model = " '" FLEXOR_SOURCE_DIR "/models/published_hw.json' --rate ";
  expect_refused("send" + model, {"-5", "0"}, "", "--rate must be a positive number");
  for (const char* option : {"live --demo --lead ", "record x.csv --for ", "send m.json --rate "})
    expect_refused(option, {"nan", "-NaN"}, "", "no finite number");
}

TEST_F(Refusals, ExperimentsThatCannotBe) {
  const std::string one = file(
      "one.json",
      R"({"schema":"flexor-model","schema_version":2,"sample_period_s":0.1,"inputs":[{"name":"a",)"
      R"("valid_min":0,"valid_max":1}],"blocks":[{"type":"saturation","from":"a","to":"b","lower_deg":30,)"
      R"("upper_deg":90}],"joints":[{"name":"index","from":"b","rest_deg":30}]})");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"--gestures 7", "known: 1 to 6"},
      {"--gestures wave", "known: 1 to 6"},
      {"--compensators kalman", "published-hw"},
      {"--compensators raw,raw", "given twice"},
      {"--compensators " + one + "," + one, "given twice"},
      {"--compensators " + one, "motor for thumb, middle, ring, pinky"},
      {"--set radio.loss", "name=value"},
      {"--set placement.bend_lower_deg=200", "placement.bend_lower_deg of thumb, 200, must be below"},
      {"--rate 2000", "runs at 1000 Hz"},
      {"--rate 100", "do not fit 9600 baud"},
      {"--twin " + path("none.json"), "none.json"},
      {"--out " + one + "/x", "one.json"}};
  for (const auto& [options, reason] : cases) expect_refused("experiment --trials 1 " + options, reason);
}

TEST_F(Refusals, MotionsWhoseNamesATableCannotHold) {
  const auto gesture = [&](const std::string& name_of_file, const std::string& name) {
    auto json = nlohmann::json::parse(shipped("gestures/4.json"));
    json["name"] = name;
    json.erase("number");
    return file(name_of_file, json.dump());
  };
  for (const char* name : {"wave, left", "wave\nleft", "say \"hi\"", "", "a\tb"})
    expect_no_motion(gesture("odd.json", name), "odd.json: its name");
  const std::string one = gesture("one.json", "wave");
  const std::string two = gesture("two.json", "wave");
  expect_no_motion(one + "," + two, "one.json and " + two + " have the same name");
  expect_no_motion(one + "," + one, "given twice");
  expect_no_motion(gesture("four.json", "okay sign") + ",4", "have the same name");
}

TEST_F(Refusals, OnePoseThatIsNamedTwice) {
  const std::string log = file("poses.csv",
                               "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n"
                               "0,1,1,1,1,1\n0.1,1,1,1,1,1\n");
  expect_refused("recalibrate '" FLEXOR_SOURCE_DIR "/models/published_hw.json' --out x --poses ",
                 {"open,open ", "fist,fist,fist "}, log, "or both as they follow: open,fist");
}

// One stray time stamp must neither fill the memory nor go unnamed.
TEST_F(Refusals, MotionsOfAStrayTimeStampOrCell) {
  const std::string header = "t_s,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg\n";
  const std::string row = ",100,40,50,60,70\n";
  std::string text = header;
  std::string hours = header;
  for (int k = 0; k < 300; ++k) {
    text += fmt::format("{:.2f}{}", k * 0.02, row);
    hours += fmt::format("{}{}", k * 50, row);
  }
  expect_no_motion(file("late.csv", text + "200000000" + row + "200000000.02" + row), "late.csv: row 302");
  expect_no_motion(file("pause.csv", text + "70" + row + "70.02" + row), "pause.csv: row 302");
  expect_no_motion(file("hours.csv", hours), "hours.csv");
  expect_no_motion(file("instant.csv", header + "0" + row + "1e-9" + row), "lasts");
  for (const std::string cell : {"inf", "1e308", "1e999", "x"}) {
    expect_no_motion(file("cell.csv", text + "7," + cell + ",40,50,60,70\n8" + row), "cell.csv");
    expect_no_motion(file("time.csv", text + cell + row + "8" + row), "time.csv");
  }
  for (const auto& [end, says] :
       {std::pair("200000000" + row, std::string("left out, the first is row 302")),
        {"7,nan,40,50,60,70\n8" + row, "left out, the first is row 302"},
        {"7,60,40,50,60,120\n8" + row, "thumb_deg, pinky_deg: angles are the bionic hand's own"}}) {
    expect_warned(file("left.csv", text + end), says);
  }
}

TEST_F(Refusals, RecordedTrajectoriesWithAnAbsurdRow) {
  const auto row = [](const std::string& clock, const std::string& joint) {
    std::string out = "2014 09 " + clock + " 1";
    for (int j = 0; j < 23; ++j) out += " " + (j == 4 ? joint : std::string("-0.1"));
    return out + "\n";
  };
  std::string good;
  for (int k = 0; k < 100; ++k) good += row(fmt::format("12 13 43 {:.2f}", 2 + 0.03 * k), "-0.3");
  const std::string last = "12 13 43 6";
  for (const std::string& bad :
       {row("12 13 44 50", "-0.3"), row("1e308 13 43 50", "-0.3"), row("200000000 13 43 50", "-0.3"),
        row("12 13 43 1", "-0.3"), row(last, "nan"), std::string("2014 09 12\n"),
        row(last, "-0.3").insert(60, " 7 7"), row(last, "-0.3 abc")})
    expect_warned(file("t.txt", good + bad), "left out, the first is row 101");
  expect_no_motion(file("t.txt", good + row(last, "1e308")), "t.txt: row 101: ");
  expect_no_motion(file("t.txt", good + row(last, "-57")), "-57 to -0.3 is no joint's range in radians");
  expect_no_motion(file("t.txt", good.substr(0, good.find('\n') + 1)), "has a header but no data");
}

TEST_F(Refusals, AMotionAndACameraThatWouldFillTheMemory) {
  auto json = nlohmann::json::parse(shipped("gestures/4.json"));
  json["duration_s"] = 3600;
  json["name"] = "long";
  expect_refused(
      "experiment --trials 1 --set camera.rate_hz=1000 --gestures " + file("long.json", json.dump()),
      "camera.rate_hz to at most 33");
}

}  // namespace refusals_test
}  // namespace flexor::cli
