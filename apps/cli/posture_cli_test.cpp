// flexor posture as its users run it: the columns that other tools read, one clear line for bad input, nothing half-written.
#include <sstream>

#include "apps/cli/command_test.hpp"
#include "host/posture/people_test.hpp"

namespace flexor::cli {
namespace posture_cli_test {
using posture::kJointNames;

class PostureCli : public Command {
 protected:
  int run(const std::string& arguments) {
    const Finished r = Command::run("posture " + arguments);
    said_ = r.err;
    return r.exit;
  }

  void SetUp() override {
    fs::copy_file(FLEXOR_SOURCE_DIR "/models/posture.json", path("p.json"));
    write("new.csv", posture::test::table_of(posture::test::person(5), 90));
  }

  void expect_refusal(const std::string& arguments, const std::string& what) {
    expect_refused("posture " + arguments, 2, what);
  }

  std::string said_;
};

TEST_F(PostureCli, WritesEveryJointWithItsErrorOnTheRowsOfTheFile) {
  ASSERT_EQ(run("complete p.json new.csv --from index_mcp_deg,index_pip_deg,thumb_deg --bends "
                "index=index_mcp+index_pip,thumb=thumb_mcp+thumb_ip --rest 0.5 --out full.csv"),
            0)
      << said_;
  std::istringstream rows(content(path("full.csv")));
  std::string header = "t_s";
  for (const auto name : kJointNames) header += fmt::format(",{0}_deg,{0}_se_deg", name);
  std::string line;
  std::getline(rows, line);
  EXPECT_EQ(line, header + ",index_quality,thumb_quality");
  int count = 0;
  for (; std::getline(rows, line); ++count) EXPECT_EQ(std::ranges::count(line, ','), 48) << line;
  EXPECT_EQ(count, 90);  // among them repeated and restarted times
}

TEST_F(PostureCli, RefusesInOneLineAndLeavesNothing) {
  const std::string complete = "complete p.json new.csv --out never.csv ";
  expect_refusal(complete + "--from index_mcp_deg --rest -1", "--rest must be from 0 to 3600");
  expect_refusal(complete + "--from index_mcp_deg --rest nan", "--rest");
  expect_refusal("complete p.json none.csv --from index_mcp_deg --out never.csv", "none.csv");
  expect_refusal("complete new.csv new.csv --from index_mcp_deg --out never.csv", "new.csv");
  write("text.csv", "t_s,index_mcp_deg\n1,-20\n2,inf\n");
  expect_refusal("complete p.json text.csv --from index_mcp_deg --out never.csv",
                 "row 3: column \"index_mcp_deg\"");
  expect_refusal("learn a.csv b.csv c.csv --out p.json", "python -m flexor.posture_learning");
}

TEST_F(PostureCli, SaysWhenARestShowsNoMoreThanTheSensors) {
  write("strip.csv", "t_s,index_deg\n0.0,-5\n0.1,\n0.2,nan\n0.2,-7\n");
  ASSERT_EQ(run("complete p.json strip.csv --from index_deg --bends index=index_mcp+index_pip --rest 1 --out "
                "f.csv"),
            0);
  EXPECT_NE(said_.find("0 of 23 joints are shown"), std::string::npos) << said_;
  EXPECT_NE(said_.find("2 row(s) missing"), std::string::npos) << said_;
}

}  // namespace posture_cli_test
}  // namespace flexor::cli
