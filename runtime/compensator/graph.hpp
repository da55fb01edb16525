// A compensator as data: an interpreter that runs the blocks of runtime/compensator from a string of bytes, with
// the bits of the compiled variant (host/deploy/compensator_text.hpp) and of the host's model::Compensator.
//
// A graph is one to kMaxParts parts, each a string of bytes that computes some of the fingers from some of the
// strips. Numbers are little-endian.
//
//   version u8, size u16, rate_hz u8, inputs u8, outputs u8, knots u8, sections u8, signals u8
//   input     strip | refinement << 4, calibration u16, low u16, high u16 (counts of the monitor), valid_min i16,
//             valid_max i16, open hand i16, fist i16 (Q5; equal: not known)
//   output    finger | strips << 3 (a bit each), rest i16 (Q4)
//   knots     count u8, x i16 of each, scale u16 of each
//   section   strips (a bit each), size u16 of what follows: operations
//   CRC-16 of all before
//
// A section runs when the readings of its strips are all valid, and holds its states else. Signals are numbered: the
// inputs, then the results of operations in their order. An operation is its code, with a number of its own in the upper
// four bits, the signals it takes, and its coefficients: see Operation.
#pragma once

#include "runtime/compensator/blocks.hpp"
#include "runtime/core/crc16.hpp"
#include "runtime/core/memory.hpp"

namespace flexor {
namespace compensator {

constexpr uint8_t kMaxParts = 5;
constexpr uint8_t kStrips = 5;
constexpr uint8_t kGraphVersion = 3;
constexpr uint8_t kInputCount = 4;  // places in a part
constexpr uint8_t kOutputCount = 5;
constexpr uint8_t kHeaderBytes = 9;
constexpr uint8_t kInputBytes = 15;
constexpr uint8_t kOutputBytes = 3;
constexpr uint8_t kCrcBytes = 2;
constexpr uint8_t kMostKnots = 32;
constexpr uint8_t kMostPlays = 4;
constexpr uint8_t kMostCurves = 15;  // of an operation

// In brackets the upper four bits. A weight is its mantissa u16 and its shift u8. Each gives one signal, curves one each.
enum class Operation : uint8_t {
  curves,  // [how many] where their knots lie in the part u16, signal, and of each curve y and slope i16 of each knot
  sum,         // [0, or finger + 1] shift, offset i32, n, n times signal and weight i16; an angle's limits
  plain_sum,   // [0, or finger + 1] offset i32, n, n times signal, | 0x80 to subtract; an angle's limits
  dead_zone,   // signal, lower i16, upper i16
  saturation,  // signal, lower i16, upper i16
  play,        // signal, radius i16
  hysteresis,  // signal, 4 times radius i16 and weight i16
  lag,         // signal, weight
  lti,  // signal, gain i16, gain shift i8, offset i32, 3 + 3 weights, 3 taps i16, their fraction, output shift
  direct,     // signal, gain i16, gain shift i8, 3 b u16, 3 a u16
  pole_pair,  // signal, 4 changes i16, their fraction, 2 taps i16, their fraction, up, down
  angle,  // [finger] signal, lower i16, upper i16, shift i8: a saturation, which leaves as the finger's angle
  end,    // of a section
};

enum class Loaded : uint8_t {
  ok,
  wrong_version,
  corrupt,            // size or CRC
  other_calibration,  // made for other sensors
  other_rate,
  malformed,  // what this version cannot mean
  no_room,
};

// Reads on from a place.
template <class Place>
struct Bytes {
  const uint8_t* at;

  FLEXOR_INLINE uint8_t u8() { return Place::next_byte(at); }
  FLEXOR_INLINE int8_t i8() { return static_cast<int8_t>(u8()); }
  FLEXOR_INLINE uint16_t u16() { return Place::next_word(at); }
  FLEXOR_INLINE int16_t i16() { return static_cast<int16_t>(u16()); }
  FLEXOR_INLINE int32_t i32() {
    const uint16_t half[] = {u16(), u16()};
    int32_t x;
    __builtin_memcpy(&x, half, sizeof(x));  // a compiler would shift
    return x;
  }
  FLEXOR_INLINE core::Weight weight() {
    const uint16_t mantissa = u16();
    return {mantissa, u8()};
  }
};

// Bytes that sections and their states are laid out in, and parts that lie in RAM.
class Arena {
 public:
  Arena(uint8_t* begin, uint16_t size) : next_(begin), end_(begin + size) {}

