#include "host/identify/structure_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <utility>

#include "host/io/io.hpp"
#include "host/model/kinds.hpp"
#include "runtime/compensator/lti.hpp"

namespace flexor::identify {
namespace {

using io::InputError;

// A block that may be named, and what its number may be; most 0: it takes none.
struct Known {
  std::string_view name;
  double least = 0;
  double most = 0;
  bool whole = false;
  int place = 0;  // in a chain; 0: it belongs into a sum
};
constexpr int kBehind = 2;  // places that a curve stands farther on behind the poles
constexpr Known kKnown[] = {{"curve", 2, model::kMaxKnots, true, 5},
                            {"play", 0.001, 0.5},
                            {"motion", 0.01, 5},
                            {"lag", 0.01, 2, false, 1},
                            {"dead-zone", 0, 0, false, 2},
                            {"hysteresis", 1, model::kMaxPlays, true, 3},
                            {"gain", 0, 0, false, 4},
                            {"lti", 1, compensator::kMaxOrder, true, 6},
                            {"pair", 0, 0, false, 6},
                            {"saturation", 0, 0, false, 8},
                            {"open"}};

struct Block {
  std::string_view name;
  int place = 0;  // of Known
  std::optional<double> number;
  std::size_t at = 0;         // of its first character
  std::size_t number_at = 0;  // of its number's

  int whole(int otherwise) const { return static_cast<int>(number.value_or(otherwise)); }
};

using Term = std::vector<Block>;

const std::vector<std::pair<std::string, std::string>> kShorthands = {
    {"line", "gain"},
    {"linear", "gain"},
    {"linear-dynamic", "gain > lti"},
    {"hammerstein", "curve > lti"},
    {"wiener", "lti > curve"},
    {"hw", "curve > lti > saturation"},
    {"wh", "lag > curve > lti"},
    {"hysteresis-hw", "hysteresis > curve > lti > saturation"},
};
const std::vector<std::string> kSums = {"auto", "limited-line", "line-lead", "curve", "hysteresis"};

class Parser {
 public:
  Parser(std::string_view text, std::size_t begin) : text_(text), at_(begin) {}

  std::vector<Term> terms() {
    std::vector<Term> out(1);
    for (;;) {
      out.back().push_back(block());
      skip_spaces();
      if (at_ == text_.size()) return out;
      if (text_[at_] != '>' && text_[at_] != '+') fail(at_, "a > or + is missing");
      if (text_[at_] == '+') out.emplace_back();
      ++at_;
    }
  }

  [[noreturn]] void fail(std::size_t at, const std::string& what) const {
    throw InputError(
        "--structure: {} at character {}{}", what, at + 1,
        at < text_.size() ? fmt::format(", \"{}\"", io::start_of(text_.substr(at), 30)) : ", the end");
  }

 private:
  void skip_spaces() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }

  Block block() {
    skip_spaces();
    const std::size_t at = at_;
    while (at_ < text_.size() &&
           (std::isalpha(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '-'))
      ++at_;
    const std::string_view name = text_.substr(at, at_ - at);
    if (name.empty()) fail(at_, "the name of a block is missing");
    const auto known = std::ranges::find(kKnown, name, &Known::name);
    if (known == std::end(kKnown)) {
      std::vector<std::string_view> blocks;
      for (const Known& one : kKnown) blocks.push_back(one.name);
      std::vector<std::string> structures = kSums;
      for (const auto& [shorthand, text] : kShorthands) structures.push_back(shorthand);
      fail(at,
           fmt::format(
               "unknown block {} (blocks are {}; whole structures {}; before one of several sensors mix >)",
               io::start_of(name, 30), fmt::join(blocks, ", "), fmt::join(structures, ", ")));
    }
    skip_spaces();
    Block out{known->name, known->place, {}, at, at_};
    if (at_ < text_.size() && text_[at_] == '(') read_number(*known, out);
    return out;
  }

  void read_number(const Known& known, Block& out) {
    ++at_;
    skip_spaces();
    out.number_at = at_;
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc()) fail(at_, "a number is missing");
    at_ = static_cast<std::size_t>(end - text_.data());
    skip_spaces();
    if (at_ == text_.size() || text_[at_] != ')') fail(at_, "a ) is missing");
    ++at_;
    if (known.most == 0) fail(out.number_at, fmt::format("{} takes no number", known.name));
    if (!(value >= known.least && value <= known.most))
      fail(out.number_at,
           fmt::format("the number of {} must be {:g} to {:g}", known.name, known.least, known.most));
    if (known.whole && value != std::floor(value)) fail(out.number_at, "a whole number is needed");
    out.number = value;
  }

