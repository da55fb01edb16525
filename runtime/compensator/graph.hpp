// A compensator as data: an interpreter that runs the blocks of runtime/compensator from a string of bytes, with
// the bits of the compiled variant (host/deploy/compensator_text.hpp) and of the host's model::Compensator.
//
// A graph is a string of bytes that computes the angles of some fingers from some of the sensors. Numbers are
// little-endian.
//
//   version u8, size u16, rate_hz u8, inputs u8, outputs u8, knots u8, sections u8, signals u8
//   input     sensor | refinement << 4, calibration u16, low u16, high u16 (counts of the monitor), valid_min i16,
//             valid_max i16, open hand i16, fist i16 (Q5; equal: not known)
//   output    number | place of a further joint << 4, sensors (a bit each) | finger << 5, rest i16, open hand i16, fist i16 (Q4)
//   knots     count u8, x i16 of each, scale u16 of each
//   section   sensors (a bit each), size u16 of what follows: operations
//   CRC-16 of all before
//
// A section runs when the readings of its sensors are all valid, and holds its states else. Signals are numbered: the
// inputs, then the results of operations in their order. An operation is its code (see Operation), with a number of its own
// in the upper four bits, the signal that it takes, and its coefficients: given by the `code` of its block (blocks.hpp).
// With kLeaves beside the signal come lower i16, upper i16, output u8, shift i8: the result is limited, and leaves.
#pragma once

#include "runtime/compensator/blocks.hpp"
#include "runtime/core/crc16.hpp"
#include "runtime/core/memory.hpp"

namespace flexor {
namespace compensator {

constexpr uint8_t kSensors = 5;
constexpr uint8_t kFingers = 5;
constexpr uint8_t kOutputs = 15;  // the fingers, and further joints
constexpr uint8_t kGraphVersion = 4;
constexpr uint8_t kInputCount = 4;  // places in a part
constexpr uint8_t kOutputCount = 5;
constexpr uint8_t kHeaderBytes = 9;
constexpr uint8_t kInputBytes = 15;
constexpr uint8_t kOutputBytes = 8;
constexpr uint8_t kCrcBytes = 2;
constexpr uint8_t kMostKnots = 32;
constexpr uint8_t kMostNumber = 15;  // of an operation's own
constexpr uint8_t kLeaves = 0x80;    // beside the signal that an operation takes: its result leaves

// Each gives one signal, a curve as many as its number.
#define FLEXOR_OPERATION(name, Host, ...) name,
enum class Operation : uint8_t { end, FLEXOR_BLOCKS(FLEXOR_OPERATION) count };
#undef FLEXOR_OPERATION
template <class Block>
struct OperationOf {
  static constexpr Operation kValue = Operation::end;
};
#define FLEXOR_OPERATION_OF(name, Host, ...)             \
  template <>                                            \
  struct OperationOf<__VA_ARGS__> {                      \
    static constexpr Operation kValue = Operation::name; \
  };
FLEXOR_BLOCKS(FLEXOR_OPERATION_OF)
#undef FLEXOR_OPERATION_OF
static_assert(static_cast<uint8_t>(Operation::count) <= 16, "an operation has four bits");

enum class Loaded : uint8_t {
  ok,
  wrong_version,
  corrupt,            // size or CRC
  other_calibration,  // made for other sensors
  other_rate,
  malformed,  // what this version cannot mean
  no_room,
};

// Reads on from a place. What takes a reference is for a block's `code`, whose numbers have been checked.
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

