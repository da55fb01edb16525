// The program as a page sees it: `flexor live --from twin` over its socket.
#include <sys/resource.h>

#include <fstream>

#include "apps/live/program_test.hpp"

namespace flexor::live {
namespace words_test {

class Words : public Program {
 protected:
  void SetUp() override { begin(); }
  using Program::begin;
  void begin() { begin({"--from", "twin"}); }
  static Json calibration_of(const char* person, const char* by) {
    return {{"do", "calibrate.start"}, {"person", person}, {"side", "left"}, {"reference", by}};
  }
  // The published model with other words in it.
  static std::string published(const std::vector<std::pair<std::string, std::string>>& changes) {
    std::string text = io::read_file(FLEXOR_SOURCE_DIR "/models/published_hw.json");
    for (const auto& [from, to] : changes) {
      for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; ++at)
        text.replace(at, from.size(), to);
    }
    return text;
  }
};

TEST_F(Words, AGloveMovesAndIsRecorded) {
  five_fingers();
  done({{"do", "record.start"}});
  expect_refused({{"do", "record.start"}}, "recording_runs");
  expect_refused({{"do", "device.connect"}, {"port", "auto"}}, "recording_runs");
  expect_refused({{"do", "device.leave"}}, "recording_runs");
  done({{"do", "marker"}, {"text", "a \"knock\""}});
  state_when([](const Json& s) { return s.at("recording").is_object() && s["recording"]["rows"] > 20; });
  done({{"do", "record.stop"}});
  const Json listed =
      state_when([](const Json& s) { return !s.at("sessions").empty() && s["recording"].is_null(); });
  const std::string path = "files/" + listed["sessions"][0]["name"].get<std::string>() + "/log.csv";
  const std::string file = get(*place_, "/" + place_->token + "/" + path);
  EXPECT_EQ(status_of(file), 200);
  EXPECT_NE(file.find("t_s,host_s,thumb_count"), std::string::npos);
}

TEST_F(Words, WhatIsWrongIsAnsweredInOneLine) {
  expect_refused({{"do", "dance"}}, "no word");
  expect_refused({{"do", 5}}, "text");
  expect_refused({{"do", "model.choose"}, {"path", "../../etc/passwd"}}, "no file");
  expect_refused({{"do", "replay.open"}, {"session", ".."}, {"file", "passwd"}}, "no file");
  expect_refused({{"do", "twin.set"}, {"slip_deg", 1e9}}, "between");
  expect_refused({{"do", "calibrate.next"}}, "no_calibration");
  expect_refused(calibration_of("a\nb", "poses"), "name");
  expect_refused({{"do", "calibrate.start"}, {"person", "a"}, {"side", "up"}, {"reference", "poses"}},
                 "side");
  expect_refused({{"do", "send"}}, "no_model");
  expect_refused({{"do", "flash"}, {"board", "toaster"}}, "glove or hand");
  expect_refused({{"do", "anew.start"}}, "no_model");
  tab_->send("{\"do\": [[[[[[[[[[[[");
  tab_->send("not even JSON");
  for (int kind = 0; kind < 256; ++kind)
    tab_->put(frame(kBinary, static_cast<char>(kind) + std::string(39, static_cast<char>(kind * 37))));
  tab_->put(frame(kBinary, ""));
  five_fingers();
  done({{"do", "record.start"}});  // and it goes on
}

TEST_F(Words, TwoTabsCannotCalibrateAtOnce) {
  five_fingers();
  done(calibration_of("anna", "poses"));
  Tab other(*place_);
  Json start = calibration_of("bert", "poses");
  start["id"] = "x";
  other.send(start.dump());
  Json answer = other.receive_json();
  for (int k = 0; k < 500 && answer.value("id", Json()) != "x"; ++k) answer = other.receive_json();
  EXPECT_EQ(answer.at("error"), "calibration_is_open");
  const Json state = state_when([](const Json& s) { return s.at("calibration").is_object(); });
  EXPECT_EQ(state["calibration"]["person"], "anna");
  done({{"do", "calibrate.cancel"}});
}

TEST_F(Words, ACalibrationGoesOnAfterAKill) {
  five_fingers();
  done(calibration_of("anna", "drawn"));
  expect_refused({{"do", "calibrate.next"}}, "hand_unseen");
  state_when([](const Json& s) { return s["calibration"]["tracked"] > 0.5; });
  done({{"do", "calibrate.next"}});
  const auto step_is = [](const char* step) {
    return
        [step](const Json& s) { return s.at("calibration").is_object() && s["calibration"]["step"] == step; };
  };
  state_when(step_is("motion"));
  end();  // by SIGKILL
  begin();
  const Json state = state_when(step_is("reference"));
  EXPECT_EQ(state["calibration"]["person"], "anna");
  done({{"do", "calibrate.cancel"}});
  end();
  begin();
  EXPECT_TRUE(five_fingers().at("calibration").is_null());
}

// A disk that is full, as a limit on files.
TEST_F(Words, WhatCannotBeWrittenEndsAloneAndTheServerGoesOn) {
  end();
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{20000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  begin();
  setrlimit(RLIMIT_FSIZE, &before);
  five_fingers();
  done(calibration_of("anna", "poses"));
  const auto cannot_be_written = [](const Json& s) {
    return s.at("last").is_object() &&
           s["last"]["text"].get<std::string>().find("cannot be written") != std::string::npos;
  };
  const Json full = state_when(cannot_be_written);
  EXPECT_EQ(full["calibration"]["step"], "glove") << "the motion is over, the calibration is not";
  done({{"do", "calibrate.cancel"}});  // and it goes on
}

TEST_F(Words, MarkersAreBounded) {
  five_fingers();
  done({{"do", "record.start"}});
  constexpr int kMost = 500;
  for (int k = 0; k < kMost; ++k) done({{"do", "marker"}, {"text", std::string(200, 'm')}});
  expect_refused({{"do", "marker"}, {"text", "one more"}}, "500 markers");
  Tab later(*place_);
  int received = 0;
  for (int k = 0; k < 10 * kMost && received < kMost; ++k) {
    const Json marker = later.receive_json();
    if (marker.value("event", "") != "marker") continue;
    ++received;
    EXPECT_EQ(marker["text"], std::string(200, 'm'));
    EXPECT_GT(marker["host_s"], 0);
  }
  EXPECT_EQ(received, kMost);
}

TEST_F(Words, ARecordingOfMoreColumnsThanAMessageHoldsIsRefused) {
  const std::filesystem::path folder = folder_.path() / "sessions" / "wide";
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / "log.csv");
  file << "t_s";
  for (int k = 0; k < 256; ++k) file << ",c" << k;
  for (int row = 0; row < 3; ++row) {
    file << "\n" << row;
    for (int k = 0; k < 256; ++k) file << "," << k;
  }
  file << std::endl;
  expect_refused({{"do", "replay.open"}, {"session", "wide"}, {"file", "log.csv"}}, "256 columns");
  five_fingers();  // the glove stays
}

// Angles that the page saw itself become camera.csv, also those of a page that was opened again and has another clock.
TEST_F(Words, AMarkerlessTrackersAnglesAreWritten) {
  five_fingers();
  expect_refused({{"do", "angles"}, {"t_s", 1}, {"angles", {{"index_mcp", 20}}}}, "no_angles_wanted");
  done(calibration_of("anna", "markerless"));
  const auto see = [&](double t_s, const Json& angles) {
    tab_->send(Json({{"do", "angles"}, {"t_s", t_s}, {"angles", angles}}).dump());
  };
  see(899.9, {{"index_mcp", 1}, {"index_pip", 2}});
  done({{"do", "calibrate.next"}});
  state_when([](const Json& s) { return s["calibration"]["seconds"] > 0; });
  for (int k = 0; k < 20; ++k) see(900 + 0.05 * k, {{"index_mcp", k}, {"index_pip", 2 * k}});
  for (int k = 0; k < 5; ++k) see(901 + 0.05 * k, Json::object());
  const auto opened = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - opened < std::chrono::milliseconds(1500)) (void)tab_->receive();
  for (int k = 0; k < 10; ++k) see(0.05 * k, {{"index_mcp", 50 + k}, {"index_pip", 60}});
  const Json seen = state_when(
      [](const Json& s) { return s.at("calibration").is_object() && s["calibration"]["pictures"] == 36; });
  EXPECT_EQ(seen["calibration"]["camera"], "page");
  done({{"do", "calibrate.back"}});
  const std::string session = seen["calibration"]["session"].get<std::string>();
  const std::string text = io::read_file(folder_.path() / "sessions" / session / "camera.csv");
  EXPECT_EQ(text.substr(0, text.find('\n')), "t_s,host_s,index_mcp_deg,index_pip_deg");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 20 + 10) << text;
}

