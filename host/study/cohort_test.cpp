#include "host/study/cohort.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include "host/io/expect_test.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& what) { return text.find(what) != std::string::npos; }

class Cohort : public testing::Test {
 protected:
  // A minute of an index finger; both logs share a clock.
  void take(const std::string& name, double gain, unsigned seed) const {
    std::ofstream glove(folder_ / (name + "_glove.csv"));
    std::ofstream camera(folder_ / (name + "_camera.csv"));
    glove << "t_s,host_s,index_adc\n";
    camera << "t_s,host_s,index_deg\n";
    std::mt19937 random(seed);
    std::normal_distribution<double> noise;
    for (int k = 0; k < 1200; ++k) {
      const double t_s = 0.05 * k;
      const double angle_deg = 45 + 30 * std::sin(t_s * (1 + 0.01 * seed)) + 10 * std::sin(2.3 * t_s + seed);
      glove << t_s << ',' << t_s << ',' << std::lround(300 + gain * angle_deg + noise(random)) << '\n';
      camera << t_s << ',' << t_s << ',' << angle_deg << '\n';
    }
  }

  // Two sessions of each of three people, of whom the last wears a stiffer sensor; one file is missing.
  Cohort() {
    std::string text = "age,subject,session,glove,reference,map\n";
    for (unsigned k = 0; k < 6; ++k) {
      const std::string name = std::to_string(k);
      take(name, k < 4 ? 4 : 6, k);
      text += "3" + name + ",P" + std::to_string(k / 2) + "," + std::to_string(k % 2) + "," + name +
              "_glove.csv," + name + "_camera.csv,\n";
    }
    manifest(text + "40,P9,0,none.csv,0_camera.csv,\n");
  }

  void manifest(const std::string& text) const { std::ofstream(folder_ / "m.csv", std::ios::binary) << text; }

  CohortRequest request(const std::string& name, Shard shard = {}) const {
    CohortRequest out;
    out.manifest = read_manifest(folder_ / "m.csv");
    out.options.structure = "line";
    out.folder = folder_ / name;
    out.shard = shard;
    out.threads = 2;
    return out;
  }
  CohortRequest leaving_out(const std::string& name, Shard shard = {}) const {
    CohortRequest out = request(name, shard);
    out.options.leave_out = identify::LeaveOut::person;
    return out;
  }

  std::map<std::string, std::string> files(const std::string& name) const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / name))
      if (entry.is_regular_file())
        out[entry.path().lexically_relative(folder_ / name).string()] = io::read_file(entry.path());
    return out;
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(Cohort, IsATidyTableAndAFailedTakeIsARow) {
  const CohortResult result = run_cohort(leaving_out("out"), {});
  EXPECT_EQ(result.takes, 7U);
  ASSERT_EQ(result.failed.size(), 1U);
  std::istringstream table(files("out")["cohort.csv"]);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(table, line);) recording::split(line, ',', rows.emplace_back());
  ASSERT_EQ(rows.size(), 8U);
  const auto cell = [&](std::size_t row, const std::string& column) {
    return rows[row].at(static_cast<std::size_t>(std::ranges::find(rows[0], column) - rows[0].begin()));
  };
  EXPECT_EQ(cell(2, "subject") + cell(2, "session") + cell(2, "age") + cell(2, "joint"), "P0131index");
  EXPECT_LT(std::stod(cell(2, "rmse_deg")), 1);
  EXPECT_LT(std::stod(cell(2, "rmse_low_deg")), std::stod(cell(2, "rmse_deg")));
  EXPECT_EQ(cell(2, "structure") + cell(2, "reason"), "line");
  EXPECT_TRUE(has(cell(2, "warnings"), "motion") && cell(7, "warnings").empty()) << cell(2, "warnings");
  EXPECT_EQ(result.warned, 6U);
  for (const score::Baseline& one : score::kBaselines) {
    const std::string error_deg = cell(2, std::string(one.name) + "_deg");
    EXPECT_TRUE(error_deg.empty() ||
                std::stod(error_deg) >= std::stod(cell(2, cell(2, "baseline") + "_deg")));
  }
  EXPECT_NEAR(std::stod(cell(5, "left_out_rmse_deg")), 24, 8)
      << "half as much again of what 4 counts a degree are";
  EXPECT_LT(std::stod(cell(1, "left_out_rmse_deg")), std::stod(cell(5, "left_out_rmse_deg")));
  EXPECT_EQ(cell(7, "subject") + cell(7, "joint") + cell(7, "rmse_deg"), "P9");
  EXPECT_TRUE(has(table.str(), "m.csv, row 8, column \"\"glove\"\": none.csv: ")) << table.str();
  EXPECT_EQ(files("out").count("models/P2_1.json"), 1U);
}

