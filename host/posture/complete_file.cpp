#include "host/posture/complete_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>

#include "host/io/io.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/unit.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;

using recording::without_unit;

std::string column_of(std::string_view name) { return fmt::format("{}_deg", name); }

int joint_of(const std::string& name, const std::string& where) {
  const auto joint = find_joint(name);
  if (joint) return *joint;
  throw io::InputError("{}: \"{}\" is no joint; joints are: {}", where, name, fmt::join(kJointNames, ", "));
}

Input bend_of(const std::string& text) {
  const std::string where = fmt::format("--bends {}", text);
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw io::InputError("{}: write NAME=JOINT+JOINT, as index=index_mcp+index_pip", where);
  }
  Input bend{text.substr(0, equals), {}};
  for (std::size_t begin = equals + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    bend.joints.push_back(joint_of(without_unit(text.substr(begin, end - begin)), where));
    begin = end + 1;
  }
  std::ranges::sort(bend.joints);
  if (std::ranges::adjacent_find(bend.joints) != bend.joints.end()) {
    throw io::InputError("{}: a joint twice; a sensor bends over it once", where);
  }
  return bend;
}

// What is read, and from which of the table's columns each input is the sum.
struct Plan {
  std::vector<Input> inputs;
  std::vector<std::vector<std::size_t>> parts;
  std::vector<std::string> columns;
  std::vector<double> column_sign;      // of their angles, against the document's
  std::vector<double> column_open_deg;  // what is 0 in it
  std::map<int, std::size_t> shown;     // joint and its column
  Hand sign = Hand::Ones();             // of each joint's angles

  std::size_t place(const std::string& name, int joint, const CompleteOptions& options) {
    const auto it = std::ranges::find(columns, column_of(name));
    if (it != columns.end()) return static_cast<std::size_t>(it - columns.begin());
    columns.push_back(column_of(name));
    const auto ends = options.ends_deg.find(name);
    const auto [open_deg, fist_deg] = ends == options.ends_deg.end() ? std::pair(0.0, 90.0) : ends->second;
    column_sign.push_back(fist_deg > open_deg ? sign[joint] : -sign[joint]);
    column_open_deg.push_back(open_deg);
    return columns.size() - 1;
  }
};

void require_one_sign(const Plan& plan, const Input& bend) {
  for (const int joint : bend.joints) {
    if (plan.sign[joint] == plan.sign[bend.joints.front()]) continue;
    throw io::InputError("--bends {}: with --flexion positive only joints that flex can be summed",
                         bend.name);
  }
}

// A bend is sensed where --from names it, or the columns of all of its joints.
void require_named(const Input& bend, const CompleteOptions& options) {
  const auto named = [&](std::string_view name) {
    return std::ranges::any_of(options.from, [&](const std::string& c) { return without_unit(c) == name; });
  };
  if (named(bend.name)) return;
  for (const int joint : bend.joints) {
    if (named(joint_name(joint))) continue;
    throw io::InputError(
        "--bends {0}: --from names neither {0}_deg nor {1}_deg: name the bend, or all of its joints' columns",
        bend.name, joint_name(joint));
  }
}

void add_part(Plan& plan, const std::string& name, int joint, const CompleteOptions& options) {
  if (!options.ends_deg.empty() && !options.ends_deg.contains(name))
    throw io::InputError("--from: --model has no joint {}: leave it out", name);
  plan.parts.back().push_back(plan.place(name, joint, options));
}

void add_input(Plan& plan, const Input& input, const CompleteOptions& options,
               const recording::LogReader& table) {
  plan.inputs.push_back(input);
  plan.parts.emplace_back();
  if (table.has(column_of(input.name)) && !find_joint(input.name))
    return add_part(plan, input.name, input.joints.front(), options);
  for (const int joint : input.joints) add_part(plan, std::string(joint_name(joint)), joint, options);
}

Plan plan_of(const CompleteOptions& options, const recording::LogReader& table) {
  Plan plan;
  for (int joint = 0; joint < kJoints; ++joint) {
    if (options.flexion_is_positive && flexes(joint)) plan.sign[joint] = -1;
  }
  std::vector<Input> bends;
  for (const std::string& text : options.bends) bends.push_back(bend_of(text));
  for (const Input& bend : bends) {
    require_named(bend, options);
    require_one_sign(plan, bend);
    add_input(plan, bend, options, table);
  }
  for (const std::string& column : options.from) {
    const std::string name = without_unit(column);
    if (std::ranges::count(bends, name, &Input::name) > 0) continue;
    const int joint = joint_of(name, "--from");
    const bool in_bend = std::ranges::any_of(
        bends, [&](const Input& bend) { return std::ranges::count(bend.joints, joint) > 0; });
    if (!in_bend) add_input(plan, {name, {joint}}, options, table);
  }
  for (int joint = 0; joint < kJoints && options.rest_s > 0; ++joint) {
    const std::string name(joint_name(joint));
    if (table.has(column_of(name))) plan.shown[joint] = plan.place(name, joint, options);
  }
  return plan;
}

std::string header_of(const Plan& plan) {
  std::string text = "t_s";
  for (const std::string_view name : kJointNames) text += fmt::format(",{0}_deg,{0}_se_deg", name);
  for (const Input& input : plan.inputs) text += fmt::format(",{}_quality", input.name);
  return text + "\n";
}

