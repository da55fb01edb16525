// Every command with --json: standard output is one JSON object, nothing before it, nothing after it.
#include <cmath>

#include "apps/cli/command_test.hpp"

namespace flexor::cli {
namespace json_test {

class Json : public Command {
 protected:
  nlohmann::ordered_json run(const std::string& arguments) const { return json_of(arguments + " --json"); }
};

TEST_F(Json, OfRecalibrationAndWhatItLeavesAsItWas) {
  make(FLEXOR_SIMULATE);
  run("identify --sensor simulated_glove.csv --reference simulated_camera.csv --model m.json");
  const auto done = run("recalibrate m.json --recording simulated_glove.csv --out n.json");
  EXPECT_TRUE(done.contains("applied") && done.contains("shift") && done.contains("gain") &&
              done.contains("se_deg"));
  const std::string log = content(folder_ / "simulated_glove.csv");
  std::size_t end = 0;
  for (int line = 0; line < 30; ++line) end = log.find('\n', end) + 1;
  write("short.csv", log.substr(0, end));
  const auto refused = run("recalibrate m.json --recording short.csv --out n.json");
  EXPECT_FALSE(refused.at("applied").get<bool>());
  EXPECT_FALSE(refused.at("wanted").empty());
  EXPECT_EQ(content(folder_ / "n.json"), content(folder_ / "m.json")) << "to the byte";
  std::string twelve_bits = "t_s,index_count\n";
  for (int k = 0; k < 400; ++k)
    twelve_bits += std::to_string(k * 0.05) + "," + std::to_string(2000 + 9 * (k % 100)) + "\n";
  write("twelve.csv", twelve_bits);
  expect_refused("recalibrate m.json --recording twelve.csv --input index_count --out p.json", 3,
                 "lie outside of the model's range");
}

TEST_F(Json, OfTheCommandsForTheTwin) {
  EXPECT_TRUE(run("twin").contains("schema"));
  EXPECT_TRUE(run("experiment --gestures 2 --trials 1 --compensators raw --scenarios").contains("scenarios"));
  const auto protocol = run("protocol");
  EXPECT_EQ(protocol.at("duration_s"), 120);
  EXPECT_GT(protocol.at("moves").size(), 40U);
  const auto recorded = run("twin record --donnings 2 --out g");
  ASSERT_EQ(recorded.at("pairs").size(), 2U);
  const auto& pair = recorded.at("pairs").at(1);
  const auto hand = run("identify --pair " + pair.at("glove").get<std::string>() + " " +
                        pair.at("camera").get<std::string>() + " --rate 10 --structure line");
  EXPECT_EQ(hand.at("joints").size(), 5U);
  // What it says comes next works as it stands.
  const std::string next = recorded.at("next");
  ASSERT_TRUE(next.starts_with("flexor identify --pair "));
  EXPECT_EQ(run(next.substr(7)).at("pairs").size(), 2U);
  EXPECT_EQ(run("show g/identified.json").at("joints").size(), 5U);
  const auto applied = run("apply --intervals g/identified.json " + pair.at("glove").get<std::string>());
  run(std::string(next).erase(next.find(" --neighbours"), 13).substr(7));
  const auto tracked = run("apply --track g/identified.json " + pair.at("glove").get<std::string>());
  ASSERT_EQ(tracked.at("tracking").size(), 5U);
  EXPECT_LT(std::abs(tracked.at("tracking").begin()->at("shift_deg").get<double>()), 6)
      << "another donning of two degrees";
  EXPECT_FALSE(tracked.at("tracking").begin()->at("alarm").get<bool>());
  const auto& thumb = applied.at("channels").at("thumb");
  ASSERT_EQ(thumb.at("se_deg").size(), thumb.at("angle_deg").size());
  EXPECT_GT(thumb.at("se_deg").at(100).get<double>(), 0);
  // Gains and dead zones of the published model, fitted to the same recording.
  const auto refitted = run("identify --pair " + pair.at("glove").get<std::string>() + " " +
                            pair.at("camera").get<std::string>() + " --rate 10 --refit " +
                            quoted(fs::absolute("models/published_hw.json").string()));
  EXPECT_EQ(refitted.at("joints").at("thumb").at("structure"), "gain and dead zone refitted");
}

}  // namespace json_test
}  // namespace flexor::cli