  FLEXOR_INLINE void i16(int16_t& x) { x = i16(); }
  FLEXOR_INLINE void weight(core::Weight& x) { x = weight(); }
  FLEXOR_INLINE void within(uint8_t& x, int8_t, int8_t) { x = u8(); }
  FLEXOR_SHARED void words(int16_t* x, uint8_t n) {  // a compiler would write each out
    for (; n > 0; --n) *x++ = i16();
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
  // Bytes right behind what was taken last.
  uint8_t* append(uint16_t bytes) {
    if (bytes > static_cast<uint16_t>(end_ - next_)) return nullptr;
    uint8_t* const appended = next_;
    next_ += bytes;
    return appended;
  }

 private:
  uint8_t* next_;
  uint8_t* end_;
};

struct Section {
  const uint8_t* code;
  uint8_t* own;  // states of its operations, in their order
  uint8_t sensors;
  uint8_t signal;  // of its first operation
  bool started;
};

struct Input {
  uint8_t first;  // sensor | refinement << 4
  int16_t least;  // valid
  int16_t most;
};

struct Part {
  const uint8_t* begin;
  Input* inputs;
  Section* sections;
  uint8_t input_count;
  uint8_t section_count;
  bool is_far;  // in flash: curves' tables are read there, all else has been moved into RAM
};

// On a microcontroller one graph runs at a time, and what is at a fixed place is quickly reached.
#ifdef __AVR__
#define FLEXOR_PER_THREAD
#else
#define FLEXOR_PER_THREAD thread_local
#endif

// The best of what a block has is taken.
struct Third {};
struct Second : Third {};
struct First : Second {};

// Bytes of a block's states.
template <class Block>
FLEXOR_INLINE auto state_bytes_of(uint8_t n, First) -> decltype(Block::state_bytes(n)) {
  return Block::state_bytes(n);
}
template <class Block>
FLEXOR_INLINE uint8_t state_bytes_of(uint8_t, Second, typename Block::State* = nullptr) {
  return sizeof(typename Block::State);
}
template <class Block>
FLEXOR_INLINE uint8_t state_bytes_of(uint8_t, Third) {
  return 0;
}
template <class Block>
FLEXOR_INLINE uint8_t state_bytes(uint8_t n) {
  return state_bytes_of<Block>(n, First());
}

// A bit for each sensor and finger; other outputs have none.
const uint8_t kBits[kOutputs] FLEXOR_IN_FLASH = {1, 2, 4, 8, 16};
static_assert(kSensors == 5 && kFingers == 5, "a bit for each sensor and finger");
FLEXOR_INLINE uint8_t bit_of(uint8_t n) { return core::Flash::byte(kBits + n); }

// What operations share while a section runs. Tables: where a part in flash has those of its curves.
template <class Tables>
class Machine {
 public:
  using Far = Tables;
  using In = Bytes<core::Ram>;
  // What lies behind an operation, and what it gives.
  struct Out {
    const uint8_t* at;
    int16_t y;
  };
  struct Outs {
    const uint8_t* at;
    int16_t* next;
  };

  FLEXOR_INLINE static int16_t signal(uint8_t number) { return m.signals[number]; }
  FLEXOR_INLINE static bool first() { return m.is_first; }  // sample: states start
  FLEXOR_INLINE static const uint8_t* at(uint16_t offset) { return m.part + offset; }
  FLEXOR_INLINE static bool is_far() { return m.is_far; }

  // States lie one behind the other, as the loader has taken them.
  template <class State>
  FLEXOR_INLINE static State* state(uint8_t bytes) {
    uint8_t* const state = Arena::aligned(m.own);
    m.own = state + bytes;
    return reinterpret_cast<State*>(state);
  }

  static void begin(const Part& part, const int16_t* signals, int16_t* angle) {
    m.part = part.begin;
    m.is_far = part.is_far;
    m.signals = signals;
    m.angle = angle;
    m.good = 0;
  }
  // Operations up to the section's end. out: where the first's result goes.
  FLEXOR_INLINE static void run(const uint8_t* code, uint8_t* own, bool is_first, int16_t* out) {
    m.own = own;
    m.is_first = is_first;
    const int16_t* const signals = m.signals;
    for (In in{code};;) {
      const uint8_t first = in.u8();
      const uint8_t operation = first & 15;
      if (operation == static_cast<uint8_t>(Operation::end)) return;
      const uint8_t n = upper_nibble(first);
      const uint8_t from = in.u8();
      const int16_t u = signals[from & static_cast<uint8_t>(~kLeaves)];
      if (operation == static_cast<uint8_t>(Operation::curve)) {
        const Outs outs = Curves::interpret<Machine>(in, n, u, out);
        in.at = outs.at;
        out = outs.next;
      } else {
        const Out one = operator_of(operation)(in, n, u);
        in.at = one.at;
        *out++ = one.y;
      }
      if ((from & kLeaves) != 0) in = leave(in, out[-1]);
    }
  }
  static uint8_t good() { return m.good; }

 private:
  // Limits a result, which is an output's angle then.
  FLEXOR_SHARED static In leave(In in, int16_t& u) {
    const int16_t lower = in.i16();
    u = core::clamp(u, lower, in.i16());
    const uint8_t output = in.u8();
    m.angle[output] = core::to_output(u, in.i8());
    m.good = static_cast<uint8_t>(m.good | bit_of(output));
    return in;
  }

  using Operator = Out (*)(In, uint8_t, int16_t);

