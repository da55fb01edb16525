#include "host/deploy/compensator_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string_view>
#include <vector>

#include "host/deploy/sources.hpp"
#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/model/formats.hpp"
#include "host/model/wiring.hpp"

namespace flexor::compensator {

// As the list of blocks writes its struct.
template <class Block>
inline constexpr const char* kTypeText = nullptr;
#define FLEXOR_TYPE_TEXT(name, Host, ...) \
  template <>                             \
  inline constexpr const char* kTypeText<__VA_ARGS__> = #__VA_ARGS__;
FLEXOR_BLOCKS(FLEXOR_TYPE_TEXT)
#undef FLEXOR_TYPE_TEXT

}  // namespace flexor::compensator

namespace flexor::deploy {
namespace {

// Coefficients as C++: the type inside namespace flexor::compensator, and the braces after it.
struct CppText {
  std::string type;
  std::string braces;
};

template <class List>
std::string braces(const List& list) {
  return fmt::format("{{{}}}", fmt::join(list, ", "));
}
template <class Number>
std::string braces(const Number* first, std::size_t count) {
  return braces(std::span(first, count));
}
std::string braces(const core::Weight& w) { return fmt::format("{{{}, {}}}", w.mantissa, w.shift); }

// What a block's `code` names is what its struct has, in this order.
class MemberTexts {
 public:
  std::vector<std::string> all;
  void i16(int x) { all.push_back(std::to_string(x)); }
  void within(int x, int, int) { i16(x); }
  void words(const std::int16_t* x, int n) { all.push_back(braces(x, static_cast<std::size_t>(n))); }
  void weight(const core::Weight& w) { all.push_back(braces(w)); }
};

template <class Block>
CppText cpp_of(Block block) {
  MemberTexts members;
  block.code(members, 0);
  return {compensator::kTypeText<Block>, braces(members.all)};
}

// Values and slopes; the knots apart, since several curves may share them.
CppText cpp_of(const model::Curve::Fixed& c) {
  std::vector<std::string> values;
  for (int i = 0; i < c.knots.count; ++i)
    values.push_back(fmt::format("{{{}, {}}}", c.values.at[i].y, c.values.at[i].slope));
  return {fmt::format("FixedValues<{}>", c.knots.count), fmt::format("{{{}}}", braces(values))};
}

CppText cpp_of(const model::Hysteresis::Fixed& c) {
  return {fmt::format("FixedHysteresis<{}>", c.plays.count),
          fmt::format("{{{{{}, {}}}, {}}}", c.plays.count, braces(c.plays.radius, c.plays.count),
                      braces(c.weight, c.plays.count))};
}

// As small as the block allows: states at the front that a shorter chain does not use are left out.
CppText cpp_of(const model::Lti::Fixed& c) {
  constexpr int kOrder = compensator::kMaxOrder;
  const std::uint8_t number = c.number();
  const int order = number & c.kOrderBits;
  const int first = kOrder - order;
  std::vector<std::string> weights;
  std::vector<std::string> chain;
  for (int i = first; i < kOrder; ++i) {
    weights.push_back(braces(c.input_weight[i]));
    for (int j = first; j < i; ++j) chain.push_back(braces(c.chain_weight[compensator::chain_index(i, j)]));
  }
  if (chain.empty()) chain = {"{0, 0}"};
  // The tap of the input stands first, those of unused states are zero.
  std::vector<std::int16_t> tap = {c.tap[0]};
  tap.insert(tap.end(), c.tap + first + 1, c.tap + kOrder);
  const auto n = static_cast<std::size_t>(order);
  return {fmt::format("FixedLti<{}, {}>", order, (number & c.kHasTaps) != 0),
          fmt::format("{{{}, {}, {}L, {}, {}, {}, {}, {}, {}, {{{}, {}}}}}", c.gain, c.gain_shift, c.offset,
                      braces(weights), braces(chain), braces(tap), c.tap_fraction, c.output_shift,
                      c.is_direct, braces(c.direct.b, n), braces(c.direct.a, n))};
}

class Writer {
 public:
  explicit Writer(const model::Model& model)
      : model_(model), fixed_(model), wiring_(model::wiring_of(model)), inputs_(model.inputs.size()) {
    // What only joints without a motor ask for stays on the PC.
    std::vector<std::size_t> moved;
    for (const auto& joint : wiring_.joint)
      if (joint) moved.push_back(fixed_.graph.joint[*joint]);
    needed_ = fixed_.graph.needed_for(moved);
    for (std::size_t b = 0; b < model_.blocks.size(); ++b) {
      if (needed_[inputs_ + b]) add_block(b);
    }
    close();
    for (std::size_t i = 0; 8 * i < sections_; ++i) {
      shared_ += fmt::format("    uint8_t started{0} = started{0}_;\n", i);
      lines_ += fmt::format("    started{0}_ = started{0};\n", i);
      states_ += fmt::format("  uint8_t started{}_ = 0;\n", i);
    }
    for (std::size_t f = 0; f < model::kFingers; ++f) {
      if (wiring_.joint[f]) rests_ += fmt::format("    angle[{}] = {};\n", f, fixed_.rest[*wiring_.joint[f]]);
    }
  }