TEST_F(Cohort, ShardsGiveTheBytesOfTheWholeRunInAnyOrder) {
  (void)run_cohort(leaving_out("whole"), {});
  std::vector<fs::path> parts;
  for (const std::size_t i : {2U, 3U, 1U}) {
    const std::string name = "part" + std::to_string(i);
    (void)run_cohort(leaving_out(name, {i, 3}), {});
    parts.push_back(folder_ / name);
  }
  EXPECT_TRUE(is_cohort(parts[0]) && is_cohort(folder_ / "whole") && !is_cohort(folder_));
  const auto refusal = [&] { return io::refusal_of([&] { merge_cohort(parts, folder_ / "merged"); }); };
  const fs::path last = parts.back();
  parts.pop_back();
  EXPECT_TRUE(has(refusal(), "row 2 (P0 0) of shard 1")) << refusal();
  EXPECT_TRUE(has(refusal(), "P2 left out of shard 1")) << refusal();
  EXPECT_FALSE(fs::exists(folder_ / "merged"));
  parts.push_back(last);
  const fs::path row = last / "rows" / "1.json";
  const std::string before = io::read_file(row);
  io::write_file(row, before + " ");
  EXPECT_TRUE(has(refusal(), last.string() + ": its rows are not those"));
  EXPECT_THROW((void)run_cohort(leaving_out(last.filename(), {1, 3}), {}), io::InputError);
  io::write_file(row, before);
  merge_cohort(parts, folder_ / "merged");
  EXPECT_EQ(files("merged"), files("whole"));
}

TEST_F(Cohort, StoppedItGoesOnAndAnotherRunsFolderIsRefused) {
  (void)run_cohort(request("whole"), {});
  CohortRequest one = request("out");
  std::atomic<int> done = 0;
  one.threads = 1;
  one.goes_on = [&] { return done < 2; };
  EXPECT_THROW((void)run_cohort(one, [&](std::size_t, std::size_t) { ++done; }), io::Cancelled);
  EXPECT_EQ(files("out").count("rows/2.json"), 1U);
  EXPECT_EQ(files("out").count("rows/3.json") + files("out").count("cohort.csv"), 0U);
  EXPECT_EQ(run_cohort(request("out"), {}).failed.size(), 1U);
  EXPECT_EQ(files("out"), files("whole"));
  io::expect_refused([&] { (void)run_cohort(leaving_out("out"), {}); }, "other settings");
  manifest("Subject,session,Glove,reference,map\nP0,0,0_glove.csv,0_camera.csv,\n");
  io::expect_refused([&] { (void)run_cohort(request("out"), {}); }, "other settings");
}

