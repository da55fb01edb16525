#include "host/deploy/model_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <set>

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
  void weight(const core::Weight& w) {
    u16(w.mantissa);
    u8(w.shift);
  }
  void operation(Operation code, int n = 0) { u8(static_cast<int>(code) | n << 4); }
};

// What the structs of graph.hpp take on the microcontroller, where a pointer is two bytes and nothing is aligned.
constexpr int kSectionRam = 7;
constexpr int kChainRam = 12;

// Some fingers of a model, as one part.
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
    mark_needed(fingers);
    if (fingers.front() == 0) mark_idle_strips();
    number_inputs();
    knots_begin_ = compensator::kHeaderBytes + compensator::kInputBytes * signals_ +
                   compensator::kOutputBytes * static_cast<int>(fingers.size());
    for (std::size_t b = 0; b < model_.blocks.size(); ++b) {
      if (needed_[inputs_ + b]) add_block(b, fingers);
    }
    close();
    if (signals_ > kMostSignals) {
      throw InputError(
          fmt::format("model {:?}: {} signals, a board's interpreter knows {} in a part: fewer blocks",
                      model_.name, signals_, kMostSignals));
    }
    finish(sample_rate_hz(glove.model), fingers);
  }

  const Bytes& bytes() const { return out_.bytes; }
  int signals() const { return signals_; }
  int ram() const { return ram_; }  // signals apart

 private:
  static constexpr int kMostSignals = 127;

  void mark_needed(const std::vector<std::size_t>& fingers) {
    needed_.resize(fixed_.signals.size(), false);
    for (const std::size_t f : fingers) {
      if (wiring_.joint[f]) needed_[fixed_.graph.joint[*wiring_.joint[f]]] = true;
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
    code_.operation(Operation::end);
    int strips = 0;
    for (const std::size_t i : open_) strips |= 1 << wiring_.strip[i];
    sections_.u8(strips);
    sections_.u16(static_cast<int>(code_.bytes.size()));
    sections_.bytes.insert(sections_.bytes.end(), code_.bytes.begin(), code_.bytes.end());
    code_.bytes.clear();
    ++section_count_;
    ram_ += kSectionRam;
  }

  void add_block(std::size_t b, const std::vector<std::size_t>& fingers) {
    const std::size_t signal = inputs_ + b;
    if (number_.contains(signal)) return;
    open(fixed_.graph.inputs[signal]);
    if (const std::optional<std::size_t> finger = finger_behind(b, fingers)) {
      // Its saturation comes with the sum.
      add_sum(b, std::get<model::FixedCoefficients<model::Sum>>(fixed_.blocks[b]).c,
              static_cast<int>(*finger) + 1);
      add_limits(joint_block(*finger));
      number_[inputs_ + joint_block(*finger)] = signals_++;
      return;
    }
    bool written = false;
    for (const std::size_t f : fingers) {
      if (!wiring_.joint[f] || fixed_.graph.joint[*wiring_.joint[f]] != signal) continue;
      // A joint's last block is its saturation, which changes nothing the second time.
      add_angle(b, f, written ? number_[signal] : source(b));
      number_[signal] = signals_++;
      written = true;
    }
    if (written) return;
    std::visit([&](const auto& one) { add_step(b, one.c); }, fixed_.blocks[b]);
    if (!number_.contains(signal)) number_[signal] = signals_++;
  }

  std::size_t joint_block(std::size_t finger) const {
    return fixed_.graph.joint[*wiring_.joint[finger]] - inputs_;
  }

  // Of a sum that nothing takes but the saturation of one finger: which.
  std::optional<std::size_t> finger_behind(std::size_t b, const std::vector<std::size_t>& fingers) const {
    if (!std::holds_alternative<model::FixedCoefficients<model::Sum>>(fixed_.blocks[b])) return {};
    std::optional<std::size_t> found;
    for (std::size_t taker = b + 1; taker < model_.blocks.size(); ++taker) {
      const std::vector<std::size_t>& from = fixed_.graph.from[taker];
      if (!needed_[inputs_ + taker] || std::ranges::find(from, inputs_ + b) == from.end()) continue;
      const auto own = [&](std::size_t f) { return wiring_.joint[f] && joint_block(f) == taker; };
      if (found || std::ranges::count_if(fingers, own) != 1) return {};
      found = *std::ranges::find_if(fingers, own);
    }
    return found;
  }

  void add_angle(std::size_t b, std::size_t finger, int from) {
    code_.operation(Operation::angle, static_cast<int>(finger));
    code_.u8(from);
    add_limits(b);
  }

  void add_limits(std::size_t b) {
    const auto& limits = std::get<model::FixedCoefficients<model::Saturation>>(fixed_.blocks[b]).c;
    code_.u16(limits.lower);
    code_.u16(limits.upper);
    code_.u8(fixed_.signals[inputs_ + b].fraction - core::kOutputFraction);
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
  void start(std::size_t b, Operation operation, int ram) {
    code_.operation(operation);
    code_.u8(source(b));
    ram_ += ram;
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
    for (std::size_t other = b; other < model_.blocks.size() && all.size() < compensator::kMostCurves;
         ++other) {
      const model::Curve::Fixed* curve = curve_of(other);
      if (curve == nullptr || !needed_[inputs_ + other] || number_.contains(inputs_ + other)) continue;
      if (fixed_.graph.from[other] == fixed_.graph.from[b] && knots_of(*curve) == knots) all.push_back(other);
    }
    code_.operation(Operation::curves, static_cast<int>(all.size()));
    code_.u16(knots);
    code_.u8(source(b));
    for (const std::size_t one : all) {
      add_values(*curve_of(one));
      number_[inputs_ + one] = signals_++;
    }
  }

  void add_values(const model::Curve::Fixed& c) {
    for (int i = 0; i < c.knots.count; ++i) {
      code_.u16(c.values.at[i].y);
      code_.u16(c.values.at[i].slope);
    }
  }

  // Weights of +-1 in steps of the output need no product: the rest of the shift comes out even.
  void add_step(std::size_t b, const model::Sum::Fixed& c) { add_sum(b, c, 0); }

  // finger: one more than that which the sum is the angle of; 0: of none.
  void add_sum(std::size_t b, const model::Sum::Fixed& c, int finger) {
    const std::vector<std::size_t>& from = fixed_.graph.from[b];
    const int unit = 1 << c.shift;
    const bool plain =
        std::all_of(c.weight, c.weight + from.size(), [&](int w) { return std::abs(w) == unit; });
    code_.operation(plain ? Operation::plain_sum : Operation::sum, finger);
    if (!plain) code_.u8(c.shift);
    code_.i32(plain ? (c.offset + unit / 2) >> c.shift : c.offset);
    code_.u8(static_cast<int>(from.size()));
    for (std::size_t i = 0; i < from.size(); ++i) {
      code_.u8(number_.at(from[i]) | (plain && c.weight[i] < 0 ? 0x80 : 0));
      if (!plain) code_.u16(c.weight[i]);
    }
  }

  void add_step(std::size_t b, const model::DeadZone::Fixed& c) {
    start(b, Operation::dead_zone, 0);
    code_.u16(c.lower);
    code_.u16(c.upper);
  }
  void add_step(std::size_t b, const model::Saturation::Fixed& c) {
    start(b, Operation::saturation, 0);
    code_.u16(c.lower);
    code_.u16(c.upper);
  }
  void add_step(std::size_t b, const model::Play::Fixed& c) {
    start(b, Operation::play, 2);
    code_.u16(c.radius);
  }
  void add_step(std::size_t b, const model::Hysteresis::Fixed& c) {
    start(b, Operation::hysteresis, 2 * compensator::kMostPlays);
    // Plays that are not there have no radius and no weight.
    for (int j = 0; j < compensator::kMostPlays; ++j) {
      code_.u16(j < c.plays.count ? c.plays.radius[j] : 0);
      code_.u16(j < c.plays.count ? c.weight[j] : 0);
    }
  }
  void add_step(std::size_t b, const model::Lag::Fixed& c) {
    start(b, Operation::lag, 4);
    code_.weight(c.share);
  }
  void add_step(std::size_t b, const model::PolePair::Fixed& c) {
    start(b, Operation::pole_pair, 10);
    for (const std::int16_t change : c.change) code_.u16(change);
    code_.u8(c.change_fraction);
    for (const std::int16_t tap : c.tap) code_.u16(tap);
    code_.u8(c.tap_fraction);
    code_.u8(c.up);
    code_.u8(c.down);
  }

  void add_step(std::size_t b, const model::Lti::Fixed& c) {
    start(b, c.is_direct ? Operation::direct : Operation::lti, kChainRam);
    code_.u16(c.gain);
    code_.u8(c.gain_shift);
    if (c.is_direct) {
      for (const std::uint16_t one : c.direct.b) code_.u16(one);
      for (const std::uint16_t one : c.direct.a) code_.u16(one);
      return;
    }
    code_.i32(c.offset);
    for (const core::Weight& weight : c.input_weight) code_.weight(weight);
    for (int i = 0; i < compensator::kMaxOrder; ++i) code_.weight(c.chain_weight[i]);
    for (const std::int16_t tap : c.tap) code_.u16(tap);
    code_.u8(c.tap_fraction);
    code_.u8(c.output_shift);
  }

  void finish(int rate_hz, const std::vector<std::size_t>& fingers) {
    out_.u8(compensator::kGraphVersion);
    out_.u16(0);
    out_.u8(rate_hz);
    out_.u8(static_cast<int>(
        std::count(needed_.begin(), needed_.begin() + static_cast<std::ptrdiff_t>(inputs_), true)));
    out_.u8(static_cast<int>(fingers.size()));
    out_.u8(static_cast<int>(knots_.size()));
    out_.u8(section_count_);
    out_.u8(signals_);
    for (std::size_t i = 0; i < inputs_; ++i) {
      if (needed_[i]) add_input(i);
    }
    for (const std::size_t f : fingers) {
      out_.u8(static_cast<int>(f) | tables_.strips[f] << 3);
      out_.u16(tables_.guard[f].rest);
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