  // Coefficients, and class Compensator.
  std::string text() const {
    return "namespace config {\n" + coefficients_ +
           "}  // namespace config\n\nclass Compensator {\n public:\n  int16_t alpha[5] = {};\n  int16_t "
           "angle[5] = {};\n\n  Compensator() {\n" +
           rests_ + "  }\n\n  uint8_t step() {\n    uint8_t good = 0;\n" + shared_ + lines_ +
           "    return good;\n  }\n\n private:\n" + states_ + "};\n";
  }

 private:
  // Blocks in a row that the same inputs reach step, and start, together: a section.
  void open(const std::vector<std::size_t>& inputs) {
    if (open_ == inputs) return;
    close();
    open_ = inputs;
    std::string condition;
    for (const std::size_t i : inputs) {
      const std::size_t sensor = wiring_.sensor[i];
      condition += fmt::format("{0}alpha[{1}] >= {2} && alpha[{1}] <= {3}", condition.empty() ? "" : " && ",
                               sensor, fixed_.valid_min[i], fixed_.valid_max[i]);
    }
    lines_ += fmt::format("    if ({}) {{\n", condition);
    first_ = lines_.size();
  }

  void close() {
    if (!std::exchange(open_, {})) return;
    std::string before;
    for (const std::size_t i : read_) {
      before += fmt::format("      const int16_t s{} = core::refine(alpha[{}], {});\n", i, wiring_.sensor[i],
                            fixed_.signals[i].fraction - core::kInputFraction);
    }
    read_.clear();
    if (starts_) {
      const int bit = 1 << sections_ % 8;
      before += fmt::format("      const bool first = ({} & {}) == 0;\n", started(), bit);
      lines_ += fmt::format("      {} |= {};\n", started(), bit);
      ++sections_;
    }
    lines_.insert(first_, before);
    lines_ += "    }\n";
    starts_ = false;
    found_.clear();
  }

  // Eight sections share a byte, which stays in a register while they run.
  std::string started() const { return fmt::format("started{}", sections_ / 8); }

  // A signal that another section uses too lives outside both.
  bool leaves_section(std::size_t signal) const {
    bool left = false;
    for (std::size_t b = signal - inputs_ + 1; b < model_.blocks.size(); ++b) {
      if (!needed_[inputs_ + b]) continue;
      left = left || fixed_.graph.inputs[inputs_ + b] != fixed_.graph.inputs[signal];
      if (left && std::ranges::find(fixed_.graph.from[b], signal) != fixed_.graph.from[b].end()) return true;
    }
    return false;
  }

