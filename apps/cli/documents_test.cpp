// Foreign documents and foreign file names, through the program: hostile JSON at every option that reads
// JSON, and files whose names are Latin-1.
#include <set>

#include "apps/cli/command_test.hpp"
#include "host/io/json.hpp"

namespace flexor::cli {
namespace documents_test {

// The program runs in a folder of the test's.
std::string quoted(const char* file) { return "'" + fs::absolute(file).string() + "'"; }

const std::string kModel = quoted(FLEXOR_SOURCE_DIR "/models/published_hw.json");
const std::string kJoints = quoted(FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json");

class Documents : public Command {
 protected:
  int run(const std::string& arguments) {
    const Finished r = Command::run(arguments);
    out_ = r.out;
    err_ = r.err;
    return r.exit;
  }

  // How many files, or those of `kinds`; each is UTF-8, and its JSON such that we read it.
  static int documents_below(const fs::path& folder, const std::set<std::string>& kinds = {}) {
    int out = 0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
      const std::string kind = entry.path().extension().string();
      if (!kinds.empty() && !kinds.contains(kind)) continue;
      const std::string text = content(entry.path());
      EXPECT_EQ(io::to_utf8(text), text) << entry.path();
      EXPECT_TRUE(kind != ".json" || !io::parse_json(text, entry.path()).is_null());
      ++out;
    }
    return out;
  }

  std::string out_;
  std::string err_;
};

TEST_F(Documents, HostileJsonIsRefusedInOneLineWhereverJsonIsRead) {
  make(FLEXOR_TEST_INPUTS);
  write("log.csv", "t_s,thumb\n0,1\n1,2\n");
  const std::vector<std::string> options = {
      "show x.json",
      "apply x.json log.csv",
      "deploy x.json --out out",
      "deploy " + kModel + " --calibration x.json --out out",
      "deploy " + kModel + " --hardware x.json --out out",
      "send " + kModel + " --hardware x.json",
      "wiring --hardware x.json --out out",
      "show --hardware x.json",
      "latency --edges 1 --compensator x.json",
      "latency --edges 1 --twin x.json",
      "experiment --trials 1 --compensators x.json",
      "experiment --trials 1 --gestures x.json",
      "experiment --trials 1 --twin x.json",
      "twin record --twin x.json --out out",
      "twin wear --twin x.json",
      "camera film --twin x.json --out out",
      "camera film --gestures x.json --out out",
      "track video.mp4 --joints x.json --out a.csv",
      "track video.mp4 --joints joints.json --lens x.json --out a.csv",
      "track --setup video.mp4 --joints x.json --out a.png",
      "identify --sensor log.csv --reference video.mp4 --joints x.json --model m.json",
      "identify --sensor log.csv --reference video.mp4 --joints joints.json --lens x.json --model m.json",
  };
  const std::vector<std::pair<std::string, std::string>> documents = {
      {std::string(80000, '[') + std::string(80000, ']'), "x.json: nested deeper than 64 levels"},
      {"{\n\"a\": 1,\n\"a\": 2}", "x.json: key \"a\" comes twice in one object"},
      {"{\"a\": NaN}", "x.json: not valid JSON at line 1: NaN is no value"},
      {"{\"a\": 1e999}", "x.json: number overflow parsing '1e999'"},
      {"{\"gl\xf6ve\": 1}", "x.json: is no UTF-8 text: byte 4, in line 1"},
  };
  for (const auto& [text, expected] : documents) {
    write("x.json", text);
    for (const std::string& option : options) expect_refused(option, 2, expected);
  }
}

// No JSON and no page may hold bytes that are not UTF-8, whatever files are called.
TEST_F(Documents, FilesWhoseNamesAreLatin1) {
  make(FLEXOR_TEST_INPUTS);
  make(FLEXOR_SIMULATE);
  const std::string name = "gl\xf6ve";
  fs::rename(folder_ / "simulated_glove.csv", folder_ / (name + ".csv"));
  fs::rename(folder_ / "simulated_camera.csv", folder_ / (name + "_camera.csv"));
  fs::rename(folder_ / "video.mp4", folder_ / (name + ".mp4"));
  fs::rename(folder_ / "joints.json", folder_ / (name + "_joints.json"));
  fs::copy_file(FLEXOR_SOURCE_DIR "/models/published_hw.json", folder_ / (name + "_hw.json"));
  fs::copy_file(FLEXOR_SOURCE_DIR "/models/gestures/1.json", folder_ / (name + "_gesture.json"));
  write(name + "_log.csv",
        "t_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n0,50,60,70,80,90\n0.1,51,61,71,81,"
        "91\n");
  write(name + "_a.csv", "t_s,a_deg\n0,1\n1,2\n2,3\n");
  const std::string files = "--sensor " + name + ".csv --reference " + name + "_camera.csv";
  for (const std::string& command : {
           "align " + files + " --out out_" + name + ".csv --json",
           "identify " + files + " --structure linear --model m_" + name + ".json --report r_" + name +
               " --json",
           "show " + name + "_hw.json --json",
           "apply " + name + "_hw.json " + name + "_log.csv --json",
           "score " + name + "_a.csv " + name + "_a.csv --json",
           "experiment --trials 1 --gestures " + name + "_gesture.json --compensators raw," + name +
               "_hw.json --out e_" + name + " --json",
           "track " + name + ".mp4 --joints " + name + "_joints.json --out a_" + name + ".csv --preview p_" +
               name + ".mp4 --report t_" + name + " --json",
           "track --setup " + name + ".mp4 --joints " + name + "_joints.json --out s_" + name + ".png --json",
           "deploy " + name + "_hw.json --recording " + name + "_log.csv --out d_" + name + " --json",
           "latency --edges 2 --compensator " + name + "_hw.json --out l_" + name + " --json",
           "camera calibrate board?.png --out lens_" + name + ".json --json",
           "export " + name + "_a.csv --to mcap --out x_" + name + ".mcap --json",
       }) {
    EXPECT_EQ(run(command), 0) << command << "\n" << err_;
    EXPECT_NO_THROW((void)io::parse_json(out_, "standard output")) << command << "\n" << out_.substr(0, 500);
    EXPECT_TRUE(out_.starts_with('{') && out_.ends_with("}\n")) << command;
    EXPECT_EQ(err_.find('{'), std::string::npos) << command << ": the object is no log";
  }
  EXPECT_GE(documents_below(folder_, {".json", ".html", ".svg"}), 10);
}

// Such a log once cost the whole fit, which failed when its names were written.
TEST_F(Documents, ALogWhoseHeaderIsLatin1) {
  make(FLEXOR_SIMULATE);
  const auto renamed = [&](const std::string& file, const std::string& header) {
    const std::string text = content(folder_ / file);
    write(file, header + text.substr(text.find('\n')));
  };
  renamed("simulated_glove.csv", "Zeit(ms),Phase,F\xfchler_adc");
  renamed("simulated_camera.csv", "Time(ms),Winkel \xb0");
  const std::string files = "--sensor simulated_glove.csv --reference simulated_camera.csv ";
  EXPECT_EQ(run("identify " + files + "--structure linear --model m.json --report r --json"), 0) << err_;
  const auto json = io::parse_json(out_, "standard output");
  EXPECT_EQ(io::parse_json(content(folder_ / "m.json"), "m.json").at("inputs")[0].at("column"),
            "F\u00fchler_adc");
  EXPECT_EQ(run("apply m.json simulated_glove.csv --json"), 0) << err_;
  EXPECT_NO_THROW((void)io::parse_json(out_, "standard output"));
  EXPECT_EQ(run("align " + files + "--out a.csv --json"), 0) << err_;
  EXPECT_NO_THROW((void)io::parse_json(out_, "standard output"));
  EXPECT_TRUE(content(folder_ / "a.csv").starts_with("t_s,F\u00fchler_adc,Winkel \u00b0,gap\n"));
  EXPECT_NE(content(folder_ / "r/report.html").find("F\u00fchler_adc"), std::string::npos);
  EXPECT_GE(documents_below(folder_ / "r"), 5);
  // A terminal in Latin-1 may name the column so; that is told at once.
  EXPECT_EQ(run("identify " + files + "--input 'F\xfchler_adc' --structure linear --model n.json"), 2);
  EXPECT_NE(err_.find("there are: Zeit(ms), Phase, F\u00fchler_adc"), std::string::npos) << err_;
  EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
}

}  // namespace documents_test
}  // namespace flexor::cli