TEST_F(Cohort, ALogThatWasMendedIsIdentifiedAgainAndShardsOfOtherDataAreRefused) {
  manifest("subject,session,glove,reference\nP0,0,0_glove.csv,0_camera.csv\nP1,0,4_glove.csv,4_camera.csv\n");
  for (const std::size_t i : {1U, 2U}) (void)run_cohort(request("part" + std::to_string(i), {i, 2}), {});
  (void)run_cohort(leaving_out("out"), {});
  auto before = files("out");
  take("0", 5, 0);
  (void)run_cohort(leaving_out("out"), {});
  (void)run_cohort(leaving_out("again"), {});
  EXPECT_TRUE(files("out") == files("again"));
  EXPECT_NE(files("out")["models/P0_0.json"], before["models/P0_0.json"]);
  std::ofstream(folder_ / "0_glove.csv") << "t_s,index_adc\n0,500\n";  // determines nothing: its model goes
  for (const char* name : {"out", "broken"}) (void)run_cohort(leaving_out(name), {});
  EXPECT_TRUE(files("out") == files("broken"));
  take("0", 5, 0);
  (void)run_cohort(request("part2", {2, 2}), {});
  const auto refusal = [&] {
    return io::refusal_of([&] { merge_cohort({folder_ / "part1", folder_ / "part2"}, folder_ / "m"); });
  };
  EXPECT_TRUE(has(refusal(), "\"takes\" differs")) << refusal();
  (void)run_cohort(request("part1", {1, 2}), {});
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(Cohort, AModelsFileHasANameThatWindowsTakesOrItsRowAReason) {
  manifest(
      "subject,session,glove,reference\n<A:B>,?*|,0_glove.csv,0_camera.csv\n"
      "P1,0,1_glove.csv,1_camera.csv\n");
  fs::create_directories(folder_ / "out/models/P1_0.json/in the way");
  EXPECT_TRUE(has(run_cohort(request("out"), {}).failed.at(0), "row 3 (P1 0): "));
  EXPECT_TRUE(has(files("out")["cohort.csv"], "P1_0.json") && files("out").count("models/_A_B_____.json"));
  fs::remove_all(folder_ / "out/models/P1_0.json");
  EXPECT_TRUE(run_cohort(request("out"), {}).failed.empty()) << "it is tried again";
}

TEST_F(Cohort, AHeaderThatIsWrongIsRefused) {
  for (const auto& [header, what] : std::map<std::string, std::string>{
           {"subject,session,glove", "column \"reference\" is missing"},
           {"subjects,session,glove,reference,map", "column \"subject\" is missing"},
           {"subject,session,glove,reference,Maps", "is \"Maps\" the column \"map\"?"},
           {"subject,session,glove,reference,map,map", "\"map\" is there twice"},
           {"subject,session,glove,reference,map,rmse_deg", "\"rmse_deg\" is there twice"},
           {"subject,session,glove,reference,,map", "column 5 has no name"},
           {std::string("\0\xff\x80\x01", 4), "is missing"}}) {
    manifest(header + "\nP0,0,0_glove.csv,0_camera.csv,\n");
    const std::string refusal = io::refusal_of([&] { (void)read_manifest(folder_ / "m.csv"); });
    EXPECT_TRUE(has(refusal, "m.csv, row 1: ") && has(refusal, what)) << refusal;
  }
  manifest("subject,session,glove,reference,map\n");
  io::expect_refused([&] { (void)read_manifest(folder_ / "m.csv"); }, "no row");
}

TEST_F(Cohort, ARowThatIsWrongIsNamed) {
  const std::string good = "0_glove.csv,0_camera.csv,";
  for (const auto& [row, what] : std::map<std::string, std::string>{
           {"P1,0,none.csv,0_camera.csv,", "column \"glove\": none.csv: "},
           {"P1,0,0_glove.csv,.,", "column \"reference\": "},
           {"P1,0,,0_camera.csv,", "column \"glove\": is empty"},
           {",0," + good, "column \"subject\": is empty"},
           {"../P1,0," + good, "column \"subject\": \"../P1\" cannot be"},
           {"P0,0," + good, "column \"session\": subject \"P0\" and session \"0\" are those of row 2"},
           {"p0,0,1_glove.csv,1_camera.csv,", "or their model's file is"},
           {"P1,0," + good + "nowhere", "column \"map\": nowhere: "},
           {"P1,0," + good + "index=index_adc", "column \"map\": --map: no angle"},
           {"P1\x01,0," + good, "column 1: bytes that are no text"},
           {"P1,0,/dev/zero,0_camera.csv,", "column \"glove\": /dev/zero: is no file that stays"},
           {"P1,0," + good + "\"never\nends", "a quote is not closed"},
           {"P1,0,0_glove.csv", "has 3 cells, the header 5"},
           {"P1,0," + good, "its logs and map are those of row 2"}}) {
    manifest("subject,session,glove,reference,map\nP0,0," + good + "\n" + row + "\n");
    const Manifest read = read_manifest(folder_ / "m.csv");
    ASSERT_EQ(read.takes.size(), 2U);
    EXPECT_EQ(read.takes[0].fault, "");
    EXPECT_EQ(read.takes[1].fault.find("m.csv, row 3"), 0U) << read.takes[1].fault;
    EXPECT_TRUE(has(read.takes[1].fault, what)) << read.takes[1].fault;
  }
}

TEST_F(Cohort, AMapIsTextOrAFileAndAManifestMayBeASpreadsheets) {
  std::ofstream(folder_ / "map.txt") << "ring=index_adc:index_deg\n";
  manifest(
      "\xef\xbb\xbfsep=;\r\nsession;subject;glove;reference;map;note;;\r\n"
      "1;Zo\xeb;0_glove.csv;0_camera.csv;\"index=index_adc:index_deg,thumb=index_adc:index_deg\";\"a; "
      "b\";;\r\n"
      "2;Zo\xeb;1_glove.csv;1_camera.csv;map.txt;\r\n");
  const Manifest read = read_manifest(folder_ / "m.csv");
  ASSERT_EQ(read.takes.size(), 2U);
  EXPECT_EQ(read.takes[0].fault + read.takes[1].fault, "");
  EXPECT_EQ(read.takes[0].subject, "Zo\xc3\xab");
  EXPECT_EQ(read.takes[0].covariates, std::vector<std::string>{"a; b"});
  EXPECT_EQ(read.takes[0].map, "index=index_adc:index_deg,thumb=index_adc:index_deg");
  EXPECT_EQ(read.takes[1].map, "ring=index_adc:index_deg");
  CohortRequest one = leaving_out("out");
  for (const std::string& reason : run_cohort(one, {}).failed) ADD_FAILURE() << reason;
  EXPECT_TRUE(has(files("out")["cohort.csv"],
                  "without Zo\xc3\xab nobody is left whose map is "
                  "\"\"ring=index_adc:index_deg\"\": it differs in row 3"))
      << files("out")["cohort.csv"];
  manifest(
      "subject,session,glove,reference,note\nP0,0,0_glove.csv,0_camera.csv,\"left hand\nP2,2\"\n"
      "P1,0,1_glove.csv,1_camera.csv,5\" long\n");
  EXPECT_EQ(read_manifest(folder_ / "m.csv").takes.at(1).covariates, std::vector<std::string>{"5\" long"});
  manifest("subject,session,glove,reference\nP0,0,0_glove.csv,0_camera.csv\nP1,0,1_glove.csv\n");
  const Manifest without = read_manifest(folder_ / "m.csv");
  EXPECT_EQ(without.takes.at(0).map + without.takes.at(0).fault, "");
  EXPECT_TRUE(has(without.takes.at(1).fault, "has 3 cells, the header 4"));
}

}  // namespace
}  // namespace flexor::study
