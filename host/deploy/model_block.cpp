#include "host/deploy/model_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "host/io/io.hpp"
#include "host/model/formats.hpp"
#include "runtime/glove/flash_model.hpp"
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
  void values(const compensator::Value* x, int n) {
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

// Of compensator::Section on the microcontroller, where a pointer is two bytes.
constexpr int kSectionRam = 7;

// Some fingers of a model and their further joints, as one part.
class PartWriter {
 public:
  PartWriter(const Glove& glove, const model::FixedModel& fixed, const GloveTables& tables,
             const std::vector<std::size_t>& fingers)
      : model_(glove.model),
        fixed_(fixed),
        wiring_(model::wiring_of(glove.model)),
        tables_(tables),
        ids_(calibration_ids(tables)),
        inputs_(glove.model.inputs.size()) {
    choose_outputs(glove, fingers);
    mark_needed();
    if (fingers.front() == 0) mark_idle_strips();
    number_inputs();
    knots_begin_ = compensator::kHeaderBytes + compensator::kInputBytes * signals_ +
                   compensator::kOutputBytes * static_cast<int>(outputs_.size());
    for (std::size_t b = 0; b < model_.blocks.size(); ++b) {
      if (needed_[inputs_ + b]) add_block(b);
    }
    close();
    if (signals_ > kMostSignals) {
      throw InputError(
          fmt::format("model {:?}: {} signals, a board's interpreter knows {} in a part: fewer blocks",
                      model_.name, signals_, kMostSignals));
    }
    finish(sample_rate_hz(glove.model));
  }

  const Bytes& bytes() const { return out_.bytes; }
  int signals() const { return signals_; }
  int ram() const { return ram_; }  // signals apart

 private:
  static constexpr int kMostSignals = 127;

  // What leaves: a finger, or a further joint of one.
  struct Leaving {
    std::size_t number;
    std::size_t finger;
    int place;
    std::optional<std::size_t> joint;
    int strips;
    int rest;
  };

  void choose_outputs(const Glove& glove, const std::vector<std::size_t>& fingers) {
    for (const std::size_t f : fingers)
      outputs_.push_back({f, f, 0, wiring_.joint[f], tables_.strips[f], tables_.guard[f].rest});
    std::size_t number = kFingers;
    for (const VrJoint& more : vr_joints(glove)) {
      const glove::JointSettings& joint = more.settings;
      if (std::ranges::find(fingers, joint.finger) != fingers.end())
        outputs_.push_back({number, joint.finger, joint.place, more.joint, joint.strips, joint.guard.rest});
      ++number;
    }
  }

  void mark_needed() {
    needed_.resize(fixed_.signals.size(), false);
    for (const Leaving& one : outputs_) {
      if (one.joint) needed_[fixed_.graph.joint[*one.joint]] = true;
    }
    for (std::size_t b = model_.blocks.size(); b-- > 0;) {
      if (!needed_[inputs_ + b]) continue;
      for (const std::size_t from : fixed_.graph.from[b]) needed_[from] = true;
    }
  }

  // Strips that move no motor are watched all the same: the first part brings them.
  void mark_idle_strips() {
    for (std::size_t i = 0; i < inputs_; ++i) {
      const bool moves = std::ranges::any_of(wiring_.strips, [&](const std::vector<std::size_t>& strips) {
        return std::ranges::find(strips, wiring_.strip[i]) != strips.end();
      });
      if (!moves) needed_[i] = true;
    }
  }

  void number_inputs() {
    for (std::size_t i = 0; i < inputs_; ++i) {
      if (needed_[i]) number_[i] = signals_++;
    }
  }

  // Blocks in a row that the same inputs reach.
  void open(const std::vector<std::size_t>& inputs) {
    if (is_open_ && inputs == open_) return;
    close();
    open_ = inputs;
    is_open_ = true;
  }

  void close() {
    if (!is_open_) return;
    is_open_ = false;
    code_.u8(static_cast<int>(Operation::end));
    int strips = 0;
    for (const std::size_t i : open_) strips |= 1 << wiring_.strip[i];
    sections_.u8(strips);
    sections_.u16(static_cast<int>(code_.bytes.size()));
    sections_.bytes.insert(sections_.bytes.end(), code_.bytes.begin(), code_.bytes.end());
    code_.bytes.clear();
    ++section_count_;
    ram_ += kSectionRam;
  }

  void add_block(std::size_t b) {
    const std::size_t signal = inputs_ + b;
    if (number_.contains(signal)) return;
    open(fixed_.graph.inputs[signal]);
    for (const Leaving& one : outputs_) {
      if (!one.joint || joint_block(one) != b) continue;
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

  std::size_t joint_block(const Leaving& one) const { return fixed_.graph.joint[*one.joint] - inputs_; }

  compensator::Saturation<std::int16_t> limits_of(const Leaving& one) const {
    return std::get<model::FixedCoefficients<model::Saturation>>(fixed_.blocks[joint_block(one)]).c;
  }

  // Of a block that nothing takes but the saturation of one output: which.
  const Leaving* output_behind(std::size_t b) const {
    const Leaving* found = nullptr;
    for (std::size_t taker = b + 1; taker < model_.blocks.size(); ++taker) {
      const std::vector<std::size_t>& from = fixed_.graph.from[taker];
      if (!needed_[inputs_ + taker] || std::ranges::find(from, inputs_ + b) == from.end()) continue;
      const auto own = [&](const Leaving& one) { return one.joint && joint_block(one) == taker; };
      if (found != nullptr || std::ranges::count_if(outputs_, own) != 1) return nullptr;
      found = &*std::ranges::find_if(outputs_, own);
    }
    return found;
  }

  template <class Block>
  void add(int from, Block block, int n) {
    using compensator::kOperationOf;
    static_assert(kOperationOf<Block> != Operation::end, "in FLEXOR_BLOCKS");
    code_.u8(static_cast<int>(kOperationOf<Block>) | n << 4);
    code_.u8(from | (behind_ != nullptr ? compensator::kLeaves : 0));
    block.code(code_, static_cast<std::uint8_t>(n));
    ram_ += compensator::state_bytes<Block>(static_cast<std::uint8_t>(n));
    if (behind_ == nullptr) return;
    limits_of(*behind_).code(code_, 0);
    code_.u8(static_cast<int>(behind_->number));
    code_.u8(fixed_.signals[fixed_.graph.joint[*behind_->joint]].fraction - core::kOutputFraction);
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
    if (behind_ != nullptr) std::ranges::rotate(all, all.begin() + 1);  // the last leaves
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
    std::ranges::stable_partition(order, [&](std::size_t i) { return c.weight[i] == unit; });
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
    for (const Leaving& one : outputs_) add_output(one);
    for (const Bytes& one : knots_) out_.bytes.insert(out_.bytes.end(), one.begin(), one.end());
    out_.bytes.insert(out_.bytes.end(), sections_.bytes.begin(), sections_.bytes.end());
    const std::size_t size = out_.bytes.size() + compensator::kCrcBytes;
    out_.bytes[1] = static_cast<std::uint8_t>(size & 0xff);
    out_.bytes[2] = static_cast<std::uint8_t>(size >> 8);
    std::uint16_t crc = 0;
    for (const std::uint8_t byte : out_.bytes) crc = core::crc16_add(crc, byte);
    out_.u16(crc);
  }

  void add_output(const Leaving& one) {
    const auto q4 = [](double deg) {
      return static_cast<int>(std::lround(std::ldexp(deg, core::kOutputFraction)));
    };
    out_.u8(static_cast<int>(one.number) | one.place << 4);
    out_.u8(one.strips | static_cast<int>(one.finger) << 5);
    out_.u16(one.rest);
    const model::Ends ends = one.joint ? model::ends(model_, model_.joints[*one.joint]) : model::Ends{};
    out_.u16(q4(ends.open_deg));
    out_.u16(q4(ends.fist_deg));
  }

  void add_input(std::size_t i) {
    const std::size_t strip = wiring_.strip[i];
    out_.u8(static_cast<int>(strip) | (fixed_.signals[i].fraction - core::kInputFraction) << 4);
    out_.u16(ids_[strip]);
    out_.u16(tables_.monitor[strip].low);
    out_.u16(tables_.monitor[strip].high);
    out_.u16(fixed_.valid_min[i]);
    out_.u16(fixed_.valid_max[i]);
    out_.u16(tables_.poses[strip].open);
    out_.u16(tables_.poses[strip].fist);
  }

  const model::Model& model_;
  const model::FixedModel& fixed_;
  model::Wiring wiring_;
  const GloveTables& tables_;
  std::array<std::uint16_t, kFingers> ids_;
  std::size_t inputs_;
  std::vector<Leaving> outputs_;
  const Leaving* behind_ = nullptr;  // what leaves with the operation that is written
  std::vector<bool> needed_;
  std::map<std::size_t, int> number_;  // of each signal, in this part
  std::vector<Bytes> knots_;
  std::vector<std::size_t> open_;  // inputs of the open section
  bool is_open_ = false;
  int section_count_ = 0;
  int knots_begin_ = 0;
  int signals_ = 0;
  int ram_ = 0;
  ByteWriter code_;      // of the open section
  ByteWriter sections_;  // that are closed
  ByteWriter out_;
};

}  // namespace

int ModelBlock::largest() const {
  std::size_t most = 0;
  for (const Bytes& part : parts) most = std::max(most, part.size());
  return static_cast<int>(most);
}

int ModelBlock::bytes() const {
  std::size_t sum = 0;
  for (const Bytes& part : parts) sum += part.size();
  return static_cast<int>(sum);
}

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
    throw InputError(fmt::format("the model is for {} Hz, {} samples at {} Hz: --rate {}", model_rate_hz,
                                 name, rate_hz, rate_hz));
  }
  const auto ids = calibration_ids(glove_tables(glove));
  const model::Wiring wiring = model::wiring_of(glove.model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.input[i] || ids[i] == calibration[i]) continue;
    throw InputError(
        fmt::format("{}: {}'s image was made for another calibration of this strip: --calibration as at its "
                    "deployment, or deploy and flash it anew",
                    model::finger_names()[i], name));
  }
}