  void add_block(std::size_t b) {
    const std::size_t signal = inputs_ + b;
    open(fixed_.graph.inputs[signal]);
    for (const std::size_t from : fixed_.graph.from[b]) {
      if (from < inputs_) read_.insert(from);
    }
    const bool shared = leaves_section(signal);
    if (shared) shared_ += fmt::format("    int16_t s{} = 0;\n", signal);
    const std::string target = fmt::format("      {}s{} = ", shared ? "" : "const int16_t ", signal);
    std::visit([&](const auto& one) { add_step(b, target, one); }, fixed_.blocks[b]);
    for (std::size_t f = 0; f < model::kFingers; ++f) {
      if (!wiring_.joint[f] || fixed_.graph.joint[*wiring_.joint[f]] != signal) continue;
      lines_ += fmt::format("      angle[{}] = core::to_output(s{}, {});\n      good |= {};\n", f, signal,
                            fixed_.signals[signal].fraction - core::kOutputFraction, 1 << f);
    }
  }

  // Curves of one signal on the same knots share the search for the segment, and all curves equal knots.
  std::string segment_of(std::size_t in, const model::Curve::Fixed& c) {
    const std::string text = fmt::format("{{{}, {}, {}}}", c.knots.count, braces(c.knots.x, c.knots.count),
                                         braces(c.knots.scale, c.knots.count));
    const auto known = std::ranges::find(knots_, text);
    const auto knots = known - knots_.begin();
    if (known == knots_.end()) {
      knots_.push_back(text);
      coefficients_ += fmt::format("constexpr compensator::FixedKnots<{}> kKnots{} PROGMEM = {};\n",
                                   c.knots.count, knots, text);
    }
    std::string name = fmt::format("g{}_{}", in, knots);
    if (std::ranges::find(found_, name) == found_.end()) {
      found_.push_back(name);
      lines_ +=
          fmt::format("      const compensator::Segment {} = config::kKnots{}(s{});\n", name, knots, in);
    }
    return name;
  }

  // Weights of +-1 in steps of the output need no product: the rest of the shift comes out even.
  std::string sum_text(std::size_t b, const model::Sum::Fixed& c) const {
    const std::vector<std::size_t>& from = fixed_.graph.from[b];
    const int unit = 1 << c.shift;
    const bool plain =
        std::all_of(c.weight, c.weight + from.size(), [&](int w) { return std::abs(w) == unit; });
    std::string sum = fmt::format("{}L", plain ? (c.offset + unit / 2) >> c.shift : c.offset);
    for (std::size_t i = 0; i < from.size(); ++i) {
      sum += plain ? fmt::format(" {} s{}", c.weight[i] > 0 ? '+' : '-', from[i])
                   : fmt::format(" + int32_t{{{}}} * s{}", c.weight[i], from[i]);
    }
    return plain ? sum : fmt::format("core::round_shift({}, {})", sum, c.shift);
  }

  template <class K>
  void add_step(std::size_t b, const std::string& target, const model::FixedCoefficients<K>& one) {
    const std::size_t in = fixed_.graph.from[b].front();
    if constexpr (std::is_same_v<typename K::Fixed, model::Sum::Fixed>) {
      // Written out: the compiler would loop over constants that lie in flash.
      lines_ += fmt::format("{}core::narrow({});\n", target, sum_text(b, one.c));
    } else {
      const CppText text = cpp_of(one.c);
      coefficients_ +=
          fmt::format("constexpr compensator::{} kBlock{} PROGMEM = {};\n", text.type, b, text.braces);
      if constexpr (std::is_same_v<typename K::Fixed, model::Curve::Fixed>) {
        lines_ += fmt::format("{}config::kBlock{}({});\n", target, b, segment_of(in, one.c));
      } else if constexpr (requires { typename K::Fixed::State; }) {
        starts_ = true;
        states_ += fmt::format("  compensator::{}::State block{}_;\n", text.type, b);
        lines_ += fmt::format("      if (first) config::kBlock{0}.start(block{0}_, s{1});\n", b, in);
        lines_ += fmt::format("{0}config::kBlock{1}.step(block{1}_, s{2});\n", target, b, in);
      } else {
        lines_ += fmt::format("{0}config::kBlock{1}(s{2});\n", target, b, in);
      }
    }
  }

