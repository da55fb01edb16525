// `flexor experiment` when things go wrong around it: killed at any instant, stopped, twice in one folder, no
// room on the disk, and input that nobody could have meant. Real processes of the real program.
#include <chrono>
#include <random>
#include <thread>

#include "apps/cli/command_test.hpp"

namespace flexor::cli {
namespace experiment_faults_test {
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class ExperimentFaults : public Command {
 protected:
  // Waits until `what` holds; false after a minute.
  static bool until(const std::function<bool()>& what) {
    const auto begin = Clock::now();
    while (!what()) {
      if (seconds_since(begin) > 60) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
  }

  // What a run must leave, whatever happened on the way: every trials.csv, and results.json.
  static std::string kept(const fs::path& run) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(run)) {
      const std::string name = entry.path().filename().string();
      if (name == "trials.csv" || name == "results.json") files.push_back(entry.path());
    }
    std::ranges::sort(files);
    std::string out;
    for (const fs::path& file : files)
      out += file.lexically_relative(run).string() + "\n" + content(file) + "\n";
    return out;
  }
};

const std::string kSmall = "experiment --gestures 4 --compensators raw --trials 48 --out ";

// At random instants; FLEXOR_KILLS: how many.
TEST_F(ExperimentFaults, KilledAtRandomItGoesOnToTheSameBytes) {
  const std::string arguments =
      "experiment --gestures 2,4 --compensators raw,published-hw --trials 200 --scenarios --out ";
  const auto begin = Clock::now();
  ASSERT_EQ(run(arguments + "whole").exit, 0);
  const double whole_s = seconds_since(begin);
  const std::string whole = kept(path("whole"));
  ASSERT_NE(whole.find("results.json"), std::string::npos);
  const char* wanted = std::getenv("FLEXOR_KILLS");
  const int count = wanted != nullptr ? std::atoi(wanted) : 12;
  std::mt19937 random(static_cast<unsigned>(count));
  std::uniform_real_distribution<double> share(0, 1);
  for (int killed = 0; killed <= count;) {
    const pid_t child = start(arguments + "killed");
    // Half of the lives are short: many of them make one run. The last is not cut off.
    const double life_s = share(random) * whole_s * (killed % 2 == 0 ? 1 : 3.0 / count);
    std::this_thread::sleep_for(std::chrono::duration<double>(life_s));
    if (killed < count) ::kill(child, SIGKILL);
    const Finished r = wait(child);
    killed += r.signal == SIGKILL || killed == count;
    if (r.signal == SIGKILL) continue;
    ASSERT_EQ(r.exit, 0) << r.err;
    EXPECT_EQ(kept(path("killed")), whole);
    fs::remove_all(path("killed"));
  }
}

// What a kill, a power cut or a full disk can leave of a folder: each is taken up to the undisturbed end.
TEST_F(ExperimentFaults, EveryHalfWrittenStateOfTheFolderIsTakenUp) {
  ASSERT_EQ(run(kSmall + "run").exit, 0);
  const std::string whole = kept(path("run"));
  const std::string csv = content(path("run/trials.csv"));
  const std::string header = csv.substr(0, csv.find('\n') + 1);
  const std::string settings = content(path("run/run.json"));
  const auto goes_on = [&](const std::string& state) {
    const Finished r = run(kSmall + "run");
    EXPECT_EQ(r.exit, 0) << state << ": " << r.err;
    EXPECT_EQ(kept(path("run")), whole) << state;
    EXPECT_FALSE(fs::exists(path("run/lock"))) << state;
  };
  const auto with_trials = [&](const std::string& state, const std::string& text) {
    std::ofstream(path("run/trials.csv"), std::ios::binary) << text;
    goes_on(state);
  };
  with_trials("no byte", "");
  with_trials("half a header", header.substr(0, 20));
  with_trials("a header without its newline", header.substr(0, header.size() - 1));
  with_trials("the header alone", header);
  with_trials("half a row", csv.substr(0, header.size() + 30));
  with_trials("a batch and a bit", csv.substr(0, csv.size() / 2));
  with_trials("all but the last newline", csv.substr(0, csv.size() - 1));
  with_trials("a batch and zeros", csv.substr(0, csv.size() / 2) + std::string(500, '\0'));
  with_trials("rows beyond the last", csv + csv.substr(header.size()));
  with_trials("two headers, as an older version left them", header + csv);
  fs::remove(path("run/trials.csv"));
  goes_on("no trials.csv");
  std::ofstream(path("run/lock")) << "process 1 on nowhere\n";
  goes_on("a dead run's lock");
  fs::remove(path("run/trials.csv"));
  std::ofstream(path("run/run.json"), std::ios::trunc);
  goes_on("an empty run.json and no trials");
  std::ofstream(path("run/run.json"), std::ios::binary) << settings;
  goes_on("nothing wrong");
}

TEST_F(ExperimentFaults, TrialsOfSomebodyElseAreNotTouched) {
  ASSERT_EQ(run(kSmall + "run").exit, 0);
  const std::string csv = content(path("run/trials.csv"));
  expect_refused("experiment --gestures 4 --compensators raw --trials 1 --seed 2 --out run", 2,
                 "choose another folder");
  fs::remove(path("run/run.json"));
  expect_refused(kSmall + "run", 2, "no run.json");
  EXPECT_EQ(content(path("run/trials.csv")), csv);
  fs::create_directories(path("other"));
  std::ofstream(path("other/trials.csv")) << "patient,dose\n1,2\n";
  expect_refused(kSmall + "other", 2, "its columns are not those");
  EXPECT_EQ(content(path("other/trials.csv")), "patient,dose\n1,2\n");
  fs::create_directories(path("odd/trials.csv"));
  expect_refused(kSmall + "odd", 2, "no ordinary file");
  fs::create_directories(path("locked/lock"));
  expect_refused(kSmall + "locked", 2, "lock: cannot be written");
}

TEST_F(ExperimentFaults, ASecondRunInTheFolderFailsAtOnceAndSaysWhoIsThere) {
  const std::string many = "experiment --gestures 4 --compensators raw --trials 100000000 --out run";
  const pid_t first = start(many);
  ASSERT_TRUE(until([&] { return content(path("run/lock")).ends_with("\n"); }));
  ASSERT_TRUE(until([&] { return fs::exists(path("run/trials.csv")); }));
  fs::rename(path("stderr"), path("stderr_of_first"));  // the first goes on writing to it
  fs::rename(path("stdout"), path("stdout_of_first"));
  const Finished second = run(many);
  EXPECT_EQ(second.exit, 2) << second.err;
  EXPECT_EQ(lines(second.err), 1) << second.err;
  EXPECT_NE(second.err.find("process " + std::to_string(first) + " on "), std::string::npos) << second.err;
  const Finished other = run(kSmall + "run");  // other settings: also no business there now
  EXPECT_EQ(other.exit, 2);
  EXPECT_NE(other.err.find("another run works in this folder"), std::string::npos) << other.err;
  ::kill(first, SIGKILL);
  (void)wait(first);
  const pid_t third = start(many);  // a dead run's lock is nobody's
  ASSERT_TRUE(
      until([&] { return content(path("run/lock")).find(std::to_string(third)) != std::string::npos; }));
  ::kill(third, SIGTERM);
  EXPECT_EQ(wait(third).signal, SIGTERM);
}

// Ctrl-C, SIGTERM and a terminal that is closed: gone soon, by that signal, with one line that says what is kept; the same command ends
// as if nothing had been.
TEST_F(ExperimentFaults, StoppedItSaysWhatIsKeptAndGoesOnFromThere) {
  const std::string arguments = "experiment --gestures 2,4 --compensators published-hw --trials 2000 --out ";
  ASSERT_EQ(run(arguments + "whole").exit, 0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const pid_t child = start(arguments + "run");
    ASSERT_TRUE(until([&] {
      std::error_code error;
      return fs::file_size(path("run/trials.csv"), error) > 20000 && !error;
    }));
    ::kill(child, signal);
    const Finished r = wait(child);
    EXPECT_EQ(r.signal, signal) << r.err;
    const std::string csv = content(path("run/trials.csv"));
    EXPECT_TRUE(("\n" + r.err)
                    .ends_with("\nflexor: stopped: " + std::to_string(lines(csv) - 1) +
                               " of 4000 trials are kept in run, and the same command goes on from there\n"))
        << r.err;
    EXPECT_EQ(r.out, "");
    EXPECT_FALSE(fs::exists(path("run/lock")));
    EXPECT_EQ(std::distance(fs::directory_iterator(path("tmp")), {}), 0) << "temporary files are left";
    const Finished again = run(arguments + "run");
    EXPECT_EQ(again.exit, 0) << again.err;
    EXPECT_EQ(kept(path("run")), kept(path("whole")));
    fs::remove_all(path("run"));
  }
}

// No file may grow beyond 64 KB: writes fail half way, as on a full disk.
TEST_F(ExperimentFaults, WithoutRoomItStopsAndLosesNothing) {
  const std::string many = "experiment --gestures 4 --compensators raw --trials 600 --out ";
  ASSERT_EQ(run(many + "whole").exit, 0);
  ASSERT_GT(fs::file_size(path("whole/trials.csv")), 100000U);
  const Finished full = run(many + "run", "/dev/null", "trap '' XFSZ; ulimit -f 128;");
  EXPECT_EQ(full.exit, 1);
  EXPECT_EQ(lines(full.err), 1) << full.err;
  const std::string csv = content(path("run/trials.csv"));
  EXPECT_NE(full.err.find("trials.csv: cannot be written"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find(std::to_string(lines(csv) - 1) + " of 600 trials are kept"), std::string::npos)
      << full.err;
  EXPECT_EQ((lines(csv) - 1) % 16, 0);
  EXPECT_GT(csv.size(), 30000U);
  EXPECT_TRUE(csv.ends_with('\n'));
  EXPECT_TRUE(content(path("whole/trials.csv")).starts_with(csv));
  EXPECT_EQ(run(many + "run").exit, 0);
  EXPECT_EQ(kept(path("run")), kept(path("whole")));
}

TEST_F(ExperimentFaults, TheLargestNumberOfTrialsTakesNoMoreMemoryThanAFew) {
  const pid_t child = start("experiment --gestures 1-6 --trials 2147483647 --out run");
  ASSERT_TRUE(until([&] { return lines(content(path("run/trials.csv"))) > 200; }));
  std::ifstream status("/proc/" + std::to_string(child) + "/status");
  long peak_kB = 0;
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) peak_kB = std::atol(line.c_str() + 6);
  ::kill(child, SIGTERM);
  const Finished r = wait(child);
  EXPECT_GT(peak_kB, 1000);
  EXPECT_LT(peak_kB, 100000);
  EXPECT_NE(r.err.find("of 38654705646 trials are kept"), std::string::npos) << r.err;
}

TEST_F(ExperimentFaults, TwoModelsOfOneStemAreDistinguished) {
  for (const char* folder : {"a", "b"}) {
    fs::create_directories(path(folder));
    fs::copy_file(FLEXOR_SOURCE_DIR "/models/published_hw.json", path(std::string(folder) + "/model.json"));
  }
  const std::string experiment = "experiment --gestures 4 --trials 1 --json --compensators ";
  const auto cells = json_of(experiment + "a/model.json,b/model.json").at("cells");
  EXPECT_EQ(cells.at(0).at("compensator"), "a/model.json");
  EXPECT_EQ(cells.at(1).at("compensator"), "b/model.json");
  EXPECT_EQ(cells.at(0).at("difference_deg_s").at("b/model.json").at("mean"), 0);
  // A file is not the article's compensator because of its name.
  fs::copy_file(path("a/model.json"), path("raw.json"));
  auto json = Json::parse(content(path("raw.json")));
  for (const auto& [low, high, is_another] : {std::tuple(30, 160, false), {300, 400, true}}) {
    for (auto& input : json.at("inputs"))
      input["readings"] = {{"share", {0.02, 0.98}}, {"reading", {low, high}}};
    std::ofstream(path("raw.json")) << json;
    const Finished raw = run(experiment + path("raw.json"));
    EXPECT_TRUE(Json::parse(raw.out).at("cells").at(0).at("published_deg_s").is_null());
    EXPECT_EQ(raw.err.find("it is of another glove") != std::string::npos, is_another) << raw.err;
  }
}

TEST_F(ExperimentFaults, TheDistanceIsOfTheGesturesThatWerePlayed) {
  const auto json = json_of("experiment --trials 2 --gestures 1 --json");
  EXPECT_TRUE(json.at("log_rms").at("gestures_1_to_4").is_null());
  EXPECT_EQ(json.at("log_rms").at("fitted").at("gestures"), Json({1}));
}

}  // namespace experiment_faults_test
}  // namespace flexor::cli