TEST_F(Words, ARecordingIsPlayedFromTheStart) {
  end();
  std::string text = "t_s,index_count\n";
  for (int k = 0; k < 500; ++k) text += fmt::format("{:.2f},{}\n", 0.02 * k, 300 + k);
  io::write_file(folder_.path() / "log.csv", text);
  begin({"--from", (folder_.path() / "log.csv").string()});
  const Json state = state_when([](const Json& s) { return s.at("fingers").size() == 1; });
  EXPECT_EQ(state["replay"]["file"], "log.csv");
  EXPECT_EQ(state["device"]["status"], "replay");
  done({{"do", "replay.seek"}, {"t_s", 0}});
}

TEST_F(Words, ThePublishedModelIsWornAndReportsThatItCannotBeTracked) {
  five_fingers();
  expect_refused({{"do", "tracking.set"}, {"on", true}}, "no_model");
  end();
  begin({"--from", "twin", "--model", FLEXOR_SOURCE_DIR "/models/published_hw.json"});
  expect_refused({{"do", "tracking.set"}, {"on", true}}, "not_tracked");
  const Json state = state_when([](const Json& s) { return s["fingers"][1]["angle_deg"].is_number(); });
  EXPECT_EQ(state["fingers"][1]["unit"], "deg");
  EXPECT_EQ(state["tracking"], false);
  EXPECT_EQ(state["tracking_remark"], "not_tracked");
}