std::string text_of(const Plan& plan, double t_s, const Estimate& estimate) {
  std::string text = fmt::format("{}", t_s);
  for (int j = 0; j < kJoints; ++j)
    text += fmt::format(",{:.3f},{:.3f}", plan.sign[j] * estimate.angle_deg[j], estimate.se_deg[j]);
  for (const Quality quality : estimate.quality) text += fmt::format(",{}", static_cast<int>(quality));
  return text + "\n";
}

// The next row, in the document's signs.
bool next(const Plan& plan, recording::LogReader& table, recording::Row& row) {
  if (!table.next(row)) return false;
  for (std::size_t i = 0; i < plan.columns.size(); ++i)
    row.value[i] = plan.column_sign[i] * (row.value[i] - plan.column_open_deg[i]);
  return true;
}

Eigen::VectorXd readings_of(const Plan& plan, const recording::Row& row) {
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(std::ssize(plan.parts));
  for (Index i = 0; i < readings.size(); ++i) {
    for (const std::size_t part : plan.parts[static_cast<std::size_t>(i)]) readings[i] += row.value[part];
  }
  return readings;
}

// Empty where a shown joint is missing in this row.
std::optional<Hand> shown_hand(const Plan& plan, const recording::Row& row) {
  Hand hand = Hand::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const auto& [joint, column] : plan.shown) {
    if (std::isnan(row.value[column])) return std::nullopt;
    hand[joint] = row.value[column];
  }
  return hand;
}

// Of each shown joint the middle one of three rows, so that a single wrong angle shows nothing. None of the first two.
std::optional<Hand> middle_of_three(std::deque<Hand>& last, const Hand& hand) {
  last.push_back(hand);
  if (last.size() < 3) return std::nullopt;
  const Hand low = last[0].min(last[1]);
  const Hand high = last[0].max(last[1]);
  last.pop_front();
  return hand.max(low).min(high);
}

void count(const Plan& plan, const Eigen::VectorXd& readings, const Estimate& estimate,
           Completion& completion) {
  constexpr double kStraight_deg = 15;
  ++completion.rows;
  completion.mean_se_deg += estimate.se_deg;
  for (std::size_t i = 0; i < completion.inputs.size(); ++i) {
    Completion::OfInput& input = completion.inputs[i];
    ++input.rows[static_cast<std::size_t>(estimate.quality[i])];
    const bool is_extended = readings[static_cast<Index>(i)] > kStraight_deg;
    if (is_extended && std::ranges::all_of(plan.inputs[i].joints, flexes)) ++input.extended;
  }
}

void finish(const Completer& completer, Completion& completion) {
  completion.mean_se_deg /= static_cast<double>(completion.rows);
  for (const Completion::OfInput& input : completion.inputs) {
    if (2 * input.extended > completion.rows - input.rows[static_cast<std::size_t>(Quality::missing)])
      completion.extended.push_back(input.name);
  }
  completion.shape = completer.shape();
}

}  // namespace

Completion complete_table(const Posture& posture, recording::LogReader& table, const CompleteOptions& options,
                          const std::function<void(const std::string&)>& sink,
                          const std::function<void(std::size_t rows)>& progress) {
  const Plan plan = plan_of(options, table);
  table.choose(plan.columns);
  Completer completer(posture, plan.inputs, !plan.shown.empty());
  Completion completion;
  for (const Input& input : plan.inputs) completion.inputs.push_back({input.name});
  completion.shown_joints = plan.shown.size();
  sink(header_of(plan));
  std::deque<Hand> shown;
  double elapsed_s = 0;
  double last_s = 0;
  for (recording::Row row; next(plan, table, row); last_s = row.t_s) {
    const bool is_first = completion.rows == 0;
    if (!is_first) elapsed_s += step_s(last_s, row.t_s, recording::kJump_s);  // slow tables too, but no jump
    if (elapsed_s < options.rest_s) {
      completion.shown_s = elapsed_s;
      const auto hand = shown_hand(plan, row);
      const auto sound = hand ? middle_of_three(shown, *hand) : std::nullopt;
      if (sound) completer.show(*sound, is_first ? 0 : step_s(last_s, row.t_s));
    } else {
      completion.rest_ended = true;
    }
    const Eigen::VectorXd readings = readings_of(plan, row);
    const Estimate estimate = completer.complete(readings);
    count(plan, readings, estimate, completion);
    sink(text_of(plan, row.t_s, estimate));
    progress(completion.rows);
  }
  if (completion.rows == 0) throw io::InputError("{}: no row below the header", table.name());
  const auto has_none = [&](const Completion::OfInput& input) {
    return input.rows[static_cast<std::size_t>(Quality::missing)] +
               input.rows[static_cast<std::size_t>(Quality::implausible)] ==
           completion.rows;
  };
  if (std::ranges::all_of(completion.inputs, has_none))
    throw io::InputError("{}: no row has a plausible angle of {}", table.name(),
                         recording::listed(options.from));
  finish(completer, completion);
  completion.notes = table.notes();
  completion.left_out_rmse_deg = completer.left_out_rmse_deg();
  return completion;
}

}  // namespace flexor::posture
