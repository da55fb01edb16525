#include "host/deploy/model_block.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <stdexcept>

#include "host/deploy/hardware.hpp"
#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/model/formats.hpp"
#include "runtime/core/flash_map.hpp"
#include "runtime/glove/block_model.hpp"
#include "runtime/glove/model_store.hpp"

namespace flexor::deploy {
namespace {

using compensator::Operation;
using io::InputError;

class ByteWriter {
 public:
  Bytes bytes;

  void u8(int x) { bytes.push_back(static_cast<std::uint8_t>(x)); }
  void u16(int x) {
    u8(x & 0xff);
    u8(x >> 8 & 0xff);
  }
  void i32(std::int32_t x) {
    u16(x & 0xffff);
    u16(x >> 16 & 0xffff);
  }

  // For a block's `code`.
  void i16(int x) { u16(x); }
  void words(const std::int16_t* x, int n) {
    for (int i = 0; i < n; ++i) u16(x[i]);
  }
  int curve_bytes = 0;
  void values(const compensator::Value* x, int n) {
    curve_bytes += 4 * n - 2;  // which stay where they are, and a u16 points to them
    for (int i = 0; i < n; ++i) {
      u16(x[i].y);
      u16(x[i].slope);
    }
  }
  void weight(const core::Weight& w) {
    u16(w.mantissa);
    u8(w.shift);
  }
  void within(int x, int, int) { u8(x); }
  void signal(int number, int) { u8(number); }
  void knots(int offset, int) { u16(offset); }
  bool require(bool good) {
    if (!good) throw std::logic_error("a block's number");
    return true;
  }
};

// Of compensator::Section and Input on the microcontroller, where a pointer is two bytes.
constexpr int kSectionRam = 7;
constexpr int kInputRam = 5;
constexpr int kRoom = core::kModelCopy - core::kCopyHead;

// A model as the bytes of one part.
class PartWriter {
 public:
  PartWriter(const Glove& glove, const model::FixedModel& fixed, const GloveTables& tables)
      : model_(glove.model),
        fixed_(fixed),
        wiring_(model::wiring_of(glove.model)),
        tables_(tables),
        ids_(calibration_ids(tables)),
        inputs_(glove.model.inputs.size()),
        outputs_(outputs_of(glove)) {
    std::vector<std::size_t> leaving;
    for (const BoardOutput& one : outputs_) leaving.push_back(fixed_.graph.joint[one.joint]);
    needed_ = fixed_.graph.needed_for(leaving);
    for (std::size_t i = 0; i < inputs_; ++i) {
      const bool moves = std::ranges::any_of(wiring_.sensors, [&](const std::vector<std::size_t>& sensors) {
        return std::ranges::count(sensors, wiring_.sensor[i]) > 0;
      });
      // Sensors that move no motor are watched all the same: the first part brings them.
      if (!moves) needed_[i] = true;
      if (needed_[i]) number_[i] = signals_++;
    }
    knots_begin_ = compensator::kHeaderBytes + compensator::kInputBytes * signals_ +
                   compensator::kOutputBytes * static_cast<int>(outputs_.size());
    for (std::size_t b = 0; b < model_.blocks.size(); ++b) {
      if (needed_[inputs_ + b]) add_block(b);
    }
    close();
    if (signals_ > kMostSignals) {
      throw InputError("model {:?}: {} signals, a board's interpreter knows {} in a part: fewer blocks",
                       model_.name, signals_, kMostSignals);
    }
    finish(sample_rate_hz(glove.model));
  }

  const Bytes& bytes() const { return out_.bytes; }
  int ram() const { return ram_ + kInputRam * static_cast<int>(inputs_) + 2 * signals_; }
  int moved() const { return moved_ - code_.curve_bytes; }

 private:
  static constexpr int kMostSignals = 127;

  // Blocks in a row that the same inputs reach.
  void open(const std::vector<std::size_t>& inputs) {
    if (open_ == inputs) return;
    close();
    open_ = inputs;
  }

  void close() {
    const auto inputs = std::exchange(open_, {});
    if (!inputs) return;
    code_.u8(static_cast<int>(Operation::end));
    int sensors = 0;
    for (const std::size_t i : *inputs) sensors |= 1 << wiring_.sensor[i];
    sections_.u8(sensors);
    sections_.u16(static_cast<int>(code_.bytes.size()));
    sections_.bytes.insert(sections_.bytes.end(), code_.bytes.begin(), code_.bytes.end());
    moved_ += static_cast<int>(code_.bytes.size());
    code_.bytes.clear();
    ++section_count_;
    ram_ += kSectionRam;
  }

