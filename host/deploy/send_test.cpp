#include "host/deploy/send.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "host/deploy/hardware.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/expect_test.hpp"
#include "runtime/glove/model_receiver.hpp"

namespace flexor::deploy {
namespace {

using io::expect_refused;

struct Eeprom {
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(glove::kStoreEnd, 0xff);
  std::uint8_t read(std::uint16_t address) const { return bytes.at(address); }
  bool ready() const { return true; }
  void write(std::uint16_t address, std::uint8_t byte) { bytes.at(address) = byte; }
};

Glove published() {
  return glove_for({}, model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json"),
                   key_from_hex("000102030405060708090a0b0c0d0e0f"));
}

// A glove that takes models, at the other end of a line that loses frames of either direction.
class FakeGlove {
 public:
  explicit FakeGlove(Glove glove, double loss = 0)
      : glove_(std::move(glove)), loss_(loss), ids_(calibration_ids(glove_tables(glove_))) {}

  Line line() {
    return {[this](std::span<const std::uint8_t> bytes) { take(bytes); },
            [this](double timeout_s) { return answer(timeout_s); }, [this] { return now_s_; }};
  }

  // What is stored, as it was sent.
  std::vector<std::uint8_t> stored() {
    const glove::Place place = store_.find(eeprom_);
    return {eeprom_.bytes.begin() + place.address, eeprom_.bytes.begin() + place.address + place.size};
  }
  std::vector<std::vector<std::uint8_t>> received;  // frames
  std::vector<std::vector<std::uint8_t>> sent;
  std::vector<std::uint8_t> taped;  // somebody sends this at every tenth frame,
  int tapes = 0;                    // so often
  bool deaf = false;
  int room = 1 << 20;
  int stranger_at = -1;  // after so many frames somebody without the key asks, too
  std::uint8_t rate_hz = 10;

  // Nothing but EEPROM lasts, and this converter has no noise.
  void restart() {
    nonces_ = {};
    receiver_.emplace(glove_.key ? &*glove_.key : nullptr, store_);
  }

  void take(std::span<const std::uint8_t> bytes) {
    received.emplace_back(bytes.begin(), bytes.end());
    now_s_ += 0.05;
    if (deaf || lost()) return;
    if (static_cast<int>(received.size()) == stranger_at) offer();
    for (const std::uint8_t byte : bytes) {
      if (reader_.push(byte) != link::Received::pending) continue;
      if (reader_.type() == link::Type::request) offer();
      if (reader_.type() == link::Type::coefficients) receiver_->take(reader_, eeprom_);
    }
  }

 private:
  void offer() {
    nonces_.start(store_.digest(eeprom_));
    receiver_->challenge(nonces_.next());
  }
  std::uint8_t load() {
    return static_cast<std::uint8_t>(store_.find(eeprom_).size <= room ? compensator::Loaded::ok
                                                                       : compensator::Loaded::no_room);
  }
  bool lost() { return std::generate_canonical<double, 32>(random_) < loss_; }

  std::vector<std::uint8_t> answer(double timeout_s) {
    for (int k = 0; k < 40; ++k) {
      if (receiver_->work(eeprom_)) receiver_->loaded(load());
    }
    now_s_ += std::min(timeout_s, 0.02);
    std::vector<std::uint8_t> wire(link::kMaxWire);
    wire.resize(receiver_->answer({rate_hz, ids_.data()}, 0, wire.data()));
    if (!wire.empty()) sent.push_back(wire);
    if (tapes > 0 && received.size() % 10 == 5) {
      --tapes;
      return taped;
    }
    return deaf || lost() ? std::vector<std::uint8_t>() : wire;
  }