  // Null where it does not fit.
  FLEXOR_SHARED uint8_t* take(uint16_t bytes) {
    uint8_t* const taken = aligned(next_);
    if (taken > end_ || bytes > static_cast<uint16_t>(end_ - taken)) return nullptr;
    next_ = taken + bytes;
    return taken;
  }
  template <class T>
  T* take_all(uint8_t count) {
    return reinterpret_cast<T*>(take(static_cast<uint16_t>(count * sizeof(T))));
  }

  // The next place that any state may lie at: on a microcontroller each is.
  static uint8_t* aligned(uint8_t* at) {
#ifdef __AVR__
    return at;
#else
    return at + (8 - reinterpret_cast<uintptr_t>(at) % 8) % 8;
#endif
  }

  // Gives up what is beyond `size` bytes from the end.
  bool keep(uint8_t* end) {
    if (end < next_) return false;
    end_ = end;
    return true;
  }
  uint8_t* next() const { return next_; }

 private:
  uint8_t* next_;
  uint8_t* end_;
};

struct Section {
  const uint8_t* code;
  uint8_t* own;  // states of its operations, in their order
  uint8_t strips;
  uint8_t signal;  // of its first operation
  bool started;
};

struct Part {
  const uint8_t* begin;
  Section* sections;
  uint8_t input_count;
  uint8_t section_count;
};

// On a microcontroller one graph runs at a time, and what is at a fixed place is quickly reached.
#ifdef __AVR__
#define FLEXOR_PER_THREAD
#else
#define FLEXOR_PER_THREAD thread_local
#endif

const uint8_t kBits[] FLEXOR_IN_FLASH = {1, 2, 4, 8, 16};
static_assert(sizeof(kBits) == kStrips && kStrips == kMaxParts, "a bit for each strip and finger");
FLEXOR_INLINE uint8_t bit_of(uint8_t n) { return core::Flash::byte(kBits + n); }

// Where a section's run is: the states of its next operation, and where its results go.
template <class Place>
struct Machine {
  uint8_t* own;  // state of the next operation
  int16_t* out;  // the next signal
  const int16_t* signal;
  const uint8_t* part;
  int16_t* angle;
  bool first;  // sample: states start
  uint8_t good;
};

// Operations, each out of line: from what lies behind its code to what lies behind it.
template <class Place>
struct Step {
  using In = Bytes<Place>;
  static FLEXOR_PER_THREAD Machine<Place> m;

  // States lie one behind the other, as the loader has taken them.
  template <class State>
  FLEXOR_INLINE static State& next() {
    uint8_t* const state = Arena::aligned(m.own);
    m.own = state + sizeof(State);
    return *reinterpret_cast<State*>(state);
  }

  FLEXOR_INLINE static In end(In in, int16_t result) {
    *m.out++ = result;
    return in;
  }

  template <class Block>
  FLEXOR_INLINE static In end(In in, const Block& block, int16_t u) {
    typename Block::State& state = next<typename Block::State>();
    if (m.first) block.start(state, u);
    return end(in, block.step(state, u));
  }

  FLEXOR_SHARED static In curves(In in, uint8_t n) {
    In knots{m.part + in.u16()};
    const int16_t u = m.signal[in.u8()];
    const uint8_t count = knots.u8();
    const core::Words<Place, int16_t> x{knots.at};
    const Segment on = segment_of(x, core::Words<Place, uint16_t>{(x + count).at}, count, u);
    return {values_in<Place>(in.at, static_cast<uint8_t>(4 * count), on, m.out, n)};
  }

  // What leaves as a finger's angle.
  FLEXOR_SHARED static In end_angle(In in, uint8_t finger, int16_t u) {
    const int16_t lower = in.i16();
    const int16_t y = Saturation<int16_t>{lower, in.i16()}(u);
    m.angle[finger] = core::to_output(y, in.i8());
    m.good = static_cast<uint8_t>(m.good | bit_of(finger));
    return end(in, y);
  }

  // A sum that is a finger's angle, one more than `number`: limits and shift follow.
  FLEXOR_INLINE static In end_sum(In in, uint8_t number, int16_t y) {
    return number > 0 ? end_angle(in, static_cast<uint8_t>(number - 1), y) : end(in, y);
  }