  void add_block(std::size_t b) {
    const std::size_t signal = inputs_ + b;
    if (number_.contains(signal)) return;
    open(fixed_.graph.inputs[signal]);
    for (const BoardOutput& one : outputs_) {
      if (joint_block(one) != b) continue;
      // A joint's last block is its saturation, which changes nothing the second time.
      behind_ = &one;
      add(number_.contains(signal) ? number_[signal] : source(b), limits_of(one), 0);
      number_[signal] = signals_++;
    }
    if (number_.contains(signal)) return;
    behind_ = output_behind(b);
    std::visit([&](const auto& one) { add_step(b, one.c); }, fixed_.blocks[b]);
    if (!number_.contains(signal)) number_[signal] = signals_++;
    if (behind_ != nullptr) number_[inputs_ + joint_block(*behind_)] = number_[signal];
  }

  std::size_t joint_block(const BoardOutput& one) const { return fixed_.graph.joint[one.joint] - inputs_; }

  compensator::Saturation<std::int16_t> limits_of(const BoardOutput& one) const {
    return std::get<model::FixedCoefficients<model::Saturation>>(fixed_.blocks[joint_block(one)]).c;
  }

  // Of a block that nothing takes but the saturation of one output: which.
  const BoardOutput* output_behind(std::size_t b) const {
    const BoardOutput* found = nullptr;
    for (std::size_t taker = b + 1; taker < model_.blocks.size(); ++taker) {
      const std::vector<std::size_t>& from = fixed_.graph.from[taker];
      if (!needed_[inputs_ + taker] || std::ranges::find(from, inputs_ + b) == from.end()) continue;
      const auto own = [&](const BoardOutput& one) { return joint_block(one) == taker; };
      if (found != nullptr || std::ranges::count_if(outputs_, own) != 1) return nullptr;
      found = &*std::ranges::find_if(outputs_, own);
    }
    return found;
  }

  template <class Block>
  void add(int from, Block block, int n) {
    constexpr Operation kOperation = compensator::OperationOf<Block>::kValue;
    static_assert(kOperation != Operation::end, "in FLEXOR_BLOCKS");
    code_.u8(static_cast<int>(kOperation) | n << 4);
    code_.u8(from | (behind_ != nullptr ? compensator::kLeaves : 0));
    block.code(code_, static_cast<std::uint8_t>(n));
    ram_ += compensator::state_bytes<Block>(static_cast<std::uint8_t>(n));
    if (behind_ == nullptr) return;
    limits_of(*behind_).code(code_, 0);
    code_.u8(static_cast<int>(behind_->output.number));
    code_.u8(fixed_.signals[fixed_.graph.joint[behind_->joint]].fraction - core::kOutputFraction);
  }

  // Where the knots lie in the part, behind what each input and finger takes.
  int knots_of(const model::Curve::Fixed& c) {
    ByteWriter one;
    one.u8(c.knots.count);
    for (int i = 0; i < c.knots.count; ++i) one.u16(c.knots.x[i]);
    for (int i = 0; i < c.knots.count; ++i) one.u16(c.knots.scale[i]);
    int offset = knots_begin_;
    for (const Bytes& known : knots_) {
      if (known == one.bytes) return offset;
      offset += static_cast<int>(known.size());
    }
    knots_.push_back(one.bytes);
    return offset;
  }

  int source(std::size_t b) const { return number_.at(fixed_.graph.from[b].front()); }

  template <class Block>
  void add_step(std::size_t b, const Block& block) {
    int n = 0;
    if constexpr (requires { block.number(); }) n = block.number();
    add(source(b), block, n);
  }

  // Of every kind that fixed point holds as one; null: of none.
  const model::Curve::Fixed* curve_of(std::size_t b) const {
    return std::visit(
        []<class K>(const model::FixedCoefficients<K>& one) -> const model::Curve::Fixed* {
          if constexpr (std::is_same_v<typename K::Fixed, model::Curve::Fixed>) return &one.c;
          return nullptr;
        },
        fixed_.blocks[b]);
  }