  // A block that interprets itself, one with states, and one without.
  template <class Block>
  static constexpr auto chosen(First) -> decltype(&Block::template interpret<Machine>) {
    return &Block::template interpret<Machine>;
  }
  template <class Block>
  static constexpr Operator chosen(Second, typename Block::State* = nullptr) {
    return with_state<Block>;
  }
  template <class Block>
  static constexpr Operator chosen(Third) {
    return without_state<Block>;
  }

  template <class Block>
  static Out with_state(In in, uint8_t n, int16_t u) {
    Block block;
    block.code(in, n);
    typename Block::State& own = *state<typename Block::State>(sizeof(typename Block::State));
    if (m.is_first) block.start(own, u);
    const int16_t y = block.step(own, u);
    return {in.at, y};
  }
  template <class Block>
  static Out without_state(In in, uint8_t n, int16_t u) {
    Block block;
    block.code(in, n);
    return {in.at, block(u)};
  }

  FLEXOR_INLINE static Operator operator_of(uint8_t operation) {
#define FLEXOR_OPERATOR(name, Host, ...) table_entry(chosen<__VA_ARGS__>(First())),
    static const Operator kOperators[] FLEXOR_IN_FLASH = {nullptr, FLEXOR_BLOCKS(FLEXOR_OPERATOR)};
#undef FLEXOR_OPERATOR
#ifdef __AVR__
    return reinterpret_cast<Operator>(pgm_read_word(kOperators + operation));
#else
    return kOperators[operation];
#endif
  }
  static constexpr Operator table_entry(Operator one) { return one; }
  static constexpr Operator table_entry(Outs (*)(In, uint8_t, int16_t, int16_t*)) { return nullptr; }

  FLEXOR_INLINE static uint8_t upper_nibble(uint8_t code) {
#ifdef __AVR__
    return __builtin_avr_swap(code) & 15;  // the compiler would shift bit by bit
#else
    return static_cast<uint8_t>(code >> 4);
#endif
  }

  struct Run {
    uint8_t* own;  // state of the next operation
    const int16_t* signals;
    const uint8_t* part;
    int16_t* angle;
    bool is_far;
    bool is_first;
    uint8_t good;
  };
  static FLEXOR_PER_THREAD Run m;
};

template <class Tables>
FLEXOR_PER_THREAD typename Machine<Tables>::Run Machine<Tables>::m;

// What leaves a part. The first kFingers are the fingers' angles; others are further joints of a finger's, for programs that
// show a whole hand.
struct Output {
  uint8_t number;
  uint8_t place;  // of a further joint on its finger
  uint8_t finger;
  uint8_t sensors;  // a bit for each that it needs
  int16_t rest;     // Q4
  int16_t open;     // Q4 of an open hand
  int16_t fist;

  template <class Place>
  static Output read(const uint8_t* at) {
    Bytes<Place> in{at};
    const uint8_t first = in.u8();
    const uint8_t second = in.u8();
    const int16_t rest = in.i16();
    const int16_t open = in.i16();
    return {static_cast<uint8_t>(first & 15),
            static_cast<uint8_t>(first >> 4),
            static_cast<uint8_t>(second >> 5),
            static_cast<uint8_t>(second & 31),
            rest,
            open,
            in.i16()};
  }
};

// What a part must have been made for.
struct MadeFor {
  const uint16_t* calibration;  // of each sensor
  uint8_t rate_hz;
};

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
    part.begin = Place::address(begin_);
    part.is_far = Place::is_far(begin_);
    part.input_count = inputs_;
    part.section_count = sections;
    signals_ = inputs_;
    part.inputs = arena_.template take_all<Input>(inputs_);
    if (part.inputs == nullptr) return Loaded::no_room;
    const Loaded fits = check_inputs(made_for.calibration, part.inputs);
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
    if (at_ != end_ || signals_ != signals()) return Loaded::malformed;
    for (uint8_t i = 0; i < sections; ++i) {
      if (!move(part.sections[i], part.is_far)) return Loaded::no_room;
    }
    return Loaded::ok;
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

