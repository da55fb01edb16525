// A model as bytes: the interpreter gives the host's bits, whatever the model, the readings and where the bytes lie.
#include "host/deploy/model_block.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "host/deploy/gloves_test.hpp"
#include "host/io/io.hpp"
#include "host/model/random_glove.hpp"
#include "host/model/random_model.hpp"
#include "runtime/glove/block_model.hpp"

namespace flexor::deploy {
namespace {

using compensator::Loaded;

constexpr int kArena = 20000;
using InRam = compensator::Graph<core::Ram, kArena>;

Glove glove_of(model::Model model, double rate_hz) {
  Glove glove;
  model.sample_period_s = 1 / rate_hz;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].name.starts_with("joint")) model.joints[j].name = model::finger_names()[j];
  }
  for (model::Input& input : model.inputs) input.strip = "";
  glove.model = std::move(model);
  glove.sensor.fill(counts_as_they_are());
  return glove;
}

template <class Graph>
Loaded load(Graph& graph, const ModelBlock& block, const Glove& glove) {
  const std::array<std::uint16_t, kFingers> ids = calibration_ids(glove_tables(glove));
  const auto rate_hz = static_cast<std::uint8_t>(sample_rate_hz(glove.model));
  return graph.add(block.bytes.data(), static_cast<std::uint16_t>(block.bytes.size()), {ids.data(), rate_hz});
}

// Walks, jumps, stops, and readings that no sensor gives.
class Readings {
 public:
  explicit Readings(unsigned seed) : random_(seed) {}

  void next(std::array<std::int16_t, kFingers>& alpha) {
    for (std::int16_t& one : alpha) {
      const auto how = random_() % 40;
      if (how == 0) one = static_cast<std::int16_t>(random_());
      if (how == 1) one = static_cast<std::int16_t>(random_() % 2 == 0 ? INT16_MIN : INT16_MAX);
      if (how == 2) one = static_cast<std::int16_t>(32 * (random_() % 1024));
      if (how > 12)
        one = static_cast<std::int16_t>(
            std::clamp(one + static_cast<int>(random_() % 800) - 400, -32768, 32767));
    }
  }

 private:
  std::mt19937 random_;
};

void expect_equal(const Glove& glove, const ModelBlock& block, unsigned seed, int samples) {
  model::HostCompensator host(glove.model);
  InRam in_ram;
  compensator::Graph<core::Flash, kArena> in_flash;
  ASSERT_EQ(load(in_ram, block, glove), Loaded::ok);
  ASSERT_EQ(load(in_flash, block, glove), Loaded::ok);
  Readings readings(seed);
  for (int k = 0; k < samples; ++k) {
    readings.next(host.alpha);
    const std::uint8_t good = host.step();
    const auto compare = [&](auto& graph, const char* which) {
      std::ranges::copy(host.alpha, graph.alpha);
      ASSERT_EQ(graph.step(), good) << which << ", sample " << k;
      for (std::size_t f = 0; f < kFingers; ++f)
        ASSERT_EQ(graph.angle[f], host.angle[f]) << which << ", finger " << f << ", sample " << k;
    };
    compare(in_ram, "in RAM");
    compare(in_flash, "in flash");
    if (testing::Test::HasFatalFailure()) return;
  }
}

// How many were compared, of one: none where fixed point does not hold it, or no glove has it.
int compared(const Glove& glove, unsigned seed, int samples) {
  std::optional<ModelBlock> block;
  try {
    block = model_block(glove);
  } catch (const io::InputError&) {
    return 0;
  }
  expect_equal(glove, *block, seed, samples);
  return 1;
}

TEST(ModelBlock, RandomModelsGiveTheHostsBits) {
  int all = 0;
  EXPECT_TRUE(rc::check([&] {
    const auto seed = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0U, 1U << 30));
    const double rate_hz = *rc::gen::element(10.0, 20.0, 50.0, 100.0);
    all += compared(glove_of(model::RandomGlove(seed).make(), rate_hz), seed, 300);
    RC_ASSERT(!testing::Test::HasFatalFailure());
  }));
  EXPECT_GT(all, 50);
}

// A board that was flashed with this version reads what a later program sends. Where these bytes change, so does
// compensator::kGraphVersion.
TEST(ModelBlock, TheLayoutIsThatOfItsVersion) {
  const model::Model published = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  const Bytes part = model_block(glove_for({}, published, {})).bytes;
  EXPECT_EQ(compensator::kGraphVersion, 4);
  EXPECT_EQ(part.size(), 251U);
  EXPECT_EQ(core::crc16(part.data(), 251), 20786);
}

TEST(ModelBlock, EveryKindOfBlockGivesTheHostsBits) {
  int all = 0;
  for (std::size_t kind = 0; kind < std::variant_size_v<model::Kind>; ++kind) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      const model::Model model = model::RandomGlove(seed).make_with(kind);
      all += compared(glove_of(model, seed % 2 == 0 ? 10 : 100), seed, 300);
      ASSERT_FALSE(HasFatalFailure()) << "kind " << kind << ", seed " << seed;
    }
  }
  EXPECT_GT(all, 10 * static_cast<int>(std::variant_size_v<model::Kind>));
}

TEST(ModelBlock, GraphsAtTheirVeryBoundsGiveTheHostsBits) {
  int all = 0;
  for (unsigned seed = 0; seed < 6000; ++seed) {
    all += compared(glove_of(model::RandomModel(seed).make(), 50), seed, 60);
    ASSERT_FALSE(HasFatalFailure()) << "seed " << seed;
  }
  EXPECT_GT(all, 30);
}

