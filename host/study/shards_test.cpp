#include "host/study/shards.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "host/io/json.hpp"
#include "host/io/refusal_test.hpp"
#include "host/study/plan_test.hpp"
#include "host/study/results.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

class ShardsTest : public testing::Test {
 protected:
  ShardsTest() {
    for (std::size_t i = 1; i <= 3; ++i)
      (void)run(plan(Shard{i, 3}, folders_.emplace_back(folder_ / std::to_string(i))), {});
  }

  // 40 trials are three batches of each motion.
  static Plan plan(std::optional<Shard> shard, const fs::path& folder) {
    Plan out = study::plan("1,4", 40, folder);
    out.shard = shard;
    return out;
  }

  Result merged() {
    Shards shards = read_shards(folders_, [](const std::string&) { return nullptr; });
    shards.plan.folder = folder_ / "merged";
    return merge(shards.plan, shards.folders, {});
  }
  std::string refusal() {
    return io::refusal_of([&] { (void)merged(); });
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  std::vector<fs::path> folders_;
};

TEST_F(ShardsTest, GiveTheBytesOfTheWholeRunInAnyOrder) {
  const Plan whole = plan({}, folder_ / "whole");
  const Result one = run(whole, {});
  std::swap(folders_[0], folders_[2]);
  EXPECT_EQ(to_json(merged(), whole), to_json(one, whole));
  for (const char* file : {"run.json", "trials.csv"})
    EXPECT_EQ(io::read_file(folder_ / "merged" / file), io::read_file(folder_ / "whole" / file)) << file;
}

TEST_F(ShardsTest, OneWithoutATrialIsFinishedAndOneMayHaveAll) {
  (void)run(plan({}, folder_ / "whole"), {});
  for (const std::size_t of : {8, 1}) {
    folders_.clear();
    for (std::size_t i = 1; i <= of; ++i)
      (void)run(plan(Shard{i, of}, folders_.emplace_back(folder_ / std::to_string(of) / std::to_string(i))),
                {});
    (void)merged();
    EXPECT_EQ(io::read_file(folder_ / "merged" / "trials.csv"),
              io::read_file(folder_ / "whole" / "trials.csv"));
    fs::remove_all(folder_ / "merged");
  }
}

TEST_F(ShardsTest, AnUnfinishedOneIsNamedAndNothingIsWritten) {
  const std::string rows = io::read_file(folders_[1] / "trials.csv");
  std::ofstream(folders_[1] / "trials.csv", std::ios::trunc) << rows.substr(0, rows.size() - 5);
  EXPECT_EQ(refusal(),
            folders_[1].string() +
                " has 1 of its 2 batches: give that shard's command once more, it goes on from there");
  EXPECT_FALSE(fs::exists(folder_ / "merged"));
}

TEST_F(ShardsTest, OneThatWasKilledBehindItsLastRowIsEndedByItsCommand) {
  auto settings = Json::parse(io::read_file(folders_[1] / "run.json"));
  settings.erase("rows_digest");
  io::write_file(folders_[1] / "run.json", io::dump(settings));
  EXPECT_EQ(refusal(),
            folders_[1].string() +
                ": its run has not ended: give that shard's command once more, it goes on from there");
  (void)run(plan(Shard{2, 3}, folders_[1]), {});
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(ShardsTest, AChangedDigitIsRefusedAlsoByItsOwnCommandAndOfAWholeRun) {
  (void)run(plan({}, folder_ / "whole"), {});
  for (const auto& [folder, shard] :
       {std::pair(folders_[1], std::optional(Shard{2, 3})), {folder_ / "whole", {}}}) {
    std::string rows = io::read_file(folder / "trials.csv");
    char& digit = rows.at(rows.find('.', rows.find('\n')) + 1);
    digit = digit == '3' ? '4' : '3';
    io::write_file(folder / "trials.csv", rows);
    const std::string message = folder.string() + ": its rows are not those that its run ended with";
    EXPECT_EQ(io::refusal_of([&, &f = folder, &s = shard] { (void)run(plan(s, f), {}); }).find(message), 0U);
  }
  EXPECT_NE(refusal().find("its rows are not those"), std::string::npos) << refusal();
}

TEST_F(ShardsTest, OnesThatAreMissingTwiceThereOrOfAnotherRunAreNamed) {
  const fs::path third = folders_.back();
  folders_.pop_back();
  EXPECT_EQ(refusal(), "of 3 shards 3 is missing: give their folders too");
  folders_.push_back(folders_[1]);
  EXPECT_NE(refusal().find("are both shard 2"), std::string::npos);
  fs::remove_all(third);
  Plan other = plan(Shard{3, 3}, third);
  other.seed = 4;
  (void)run(other, {});
  folders_.back() = third;
  EXPECT_NE(refusal().find("\"seed\" differs"), std::string::npos);
  folders_.back() = folder_ / "whole";
  (void)run(plan({}, folders_.back()), {});
  EXPECT_NE(refusal().find("is no shard's"), std::string::npos);
}

TEST(Shard, IsPartOfSo) {
  EXPECT_EQ(parse_shard("2/8"), (Shard{2, 8}));
  EXPECT_EQ((Shard{2, 8}).count(9), 1U);
  EXPECT_EQ((Shard{1, 8}).count(9), 2U);
  EXPECT_EQ((Shard{5, 8}).count(2), 0U);
  for (const char* wrong : {"", "2", "2/", "0/8", "9/8", "2/8x", "-1/8", "2/1001"})
    EXPECT_NE(io::refusal_of([&] { (void)parse_shard(wrong); }), "accepted") << wrong;
}

}  // namespace
}  // namespace flexor::study
