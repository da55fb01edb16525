#include "host/model/matlab.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {

// The runtime's blocks, over the samples in a row that a block follows. x: the state; empty before the first sample.
struct BlockFunction {
  std::string_view name;
  std::string_view text;
};
constexpr BlockFunction kBlockFunctions[] = {
    {"dead_zone", R"(
function y = dead_zone(u, lower, upper)
y = u - min(max(u, lower), upper);
)"},
    {"saturation", R"(
function y = saturation(u, lower, upper)
y = min(max(u, lower), upper);
)"},
    {"curve", R"(
function y = curve(u, x, f)
u = min(max(u, x(1)), x(end));
slope = diff(f) ./ diff(x);
i = ones(size(u));
for j = 2:numel(x) - 1
  i = i + (u >= x(j));
end
y = f(i) + slope(i) .* (u - x(i));
)"},
    {"play", R"(
function [y, x] = play(u, x, radius)
y = u;
if isempty(x), x = u(1:min(1, end)); end
for k = 1:numel(u)
  x = min(max(x, u(k) - radius), u(k) + radius);
  y(k) = x;
end
)"},
    {"hysteresis", R"(
function [y, x] = hysteresis(u, x, radii, weights)
y = u;
for k = 1:numel(u)
  if isempty(x), x = u(k) * ones(size(radii)); end
  x = min(max(x, u(k) - radii), u(k) + radii);
  for j = 1:numel(radii)
    y(k) = y(k) + weights(j) * (x(j) - u(k));
  end
end
)"},
    {"lag", R"(
function [y, x] = lag(u, x, share)
y = u;
if isempty(x), x = u(1:min(1, end)); end
for k = 1:numel(u)
  x = x + share * (u(k) - x);
  y(k) = x;
end
)"},
    {"lti", R"(
function [y, x] = lti(u, x, gain, offset, b, a, c)
w = gain * u + offset;
y = w;
for k = 1:numel(u)
  if isempty(x), x = w(k) * [1 1 1]; end
  x(3) = x(3) + (b(3) * (w(k) - x(3)) + a(2) * (x(1) - x(3)) + a(3) * (x(2) - x(3)));
  x(2) = x(2) + (b(2) * (w(k) - x(2)) + a(1) * (x(1) - x(2)));
  x(1) = x(1) + b(1) * (w(k) - x(1));
  y(k) = x(3) + c(1) * (w(k) - x(3)) + c(2) * (x(1) - x(3)) + c(3) * (x(2) - x(3));
end
)"},
    {"pole_pair", R"(
function [y, x] = pole_pair(u, x, a, c)
y = u;
for k = 1:numel(u)
  if isempty(x), x = [u(k) 0 0]; end
  e = [x(2) - (u(k) - x(1)), x(3)];
  x = [u(k), a(1) * e(1) + a(2) * e(2), a(3) * e(1) + a(4) * e(2)];
  y(k) = u(k) + (1 - c(1)) * x(2) + c(2) * x(3);
end
)"},
};
static_assert(compensator::kMaxOrder == 3, "lti is written out");

constexpr std::string_view kBegin = R"(readings = double(readings);
if size(readings, 2) ~= inputs
  error('readings: must have a column for each input, as in the help');
end
if nargin < 2 || isempty(state)
  state = struct('x', {cell(1, blocks)}, 'angle_deg', rest_deg);
end
x = state.x;
s = [readings, zeros(size(readings, 1), blocks)];
bad = zeros(size(s));
for i = 1:inputs
  bad(:, i) = (s(:, i) < lowest(i)) + 2 * (s(:, i) > highest(i)) + 3 * isnan(s(:, i));
end
)";
constexpr std::string_view kEnd = R"(
angle_deg = s(:, joints);
status = bad(:, joints);
for k = 1:size(s, 1)
  held = status(k, :) ~= 0;
  angle_deg(k, held) = state.angle_deg(held);
  state.angle_deg = angle_deg(k, :);