  Loaded check_inputs(const uint16_t* calibration, Input* inputs) {
    if (inputs_ > kSensors) return Loaded::malformed;
    for (uint8_t i = 0; i < inputs_; ++i) {
      if (!has(kInputBytes)) return Loaded::malformed;
      const uint8_t first = Place::byte(at_);
      const uint8_t sensor = first & 15;
      if (sensor >= kSensors || first >> 4 > 8) return Loaded::malformed;
      if (Place::word(at_ + 1) != calibration[sensor]) return Loaded::other_calibration;
      inputs[i] = {first, static_cast<int16_t>(Place::word(at_ + 7)),
                   static_cast<int16_t>(Place::word(at_ + 9))};
      at_ += kInputBytes;
    }
    return Loaded::ok;
  }
  bool check_outputs(uint8_t outputs) {
    for (uint8_t i = 0; i < outputs; ++i) {
      if (!has(kOutputBytes)) return false;
      const Output one = Output::read<Place>(at_);
      if (one.number >= kOutputs || one.finger >= kFingers) return false;
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
    section.sensors = in.u8();
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

  // Operations that lie in flash come into RAM, where they are read sooner; of curves the values stay, and a u16 points to them.
  bool move(Section& section, bool is_far) {
    if (!is_far) {
      section.code = Place::address(section.code);
      return true;
    }
    at_ = section.code;
    signals_ = section.signal;
    is_moving_ = true;
    section.code = arena_.next();
    bool is_last = false;
    while (!is_last) {
      const uint8_t* const from = at_;
      is_last = Place::byte(from) == static_cast<uint8_t>(Operation::end);
      values_ = nullptr;
      if (is_last) ++at_;
      if (!is_last) load_operation();
      if (values_ == nullptr) {
        if (!append(from, at_)) return false;
        continue;
      }
      const uint16_t offset = static_cast<uint16_t>(values_ - begin_);
      if (!append(from, values_)) return false;
      uint8_t* const to = arena_.append(sizeof(offset));
      if (to == nullptr) return false;
      __builtin_memcpy(to, &offset, sizeof(offset));
      if (!append(behind_values_, at_)) return false;
    }
    return true;
  }
  FLEXOR_SHARED bool append(const uint8_t* from, const uint8_t* until) {
    uint8_t* to = arena_.append(static_cast<uint16_t>(until - from));
    if (to == nullptr) return false;
    while (from < until) *to++ = Place::byte(from++);
    return true;
  }

  Loaded load_operation() {
    const uint8_t code = Place::byte(at_++);
    const uint8_t n = static_cast<uint8_t>(code >> 4);
    const Operation operation = static_cast<Operation>(code & 15);
    const uint8_t results = operation == Operation::curve ? n : 1;
    uint8_t bytes = 0;
    const uint8_t from = next();
    require((from & static_cast<uint8_t>(~kLeaves)) < signals_);
    switch (operation) {
#define FLEXOR_CHECK(name, Host, ...) \
  case Operation::name:               \
    bytes = check<__VA_ARGS__>(n);    \
    break;
      FLEXOR_BLOCKS(FLEXOR_CHECK)
#undef FLEXOR_CHECK
      default:
        is_good_ = false;
    }
    if ((from & kLeaves) != 0) {
      advance(4);
      within(0, kOutputs - 1);
      within(-12, 15);
    }
    require(results <= 255 - signals_);
    if (!is_good_) return Loaded::malformed;
    signals_ = static_cast<uint8_t>(signals_ + results);
    return is_moving_ || arena_.take(bytes) != nullptr ? Loaded::ok : Loaded::no_room;
  }

  template <class Block>
  uint8_t check(uint8_t n) {
    Block block{};
    block.code(*this, n);
    return state_bytes<Block>(n);
  }

 public:  // for a block's `code`
  void i16(int16_t) { advance(2); }
  void u16(uint16_t) { advance(2); }
  void i32(int32_t) { advance(4); }
  void words(const int16_t*, uint8_t n) { advance(static_cast<uint16_t>(2 * n)); }
  void values(const Value*, uint16_t n) {
    values_ = at_;
    advance(static_cast<uint16_t>(4 * n));
    behind_values_ = at_;
  }
  void weight(const core::Weight&) {
    advance(2);
    within(0, 31);
  }
  template <class Number>
  void within(Number& x, int8_t least, int8_t most) {
    x = static_cast<Number>(within(least, most));
  }
  void signal(uint8_t, uint8_t flag) {
    const uint8_t number = next() & static_cast<uint8_t>(~flag);
    require(number < signals_);
  }
  void knots(uint16_t, uint8_t& count) {
    advance(2);
    count = is_good_ ? knots_at(Place::word(at_ - 2)) : 0;
    require(count > 0);
  }
  bool require(bool good) { return is_good_ = is_good_ && good; }

 private:
  FLEXOR_SHARED void advance(uint16_t count) { require(skip(count)); }
  FLEXOR_SHARED uint8_t next() {
    advance(1);
    return is_good_ ? Place::byte(at_ - 1) : 0;
  }
  FLEXOR_SHARED uint8_t within(int8_t least, int8_t most) {
    const int8_t value = static_cast<int8_t>(next());
    return require(value >= least && value <= most) ? static_cast<uint8_t>(value) : 0;
  }

  const uint8_t* begin_;
  uint16_t size_;
  const uint8_t* at_ = nullptr;
  const uint8_t* end_ = nullptr;
  const uint8_t* knots_ = nullptr;
  const uint8_t* values_ = nullptr;  // of the operation's curves
  const uint8_t* behind_values_ = nullptr;
  Arena& arena_;
  uint8_t inputs_ = 0;
  uint8_t signals_ = 0;
  uint8_t knot_tables_ = 0;
  bool is_good_ = true;
  bool is_moving_ = false;
};

// Place: where the bytes lie. kArena: bytes for everything else that they need, and for themselves where
// they were reserved here.
template <class Place, uint16_t kArena>
class Graph {
 public:
  int16_t alpha[kSensors] = {};  // Q5, in
  int16_t angle[kOutputs] = {};  // Q4 of each finger and further joint, out; kept where a reading is bad

  // Forgets what was loaded. The angles stay.
  void clear() {
    arena_ = Arena(memory_, kArena);
    bytes_ = nullptr;
  }

  // Room for bytes that lie in RAM; null: there is not as much. Valid until clear().
  uint8_t* reserve(uint16_t size) { return arena_.take(size); }

  // Behind clear(), once; `bytes` outlive the graph. Unless it is ok, only clear() helps.
  Loaded add(const uint8_t* bytes, uint16_t size, const MadeFor& made_for) {
    Loader<Place> loader(bytes, size, arena_);
    const Loaded loaded = loader.load(made_for, part_);
    if (loaded != Loaded::ok) return loaded;
    signals_ = reinterpret_cast<int16_t*>(memory_ + kArena) - loader.signals();
    if (!arena_.keep(reinterpret_cast<uint8_t*>(signals_))) return Loaded::no_room;
    bytes_ = bytes;
    for (uint8_t k = 0; k < outputs(); ++k) {
      const Output one = output(k);
      angle[one.number] = one.rest;  // where it stands before the first good reading
    }
    return Loaded::ok;
  }

  uint8_t outputs() const { return bytes_ == nullptr ? 0 : Place::byte(bytes_ + kOutputCount); }
  FLEXOR_SHARED Output output(uint8_t k) const {
    return Output::read<Place>(bytes_ + kHeaderBytes + kInputBytes * part_.input_count + kOutputBytes * k);
  }

  // One sample: a bit for each finger whose readings were all valid.
  uint8_t step() { return bytes_ == nullptr ? 0 : run(read()); }

 private:
  using Run = Machine<core::Flash>;

  // The sensors whose readings are valid.
  uint8_t read() {
    uint8_t sensors = 0;
    int16_t* signal = signals_;
    const Input* input = part_.inputs;
    for (uint8_t left = part_.input_count; left > 0; --left, ++signal, ++input) {
      const int16_t u = alpha[input->first & 15];
      if (u < input->least || u > input->most) continue;
      sensors = static_cast<uint8_t>(sensors | bit_of(input->first & 15));
      *signal = core::refine(u, static_cast<uint8_t>(input->first >> 4));
    }
    return sensors;
  }

  // The sections of which all sensors are valid.
  FLEXOR_SHARED uint8_t run(uint8_t sensors) {
    const uint8_t missing = static_cast<uint8_t>(~sensors);
    Run::begin(part_, signals_, angle);
    Section* section = part_.sections;
    for (uint8_t i = part_.section_count; i > 0; --i, ++section) {
      if ((section->sensors & missing) != 0) continue;
      const bool is_first = !section->started;
      section->started = true;
      Run::run(section->code, section->own, is_first, signals_ + section->signal);
    }
    return Run::good();
  }

  Arena arena_{memory_, kArena};
  Part part_ = {};
  const uint8_t* bytes_ = nullptr;
  int16_t* signals_ = nullptr;         // at the arena's end: none is kept from sample to sample
  alignas(8) uint8_t memory_[kArena];  // last: a sanitizer sees what would run over it
};

}  // namespace compensator
}  // namespace flexor