TEST(ModelBlock, StartsAtRestAndHoldsWhatBadReadingsReach) {
  const Glove glove = plain_glove(50);
  const ModelBlock block = model_block(glove);
  InRam graph;
  ASSERT_EQ(load(graph, block, glove), Loaded::ok);
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_EQ(graph.angle[f], 16 * 30);
  std::ranges::fill(graph.alpha, static_cast<std::int16_t>(0));
  EXPECT_EQ(graph.step(), 0);
  EXPECT_EQ(graph.angle[2], 16 * 30);
  std::ranges::fill(graph.alpha, static_cast<std::int16_t>(32 * 600));
  graph.alpha[1] = 32 * 901;
  EXPECT_EQ(graph.step(), 0x1d);
  EXPECT_EQ(graph.angle[0], 16 * 50);
  EXPECT_EQ(graph.angle[1], 16 * 30);
}

// Joints that a text for VR drivers names beside the fingers' own: one that is a finger's angle too, one of its own.
TEST(ModelBlock, FurtherJointsLeaveBehindTheFingers) {
  Glove glove = plain_glove(50);
  glove.model.blocks.push_back({{"index lag"}, "index tip", model::Saturation{0, 60}});
  glove.model.joints.push_back({"index_dip", "index tip", 20, {}, model::Ends{5, 55}});
  glove.model.joints.push_back({"ring_pip", "ring angle", 30, {}, {}});
  EXPECT_EQ(model_block(glove).bytes[compensator::kOutputCount], kFingers);
  glove.output = Output::opengloves;
  glove.encoding = Encoding::beta;
  {
    const ModelBlock block = model_block(glove);
    glove::BlockModel<core::Ram, kArena> graph;
    ASSERT_EQ(load(graph, block, glove), Loaded::ok);
    std::array<compensator::Output, compensator::kOutputs> of{};
    for (std::uint8_t k = 0; k < graph.outputs(); ++k) of.at(graph.output(k).number) = graph.output(k);
    EXPECT_EQ(graph.angle[5], 16 * 20);
    std::ranges::fill(graph.alpha, static_cast<std::int16_t>(32 * 800));
    EXPECT_EQ(graph.step(), 0x1f);
    EXPECT_EQ(std::vector(graph.angle, graph.angle + 7),
              (std::vector<std::int16_t>{1280, 1280, 1280, 1280, 1280, 16 * 60, 1280}));
    EXPECT_EQ(of[5].finger, 1);
    EXPECT_EQ(of[5].place, 3);
    EXPECT_EQ(of[5].sensors, 1 << 1);
    EXPECT_EQ(of[5].open, 16 * 5);
    EXPECT_EQ(of[5].fist, 16 * 55);
    EXPECT_EQ(of[6].finger, 3);
    EXPECT_EQ(of[6].place, 2);
    EXPECT_EQ(of[0].sensors, 1);
  }
}

TEST(ModelBlock, IsRefusedWhereItDoesNotBelong) {
  const Glove glove = plain_glove(50);
  const Bytes part = model_block(glove).bytes;
  std::array<std::uint16_t, kFingers> ids = calibration_ids(glove_tables(glove));
  const auto loaded = [&](const Bytes& bytes, std::uint8_t rate_hz) {
    InRam graph;
    return graph.add(bytes.data(), static_cast<std::uint16_t>(bytes.size()), {ids.data(), rate_hz});
  };
  EXPECT_EQ(loaded(part, 50), Loaded::ok);
  EXPECT_EQ(loaded(part, 100), Loaded::other_rate);
  Bytes later = part;
  later[0] ^= 2;
  EXPECT_EQ(loaded(later, 50), Loaded::wrong_version);
  EXPECT_EQ(loaded(Bytes(part.begin(), part.end() - 1), 50), Loaded::corrupt);
  for (std::size_t i = 1; i < part.size(); ++i) {
    Bytes damaged = part;
    damaged[i] ^= 0x10;
    EXPECT_EQ(loaded(damaged, 50), Loaded::corrupt) << "byte " << i;
  }
  ids[3] ^= 1;
  EXPECT_EQ(loaded(part, 50), Loaded::other_calibration);
}

// Those that fit by docs/adr/0016-model-as-data.md.
TEST(ModelBlock, SixCurvesOfTwelveKnotsFitFlashAndNoMoreThanTheCopyHolds) {
  for (const int curves : {2, 6}) {
    const Glove glove = glove_of_shared_knots(12, curves);
    const ModelBlock block = model_block(glove);
    std::printf("12 shared knots, %d curves, a lag: %zu bytes, %d of RAM\n", curves, block.bytes.size(),
                block.state_bytes);
    const Bytes bytes = flash_block(glove);
    const auto ids = calibration_ids(glove_tables(glove));
    glove::ChannelSettings settings[kFingers] = {};
    glove::BlockModel<core::Flash, glove::kLibraryArenaBytes>
        library;  // a model that fits a board fits the Arduino library
    EXPECT_EQ(
        library.load(bytes.data(), static_cast<std::uint16_t>(bytes.size()), {ids.data(), 50}, settings),
        compensator::Loaded::ok)
        << curves;
    EXPECT_FALSE(fits_eeprom(glove)) << curves;
  }
  EXPECT_TRUE(fits_eeprom(plain_glove(50)));
  EXPECT_THROW((void)flash_block(glove_of_shared_knots(24, 6)), io::InputError);
}

}  // namespace
}  // namespace flexor::deploy