  Glove glove_;
  double loss_;
  std::array<std::uint16_t, kFingers> ids_;
  Eeprom eeprom_;
  glove::ModelStore<Eeprom> store_{7};
  link::PacketReader reader_;
  std::optional<glove::ModelReceiver<Eeprom>> receiver_{std::in_place, glove_.key ? &*glove_.key : nullptr,
                                                        store_};
  link::NonceSource nonces_;
  std::mt19937 random_{1};
  double now_s_ = 0;
};

// published-hw of which one finger's curve has more knots.
Glove with_a_large(std::size_t finger) {
  Glove glove = published();
  model::Model& model = glove.model;
  const std::string name = model.inputs[finger].name;
  model::Curve curve;
  for (int k = 0; k < 9; ++k) {
    curve.x.push_back(model.inputs[finger].valid_min +
                      (model.inputs[finger].valid_max - model.inputs[finger].valid_min) * k / 8);
    curve.y.push_back(curve.x.back());
  }
  for (model::Block& block : model.blocks) {
    for (std::string& from : block.from) {
      if (from == name) from = "larger";
    }
  }
  model.blocks.insert(model.blocks.begin(), model::Block{{name}, "larger", curve});
  return glove;
}

TEST(Send, APartThatCannotRunLeavesTheOldOneAndIsReported) {
  FakeGlove board(published());
  send_model(board.line(), published(), {});
  const auto before = board.stored();
  EXPECT_FALSE(before.empty());
  board.room = static_cast<int>(before.size()) + 10;
  expect_refused<io::JobError>([&] { (void)send_model(board.line(), with_a_large(1), {}); },
                               "more RAM than it has; it runs its old model");
  EXPECT_EQ(board.stored(), before);
}

TEST(Send, AStrangersQuestionDoesNotEndIt) {
  const auto wanted = model_block(published()).bytes;
  for (const int at : {2, 3, 5, 8}) {
    FakeGlove board(published());
    board.stranger_at = at;
    send_model(board.line(), published(), {});
    EXPECT_EQ(board.stored(), wanted) << at;
  }
}

// The sender believes an old offer: its frames then mean nothing to the glove.
TEST(Send, AnOfferThatWasTapedDoesNotEndIt) {
  FakeGlove board(published());
  send_model(board.line(), published(), {});
  ASSERT_FALSE(board.sent.empty());
  board.taped = board.sent.front();
  board.tapes = 3;
  const Glove other = with_a_large(2);
  send_model(board.line(), other, {});
  EXPECT_EQ(board.tapes, 0);
  EXPECT_EQ(board.stored(), model_block(other).bytes);
  board.tapes = 1'000'000;
  expect_refused<std::exception>([&] { (void)send_model(board.line(), published(), {}); },
                                 "somebody else speaks to the glove again and again");
}

TEST(Send, AModelArrivesWholeWhateverTheLineLoses) {
  const auto wanted = model_block(published()).bytes;
  for (const double loss : {0.0, 0.3, 0.6}) {
    FakeGlove board(published(), loss);
    int last = -1;
    const Sent sent = send_model(board.line(), published(), [&](int done, int all) {
      EXPECT_GE(done, last);
      EXPECT_LE(done, all);
      last = done;
    });
    EXPECT_EQ(board.stored(), wanted) << loss;
    EXPECT_EQ(sent.bytes, static_cast<int>(wanted.size()));
    const int pieces = static_cast<int>((wanted.size() + link::Piece::kMost - 1) / link::Piece::kMost);
    EXPECT_GE(sent.pieces, pieces);
    EXPECT_LE(sent.pieces, loss == 0 ? 2 * pieces : 100 * pieces);
  }
}

TEST(Send, AModelThatWasSentBeforeIsNotTakenAgain) {
  FakeGlove board(published());
  (void)send_model(board.line(), published(), {});
  const auto recorded = board.received;
  const auto before = board.stored();
  Glove other = published();
  for (auto& joint : other.model.joints) joint.rest_deg += 1;
  (void)send_model(board.line(), other, {});
  const auto now = board.stored();
  EXPECT_NE(now, before);
  const Line line = board.line();
  for (const bool restarts : {false, true}) {
    if (restarts) board.restart();
    for (const auto& frame : recorded) {
      board.take(frame);
      for (int k = 0; k < 50; ++k) (void)line.read(0.1);
    }
    EXPECT_EQ(board.stored(), now) << restarts;
  }
}

TEST(Send, AGloveOfAnotherRateGetsItsModelAtThatRate) {
  FakeGlove board(published());
  board.rate_hz = 50;
  double asked_hz = 0;
  const auto at_rate = [&](double rate_hz) {
    asked_hz = rate_hz;
    Glove glove = published();
    glove.model.sample_period_s = 1 / rate_hz;
    return glove;
  };
  EXPECT_NO_THROW((void)send_model(board.line(), published(), {}, at_rate));
  EXPECT_EQ(asked_hz, 50);
  EXPECT_FALSE(board.stored().empty());
}

TEST(Send, RefusesByNameWhatTheGloveDoesNotTake) {
  FakeGlove board(published());
  const auto refuses = [&](const Glove& glove, const char* reason) {
    expect_refused<std::exception>([&] { (void)send_model(board.line(), glove, {}); }, reason);
  };
  Glove foreign = published();
  foreign.key->bytes[0] ^= 1;
  refuses(foreign, "another key");
  Glove plain = published();
  plain.key.reset();
  refuses(plain, "the glove has a key: --key");
  Glove other = published();
  other.sensor[2] = divider(47, 25, 100.0 / 180);
  refuses(other, "middle: the glove has another calibration");
  board.rate_hz = 50;
  refuses(published(), "--rate 50");
  board.deaf = true;
  refuses(published(), "nothing answers");
  EXPECT_TRUE(board.stored().empty()) << "and nothing is written";
}

TEST(Send, AGloveThatFallsSilentKeepsItsModel) {
  FakeGlove board(published());
  expect_refused<std::exception>(
      [&] { (void)send_model(board.line(), published(), [&](int done, int) { board.deaf = done > 40; }); },
      "it runs its old model");
  EXPECT_TRUE(board.stored().empty());
}

}  // namespace
}  // namespace flexor::deploy
