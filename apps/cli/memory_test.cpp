// Memory follows the size of the input, never the numbers in it: at most 200 MB and three times the input.
#include <cmath>

#include "apps/cli/command_test.hpp"

namespace flexor::cli {
namespace memory_test {

class Memory : public Command {
 protected:
  double megabytes(const std::vector<std::string>& files) const {
    double sum = 0;
    for (const std::string& f : files) sum += static_cast<double>(fs::file_size(path(f))) / 1e6;
    return sum;
  }

  // Bounded memory, and an end that a program may have: done, failed, or refused; never killed.
  void expect_bounded(const std::string& arguments, const std::vector<std::string>& inputs) const {
    const Finished r = run(arguments);
    EXPECT_LE(r.peak_mb, 200 + 3 * megabytes(inputs)) << arguments;
    EXPECT_EQ(r.signal, 0) << arguments;
    EXPECT_LE(r.exit, 2) << arguments;
  }

  // Of a finger between 10 and 80 degrees, never twice the same, at time_of(k) in seconds for each row.
  template <class TimeOf>
  std::string log(const std::string& name, const std::string& column, int rows, double scale,
                  TimeOf time_of) const {
    std::ofstream out(path(name));
    out << "t_s," << column << "\n";
    out.precision(12);
    for (int k = 0; k < rows; ++k) {
      const double t_s = time_of(k);
      const double t = std::fmod(t_s, 1e6);
      const double angle = 45 + 20 * std::sin(1.3 * t) + 15 * std::sin(0.41 * t + 0.3 * std::sin(0.07 * t));
      out << t_s << "," << std::round(scale * angle * 100) / 100 << "\n";
    }
    return name;
  }

  void expect_all_bounded(const std::string& glove, const std::string& camera) const {
    const std::vector<std::string> both = {glove, camera};
    const std::string pair = " --sensor " + glove + " --reference " + camera;
    expect_bounded("align --out aligned.csv" + pair, both);
    expect_bounded("identify --structure linear-dynamic --model m.json" + pair, both);
    expect_bounded("score " + camera + " " + camera, both);
    std::string apply =
        "apply " + quoted(fs::absolute(FLEXOR_SOURCE_DIR "/models/published_hw.json")) + " " + glove;
    for (int i = 0; i < 5; ++i) apply += " --input index_alpha";
    expect_bounded(apply, both);
    expect_bounded(apply + " --json", both);
  }
};

TEST_F(Memory, AnHourAtAHundredHertz) {
  const std::string glove = log("glove.csv", "index_alpha", 360000, 2, [](int k) { return 0.01 * k; });
  const std::string camera = log("camera.csv", "index_deg", 108000, 1, [](int k) { return 7 + k / 30.0; });
  ASSERT_GT(megabytes({glove, camera}), 6);
  expect_all_bounded(glove, camera);
}

TEST_F(Memory, AnExportHasNoMoreOfALongRecordingThanOfAShortOne) {
  const std::string brief = log("brief.csv", "index_deg", 3000, 1, [](int k) { return 0.01 * k; });
  const std::string hour = log("hour.csv", "index_deg", 360000, 1, [](int k) { return 0.01 * k; });
  const Finished little = run("export " + brief + " --to mcap --out brief.mcap");
  const Finished much = run("export " + hour + " --to mcap --out hour.mcap");
  EXPECT_EQ(little.exit + much.exit, 0);
  EXPECT_LE(much.peak_mb, little.peak_mb + 8);
}

TEST_F(Memory, TimesThatAreAbsurd) {
  const std::string camera = log("camera.csv", "index_deg", 3000, 1, [](int k) { return k / 30.0; });
  const auto stray = [](int k) { return k == 500 ? 2e8 : 0.05 * k; };
  const auto two_strays = [](int k) { return k == 500 || k == 900 ? 2e8 : 0.05 * k; };
  const auto jump = [](int k) { return k < 1000 ? 0.05 * k : 2e8 + 0.05 * k; };
  const auto sparse = [](int k) { return 9.9 * k; };
  const auto half_sparse = [](int k) { return 5.0 * (k - k % 2) + 0.01 * (k % 2); };
  expect_all_bounded(log("stray.csv", "index_alpha", 2000, 2, stray), camera);
  expect_all_bounded(log("two.csv", "index_alpha", 2000, 2, two_strays), camera);
  expect_all_bounded(log("jump.csv", "index_alpha", 2000, 2, jump), camera);
  expect_all_bounded(log("sparse.csv", "index_alpha", 20000, 2, sparse), camera);
  expect_all_bounded(log("half.csv", "index_alpha", 100000, 2, half_sparse), camera);
  const std::string glove = log("glove.csv", "index_alpha", 2000, 2, [](int k) { return 0.05 * k; });
  expect_all_bounded(glove, log("camera2.csv", "index_deg", 3000, 1, jump));
}

}  // namespace memory_test
}  // namespace flexor::cli