  FLEXOR_SHARED static In sum(In in, uint8_t number) {
    const uint8_t shift = in.u8();
    int32_t y = in.i32();
    for (uint8_t n = in.u8(); n > 0; --n) {
      const int16_t u = m.signal[in.u8()];
      y += core::multiply_signed(in.i16(), u);
    }
    return end_sum(in, number, core::narrow(core::round_shift(y, shift)));
  }

  FLEXOR_SHARED static In plain_sum(In in, uint8_t number) {
    int32_t y = in.i32();
    for (uint8_t n = in.u8(); n > 0; --n) {
      const uint8_t term = in.u8();
      const int16_t u = m.signal[term & 0x7f];
      if ((term & 0x80) == 0) y += u;
      if ((term & 0x80) != 0) y -= u;
    }
    return end_sum(in, number, core::narrow(y));
  }

  template <class Block>
  FLEXOR_INLINE static int16_t limited(In& in) {
    const int16_t u = m.signal[in.u8()];
    const int16_t lower = in.i16();
    return Block{lower, in.i16()}(u);
  }
  FLEXOR_SHARED static In dead_zone(In in, uint8_t) {
    const int16_t y = limited<DeadZone<int16_t>>(in);
    return end(in, y);
  }
  FLEXOR_SHARED static In saturation(In in, uint8_t) {
    const int16_t y = limited<Saturation<int16_t>>(in);
    return end(in, y);
  }
  FLEXOR_SHARED static In angle(In in, uint8_t finger) {
    const int16_t u = m.signal[in.u8()];
    return end_angle(in, finger, u);
  }

  FLEXOR_SHARED static In play(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    const Play<int16_t> c{in.i16()};
    return end(in, c, u);
  }

  FLEXOR_SHARED static In lag(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    const FixedLag c{in.weight()};
    return end(in, c, u);
  }

  using Hysteresis = FixedHysteresis<kMostPlays>;
  FLEXOR_SHARED static In hysteresis(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    int32_t sum = 0;
    for (int16_t& p : next<typename Hysteresis::State>().p) {
      const int16_t radius = in.i16();
      p = m.first ? u : moved(p, u, radius);
      sum += Hysteresis::term(in.i16(), core::subtract(p, u));
    }
    return end(in, Hysteresis::total(u, sum));
  }

  // Rows of coefficients, out of line: a compiler would write each out.
  template <class Number>
  FLEXOR_SHARED static In words(In in, Number* out, uint8_t n) {
    for (; n > 0; --n) *out++ = static_cast<Number>(in.u16());
    return in;
  }

  FLEXOR_INLINE static int32_t weighted(const uint8_t* weights, uint8_t n, int32_t difference) {
    return Bytes<Place>{weights + 3 * n}.weight().times(difference);
  }

  // FixedLti of kMaxOrder in loops: each coefficient is read where it lies.
  using Chain = FixedLti<kMaxOrder, true>;
  FLEXOR_SHARED static In lti(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    const int16_t gain = in.i16();
    int32_t w = scaled_by(u, gain, in.i8());
    w += in.i32();
    int32_t* const x = next<typename Chain::State>().x;
    for (uint8_t i = 0; m.first && i < kMaxOrder; ++i) x[i] = w;
    const uint8_t* weights = in.at;
    in.at += 3 * (kMaxOrder + kMaxOrder);
    // From the last state to the first: a state needs the old values of those before it.
    for (uint8_t i = kMaxOrder; i-- > 0;) {
      int32_t way = weighted(weights, i, w - x[i]);
      for (uint8_t j = 0; j < i; ++j)
        way += weighted(weights, static_cast<uint8_t>(kMaxOrder + chain_index(i, j)), x[j] - x[i]);
      x[i] += way;
    }
    const int32_t last = x[kMaxOrder - 1];
    int32_t y = last;
    int32_t from = w;
    const uint8_t fraction = Place::byte(in.at + 2 * kMaxOrder);
    for (uint8_t i = 0; i < kMaxOrder; from = x[i++]) y += Chain::tapped(in.i16(), fraction, from - last);
    in.u8();
    const uint8_t shift = in.u8();  // before `in` is passed on: arguments have no order
    return end(in, core::narrow(core::round_shift(y, shift)));
  }

