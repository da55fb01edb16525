// What export --to matlab writes, run by GNU Octave, against flexor apply.
#include "apps/cli/command_test.hpp"
#include "host/model/random_model.hpp"

namespace flexor::cli {
namespace matlab_test {

const std::string kPublished = fs::absolute(FLEXOR_SOURCE_DIR "/models/published_hw.json").string();

class Matlab : public Command {
 protected:
  std::string octave(const std::string& program) const {
    write("program.m", program);
    const std::string command =
        "cd '" + folder_.string() + "' && octave-cli --quiet --norc program.m > result.txt 2> errors.txt";
    EXPECT_EQ(std::system(command.c_str()), 0) << content(path("errors.txt"));
    return content(path("result.txt"));
  }

  // Readings on the model's grid, over the valid range and now and then beyond; apply's angles and statuses, row by row.
  std::string applied(const model::Model& m, int rows) const {
    std::mt19937 random(7);
    std::string csv = "t_s";
    std::string matrix;
    for (std::size_t i = 0; i < m.inputs.size(); ++i) csv += fmt::format(",u{}", i);
    for (int k = 0; k < rows; ++k) {
      csv += fmt::format("\n{}", k * m.sample_period_s);
      for (const model::Input& input : m.inputs) {
        const double share =
            0.5 + 0.5 * std::sin(0.05 * k) + std::uniform_real_distribution(-0.05, 0.05)(random);
        const double u = input.valid_min + share * (input.valid_max - input.valid_min);
        csv += fmt::format(",{}", u);
        matrix += fmt::format("{} ", u);
      }
      matrix += "\n";
    }
    write("log.csv", csv + "\n");
    write("readings.txt", matrix);
    model::save(m, path("model.json"));
    const Finished r = run("apply model.json log.csv --json");
    EXPECT_TRUE(r.exit == 0 || r.exit == 3) << r.err;
    return r.out;
  }

  void expect_same_angles(model::Model m, int rows) const {
    for (std::size_t i = 0; i < m.inputs.size(); ++i) {
      m.inputs[i].column = fmt::format("u{}", i);
      m.inputs[i].unit = "";
    }
    const auto json = Json::parse(applied(m, rows));
    ASSERT_EQ(run("export model.json --to matlab --out glove.m").exit, 0);
    // The whole recording at once, and in two parts.
    std::istringstream found(
        octave("r = load('readings.txt'); [a, s] = glove(r); [a1, s1, c] = glove(r(1:100, :)); a2 = "
               "glove(r(101:end, :), c);\n"
               "assert(isequal(a, [a1; a2])); printf('%.17g %d\\n', [a(:) s(:)]');\n"));
    for (const auto& [name, joint] : json["channels"].items()) {
      ASSERT_EQ(joint["angle_deg"].size(), static_cast<std::size_t>(rows));
      for (std::size_t k = 0; k < joint["angle_deg"].size(); ++k) {
        double angle_deg = 0;
        int status = -1;
        found >> angle_deg >> status;
        ASSERT_NEAR(angle_deg, joint["angle_deg"][k].get<double>(), 1e-9) << name << " " << k;
        ASSERT_EQ(status, joint["status"][k].get<int>()) << name << " " << k;
      }
    }
  }
};

#define SKIP_WITHOUT_OCTAVE() \
  if (std::system("command -v octave-cli > /dev/null") != 0) GTEST_SKIP() << "octave-cli is not installed"

TEST_F(Matlab, TheShippedModelsGiveTheAnglesOfApply) {
  SKIP_WITHOUT_OCTAVE();
  for (const char* name : {"published_hw", "published_wiener"})
    expect_same_angles(model::load(fs::path(FLEXOR_SOURCE_DIR) / "models" / (std::string(name) + ".json")),
                       2000);
}

TEST_F(Matlab, AnyModelGivesTheAnglesOfApply) {
  SKIP_WITHOUT_OCTAVE();
  std::vector<bool> seen(std::variant_size_v<model::Kind>);
  for (unsigned seed = 1; seed <= 30; ++seed) {
    model::Model m = model::RandomModel(seed).make();
    if (m.sample_period_s < 1e-3 || m.sample_period_s > 5) continue;  // times of a log, and its pauses
    m.max_gap_s = 0;
    expect_same_angles(m, 300);
    for (const model::Block& block : m.blocks) seen[block.kind.index()] = true;
  }
  EXPECT_EQ(std::ranges::count(seen, false), 0);
}

TEST_F(Matlab, WhatIsNotANumberIsHeld) {
  SKIP_WITHOUT_OCTAVE();
  ASSERT_EQ(run("export " + kPublished + " --to matlab --out glove.m").exit, 0);
  EXPECT_EQ(
      octave("[a, s] = glove([50 50 50 50 50; 60 nan 60 60 60]); printf('%d', s(2, :), a(1, 2) == a(2, 2));\n"
             "try, glove([1 2]), catch e, printf(' %s', e.message), end\n"),
      "030001 readings: must have a column for each input, as the help says");
}

TEST_F(Matlab, RefusesWhatMatlabCannotCall) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"--out glove.txt", "ends in .m"},
      {"--out my-glove.m", "the first a letter"},
      {"--out 1glove.m", "the first a letter"},
      {"--out max.m", "another name, as my_max"},
      {"--out while.m", "another name, as my_while"},
      {"--out lti.m", "another name, as my_lti"},
      {kPublished + " --out a.m", "not expected"},
      {"--names a=b --out a.m", "leave it out"}};
  for (const auto& [options, reason] : cases)
    expect_refused("export " + kPublished + " --to matlab " + options, 2, reason);
}

}  // namespace matlab_test
}  // namespace flexor::cli
