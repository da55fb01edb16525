// What the model reaches on people whom it never saw. Needs ../shared/data/hands, which is not in the repository.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "host/posture/complete.hpp"
#include "host/posture/learn.hpp"

namespace flexor::posture {
namespace {
namespace fs = std::filesystem;

constexpr int kPeople = 5;

std::vector<Input> ten_joints() {
  std::vector<Input> inputs;
  for (const int joint : {1, 2, 4, 5, 8, 9, 12, 13, 16, 17}) inputs.push_back({std::to_string(joint), {joint}});
  return inputs;
}

std::vector<Input> five_bends() {
  return {{"thumb", {1, 2}}, {"index", {4, 5}}, {"middle", {8, 9}}, {"ring", {12, 13}}, {"pinky", {16, 17}}};
}

enum class Shown { nothing, rest, first_of_file, pieces };

struct Figures {
  Hand rmse_deg = Hand::Zero();  // mean over people
  double within_68 = 0;          // share of joints and rows
  double within_95 = 0;
  double refused = 0;            // share of readings
};

class RecordedHands : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const fs::path folder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/hands";
    if (!fs::exists(folder)) return;
    for (int i = 1; i <= kPeople; ++i) people().push_back(read_recorded(folder / fmt::format("subject{}.csv", i)));
    for (std::size_t i = 0; i < kPeople; ++i) {
      std::vector<Recorded> others = people();
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      postures().push_back(learn(others, 1, [](const auto&, auto, auto) {}));
    }
  }
  void SetUp() override {
    if (people().empty()) GTEST_SKIP() << "needs ../shared/data/hands, which is not part of the repository";
  }
  static std::vector<Recorded>& people() {
    static std::vector<Recorded> all;
    return all;
  }
  static std::vector<Posture>& postures() {
    static std::vector<Posture> all;
    return all;
  }

  static void show(Completer& completer, const Recorded& r, Shown shown) {
    double begin_s = r.t_s.front();
    for (std::size_t i = 0; i < r.t_s.size(); ++i) {
      const bool starts = i > 0 && r.t_s[i] < r.t_s[i - 1];
      if (starts && shown == Shown::first_of_file) return;
      if (starts) begin_s = r.t_s[i];
      const double since_s = r.t_s[i] - begin_s;
      const double step_s = i == 0 || starts ? 0 : r.t_s[i] - r.t_s[i - 1];
      const bool resting = since_s <= kRest_s;
      const bool piece = shown == Shown::pieces && since_s >= 5 && since_s < 6;
      if (resting || piece) completer.show(r.hands_deg.row(static_cast<Eigen::Index>(i)).transpose(), step_s);
    }
  }

  static void score(const Recorded& r, Completer& completer, const InputMatrix& matrix, Figures& figures,
                    std::size_t lost) {
    constexpr Eigen::Index kEvery = 7;
    Hand square = Hand::Zero();
    double inside_68 = 0;
    double inside_95 = 0;
    double refused = 0;
    double rows = 0;
    for (Eigen::Index row = 0; row < r.hands_deg.rows(); row += kEvery, ++rows) {
      const Hand hand = r.hands_deg.row(row).transpose();
      Eigen::VectorXd readings = matrix * hand.matrix();
      if (lost < 5) readings[static_cast<Eigen::Index>(lost)] = std::nan("");
      const Estimate estimate = completer.complete(readings);
      const Hand error = (estimate.angle_deg - hand).abs();
      square += error.square();
      inside_68 += (error <= estimate.se_deg).cast<double>().mean();
      inside_95 += (error <= 1.96 * estimate.se_deg).cast<double>().mean();
      for (const Quality q : estimate.quality) refused += q == Quality::implausible ? 1 : 0;
    }
    figures.rmse_deg += (square / rows).sqrt() / kPeople;
    figures.within_68 += inside_68 / rows / kPeople;
    figures.within_95 += inside_95 / rows / kPeople;
    figures.refused += refused / rows / static_cast<double>(matrix.rows()) / kPeople;
  }

  static Figures figures(const std::vector<Input>& inputs, Shown shown, const char* what, std::size_t lost = 9) {
    Figures out;
    for (std::size_t i = 0; i < kPeople; ++i) {
      Completer completer(postures()[i], inputs, shown != Shown::nothing);
      if (shown != Shown::nothing) show(completer, people()[i], shown);
      score(people()[i], completer, input_matrix(inputs), out, lost);
    }
    fmt::print("{}: {:.2f} deg, within one se {:.1f} %, within 1.96 {:.1f} %, refused {:.2f} % of readings\n", what,
               out.rmse_deg.mean(), 100 * out.within_68, 100 * out.within_95, 100 * out.refused);
    std::fflush(stdout);
    return out;
  }
};

TEST_F(RecordedHands, FiveBends) {
  figures(five_bends(), Shown::nothing, "five bends");
  figures(five_bends(), Shown::rest, "five bends after a resting pose");
  figures(five_bends(), Shown::first_of_file, "five bends after a quarter of a second");
  figures(five_bends(), Shown::pieces, "five bends after 20 s of the whole hand");
}
TEST_F(RecordedHands, TenJoints) {
  figures(ten_joints(), Shown::nothing, "ten joints");
  figures(ten_joints(), Shown::rest, "ten joints after a resting pose");
  figures(ten_joints(), Shown::first_of_file, "ten joints after a quarter of a second");
}

}  // namespace
}  // namespace flexor::posture