ModelBlock model_block(const Glove& glove, int parts) {
  const model::FixedModel fixed(glove.model);
  const GloveTables tables = glove_tables(glove);
  ModelBlock out;
  int signals = 0;
  for (int p = 0; p < parts; ++p) {
    std::vector<std::size_t> fingers;
    for (std::size_t f = 0; f < model::kFingers; ++f) {
      if (parts == 1 || static_cast<int>(f) == p) fingers.push_back(f);
    }
    const PartWriter part(glove, fixed, tables, fingers);
    out.parts.push_back(part.bytes());
    out.state_bytes += part.ram();
    signals = std::max(signals, part.signals());
  }
  out.state_bytes += 2 * signals;
  return out;
}

DataBlock data_block(const Glove& glove) {
  for (const int parts : {1, kFingers}) {
    if (glove.in_flash) break;
    ModelBlock block = model_block(glove, parts);
    if (block.largest() > glove::slot_room(static_cast<std::uint8_t>(parts))) continue;
    if (block.bytes() + block.state_bytes <= kArenaBytes) return {std::move(block), false};
  }
  ModelBlock block = model_block(glove, 1);
  if (block.state_bytes > kFlashArenaBytes || block.bytes() + glove::kCopyHead > kCopyBytes) {
    throw InputError(fmt::format(
        "model {:?} is too large to be data on an atmega328p: {} of {} bytes of flash, {} of {} bytes of "
        "RAM; use "
        "fewer knots, or --model-as code",
        glove.model.name, block.bytes(), kCopyBytes - glove::kCopyHead, block.state_bytes, kFlashArenaBytes));
  }
  return {std::move(block), true};
}