  FLEXOR_SHARED static In direct(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    Chain c;
    c.gain = in.i16();
    c.gain_shift = in.i8();
    c.offset = 0;
    c.is_direct = true;
    for (uint16_t& b : c.direct.b) b = in.u16();
    for (uint16_t& a : c.direct.a) a = in.u16();
    return end(in, c, u);
  }

  FLEXOR_SHARED static In pole_pair(In in, uint8_t) {
    const int16_t u = m.signal[in.u8()];
    FixedPolePair c;
    in = words(in, c.change, 4);
    c.change_fraction = in.u8();
    in = words(in, c.tap, 2);
    c.tap_fraction = in.u8();
    c.up = in.u8();
    c.down = in.u8();
    return end(in, c, u);
  }

  // Operations up to the section's end.
  FLEXOR_INLINE static void run(In in) {
    for (;;) {
      const uint8_t code = in.u8();
      if (code == static_cast<uint8_t>(Operation::end)) return;
      in = one(static_cast<uint8_t>(code & 15))(in, upper_nibble(code));
    }
  }

 private:
  using Operator = In (*)(In, uint8_t);

  FLEXOR_INLINE static Operator one(uint8_t operation) {
    // In the order of Operation.
    static const Operator kOperators[] FLEXOR_IN_FLASH = {
        curves, sum, plain_sum, dead_zone, saturation, play, hysteresis, lag, lti, direct, pole_pair, angle};
#ifdef __AVR__
    return reinterpret_cast<Operator>(pgm_read_word(kOperators + operation));
#else
    return kOperators[operation];
#endif
  }

  FLEXOR_INLINE static uint8_t upper_nibble(uint8_t code) {
#ifdef __AVR__
    return __builtin_avr_swap(code) & 15;  // the compiler would shift bit by bit
#else
    return static_cast<uint8_t>(code >> 4);
#endif
  }
};

template <class Place>
FLEXOR_PER_THREAD Machine<Place> Step<Place>::m;

// What a part must have been made for.
struct MadeFor {
  const uint16_t* calibration;  // of each strip
  uint8_t rate_hz;
};

// What an operation consists of behind its code: so many bytes that may be anything, or one of these.
namespace field {

constexpr uint8_t kKnots = 32;  // where they lie
constexpr uint8_t kSignal = 33;
constexpr uint8_t kSignedSignal = 34;  // | 0x80
constexpr uint8_t kTimes = 35;         // what follows comes so often
constexpr uint8_t kEnd = 36;
constexpr uint8_t kRange = 37;  // and above: a number within one of kRanges
constexpr uint8_t kWeightShift = kRange;
constexpr uint8_t kGainShift = kRange + 1;
constexpr uint8_t kProductFraction = kRange + 2;
constexpr uint8_t kTapFraction = kRange + 3;
constexpr uint8_t kShift = kRange + 4;
constexpr uint8_t kOutputShift = kRange + 5;

constexpr uint8_t below_zero(int shift) { return static_cast<uint8_t>(256 - shift); }

const uint8_t kRanges[] FLEXOR_IN_FLASH = {0, 31, below_zero(16), 15, 0, 47, 0, 16,
                                           1, 30, below_zero(12), 15};

// In the order of Operation. A curve's values are as many as its knots.
const uint8_t kFields[] FLEXOR_IN_FLASH = {
    // curves
    kKnots, kSignal, kEnd,
    // sum
    kShift, 4, kTimes, kSignal, 2, kEnd,
    // plain sum
    4, kTimes, kSignedSignal, kEnd,
    // dead zone
    kSignal, 4, kEnd,
    // saturation
    kSignal, 4, kEnd,
    // play
    kSignal, 2, kEnd,
    // hysteresis
    kSignal, 16, kEnd,
    // lag
    kSignal, 2, kWeightShift, kEnd,
    // lti
    kSignal, 2, kGainShift, 6, kWeightShift, 2, kWeightShift, 2, kWeightShift, 2, kWeightShift, 2,
    kWeightShift, 2, kWeightShift, 6, kTapFraction, kShift, kEnd,
    // direct
    kSignal, 2, kGainShift, 12, kEnd,
    // pole pair
    kSignal, 8, kProductFraction, 4, kProductFraction, kTapFraction, kShift, kEnd,
    // angle
    kSignal, 4, kOutputShift, kEnd};

inline const uint8_t* of(uint8_t operation) {
  const uint8_t* fields = kFields;
  while (operation > 0) {
    if (core::Flash::byte(fields++) == kEnd) --operation;
  }
  return fields;
}

}  // namespace field

// Checks a part, whatever its bytes are, and lays out what it needs: after it no step reads or writes elsewhere. Bytes
// that Flexor did not write may give any angle.
template <class Place>
class Loader {
 public:
  Loader(const uint8_t* bytes, uint16_t size, Arena& arena) : begin_(bytes), size_(size), arena_(arena) {}