  const model::Model& model_;
  model::FixedModel fixed_;
  model::Wiring wiring_;
  std::size_t inputs_;
  std::vector<bool> needed_;
  std::optional<std::vector<std::size_t>> open_;  // inputs of the open section
  std::vector<std::string> knots_;                // all that were written
  std::vector<std::string> found_;                // segments of the open section
  std::set<std::size_t> read_;                    // inputs that a block of the open section takes
  bool starts_ = false;                           // a block of the open section has a state
  std::size_t sections_ = 0;
  std::size_t first_ = 0;
  std::string coefficients_;
  std::string shared_;
  std::string lines_;
  std::string states_;
  std::string rests_;
};

// Of C++ and of its headers.
constexpr std::string_view kReserved =
    " alignas alignof and asm auto bool break case catch char class compl const constexpr continue decltype "
    "default delete do double else enum explicit export extern false final float for friend goto if inline "
    "int long main mutable namespace new noexcept not nullptr operator or override private protected public "
    "register return short signed sizeof static std struct switch template this throw true try typedef "
    "typeid typename union unsigned using virtual void volatile while xor concept requires flexor ";

// A source and, before it, what it includes, each once.
void add_source(const std::string& path, std::set<std::string>& known, std::string& out) {
  constexpr std::string_view kInclude = "#include \"";
  if (!known.insert(path).second) return;
  std::istringstream text(sources().at(path));
  bool has_begun = false;  // what stands above is of the source's place in this repository
  for (std::string line; std::getline(text, line);) {
    has_begun = has_begun || line.starts_with("#") || line.starts_with("namespace");
    if (!has_begun || line.starts_with("#include <")) continue;
    if (line.starts_with(kInclude)) {
      add_source(line.substr(kInclude.size(), line.size() - kInclude.size() - 1), known, out);
    } else if (line != "#pragma once") {
      out += line + "\n";
    }
  }
}

}  // namespace

std::string header_text(const model::Model& given, const std::string& name) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  if (name.empty() || !is_letter(name[0]) || kReserved.find(" " + name + " ") != kReserved.npos ||
      name.ends_with("_t") || !std::ranges::all_of(name, [&](char c) { return is_letter(c) || is_digit(c); }))
    throw io::InputError(
        "{}: is no name of a namespace: letters, digits and _, no digit first, no word of C++", name);
  if (const auto left = model::left_out(given); !left.empty())
    throw io::InputError("a header has one joint of each finger: fit a model without {}",
                         fmt::join(left, ", "));
  const auto [model, correction] = model::folded(given);
  const model::Wiring wiring = model::wiring_of(model);
  std::string out = fmt::format(
      "// Written by flexor {}. Every {:g} ms set alpha of a {}::Compensator, then step(), which returns a "
      "bit for each finger\n"
      "// that has an angle; the others keep theirs. Readings out of range: alpha = -32768.\n",
      FLEXOR_VERSION, 1000 * model.sample_period_s, name);
  const auto plain = [&](std::string word) {  // no text of a model's is anything but a comment
    std::ranges::replace_if(
        word, [](char c) { return c < ' ' || c > '~' || c == '\\'; }, '?');
    return word;
  };
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    out += fmt::format("//   alpha[{}] = 32 * ({:.9g} * {} {:+.9g}), rounded; {} from {:g} to {:g}\n",
                       wiring.sensor[i], correction[i].gain, plain(given.inputs[i].name), correction[i].shift,
                       plain(given.inputs[i].unit), given.inputs[i].valid_min, given.inputs[i].valid_max);
  for (std::size_t f = 0; f < model::kFingers; ++f)
    if (wiring.joint[f])
      out +=
          fmt::format("//   {}: angle[{}] / 16.0 degrees\n", plain(model.joints[*wiring.joint[f]].name), f);
  out +=
      "#pragma once\n\n#include <stdint.h>\n#ifdef __AVR__\n#include <avr/pgmspace.h>\n#endif\n#ifndef "
      "PROGMEM\n"
      "#define PROGMEM\n#endif\n\nnamespace " +
      name + " {\n";
  std::set<std::string> known;
  add_source("runtime/compensator/blocks.hpp", known, out);
  return out + "\nnamespace flexor {\n" + Writer(model).text() +
         "}  // namespace flexor\nusing flexor::Compensator;\n}  // namespace " + name + "\n";
}

}  // namespace flexor::deploy
