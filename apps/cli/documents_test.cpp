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
  // Its one object, which io takes for a document.
  Json document(const std::string& arguments) const {
    const Finished r = run(arguments + " --json");
    (void)json_of(r);
    return io::parse_json(r.out, "standard output");
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
  for (std::string command :
       {"align --sensor @.csv --reference @_camera.csv --out out_@.csv",
        "identify --sensor @.csv --reference @_camera.csv --structure linear --model m_@.json --report r_@",
        "show @_hw.json", "apply @_hw.json @_log.csv", "score @_a.csv @_a.csv",
        "experiment --trials 1 --gestures @_gesture.json --compensators raw,@_hw.json --out e_@",
        "track @.mp4 --joints @_joints.json --out a_@.csv --preview p_@.mp4 --report t_@",
        "track --setup @.mp4 --joints @_joints.json --out s_@.png",
        "deploy @_hw.json --recording @_log.csv --out d_@",
        "latency --edges 2 --compensator @_hw.json --out l_@",
        "camera calibrate board?.png --out lens_@.json", "export @_a.csv --to mcap --out x_@.mcap"}) {
    for (std::size_t at; (at = command.find('@')) != command.npos;) command.replace(at, 1, name);
    EXPECT_NO_THROW((void)document(command)) << command;
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
  (void)document("identify " + files + "--structure linear --model m.json --report r");
  EXPECT_EQ(io::parse_json(content(folder_ / "m.json"), "m.json").at("inputs")[0].at("column"),
            "F\u00fchler_adc");
  (void)document("apply m.json simulated_glove.csv");
  (void)document("align " + files + "--out a.csv");
  EXPECT_TRUE(content(folder_ / "a.csv").starts_with("t_s,F\u00fchler_adc,Winkel \u00b0,gap\n"));
  EXPECT_NE(content(folder_ / "r/report.html").find("F\u00fchler_adc"), std::string::npos);
  EXPECT_GE(documents_below(folder_ / "r"), 5);
  // A terminal in Latin-1 may name the column so; that is reported at once.
  expect_refused("identify " + files + "--input 'F\xfchler_adc' --structure linear --model n.json", 2,
                 "there are: Zeit(ms), Phase, F\u00fchler_adc");
}

}  // namespace documents_test
}  // namespace flexor::cli