  std::string_view text_;
  std::size_t at_;
};

bool is_dynamic(const Block& block) {
  return block.name != "curve" && block.name != "play" && block.name != "motion" && block.name != "open";
}

Branches sum(const Parser& parser, const std::vector<Term>& terms) {
  constexpr std::size_t kMostOfAKind = 4;
  Branches out;
  bool reading = false;
  bool knots_are_known = false;  // of all curves together
  const auto take_knots = [&](const Block& curve) {
    const int knots = curve.whole(out.knots);
    if (knots_are_known && knots != out.knots)
      parser.fail(curve.number_at,
                  fmt::format("curves that are added have one number of knots, {} before, {} here", out.knots,
                              knots));
    out.knots = knots;
    knots_are_known = knots_are_known || curve.number.has_value();
  };
  for (const Term& term : terms) {
    const Block& first = term.front();
    if (first.name == "curve") {
      if (reading) parser.fail(first.at, "a second curve of the reading");
      reading = true;
      take_knots(first);
    } else if (first.name == "play") {
      if (!first.number) parser.fail(first.at, "play needs its radius, as a share of the range: play(0.08)");
      out.radii.push_back(*first.number);
      if (term.size() == 1 || term[1].name != "curve")
        parser.fail(first.at, "a curve is missing behind the play");
      take_knots(term[1]);
    } else if (first.name == "open") {
      out.open = true;
    } else {
      if (!first.number) parser.fail(first.at, "motion needs its seconds: motion(0.3)");
      out.lags_s.push_back(*first.number);
    }
    const std::size_t blocks = first.name == "play" ? 2 : 1;
    if (term.size() > blocks)
      parser.fail(term[blocks].at, fmt::format("nothing may follow a {} here", term[blocks - 1].name));
    if (out.radii.size() > kMostOfAKind || out.lags_s.size() > kMostOfAKind)
      parser.fail(first.at, fmt::format("more than {} of a kind", kMostOfAKind));
  }
  if (!reading) parser.fail(terms.front().front().at, "a sum begins with the curve of the reading: curve +");
  return out;
}

Chain chain(const Parser& parser, const Term& term) {
  Chain out;
  Structure& s = out.blocks;
  int before = 0;
  bool behind_lti = false;
  for (const Block& block : term) {
    const int place = block.place + (behind_lti && block.name == "curve" ? kBehind : 0);
    if (place == 0)
      parser.fail(block.at,
                  fmt::format("{} belongs into a sum, not before or behind other blocks", block.name));
    if (place <= before) {
      parser.fail(
          block.at,
          fmt::format(
              "{} cannot stand here; the order is lag, dead-zone, hysteresis, curve or gain, lti or pair, "
              "curve, saturation",
              block.name));
    }
    before = place;
    if (block.name == "lag") {
      out.lag = true;
      out.lag_s = block.number;
    }
    if (block.name == "dead-zone") s.dead_zone = true;
    if (block.name == "hysteresis") s.plays = block.whole(kDefaultPlays);
    if (block.name == "lti") s.order = block.whole(kDefaultOrder);
    if (block.name == "pair") s.order = 2;
    s.pair = s.pair || block.name == "pair";
    if (block.name == "curve") (behind_lti ? s.output_knots : s.input_knots) = block.whole(kDefaultKnots);
    if (block.name == "saturation") s.saturation = true;
    behind_lti = s.order > 0;
  }
  const bool curved = s.input_knots > 0 || s.output_knots > 0;
  const auto gain = std::ranges::find(term, "gain", &Block::name);
  if (gain != term.end() && curved) parser.fail(gain->at, "a gain is needless beside a curve");
  return out;
}

}  // namespace

std::optional<std::string_view> behind_mix(std::string_view text) {
  if (!text.starts_with("mix")) return {};
  const std::size_t arrow = text.find_first_not_of(' ', 3);
  if (arrow == std::string_view::npos || text[arrow] != '>') return {};
  return text.substr(std::min(text.find_first_not_of(' ', arrow + 1), text.size()));
}

WantedStructure parse_structure(std::string_view text, std::size_t sensors) {
  const auto rest = behind_mix(text);
  std::string_view name = rest.value_or(text);
  std::size_t begin = text.size() - name.size();
  if (rest) sensors = 1;
  if (name == "line" && sensors > 1) name = text = "curve(2) + open";
  if (std::ranges::find(kSums, name) != kSums.end()) return candidates(std::string(name), sensors);
  const auto shorthand = std::ranges::find(kShorthands, name, &std::pair<std::string, std::string>::first);
  if (shorthand != kShorthands.end()) {
    text = shorthand->second;
    begin = 0;
  }
  Parser parser(text, begin);
  const std::vector<Term> terms = parser.terms();
  const bool dynamic =
      std::ranges::any_of(terms, [](const Term& term) { return std::ranges::any_of(term, is_dynamic); });
  if (!dynamic) return Candidates{{sum(parser, terms)}, false};
  if (terms.size() > 1) parser.fail(terms[1].front().at, "blocks with dynamics of their own cannot be added");
  return chain(parser, terms.front());
}

std::string text_of(const Branches& branches) {
  std::string out = fmt::format("curve({})", branches.knots);
  for (const double radius : branches.radii)
    out += fmt::format(" + play({:g}) > curve({})", radius, branches.knots);
  for (const double lag_s : branches.lags_s) out += fmt::format(" + motion({:g})", lag_s);
  if (branches.open) out += " + open";
  return out;
}

std::string text_of(const Structure& s) {
  std::vector<std::string> blocks;
  if (s.dead_zone) blocks.emplace_back("dead-zone");
  if (s.plays > 0) blocks.push_back(fmt::format("hysteresis({})", s.plays));
  if (s.input_knots > 0) blocks.push_back(fmt::format("curve({})", s.input_knots));
  if (s.input_knots == 0 && s.output_knots == 0) blocks.emplace_back("gain");
  if (s.order > 0) blocks.push_back(s.pair ? "pair" : fmt::format("lti({})", s.order));
  if (s.output_knots > 0) blocks.push_back(fmt::format("curve({})", s.output_knots));
  if (s.saturation) blocks.emplace_back("saturation");
  return blocks == std::vector<std::string>{"gain"} ? "line" : fmt::format("{}", fmt::join(blocks, " > "));
}

std::string text_of(const Chain& chain) {
  if (!chain.lag) return text_of(chain.blocks);
  return fmt::format("lag{} > {}", chain.lag_s ? fmt::format("({:.3g})", *chain.lag_s) : "",
                     text_of(chain.blocks));
}

}  // namespace flexor::identify