end
state.x = x;

function bad = first_of(bad)
for i = 2:size(bad, 2)
  bad(bad(:, 1) == 0, 1) = bad(bad(:, 1) == 0, i);
end
bad = bad(:, 1);
)";
constexpr std::string_view kWords =
    "break case catch classdef continue do else elseif end endfor endfunction endif endswitch endwhile for "
    "function global if otherwise parfor persistent return spmd switch try until unwind_protect while";

template <class List>
std::string row(const List& list, std::size_t count, const char* separator = ", ") {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += fmt::format("{}{}", i > 0 ? separator : "", list[i]);
  return "[" + out + "]";
}

// What calls a block: its function and what follows the signal and the state.
struct Call {
  std::string_view function;
  std::string arguments;
};
using compensator::kMaxOrder;
Call call(const compensator::DeadZone<double>& c) {
  return {"dead_zone", fmt::format("{}, {}", c.lower, c.upper)};
}
Call call(const compensator::Saturation<double>& c) {
  return {"saturation", fmt::format("{}, {}", c.lower, c.upper)};
}
Call call(const Curve::Floating<double>& c) {
  return {"curve", fmt::format("{}, {}", row(c.x, c.count, "; "), row(c.y, c.count, "; "))};
}
Call call(const compensator::Play<double>& c) { return {"play", fmt::format("{}", c.radius)}; }
Call call(const Hysteresis::Floating<double>& c) {
  const std::size_t count = c.plays.count;
  return {"hysteresis", fmt::format("{}, {}", row(c.plays.radius, count), row(c.weight, count))};
}
Call call(const compensator::Lag<double>& c) { return {"lag", fmt::format("{}", c.share)}; }
Call call(const Lti::Floating<double>& c) {
  return {"lti", fmt::format("{}, {}, {}, {}, {}", c.gain, c.offset, row(c.input_weight, kMaxOrder),
                             row(c.chain_weight, kMaxOrder), row(c.tap, kMaxOrder))};
}
Call call(const compensator::PolePair<double>& c) {
  return {"pole_pair", fmt::format("{}, {}", row(c.transition, 4), row(c.tap, 2))};
}
template <class Coefficients>
Call call(const Coefficients&) {
  throw io::InputError(
      "a function for MATLAB does not have one of the model's kinds of block yet: matlab.cpp");
}

// One block: which samples it follows, and its signal there. Signals count from one.
template <class Coefficients>
std::string step_text(const Coefficients& c, std::size_t block, std::size_t signal,
                      const std::vector<std::size_t>& from) {
  std::vector<std::size_t> columns;
  for (const std::size_t one : from) columns.push_back(one + 1);
  const std::string bad = fmt::format("bad(:, {})", row(columns, columns.size()));
  std::string out =
      fmt::format("bad(:, {}) = {};\n", signal, from.size() == 1 ? bad : fmt::format("first_of({})", bad));
  out += fmt::format("ok = bad(:, {}) == 0;\n", signal);
  if constexpr (std::is_same_v<Coefficients, Sum::Floating<double>>) {
    out += fmt::format("s(ok, {}) = {}", signal, c.offset);
    for (std::size_t i = 0; i < columns.size(); ++i)
      out += fmt::format(" + {} * s(ok, {})", c.weight[i], columns[i]);
    return out + ";\n";
  } else {
    const auto [function, arguments] = call(c);
    if constexpr (requires { typename Coefficients::State; }) {
      return out + fmt::format("[s(ok, {}), x{{{}}}] = {}(s(ok, {}), x{{{}}}, {});\n", signal, block,
                               function, columns.front(), block, arguments);
    } else {
      return out +
             fmt::format("s(ok, {}) = {}(s(ok, {}), {});\n", signal, function, columns.front(), arguments);
    }
  }
}

