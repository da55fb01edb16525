#include "apps/live/sessions.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <set>
#include <thread>

#include "apps/live/recorder.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::live {
namespace {

namespace fs = std::filesystem;

class SessionsTest : public testing::Test {
 protected:
  const io::TemporaryFolder folder_;
  const fs::path root_ = folder_.path() / "all";
  Sessions sessions_{root_};
};

TEST_F(SessionsTest, AreFoundAgainWithTheirFiles) {
  Session made = sessions_.create("Änne O'Neil", "left", "glove index_count", "calibration");
  io::write_file(sessions_.folder(made) / "log.csv", "t_s,index_count\n0,1\n");
  made.seconds = 12;
  made.model = "model.json";
  sessions_.save(made);
  const std::vector<Session> list = Sessions(root_).list();
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0].person, "Änne O'Neil");
  EXPECT_EQ(list[0].side, "left");
  EXPECT_EQ(list[0].seconds, 12);
  EXPECT_EQ(list[0].files, std::vector<std::string>{"log.csv"});
}

TEST_F(SessionsTest, ColumnsAreNamedAgainWhereTheirFileIsDamaged) {
  for (const char* damaged : {"", "[]", R"({"g": ["thu)", R"({"g": 3})"}) {
    io::write_file(root_ / "columns.json", damaged);
    EXPECT_TRUE(sessions_.column_names("g").empty()) << damaged;
    sessions_.name_columns("g", {"thumb", "index"});
    EXPECT_EQ(sessions_.column_names("g"), (std::vector<std::string>{"thumb", "index"})) << damaged;
  }
}

TEST_F(SessionsTest, AGloveHasItsNewestAcceptedModel) {
  Session first = sessions_.create("anna", "right", "this glove", "x");
  first.model = "model.json";
  sessions_.save(first);
  Session second = sessions_.create("anna", "right", "this glove", "x");
  sessions_.save(second);
  Session other = sessions_.create("bert", "right", "another", "x");
  other.model = "model.json";
  sessions_.save(other);
  ASSERT_TRUE(sessions_.newest_with_model("this glove"));
  EXPECT_EQ(sessions_.newest_with_model("this glove")->name, first.name);
  EXPECT_FALSE(sessions_.newest_with_model("none"));
}

// In the hour that repeats when summer time ends, the later one has the smaller name.
TEST_F(SessionsTest, AModelIsNewestByWhenItWasAccepted) {
  Session first = sessions_.create("anna", "right", "this glove", "x");
  Session second = sessions_.create("anna", "right", "this glove", "x");
  sessions_.accept(second, "model.json");
  sessions_.accept(first, "model.json");
  ASSERT_GT(first.accepted_unix_s, second.accepted_unix_s);
  EXPECT_EQ(sessions_.newest_with_model("this glove")->name, first.name);
}

TEST_F(SessionsTest, ARecordingThatWasKilledIsAsLongAsItsWholeRows) {
  const Session made = sessions_.create("anna", "right", "g", "x");
  const auto seconds_of = [&](const std::string& log) {
    io::write_file(sessions_.folder(made) / "log.csv", log);
    return sessions_.list().at(0).seconds;
  };
  EXPECT_EQ(seconds_of("t_s,host_s,index\n0.5,7,1\n1,7.5,1\n9.75,16,1\n11,1"), 9.25);
  std::string longer = "t_s,host_s,index\n";
  for (int k = 0; k <= 9000; ++k) longer += fmt::format("{},{},1\n", 0.25 * k, 0.25 * k);
  EXPECT_EQ(seconds_of(longer), 2250);
  for (const char* log : {"t", "t_s,host_s\n", "t_s,host_s\n3,3\n", "\n\n", "t_s\nnan\ninf\n"})
    EXPECT_EQ(seconds_of(log), 0) << log;
}

TEST_F(SessionsTest, WhatIsNoSessionIsLeftAlone) {
  fs::create_directory(root_ / "holiday");
  fs::create_directory(root_ / "malformed");
  io::write_file(root_ / "malformed/session.json", "{\"schema\": \"flexor-session\"");
  EXPECT_TRUE(sessions_.list().empty());
  EXPECT_TRUE(fs::exists(root_ / "malformed/session.json"));
}