  FLEXOR_SHARED Loaded load(const MadeFor& made_for, Part& part) {
    const Loaded head = check_head(made_for);
    if (head != Loaded::ok) return head;
    Bytes<Place> in{begin_ + kInputCount};
    inputs_ = in.u8();
    const uint8_t outputs = in.u8();
    const uint8_t knots = in.u8();
    const uint8_t sections = in.u8();
    end_ = begin_ + size_ - kCrcBytes;
    at_ = in.at + 1;
    part.begin = begin_;
    part.input_count = inputs_;
    part.section_count = sections;
    signals_ = inputs_;
    const Loaded fits = check_inputs(made_for.calibration);
    if (fits != Loaded::ok) return fits;
    if (!check_outputs(outputs)) return Loaded::malformed;
    part.sections = arena_.template take_all<Section>(sections);
    if (part.sections == nullptr) return Loaded::no_room;
    knots_ = at_;
    for (; knot_tables_ < knots; ++knot_tables_) {
      if (!check_knots()) return Loaded::malformed;
    }
    for (uint8_t i = 0; i < sections; ++i) {
      const Loaded one = load_section(part.sections[i]);
      if (one != Loaded::ok) return one;
    }
    return at_ == end_ && signals_ == signals() ? Loaded::ok : Loaded::malformed;
  }

  uint8_t signals() const { return Place::byte(begin_ + kHeaderBytes - 1); }

 private:
  Loaded check_head(const MadeFor& made_for) const {
    if (size_ < kHeaderBytes + kCrcBytes) return Loaded::corrupt;
    Bytes<Place> in{begin_};
    if (in.u8() != kGraphVersion) return Loaded::wrong_version;
    if (in.u16() != size_) return Loaded::corrupt;
    uint16_t crc = 0;
    for (uint16_t i = 0; i < size_ - kCrcBytes; ++i) crc = core::crc16_add(crc, Place::byte(begin_ + i));
    if (Place::word(begin_ + size_ - kCrcBytes) != crc) return Loaded::corrupt;
    return in.u8() == made_for.rate_hz ? Loaded::ok : Loaded::other_rate;
  }

  bool has(uint16_t count) const { return count <= static_cast<uint16_t>(end_ - at_); }
  FLEXOR_SHARED bool skip(uint16_t count) {
    if (!has(count)) return false;
    at_ += count;
    return true;
  }

  Loaded check_inputs(const uint16_t* calibration) {
    if (inputs_ > kStrips) return Loaded::malformed;
    for (uint8_t i = 0; i < inputs_; ++i) {
      if (!has(kInputBytes)) return Loaded::malformed;
      const uint8_t first = Place::byte(at_);
      const uint8_t strip = first & 15;
      if (strip >= kStrips || first >> 4 > 8) return Loaded::malformed;
      if (Place::word(at_ + 1) != calibration[strip]) return Loaded::other_calibration;
      at_ += kInputBytes;
    }
    return Loaded::ok;
  }
  bool check_outputs(uint8_t outputs) {
    for (uint8_t i = 0; i < outputs; ++i) {
      if (!has(kOutputBytes) || (Place::byte(at_) & 7) >= kMaxParts) return false;
      at_ += kOutputBytes;
    }
    return true;
  }

  bool check_knots() {
    if (!has(1)) return false;
    const uint8_t count = Place::byte(at_);
    const core::Words<Place, int16_t> x{at_ + 1};
    if (count < 2 || count > kMostKnots || !skip(knots_bytes(count))) return false;
    for (uint8_t i = 0; i + 1 < count; ++i) {
      if (x[i] >= x[static_cast<uint8_t>(i + 1)]) return false;
    }
    return true;
  }
  static uint16_t knots_bytes(uint8_t count) { return static_cast<uint16_t>(1 + 4 * count); }