std::string help(const Model& model, const std::string& name) {
  std::string out = fmt::format(
      "%{}  Angles of a flex-sensor glove, as flexor apply computes them in double.\n"
      "%   angle_deg = {}(readings): a row for each sample, one every {} s, and a column for each input:\n",
      name, name, model.sample_period_s);
  for (const Input& input : model.inputs) {
    out += fmt::format("%     {} {}, valid {} to {}\n", io::one_line(input.name), io::one_line(input.unit),
                       input.valid_min, input.valid_max);
  }
  out += "%   angle_deg, and status, have a column for each joint:\n";
  for (const Joint& joint : model.joints) out += fmt::format("%     {}\n", joint.name);
  return out +
         fmt::format(
             "%   [angle_deg, status] = {0}(readings): 0 good, 1 below and 2 above the valid range, 3 not a "
             "number;\n"
             "%   with anything but 0 the last good angle is held.\n"
             "%   [angle_deg, status, state] = {0}(readings, state): goes on where an earlier call ended.\n"
             "% Model {1}, written by flexor {2}.\n",
             name, io::one_line(model.name), FLEXOR_VERSION);
}

std::string settings(const Model& model, const Graph& graph) {
  std::vector<double> low;
  std::vector<double> high;
  for (const Input& input : model.inputs) {
    low.push_back(input.valid_min);
    high.push_back(input.valid_max);
  }
  std::vector<double> rest_deg;
  std::vector<std::size_t> signals;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const Saturation& limit = limits(model, model.joints[j]);
    rest_deg.push_back(std::clamp(model.joints[j].rest_deg, limit.lower_deg, limit.upper_deg));
    signals.push_back(graph.joint[j] + 1);
  }
  return fmt::format(
      "inputs = {};\nblocks = {};\nlowest = {};\nhighest = {};\nrest_deg = {};\njoints = {};\n",
      model.inputs.size(), model.blocks.size(), row(low, low.size()), row(high, high.size()),
      row(rest_deg, rest_deg.size()), row(signals, signals.size()));
}

// Comments, which begin their line, apart.
bool has_word(std::string_view text, std::string_view word) {
  const auto is_letter = [&](std::size_t at) {
    return at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_');
  };
  for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) {
    const std::size_t line = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
    if (text[line] != '%' && !is_letter(at - 1) && !is_letter(at + word.size())) return true;
  }
  return false;
}

void check_function_name(const std::string& name, const std::string& code) {
  constexpr std::size_t kMost = 63;
  const bool is_word =
      !name.empty() && name.size() <= kMost && std::isalpha(static_cast<unsigned char>(name[0])) != 0 &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == name.npos;
  if (!is_word)
    throw io::InputError(
        "MATLAB has no function \"{}\": letters, digits and underscores, the first a letter, {} at most",
        io::one_line(name), kMost);
  if (has_word(kWords, name) || has_word(code, name))
    throw io::InputError("\"{0}\" has a meaning in MATLAB or in the function itself: another name, as my_{0}",
                         name);
}

}  // namespace

std::string matlab_text(const Model& model, const std::string& name) {
  const Graph graph(model);
  std::string code = settings(model, graph) + std::string(kBegin);
  for (std::size_t b = 0; b < model.blocks.size(); ++b) {
    const Block& block = model.blocks[b];
    code += fmt::format("\n% {}: {}\n", io::one_line(block.to), type_of(block.kind));
    code += std::visit(
        [&](const auto& kind) {
          return step_text(kind.template floating<double>(model.sample_period_s), b + 1,
                           model.inputs.size() + b + 1, graph.from[b]);
        },
        block.kind);
  }
  code += kEnd;
  const std::string body = code;
  for (const BlockFunction& one : kBlockFunctions) {
    if (has_word(body, one.name)) code += one.text;
  }
  check_function_name(name, code);
  return fmt::format("function [angle_deg, status, state] = {}(readings, state)\n{}\n{}", name,
                     help(model, name), code);
}

}  // namespace flexor::model