  // With it all other curves of its signal on the same knots: they share the search for the segment.
  void add_step(std::size_t b, const model::Curve::Fixed& c) {
    const int knots = knots_of(c);
    std::vector<std::size_t> all;
    for (std::size_t other = b; other < model_.blocks.size() && all.size() < compensator::kMostNumber;
         ++other) {
      const model::Curve::Fixed* curve = curve_of(other);
      if (curve == nullptr || !needed_[inputs_ + other] || number_.contains(inputs_ + other)) continue;
      if (fixed_.graph.from[other] == fixed_.graph.from[b] && knots_of(*curve) == knots) all.push_back(other);
    }
    if (behind_ != nullptr) std::rotate(all.begin(), all.begin() + 1, all.end());  // the last leaves
    std::vector<compensator::Value> values;
    for (const std::size_t one : all) {
      const compensator::Value* at = curve_of(one)->values.at;
      values.insert(values.end(), at, at + c.knots.count);
    }
    add(source(b), compensator::Curves{static_cast<std::uint16_t>(knots), c.knots.count, values.data()},
        static_cast<int>(all.size()));
    for (const std::size_t one : all) number_[inputs_ + one] = signals_++;
  }

  // Weights of +-1 in steps of the output need no product: the rest of the shift comes out even. The first that are added.
  void add_step(std::size_t b, const model::Sum::Fixed& c) {
    std::vector<std::size_t> order(fixed_.graph.from[b].size());
    std::iota(order.begin(), order.end(), 0U);
    const int unit = 1 << c.shift;
    std::stable_partition(order.begin(), order.end(), [&](std::size_t i) { return c.weight[i] == unit; });
    const bool plain = c.weight[order.front()] == unit && std::ranges::all_of(order, [&](std::size_t i) {
                         return std::abs(c.weight[i]) == unit;
                       });
    compensator::SumOfSignals<compensator::kMostTerms> sum{};
    sum.shift = plain ? 0 : c.shift;
    sum.offset = plain ? (c.offset + unit / 2) >> c.shift : c.offset;
    sum.more = static_cast<std::uint8_t>(order.size() - 1);
    for (std::size_t k = 0; k < order.size(); ++k) {
      sum.weight[k] = c.weight[order[k]];
      sum.signal[k] = static_cast<std::uint8_t>(number_.at(fixed_.graph.from[b][order[k]]) |
                                                (plain && sum.weight[k] < 0 ? sum.kSubtracted : 0));
    }
    add(sum.signal[0], sum, 0);
  }

  void finish(int rate_hz) {
    out_.u8(compensator::kGraphVersion);
    out_.u16(0);
    out_.u8(rate_hz);
    out_.u8(static_cast<int>(
        std::count(needed_.begin(), needed_.begin() + static_cast<std::ptrdiff_t>(inputs_), true)));
    out_.u8(static_cast<int>(outputs_.size()));
    out_.u8(static_cast<int>(knots_.size()));
    out_.u8(section_count_);
    out_.u8(signals_);
    for (std::size_t i = 0; i < inputs_; ++i) {
      if (needed_[i]) add_input(i);
    }
    for (const auto& [joint, leaves] : outputs_) {
      out_.u8(leaves.number | leaves.place << 4);
      out_.u8(leaves.sensors | leaves.finger << 5);
      for (const int angle : {leaves.rest, leaves.open, leaves.fist}) out_.u16(angle);
    }
    for (const Bytes& one : knots_) out_.bytes.insert(out_.bytes.end(), one.begin(), one.end());
    out_.bytes.insert(out_.bytes.end(), sections_.bytes.begin(), sections_.bytes.end());
    const std::size_t size = out_.bytes.size() + compensator::kCrcBytes;
    out_.bytes[1] = static_cast<std::uint8_t>(size & 0xff);
    out_.bytes[2] = static_cast<std::uint8_t>(size >> 8);
    std::uint16_t crc = 0;
    for (const std::uint8_t byte : out_.bytes) crc = core::crc16_add(crc, byte);
    out_.u16(crc);
  }

  void add_input(std::size_t i) {
    const std::size_t sensor = wiring_.sensor[i];
    out_.u8(static_cast<int>(sensor) | (fixed_.signals[i].fraction - core::kInputFraction) << 4);
    out_.u16(ids_[sensor]);
    out_.u16(tables_.monitor[sensor].low);
    out_.u16(tables_.monitor[sensor].high);
    out_.u16(fixed_.valid_min[i]);
    out_.u16(fixed_.valid_max[i]);
    out_.u16(tables_.poses[sensor].open);
    out_.u16(tables_.poses[sensor].fist);
  }