  // How many knots lie at the offset; 0: none begin there.
  uint8_t knots_at(uint16_t offset) const {
    const uint8_t* at = knots_;
    for (uint8_t i = 0; i < knot_tables_; ++i) {
      const uint8_t count = Place::byte(at);
      if (at == begin_ + offset) return count;
      at += knots_bytes(count);
    }
    return 0;
  }

  Loaded load_section(Section& section) {
    if (!has(3)) return Loaded::malformed;
    Bytes<Place> in{at_};
    section.strips = in.u8();
    const uint16_t size = in.u16();
    at_ = in.at;
    if (!has(size)) return Loaded::malformed;
    section.code = at_;
    section.own = arena_.next();
    section.signal = signals_;
    section.started = false;
    if (size == 0 || Place::byte(at_ + size - 1) != static_cast<uint8_t>(Operation::end))
      return Loaded::malformed;
    const uint8_t* const end = end_;
    // Up to that byte, which no operation before it may take for a number of its own.
    end_ = at_ + size - 1;
    Loaded loaded = Loaded::ok;
    while (at_ < end_ && loaded == Loaded::ok) loaded = load_operation();
    end_ = end;
    ++at_;
    return loaded;
  }

  Loaded load_operation() {
    const uint8_t code = Place::byte(at_++);
    const uint8_t n = static_cast<uint8_t>(code >> 4);
    const Operation operation = static_cast<Operation>(code & 15);
    if (operation >= Operation::end) return Loaded::malformed;
    if (!check(field::of(code & 15))) return Loaded::malformed;
    if (operation == Operation::angle && n >= kMaxParts) return Loaded::malformed;
    if ((operation == Operation::sum || operation == Operation::plain_sum) && n > 0) {
      if (n > kMaxParts || !skip(4) || !check_field(field::kOutputShift)) return Loaded::malformed;
    }
    if (operation == Operation::curves) {
      const uint16_t bytes = static_cast<uint16_t>(n * 4 * knots_at(Place::word(at_ - 3)));
      if (n == 0 || !skip(bytes) || n > 255 - signals_) return Loaded::malformed;
      signals_ = static_cast<uint8_t>(signals_ + n);
      return Loaded::ok;
    }
    if (++signals_ == 0) return Loaded::malformed;  // more than 255
    return arena_.take(state_bytes(operation)) != nullptr ? Loaded::ok : Loaded::no_room;
  }

  static uint8_t state_bytes(Operation operation) {
    switch (operation) {
      case Operation::play:
        return sizeof(Play<int16_t>::State);
      case Operation::hysteresis:
        return sizeof(FixedHysteresis<kMostPlays>::State);
      case Operation::lag:
        return sizeof(FixedLag::State);
      case Operation::lti:
      case Operation::direct:
        return sizeof(FixedLti<kMaxOrder, true>::State);
      case Operation::pole_pair:
        return sizeof(FixedPolePair::State);
      default:
        return 0;
    }
  }

  // The numbers of an operation, field after field.
  bool check(const uint8_t* fields) {
    const uint8_t* repeated = nullptr;
    uint8_t times = 1;
    for (;;) {
      const uint8_t one = core::Flash::byte(fields++);
      if (one == field::kEnd) {
        if (times < 2) return true;
        --times;
        fields = repeated;
      } else if (one == field::kTimes) {
        if (!has(1)) return false;
        times = Place::byte(at_++);
        if (times == 0) return true;
        repeated = fields;
      } else if (!check_field(one)) {
        return false;
      }
    }
  }

  bool check_field(uint8_t one) {
    if (one < field::kKnots) return skip(one);
    if (one == field::kKnots) return skip(2) && knots_at(Place::word(at_ - 2)) > 0;
    if (!has(1)) return false;
    const uint8_t byte = Place::byte(at_++);
    if (one == field::kSignal) return byte < signals_;
    if (one == field::kSignedSignal) return (byte & 0x7f) < signals_;
    const uint8_t* const range = field::kRanges + 2 * (one - field::kRange);
    const int8_t value = static_cast<int8_t>(byte);
    return value >= static_cast<int8_t>(core::Flash::byte(range)) &&
           value <= static_cast<int8_t>(core::Flash::byte(range + 1));
  }