std::uint16_t crc_of(const glove::ModelRecord& record) {
  std::array<std::uint8_t, offsetof(glove::ModelRecord, crc)> bytes{};
  std::memcpy(bytes.data(), &record, bytes.size());
  return core::crc16(bytes.data(), bytes.size());
}

glove::ModelRecord model_record(const Glove& glove, std::uint16_t image) {
  glove::ModelRecord record{};
  std::ranges::copy(kModelMagic, record.magic);
  record.image = image;
  record.rate_hz = static_cast<std::uint8_t>(sample_rate_hz(glove.model));
  record.version = compensator::kGraphVersion;
  std::ranges::copy(calibration_ids(glove_tables(glove)), record.calibration);
  record.copy_bytes = kCopyBytes;
  record.crc = crc_of(record);
  return record;
}

Bytes model_copy(const ModelBlock& block, std::uint16_t image, std::uint16_t generation) {
  const Bytes& part = block.parts.front();
  ByteWriter out;
  out.u16(generation);
  out.u16(static_cast<int>(part.size()));
  out.u16(0);
  out.u16(0);
  out.bytes.insert(out.bytes.end(), part.begin(), part.end());
  const std::uint16_t crc =
      glove::crc_of_copy(image, out.bytes.data(), static_cast<std::uint16_t>(part.size()));
  out.bytes[4] = static_cast<std::uint8_t>(crc & 0xff);
  out.bytes[5] = static_cast<std::uint8_t>(crc >> 8);
  return std::move(out.bytes);
}

}  // namespace flexor::deploy