  const model::Model& model_;
  const model::FixedModel& fixed_;
  model::Wiring wiring_;
  const GloveTables& tables_;
  std::array<std::uint16_t, kFingers> ids_;
  std::size_t inputs_;
  std::vector<BoardOutput> outputs_;
  const BoardOutput* behind_ = nullptr;  // what leaves with the operation that is written
  std::vector<bool> needed_;
  std::map<std::size_t, int> number_;  // of each signal, in this part
  std::vector<Bytes> knots_;
  std::optional<std::vector<std::size_t>> open_;  // inputs of the open section
  int section_count_ = 0;
  int knots_begin_ = 0;
  int signals_ = 0;
  int ram_ = 0;
  int moved_ = 0;
  ByteWriter code_;      // of the open section
  ByteWriter sections_;  // that are closed
  ByteWriter out_;
};

}  // namespace

std::array<std::uint16_t, kFingers> calibration_ids(const GloveTables& tables) {
  std::array<std::uint16_t, kFingers> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (const std::int16_t alpha : tables.calibration[i].alpha) {
      const auto bits = static_cast<std::uint16_t>(alpha);
      out[i] = core::crc16_add(out[i], static_cast<std::uint8_t>(bits & 0xff));
      out[i] = core::crc16_add(out[i], static_cast<std::uint8_t>(bits >> 8));
    }
  }
  return out;
}

void check_made_for(const Glove& glove, int rate_hz, const std::uint16_t* calibration,
                    const std::string& name) {
  const int model_rate_hz = sample_rate_hz(glove.model);
  if (model_rate_hz != rate_hz) {
    throw InputError("the model is for {} Hz, {} samples at {} Hz: --rate {}", model_rate_hz, name, rate_hz,
                     rate_hz);
  }
  const auto ids = calibration_ids(glove_tables(glove));
  const model::Wiring wiring = model::wiring_of(glove.model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.input[i] || ids[i] == calibration[i]) continue;
    throw InputError(
        "{}: {} has another calibration of this sensor: --calibration as at its deployment, or "
        "deploy and flash it again",
        model::finger_names()[i], name);
  }
}

ModelBlock model_block(const Glove& glove) {
  const model::FixedModel fixed(glove.model);
  const GloveTables tables = glove_tables(glove);
  const PartWriter part(glove, fixed, tables);
  return {part.bytes(), part.ram(), part.moved()};
}

bool fits_eeprom(const Glove& glove) {
  const ModelBlock block = model_block(glove);
  return static_cast<int>(block.bytes.size()) <= glove::kSlotRoom &&
         static_cast<int>(block.bytes.size()) + block.state_bytes <= glove::kArenaBytes;
}

double share_of_room(const model::Model& model) {
  Glove glove;
  std::vector<std::string> notes;
  try {
    glove.model = model::folded(on_hand(model, {}, notes)).model;
    const model::Wiring wiring = model::wiring_of(glove.model);
    for (std::size_t i = 0; i < glove.model.inputs.size(); ++i) {
      const model::Input& input = glove.model.inputs[i];
      glove.sensor.at(wiring.sensor[i]) = at_knots([&](double n) {
        return input.valid_min + (input.valid_max - input.valid_min) * n / sensor::kAdcTop;
      });
    }
    const ModelBlock block = model_block(glove);
    return std::max(static_cast<double>(block.bytes.size()) / kRoom,
                    static_cast<double>(block.state_bytes + block.moved_bytes) / glove::kArenaBytes);
  } catch (const InputError&) {  // another rate, other fingers: deploy reports which
    return 0;
  }
}

Bytes flash_block(const Glove& glove) {
  ModelBlock block = model_block(glove);
  const int ram = block.state_bytes + block.moved_bytes;
  if (ram > glove::kArenaBytes || static_cast<int>(block.bytes.size()) > kRoom) {
    throw InputError(
        "model {:?} is too large for an {}: {} of {} bytes of flash, {} of {} bytes of RAM: use "
        "fewer knots, or a smaller structure: identify --structure line-lead",
        glove.model.name, kAtmega328p.name, block.bytes.size(), kRoom, ram, glove::kArenaBytes);
  }
  return std::move(block.bytes);
}

}  // namespace flexor::deploy