TEST_F(SessionsTest, ANameCannotLeaveTheFolder) {
  const Session made = sessions_.create("../../etc/passwd", "right", "g", "x");
  EXPECT_EQ(made.name.find('/'), std::string::npos);
  EXPECT_TRUE(fs::exists(root_ / made.name / "session.json"));
  EXPECT_THROW(sessions_.create("a\nb", "right", "g", "x"), io::InputError);
  EXPECT_THROW(sessions_.create(std::string(100, 'a'), "right", "g", "x"), io::InputError);
  EXPECT_THROW(sessions_.create("\xff\xfe", "right", "g", "x"), io::InputError);
}

// Whoever can write into the folder leads nobody out of it, and lets nobody wait.
TEST_F(SessionsTest, LinksAndFifosAreNotFollowed) {
  Sessions outside(folder_.path() / "outside");
  const Session foreign = outside.create("eve", "right", "g", "x");
  fs::create_symlink(outside.folder(foreign), root_ / "linked");
  EXPECT_TRUE(sessions_.list().empty());
  const Session own = sessions_.create("anna", "right", "g", "x");
  const fs::path document = sessions_.folder(own) / "session.json";
  io::write_file(folder_.path() / "precious", "mine");
  fs::remove(document);
  fs::create_symlink(folder_.path() / "precious", document);
  EXPECT_THROW(sessions_.save(own), io::InputError);
  EXPECT_EQ(io::read_file(folder_.path() / "precious"), "mine");
  fs::remove(document);
  ASSERT_EQ(mkfifo(document.c_str(), 0600), 0);
  EXPECT_THROW(sessions_.save(own), io::InputError);
}

TEST_F(SessionsTest, OfManyFilesItsOwnAreListed) {
  const Session made = sessions_.create("anna", "right", "g", "x");
  for (int k = 0; k < 50; ++k) io::write_file(sessions_.folder(made) / fmt::format("a{}.png", k), "");
  io::write_file(sessions_.folder(made) / "log.csv", "");
  const std::vector<std::string> files = sessions_.list().at(0).files;
  EXPECT_EQ(files.size(), 40U);
  EXPECT_EQ(files.front(), "log.csv");
}

TEST_F(SessionsTest, OfManyProgramsEachGetsOneOfItsOwn) {
  std::vector<std::string> names(8);
  {
    std::vector<std::jthread> programs;
    for (std::string& name : names)
      programs.emplace_back([&] { name = Sessions(root_).create("anna", "right", "g", "x").name; });
  }
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
}

TEST_F(SessionsTest, ARecordingTakesNothingOfAnotherGlove) {
  SessionRecording recording({}, root_);
  recording.add({0, {}, {1, 2}, {}}, {"index", "middle"});
  EXPECT_THROW(recording.add({1, {}, {3, 4}, {}}, {"middle", "index"}), io::JobError);
  recording.flush();
  EXPECT_EQ(recording.rows(), 1U);
  EXPECT_EQ(io::read_file(recording.log_file()), "t_s,host_s,index,middle\n0.000000,0.000000,1,2\n");
}

TEST_F(SessionsTest, ARecordingOfWhichTheFolderWasRemovedEnds) {
  fs::create_directory(root_ / "session");
  SessionRecording recording({}, root_ / "session");
  recording.add({0, {}, {1}, {}}, {"index"});
  recording.flush_if_due(1.5);
  fs::remove_all(root_ / "session");
  EXPECT_NO_THROW(recording.flush_if_due(2));
  EXPECT_THROW(recording.flush_if_due(2.5), io::JobError) << "a second later, also where no sample comes";
}

TEST_F(SessionsTest, ARecordingNamesWhatItLacks) {
  SessionRecording recording({}, root_);
  recording.add({0, {}, {1}, {}}, {"index"});
  recording.add({5, {}, {1}, {}}, {"index"});
  const std::string whole = fmt::format("2 rows in {}", recording.log_file().string());
  EXPECT_EQ(recording.in_words(5.5), whole);
  recording.leave_out(360);
  EXPECT_EQ(recording.in_words(23), whole +
                                        "; 360 rows that came were malformed or did not fit, and are left "
                                        "out; nothing was recorded in the last 18 s");
}

}  // namespace
}  // namespace flexor::live