  const uint8_t* begin_;
  uint16_t size_;
  const uint8_t* at_ = nullptr;
  const uint8_t* end_ = nullptr;
  const uint8_t* knots_ = nullptr;
  Arena& arena_;
  uint8_t inputs_ = 0;
  uint8_t signals_ = 0;
  uint8_t knot_tables_ = 0;
};

// Place: where the parts lie. kArena: bytes for everything else that all parts need, and for the parts themselves where
// they were reserved here.
template <class Place, uint16_t kArena>
class Graph {
 public:
  int16_t alpha[kStrips] = {};    // Q5, in
  int16_t angle[kMaxParts] = {};  // Q4 of each finger, out; kept where a reading is bad

  // Forgets all parts. The angles stay.
  void clear() {
    arena_ = Arena(memory_, kArena);
    parts_ = 0;
    most_signals_ = 0;
  }

  // Room for a part's bytes that lie in RAM; null: there is not as much. Valid until clear().
  uint8_t* reserve(uint16_t size) { return arena_.take(size); }

  // `bytes` outlive the part. Unless it is ok, only clear() helps.
  Loaded add(const uint8_t* bytes, uint16_t size, const MadeFor& made_for) {
    if (parts_ == kMaxParts) return Loaded::no_room;
    Loader<Place> loader(bytes, size, arena_);
    const Loaded loaded = loader.load(made_for, part_[parts_]);
    if (loaded != Loaded::ok) return loaded;
    if (loader.signals() > most_signals_) {
      most_signals_ = loader.signals();
      if (!arena_.keep(reinterpret_cast<uint8_t*>(signals()))) return Loaded::no_room;
    }
    rest(part_[parts_++], Place::byte(bytes + kOutputCount));
    return Loaded::ok;
  }

  // One sample: a bit for each finger whose readings were all valid.
  uint8_t step() {
    uint8_t good = 0;
    for (uint8_t p = 0; p < parts_; ++p) good = static_cast<uint8_t>(good | run(part_[p], read(part_[p])));
    return good;
  }

 private:
  // At the end of the arena, and the same for all parts: no signal is kept from sample to sample.
  int16_t* signals() { return reinterpret_cast<int16_t*>(memory_ + kArena) - most_signals_; }

  // Where its fingers stand before the first good reading.
  void rest(const Part& part, uint8_t outputs) {
    Bytes<Place> in{part.begin + kHeaderBytes + kInputBytes * part.input_count};
    for (uint8_t i = 0; i < outputs; ++i) {
      const uint8_t finger = in.u8() & 7;
      angle[finger] = in.i16();
    }
  }

  // The strips whose readings are valid.
  uint8_t read(const Part& part) {
    uint8_t strips = 0;
    Bytes<Place> in{part.begin + kHeaderBytes};
    int16_t* signal = signals();
    for (uint8_t left = part.input_count; left > 0; --left, ++signal) {
      const uint8_t first = in.u8();
      const int16_t u = alpha[first & 15];
      in.at += 6;
      const int16_t least = in.i16();
      const int16_t most = in.i16();
      in.at += 4;
      if (u < least || u > most) continue;
      strips = static_cast<uint8_t>(strips | bit_of(first & 15));
      *signal = core::refine(u, static_cast<uint8_t>(first >> 4));
    }
    return strips;
  }

  // The sections of which all strips are valid.
  FLEXOR_SHARED uint8_t run(const Part& part, uint8_t strips) {
    Machine<Place>& m = Step<Place>::m;
    const uint8_t missing = static_cast<uint8_t>(~strips);
    int16_t* const s = signals();
    m.signal = s;
    m.part = part.begin;
    m.angle = angle;
    m.good = 0;
    Section* section = part.sections;
    for (uint8_t i = part.section_count; i > 0; --i, ++section) {
      if ((section->strips & missing) != 0) continue;
      m.own = section->own;
      m.out = s + section->signal;
      m.first = !section->started;
      section->started = true;
      Step<Place>::run({section->code});
    }
    return m.good;
  }

  Arena arena_{memory_, kArena};
  Part part_[kMaxParts] = {};
  uint8_t parts_ = 0;
  uint8_t most_signals_ = 0;
  alignas(8) uint8_t memory_[kArena];  // last: a sanitizer sees what would run over it
};

}  // namespace compensator
}  // namespace flexor