TEST_F(Words, AModelThatDoesNotFitTheGloveIsNotWornAndIsReported) {
  end();
  const std::string model = (folder_.path() / "wrist.json").string();
  io::write_file(model, published({{"thumb_alpha\"", "wrist_alpha\""}}));
  begin({"--from", "twin", "--model", model});
  state_when([](const Json& s) {
    return s["next"].value("why", "").starts_with("the model reads \"wrist_alpha\"");
  });
  done({{"do", "model.choose"}, {"path", nullptr}});
  const Json none = state_when([](const Json& s) {  // once it has moved
    return s["model"].is_null() && s["next"]["kind"] == "calibrate";
  });
  EXPECT_EQ(none["models"][0]["path"], "wrist.json") << "it may be chosen again, for its glove";
  expect_refused({{"do", "model.choose"}, {"path", "wrist.json"}}, "the model reads");
  state_when([](const Json& s) { return s["model"].is_null(); });
}

TEST_F(Words, AChosenModelIsWornAndAMisfitLeavesItOn) {
  const std::filesystem::path folder = folder_.path() / "sessions" / "anna";
  std::filesystem::create_directories(folder);
  io::write_file(folder / "model.json",
                 published({{"_alpha\"", "_count\""}, {"\"unit\": \"deg\"", "\"unit\": \"count\""}}));
  std::filesystem::copy(FLEXOR_SOURCE_DIR "/models/published_hw.json", folder / "misfit.json");
  five_fingers();
  done({{"do", "model.choose"}, {"path", "anna/model.json"}});
  const auto is_worn = [](const Json& s) {
    const Json& index = s["fingers"][1];
    return s["model"].is_object() && index["angle_deg"].is_number() && index["open_deg"] < index["fist_deg"];
  };
  state_when(is_worn);
  expect_refused({{"do", "model.choose"}, {"path", "anna/misfit.json"}}, "the model reads");
  state_when(is_worn);  // the one before stays
}

// A job is no recording: nobody would get what it finds.
TEST_F(Words, AJobEndsWithTheServer) {
  int server = 0;
  std::ifstream("/proc/thread-self/children") >> server;
  done({{"do", "experiment.run"}, {"trials", 10000}});
  int job = 0;
  std::ifstream(fmt::format("/proc/{0}/task/{0}/children", server)) >> job;
  ASSERT_GT(job, 0);
  const auto runs = [job] {
    std::string id;
    std::string name;
    std::string state;
    std::ifstream(fmt::format("/proc/{}/stat", job)) >> id >> name >> state;
    return !state.empty() && state != "Z";
  };
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(runs());
  end();  // by SIGKILL
  EXPECT_TRUE(soon([&] { return !runs(); }));
}

}  // namespace words_test
}  // namespace flexor::live
