#include "apps/live/command.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <future>

#include "host/io/io.hpp"

namespace flexor::live {
namespace command_test {

CommandResult run(std::vector<std::string> arguments, bool cancel = false) {
  std::promise<CommandResult> promise;
  Command command(
      FLEXOR_PROGRAM, std::move(arguments), [](const Progress&) {},
      [&](CommandResult result) { promise.set_value(std::move(result)); });
  if (cancel) command.cancel();
  return promise.get_future().get();
}

TEST(Command, GivesWhatTheProgramSays) {
  const CommandResult r = run({"protocol"});
  ASSERT_TRUE(r.ok) << r.text;
  EXPECT_GT(r.json.at("duration_s"), 60);
}

TEST(Command, AFailureIsItsLastLine) {
  const CommandResult r = run({"show", "/none/there.json"});
  EXPECT_FALSE(r.ok);
  EXPECT_NE(r.text.find("/none/there.json"), std::string::npos) << r.text;
  EXPECT_EQ(r.text.find("flexor: "), std::string::npos);
}

TEST(Command, WhatItWarnsOfIsKept) {
  const io::TemporaryFolder folder;
  std::string text = "t_s,index_count,middle_count\n";
  for (int k = 0; k < 320; ++k)
    text += fmt::format("{:.2f},{},{}\n", 0.05 * k, k / 80 % 2 == 0 ? 300 : 500, 360 + k % 3);
  io::write_file(folder.path() / "log.csv", text);
  const CommandResult r = run({"identify", "--poses", (folder.path() / "log.csv").string(), "--rate", "20",
                               "--model", (folder.path() / "model.json").string()});
  ASSERT_TRUE(r.ok) << r.text;
  ASSERT_EQ(r.warnings.size(), 1U);
  EXPECT_NE(r.warnings[0].find("middle_count hardly moves"), std::string::npos) << r.warnings[0];
}

TEST(Command, IsEndedAtOnce) {
  const CommandResult r = run({"experiment", "--trials", "10000"}, true);
  EXPECT_FALSE(r.ok);
  EXPECT_EQ(r.text, "ended before its time");
}

TEST(Command, ProgressIsReadAsTheProgressLineSaysIt) {
  const Progress p = progress_of("candidates 3 of 12, about 40 s left");
  EXPECT_EQ(p.stage, "candidates");
  EXPECT_DOUBLE_EQ(p.share.value_or(0), 0.25);
  EXPECT_EQ(p.left_s, 40);
  EXPECT_FALSE(progress_of("warning: something").share);
}

}  // namespace command_test
}  // namespace flexor::live
